//! Owns a window's part in the state that stopped fracture resumes from.

use super::{Window, WindowBond};
use crate::error::Result;
use crate::physics::continuum_molecular::bond::Blocks;
use crate::scene::state::State;

/// Name of the window's points in a kept state.
const POINTS: &str = "window.points";

impl<const D: usize> Window<D> {
    /// What a window on the same points, of the body as it was factorised, needs to become this one.
    pub fn save(&self, state: &mut State) {
        let points: Vec<f64> = self.points.iter().map(|&p| f64::from(p)).collect();
        let absorbed: Vec<f64> = self.absorbed.iter().map(|&n| n as f64).collect();
        state.put(POINTS, points);
        state.put("window.absorbed", absorbed);
        state.put("window.base", self.base.clone());
        state.put("window.since", self.since.clone());
    }

    pub fn saved_points(state: &State) -> Vec<usize> {
        let points = state.find(POINTS).unwrap_or_default();
        points.iter().map(|&p| p as usize).collect()
    }

    /// Becomes the saved one; `broken` are the bonds broken since its factorisation.
    pub fn restore(
        &mut self,
        blocks: &[Blocks<D>],
        broken: Vec<(WindowBond, f64)>,
        state: &State,
    ) -> Result<()> {
        self.broken = broken;
        for &count in state.find("window.absorbed").unwrap_or_default() {
            self.absorb(blocks, count as usize);
        }
        let size = self.base.len();
        self.base = state.array("window.base", size)?.to_vec();
        self.since = state.array("window.since", size)?.to_vec();
        Ok(())
    }
}
