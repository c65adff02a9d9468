//! Owns the statistics of time steps: how often they were halved and grown, and between which lengths.

use crate::error::Result;
use crate::scene::state::State;
use serde::Serialize;
use std::fmt;

/// How the time step changed.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StepStatistics {
    /// Steps that did not converge and were tried again, half as long.
    pub halvings: usize,
    /// Accepted steps longer than the one before.
    pub growths: usize,
    /// Among the accepted ones; 0 where there were none.
    pub shortest_step: f64,
    /// The same of the longest.
    pub longest_step: f64,
    #[serde(skip)]
    last: f64,
}

/// Lengths that differ by less are the same: planned steps are whole multiples of rounded ones.
const SAME: f64 = 1e-9;

impl StepStatistics {
    pub fn halved(&mut self) {
        self.halvings += 1;
    }

    pub fn accepted(&mut self, dt: f64) {
        let first = self.last == 0.0;
        if !first && dt > self.last * (1.0 + SAME) {
            self.growths += 1;
        }
        self.shortest_step = if first {
            dt
        } else {
            dt.min(self.shortest_step)
        };
        self.longest_step = dt.max(self.longest_step);
        self.last = dt;
    }

    /// Whether the step ever changed.
    pub fn changed(&self) -> bool {
        self.halvings > 0 || self.longest_step > self.shortest_step * (1.0 + SAME)
    }

    pub fn save(&self, state: &mut State) {
        let counts = [
            self.halvings as f64,
            self.growths as f64,
            self.shortest_step,
            self.longest_step,
            self.last,
        ];
        state.put("pace", counts);
    }

    pub fn restore(state: &State) -> Result<Self> {
        let counts = state.array("pace", 5)?;
        Ok(StepStatistics {
            halvings: counts[0] as usize,
            growths: counts[1] as usize,
            shortest_step: counts[2],
            longest_step: counts[3],
            last: counts[4],
        })
    }
}

impl fmt::Display for StepStatistics {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.longest_step == 0.0 {
            return write!(
                f,
                "time step halved {} times, none was taken",
                self.halvings
            );
        }
        write!(
            f,
            "time step halved {} times, grown {} times; steps taken from {:.3e} to {:.3e}",
            self.halvings, self.growths, self.shortest_step, self.longest_step
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_survive_a_stop() {
        let mut statistics = StepStatistics::default();
        assert!(!statistics.changed());
        [0.2, 0.2 + 1e-15]
            .iter()
            .for_each(|dt| statistics.accepted(*dt));
        assert!(!statistics.changed() && statistics.growths == 0);
        let mut stuck = StepStatistics::default();
        stuck.halved();
        assert_eq!(
            stuck.to_string(),
            "time step halved 1 times, none was taken"
        );
        statistics.halved();
        let mut state = State::default();
        statistics.save(&mut state);
        let mut statistics = StepStatistics::restore(&state).unwrap();
        [0.1, 0.2, 0.4]
            .iter()
            .for_each(|dt| statistics.accepted(*dt));
        let words = statistics.to_string();
        assert_eq!(
            words,
            "time step halved 1 times, grown 2 times; steps taken from 1.000e-1 to 4.000e-1"
        );
    }
}
