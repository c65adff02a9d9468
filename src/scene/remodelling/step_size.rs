//! Owns the lengths of time steps: all equal, or as long as the error they add to the densities allows.

use crate::error::Result;
use crate::scene::conditions::Time;
use crate::scene::frame::Output;
use crate::scene::state::State;

/// A step grows by no more than this, and shrinks to no less than its inverse.
const GROWTH: f64 = 2.0;
/// Aim below the tolerance by this factor.
const SAFETY: f64 = 0.9;

/// Chooses each step as a whole number of the scene's shortest.
pub struct StepSize {
    step: f64,
    tolerance: Option<f64>,
    /// Times at which supports or loads jump or bend, ascending.
    corners: Vec<f64>,
    /// Length aimed at, in steps.
    length: f64,
    before: Option<Before>,
}

/// The step before.
struct Before {
    dt: f64,
    rate: Vec<f64>,
}

impl StepSize {
    pub fn new(time: &Time, mut corners: Vec<f64>) -> Self {
        corners.sort_unstable_by(f64::total_cmp);
        StepSize {
            step: time.step,
            tolerance: time.tolerance,
            corners,
            length: 1.0,
            before: None,
        }
    }

    pub fn is_adaptive(&self) -> bool {
        self.tolerance.is_some()
    }

    /// Puts what later lengths depend on into `state`.
    pub fn save(&self, state: &mut State) {
        state.put("stride.length", [self.length]);
        if let Some(before) = &self.before {
            state.put("stride.dt", [before.dt]);
            state.put("stride.rate", before.rate.as_slice());
        }
    }

    pub fn restore(&mut self, state: &State) -> Result<()> {
        self.length = state.number("stride.length")?;
        self.before = match state.find("stride.rate") {
            Some(rate) => Some(Before {
                dt: state.number("stride.dt")?,
                rate: rate.to_vec(),
            }),
            None => None,
        };
        Ok(())
    }

    /// Number of shortest steps from `now` (as many steps from 0) on, not beyond the next output, corner or `end`.
    pub fn next(&self, now: u64, end: u64, output: &Output) -> u64 {
        if !self.is_adaptive() {
            return 1;
        }
        let t = now as f64 * self.step;
        let corner = self.corners.iter().copied().find(|c| *c > t * (1.0 + 1e-9));
        let stop = corner.into_iter().chain(output.next_due(t));
        let steps = |t: f64| (t / self.step - 1e-6).ceil() as u64;
        let stop = stop.map(steps).filter(|s| *s > now).min();
        let remaining = stop.unwrap_or(end).min(end) - now;
        let wanted = (self.length as u64).max(1);
        match remaining {
            r if r <= wanted => r,
            // Two halves rather than a long step and a rest.
            r if r < 2 * wanted => r.div_ceil(2),
            _ => wanted,
        }
    }

    /// After a step of `dt` that failed.
    pub fn failed(&mut self) {
        self.length = (0.5 * self.length).max(1.0);
    }

    /// After a step to `now` that took the relative densities from `old` to `new`. The error of implicit Euler is
    /// `dt²/2 ρ''`, and `ρ''` the change of rate between this step and the one before.
    pub fn accepted(&mut self, now: f64, dt: f64, old: &[f64], new: &[f64]) {
        let Some(tolerance) = self.tolerance else {
            return;
        };
        let rate: Vec<f64> = new.iter().zip(old).map(|(n, o)| (n - o) / dt).collect();
        let near = |c: &f64| (now - c).abs() <= 1e-9 * now;
        let corner = self.corners.iter().any(near);
        if let Some(before) = &self.before {
            let half = dt * dt / (dt + before.dt);
            let squares = rate.iter().zip(&before.rate).map(|(a, b)| (a - b).powi(2));
            let mean = squares.sum::<f64>() / rate.len().max(1) as f64;
            let error = half * mean.sqrt();
            let factor = SAFETY * (tolerance / error.max(1e-300)).sqrt();
            let now = dt / self.step;
            self.length = (now * factor.clamp(GROWTH.recip(), GROWTH)).max(1.0);
        }
        self.before = Some(Before { dt, rate });
        if corner {
            // What comes after a corner is not what came before it.
            self.before = None;
            self.length = 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decay towards rest: steps grow as the rate falls, end on outputs and corners, and the sum of errors obeys.
    #[test]
    fn steps_grow_as_rates_fall_and_stop_where_asked() {
        let time = Time {
            end: 40.0,
            step: 0.01,
            tolerance: Some(1e-5),
            smallest_share: 1.0,
        };
        let output = Output {
            times: vec![7.0],
            ..Output::default()
        };
        let mut step_size = StepSize::new(&time, vec![0.5]);
        let (mut at, mut rho, mut ends, mut lengths) = (0u64, 1.0, Vec::new(), Vec::new());
        while at < 4000 {
            let n = step_size.next(at, 4000, &output);
            let dt = n as f64 * time.step;
            let next = rho / (1.0 + dt);
            at += n;
            step_size.accepted(at as f64 * time.step, dt, &[rho], &[next]);
            rho = next;
            ends.push(at);
            lengths.push(n);
        }
        assert!(ends.contains(&50) && ends.contains(&700) && ends.contains(&4000));
        assert!(lengths.len() < 1000, "{}", lengths.len());
        assert!(
            lengths[lengths.len() - 2] > 50 && lengths[0] == 1,
            "{lengths:?}"
        );
        // Just after the corner, at t = 0.5, a step errs by dt²/2 e^-0.5.
        let after = ends.iter().position(|e| *e == 50).unwrap() + 1;
        assert_eq!(lengths[after], 1);
    }
}
