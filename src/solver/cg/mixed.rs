//! Owns conjugate gradients in mixed precision, for large models: 72 bytes a site in all instead of 150.
//!
//! The displacements are in double precision, residual, direction and their images in single. What single precision
//! loses is restored: residual and energy are computed again from the displacements, in double precision, whenever one of
//! them has fallen by a thousand (van der Vorst & Ye 2000); so any accuracy is reached that double precision
//! allows.

use super::single::{Single, advance, combine, dot, image, narrow, scale};
use super::{CgInfo, CgParams, CgStep, State, Vectors, are_positive, iterate};
use crate::operator::held::{Held, Outside};
use crate::operator::{Functional, MixedPrecision, SinglePreconditioner};
use crate::par;

/// As [`crate::solver::cg::minimise`].
pub fn minimise<'a, F: Functional<3>>(
    operator: &impl MixedPrecision,
    outside: impl Into<Outside<'a, 3>>,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    goal: Option<&F>,
    observe: impl FnMut(CgStep),
) -> CgInfo {
    let room = || vec![[0f32; 3]; operator.sites()];
    let Outside { held, forces } = outside.into();
    let mut vectors = Mixed {
        operator,
        held,
        forces,
        preconditioner,
        unit: 1.0,
        r: room(),
        p: room(),
        z: room(),
        spare: room(),
        rz_before: None,
    };
    vectors.unit = vectors.residual(u, 1.0).norm;
    iterate(vectors, u, params, goal, observe)
}

struct Mixed<'a, O, P> {
    operator: &'a O,
    held: &'a Held,
    forces: Option<&'a [[f64; 3]]>,
    preconditioner: &'a P,
    unit: f64,
    r: Single,
    p: Single,
    /// `z`, then `A p`.
    z: Single,
    spare: Single,
    /// `rᵀz` of the last iteration, in the present unit.
    rz_before: Option<f64>,
}

impl<O: MixedPrecision, P: SinglePreconditioner<3>> Vectors<3> for Mixed<'_, O, P> {
    const EXACT: bool = false;

    fn unit(&self) -> f64 {
        self.unit
    }

    /// `r = (f − A u) / unit` in the free components, part by part from double precision.
    fn residual(&mut self, u: &[[f64; 3]], factor: f64) -> State {
        let before = self.unit;
        self.unit *= factor;
        if factor != 1.0 {
            let grown = before / self.unit;
            self.rz_before = self.rz_before.map(|rz| rz * (grown * grown));
            scale(&mut self.p, grown as f32);
        }
        let unit = self.unit.max(f64::MIN_POSITIVE);
        let consume = |first: usize, force: &[[f64; 3]], r: &mut [[f32; 3]]| {
            let (mut energy, mut squared) = (0.0, 0.0);
            for (i, (r, f)) in r.iter_mut().zip(force).enumerate() {
                for d in 0..3 {
                    energy += u[first + i][d] * f[d];
                    let free = !self.held.is_held(first + i, d);
                    let outside = self.forces.map_or(0.0, |outside| outside[first + i][d]);
                    let v = if free { outside - f[d] } else { 0.0 };
                    squared += v * v;
                    r[d] = narrow(v / unit);
                }
            }
            [energy, squared]
        };
        let [energy, squared] = self.operator.for_each_chunk(u, &mut self.r, consume);
        let work = self.forces.map_or(0.0, |forces| par::dot(u, forces));
        State {
            energy: energy - 2.0 * work,
            work,
            norm: squared.sqrt(),
        }
    }

    fn precondition(&mut self) -> f64 {
        self.preconditioner
            .apply_single(&self.r, &mut self.z, &mut self.spare);
        dot(&self.r, &self.z)
    }

    fn step(&mut self, u: &mut [[f64; 3]], rz: f64) -> Option<(f64, f64)> {
        let beta = self.rz_before.map_or(0.0, |before| rz / before);
        combine(&mut self.p, &self.z, beta as f32);
        let curvature = image(self.operator, self.held, &self.p, &mut self.z);
        are_positive(curvature, rz).then(|| {
            let alpha = rz / curvature;
            self.rz_before = Some(rz);
            let squared = advance(u, &mut self.r, &self.p, &self.z, alpha, self.unit);
            (alpha, squared.sqrt())
        })
    }

    fn along(&self, goal: &impl Functional<3>) -> f64 {
        goal.of_single(&self.p)
    }

    fn work_along(&self) -> f64 {
        self.forces.map_or(0.0, |forces| {
            par::sum_chunks(self.p.len(), |range| {
                let pairs = forces[range.clone()].iter().zip(&self.p[range]);
                pairs
                    .map(|(f, p)| (0..3).map(|d| f[d] * f64::from(p[d])).sum::<f64>())
                    .sum()
            })
        })
    }

    fn is_forced(&self) -> bool {
        self.forces.is_some()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::operator::Operator;
    use crate::operator::coarsen::{Block, Coarsen, VisitRow};
    use crate::solver::cg::{ENERGY_ALONE, Ended, checked};
    use std::ops::Range;

    /// A chain of unit springs along x, but for the first; held across.
    pub struct Chain {
        pub sites: usize,
        pub first: f64,
    }

    impl Chain {
        pub fn of(sites: usize) -> Self {
            Chain { sites, first: 1.0 }
        }

        fn pull(&self, i: usize, u: impl Fn(usize) -> f64) -> f64 {
            let spring = |i: usize| if i == 0 { self.first } else { 1.0 };
            let left = if i > 0 {
                spring(i - 1) * (u(i) - u(i - 1))
            } else {
                0.0
            };
            let last = i + 1 == self.sites;
            left + if last {
                0.0
            } else {
                spring(i) * (u(i) - u(i + 1))
            }
        }
    }

    /// What the first spring bears.
    struct Reaction(f64);

    impl Functional<3> for Reaction {
        fn of(&self, u: &[[f64; 3]]) -> f64 {
            self.0 * (u[1][0] - u[0][0])
        }
        fn of_single(&self, u: &[[f32; 3]]) -> f64 {
            self.0 * f64::from(u[1][0] - u[0][0])
        }
    }

    impl Operator<3> for Chain {
        fn sites(&self) -> usize {
            self.sites
        }
        fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
            self.rows_f64(0..self.sites, x, y);
        }
        fn diagonal(&self, d: &mut [[f64; 3]]) {
            d.fill([2.0; 3]);
        }
    }

    impl Coarsen for Chain {
        fn positions(&self, _: Range<usize>, _: &mut [[f64; 3]]) {}
        fn each_row(&self, _: Range<usize>, _: &mut VisitRow<Block>) {}
        fn reach(&self, sites: Range<usize>) -> Range<usize> {
            sites
        }
        fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
            for (i, y) in sites.zip(y) {
                *y = [self.pull(i, |i| x[i][0]), 0.0, 0.0];
            }
        }
        fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
            for (i, y) in sites.zip(y) {
                *y = [self.pull(i, |i| f64::from(x[i][0])) as f32, 0.0, 0.0];
            }
        }
        fn eigenvalue_bound(&self) -> f64 {
            2.0
        }
    }

    struct Plain;

    impl SinglePreconditioner<3> for Plain {
        fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, _: &mut Vec<[f32; 3]>) {
            z.copy_from_slice(r);
        }
    }

    /// The chain held at its ends and stretched by one.
    pub fn stretched(n: usize) -> (Held, Vec<[f64; 3]>) {
        let mut held = Held::none(n);
        for i in 0..n {
            held.hold(i, 1);
            held.hold(i, 2);
        }
        held.hold(0, 0);
        held.hold(n - 1, 0);
        let mut u = vec![[0.0; 3]; n];
        u[n - 1][0] = 1.0;
        (held, u)
    }

    /// The stretch of a chain to ten digits more than single precision has, by computing the residual again.
    #[test]
    fn single_precision_vectors_do_not_limit_the_result() {
        let n = 120;
        let (held, mut u) = stretched(n);
        let params = CgParams {
            energy_tolerance: 0.0,
            ..CgParams::default()
        };
        let info = minimise(
            &Chain::of(n),
            &held,
            &Plain,
            &mut u,
            &params,
            ENERGY_ALONE,
            |_| (),
        );
        assert!(
            info.ended == Ended::ResidualTolerance && info.residual < 1e-11,
            "{info:?}"
        );
        assert!(
            (info.energy * (n - 1) as f64 - 1.0).abs() < 1e-12,
            "{info:?}"
        );
        for (i, u) in u.iter().enumerate() {
            assert!((u[0] - i as f64 / (n - 1) as f64).abs() < 1e-10, "{i}");
        }
    }

    /// Nine tenths of a millionth of the start's energy, and still its error is what is stated.
    #[test]
    fn what_keeps_little_of_the_starts_energy_converges() {
        let first = 9e-7;
        let chain = Chain { sites: 30, first };
        let (held, mut u) = stretched(30);
        let goal = Reaction(first);
        let params = CgParams::default();
        let info = minimise(&chain, &held, &Plain, &mut u, &params, Some(&goal), |_| ());
        assert_eq!(info.ended, Ended::EnergyTolerance, "{info:?}");
        let exact = 1.0 / (1.0 / first + 28.0);
        assert!((info.energy / exact - 1.0).abs() <= 1e-3, "{info:?}");
        assert!(info.energy - exact <= info.energy_error, "{info:?}");
        assert!(
            info.goal_error.unwrap() <= 1e-3 * goal.of(&u).abs(),
            "{info:?}"
        );
    }

    /// A preconditioner that is not symmetric spoils the recurrences; what they then say is not trusted.
    #[test]
    fn an_energy_that_is_not_what_the_iterations_say_is_a_breakdown() {
        assert_eq!(
            checked(Ended::EnergyTolerance, 1.0, 1.02, 5.0),
            Ended::Breakdown
        );
        assert_eq!(checked(Ended::Mechanism, 0.0, 1e-3, 10.0), Ended::Breakdown);
        assert_eq!(checked(Ended::Mechanism, 0.0, 1e-9, 10.0), Ended::Mechanism);
    }
}
