//! Owns the preconditioner of solves that follow one another, each of an operator little changed: it is kept until the solves
//! take twice the iterations of its first.

use super::CgInfo;

/// Iterations, of a preconditioner's first solve, beyond which it is made again: set-up costs about as much as that solve.
const STALE: usize = 2;

/// A preconditioner with the iterations of its first solve, once there is one.
pub struct Kept<P> {
    made: Option<(P, Option<usize>)>,
    set_ups: usize,
}

impl<P> Default for Kept<P> {
    fn default() -> Self {
        Kept {
            made: None,
            set_ups: 0,
        }
    }
}

impl<P> Kept<P> {
    /// Solves by `solve`, with the preconditioner kept or, where there is none or the last solve found it stale, with one that
    /// `make` makes. Held unknowns must be the same from solve to solve. The iterations of a first solve should be those from as good a start as
    /// later ones have, the last solution for one.
    pub fn solve(&mut self, make: impl FnOnce() -> P, solve: impl FnOnce(&P) -> CgInfo) -> CgInfo {
        let (preconditioner, first) = self.made.get_or_insert_with(|| {
            self.set_ups += 1;
            (make(), None)
        });
        let info = solve(preconditioner);
        let first = *first.get_or_insert(info.iterations.max(1));
        if info.iterations > STALE * first || !info.ended.converged() {
            self.made = None;
        }
        info
    }

    /// How many preconditioners were made.
    pub fn set_ups(&self) -> usize {
        self.set_ups
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::cg::Ended;

    fn info(iterations: usize, ended: Ended) -> CgInfo {
        CgInfo {
            ended,
            iterations,
            residual: 0.0,
            energy: 1.0,
            start_energy: 2.0,
            energy_error: 0.0,
            goal_error: None,
        }
    }

    #[test]
    fn a_preconditioner_is_made_again_after_iterations_have_doubled() {
        let mut kept = Kept::default();
        let mut made = Vec::new();
        for iterations in [5, 7, 10, 11, 6, 12, 13, 8] {
            let number = made.len();
            let solve = |_: &usize| info(iterations, Ended::EnergyTolerance);
            kept.solve(
                || {
                    made.push(iterations);
                    number
                },
                solve,
            );
        }
        assert_eq!((made, kept.set_ups()), (vec![5, 6, 8], 3));
    }

    #[test]
    fn one_that_broke_down_is_not_kept() {
        let mut kept = Kept::default();
        kept.solve(|| (), |()| info(3, Ended::Breakdown));
        kept.solve(|| (), |()| info(3, Ended::EnergyTolerance));
        kept.solve(|| (), |()| info(3, Ended::EnergyTolerance));
        assert_eq!(kept.set_ups(), 2);
    }
}
