//! Owns the state that stopped fracture resumes from: bonds in the order in which they broke, the window they broke in, and
//! the sums. Factors are computed again, so that the run continues bit for bit.

use super::{CrackGrowth, Ledger};
use crate::error::Result;
use crate::scene::continuum_molecular::window::{Window, WindowBond};
use crate::scene::state::State;

impl<const D: usize> CrackGrowth<'_, D> {
    /// The state between two events of a load step.
    pub fn state(&self) -> State {
        let mut state = State::default();
        let Ledger {
            work,
            broken,
            relaxed,
        } = self.ledger;
        let sums = [
            self.step as f64,
            self.events as f64,
            self.lambda,
            self.recorded,
            work,
            broken,
            relaxed,
            self.peak,
            self.worst_balance,
            self.solves as f64,
            self.iterations as f64,
            self.windows as f64,
            self.potential_drop,
            self.max_ratio_outside,
            f64::from(u8::from(self.stale)),
            self.before_window as f64,
            self.unsettled as f64,
        ];
        state.put("fracture.sums", sums);
        let numbers = |(p, slot): &(usize, usize)| [*p as f64, *slot as f64];
        let order: Vec<f64> = self.order.iter().flat_map(numbers).collect();
        state.put("fracture.order", order);
        self.window.save(&mut state);
        state
    }

    /// Goes back to a kept state.
    pub fn restore(&mut self, state: &State) -> Result<()> {
        let s = state.array("fracture.sums", 17)?;
        let order = state.find("fracture.order").unwrap_or_default();
        let (pairs, _) = order.as_chunks::<2>();
        let (before, since) = pairs.split_at(s[15] as usize);
        for [p, slot] in before {
            self.mark(*p as usize, *slot as usize);
        }
        self.put_window(&Window::<D>::saved_points(state))?;
        let since: Vec<(WindowBond, f64)> = since
            .iter()
            .map(|[p, slot]| self.lose(*p as usize, *slot as usize))
            .collect();
        self.bonds.retain(|b| !self.broken[b.slots[0]]);
        self.window.restore(&self.solid.body.blocks, since, state)?;
        (self.step, self.events) = (s[0] as usize, s[1] as usize);
        (self.lambda, self.recorded) = (s[2], s[3]);
        self.ledger = Ledger {
            work: s[4],
            broken: s[5],
            relaxed: s[6],
        };
        (self.peak, self.worst_balance) = (s[7], s[8]);
        (self.solves, self.iterations, self.windows) =
            (s[9] as usize, s[10] as usize, s[11] as usize);
        (self.potential_drop, self.max_ratio_outside, self.stale) = (s[12], s[13], s[14] != 0.0);
        self.unsettled = s[16] as usize;
        Ok(())
    }

    /// Breaks the bond of the window listed at `slot` of point `p`: what it was, and the factor it loses.
    pub fn lose(&mut self, p: usize, slot: usize) -> (WindowBond, f64) {
        let bond = self.window.bond(self.setup, p, slot);
        let lost = self.mark(p, slot);
        (bond, lost)
    }
}
