//! Owns the preconditioner: algebraic multigrid by smoothed aggregation with rigid motions.
//!
//! Sites are grouped into aggregates of connected neighbours; the coarse unknowns are the six rigid motions of each
//! (Vaněk, Mandel & Brezina 1996). The finest level is the caller's operator and is never assembled, nor is its
//! prolongator; the coarser ones are assembled, each coarsened by its own graph. All of it is in single precision:
//! it only has to be a good guess.

// Small fixed matrices read best by index.
#![allow(clippy::needless_range_loop)]

mod aggregate;
mod blocks;
mod chebyshev;
mod coarse;
mod coarsest;
mod cycle;
mod diagonal;
mod eigenvalue;
mod fine;
mod galerkin;
mod grouping;
mod image;
mod level;
mod rigid;
pub mod supports;
mod window;

use crate::operator::SinglePreconditioner;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use blocks::BlockMatrix;
use chebyshev::Chebyshev;
use coarse::{Coarse, mean_site_stiffness};
use coarsest::Coarsest;
use cycle::{Below, Smoothing, Vectors, accelerated, cycle, one_cycle};
use fine::{Body, Fine};
use level::{Level, Six};
use std::sync::Mutex;

/// How to coarsen and smooth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmgParams {
    /// Edges of the boxes in which the finest level's sites are aggregated, in mm. On thin structure the whole time
    /// to 0.1 % is much the same from three to seven sites wide (5 to 8 iterations on plump, 7 to 14 on thin structure);
    /// wider boxes take less memory.
    pub box_mm: [f64; 3],
    /// Degree of the smoother on the finest level and on the others.
    pub degrees: [usize; 2],
    /// Sites at which a level is factorised instead of coarsened.
    pub coarsest: usize,
    /// Cycles that solve an assembled level. On bricks two halve the iterations (thin structure to 1e-6: 59 and 28), on lattices the
    /// finest level is what limits them.
    pub cycles: usize,
}

impl AmgParams {
    /// Boxes five sites wide; where the spacing differs by axis, cubes of the same volume, since what is close
    /// together is what is coupled.
    pub fn new(spacing_mm: [f64; 3]) -> Self {
        let mean = spacing_mm.iter().product::<f64>().cbrt();
        AmgParams {
            box_mm: spacing_mm.map(|h| (5.0 * mean).max(h)),
            degrees: [2, 2],
            coarsest: 100,
            cycles: 1,
        }
    }

    /// Boxes four lattice parameters wide. On the lattices of a real stack three to six took the same time (7 to 32
    /// iterations with four); three took half as much memory again.
    pub fn lattice(lp_mm: f64) -> Self {
        AmgParams {
            box_mm: [4.0 * lp_mm; 3],
            degrees: [2, 2],
            coarsest: 100,
            cycles: 1,
        }
    }
}

/// An assembled level: how it smooths, and how its cycles are put together.
struct Assembled {
    level: Coarse,
    how: Smoothing,
    cycles: Chebyshev,
}

/// `z ≈ A⁻¹ r` by one symmetric cycle. Its coarse problems are solved by one cycle each, or by several in a polynomial.
pub struct Amg<O> {
    fine: Fine<O>,
    how: Smoothing,
    coarse: Vec<Assembled>,
    coarsest: Coarsest,
    /// Made once, used by one cycle at a time: one for every assembled level, the coarsest among them.
    room: Mutex<Vec<Vectors>>,
}

impl<O: Coarsen> Amg<O> {
    pub fn new(operator: O, held: &Held, params: &AmgParams) -> Self {
        let (fine, bodies) = Fine::new(operator, held, params.box_mm);
        let how = smoothing(&fine, params.degrees[0]);
        let matrix = galerkin::product(&fine, how.omega, Some(&bodies));
        Amg::of(fine, bodies, how, matrix, params)
    }

    /// From the finest level and the matrix of the one below.
    fn of(
        fine: Fine<O>,
        mut bodies: Vec<Body>,
        how: Smoothing,
        mut matrix: BlockMatrix,
        params: &AmgParams,
    ) -> Self {
        let mut below = mean_site_stiffness(&fine);
        let mut coarse: Vec<Assembled> = Vec::new();
        while matrix.rows() > params.coarsest {
            let (level, next) = Coarse::new(matrix, &bodies, &below);
            below = mean_site_stiffness(&level);
            let how = smoothing(&level, params.degrees[1]);
            matrix = galerkin::product(&level, how.omega, None);
            let stuck = 10 * next.len() > 9 * level.sites();
            bodies = next;
            coarse.push(Assembled {
                level,
                how,
                cycles: Chebyshev::new(1.0, 1.0, 1),
            });
            if stuck {
                break;
            }
        }
        let mut rooms: Vec<Vectors> = coarse
            .iter()
            .map(|a| Vectors::new(a.level.sites()))
            .collect();
        rooms.push(Vectors::new(matrix.rows()));
        let mut amg = Amg {
            fine,
            how,
            coarse,
            coarsest: Coarsest::new(&matrix, &below),
            room: Mutex::new(Vec::new()),
        };
        // A level's cycle is made of what solves the levels below.
        if params.cycles > 1 {
            for depth in (0..amg.coarse.len()).rev() {
                let largest = CYCLE_MARGIN * amg.largest_of_cycle(depth, &mut rooms);
                amg.coarse[depth].cycles =
                    Chebyshev::new(largest.max(1.0), CYCLE_RANGE, params.cycles);
            }
        }
        amg.room = Mutex::new(rooms);
        amg
    }

    /// The largest eigenvalue of an assembled level's cycle times its matrix.
    fn largest_of_cycle(&self, depth: usize, rooms: &mut [Vectors]) -> f32 {
        let (here, rooms) = rooms[depth..].split_at_mut(1);
        let Assembled { level, how, .. } = &self.coarse[depth];
        let mut below = Problem {
            amg: self,
            depth: depth + 1,
            rooms,
        };
        let cycle =
            |r: &[Six], z: &mut [Six]| one_cycle(level, how, r, z, &mut here[0], &mut below);
        eigenvalue::largest(level, CYCLE_STEPS, cycle)
    }

    /// Sites of each level, finest first.
    pub fn levels(&self) -> Vec<usize> {
        let aggregates = self.fine.aggregates();
        let fine = [aggregates.sites(), aggregates.count];
        let coarse = self.coarse.iter().map(|a| a.level.aggregates().count);
        fine.into_iter().chain(coarse).collect()
    }

    /// Bytes kept, without the operator's and without the vectors of the finest level: what belongs to that level, and
    /// the assembled ones.
    pub fn bytes(&self) -> [usize; 2] {
        let coarse = self
            .coarse
            .iter()
            .map(|a| a.level.bytes() + 144 * a.level.sites());
        [self.fine.bytes(), coarse.sum()]
    }
}

/// The problem of an assembled level, with room for it and for those below.
struct Problem<'a, O> {
    amg: &'a Amg<O>,
    depth: usize,
    rooms: &'a mut [Vectors],
}

impl<O: Coarsen> Below for Problem<'_, O> {
    fn right(&mut self) -> &mut [Six] {
        &mut self.rooms[0].b
    }

    fn solve(&mut self) -> &[Six] {
        let (here, rooms) = self.rooms.split_at_mut(1);
        match self.amg.coarse.get(self.depth) {
            None => self.amg.coarsest.solve(&mut here[0]),
            Some(Assembled { level, how, cycles }) => {
                let depth = self.depth + 1;
                let mut below = Problem {
                    amg: self.amg,
                    depth,
                    rooms,
                };
                accelerated(level, how, cycles, &mut here[0], &mut below);
            }
        }
        &here[0].x
    }
}

/// The first assembled level's problem as the finest one sees it: in plain motions.
struct Plain<'a, O> {
    problem: Problem<'a, O>,
    plain: Vec<Six>,
}

impl<O: Coarsen> Below for Plain<'_, O> {
    fn right(&mut self) -> &mut [Six] {
        &mut self.plain
    }

    fn solve(&mut self) -> &[Six] {
        let fine = &self.problem.amg.fine;
        fine.to_basis(&self.plain, self.problem.right());
        fine.to_plain(self.problem.solve(), &mut self.plain);
        &self.plain
    }
}

/// Largest over smallest eigenvalue of a cycle that the polynomial of several is made for.
const CYCLE_RANGE: f32 = 5.0;

/// Steps that find a cycle's largest eigenvalue, and a margin over it: a polynomial of two cycles stays positive up to 1.2 times the
/// eigenvalue it is made for.
const CYCLE_STEPS: usize = 8;
const CYCLE_MARGIN: f32 = 1.05;

fn smoothing<const D: usize>(level: &impl Level<D>, degree: usize) -> Smoothing {
    let largest = level.eigenvalue_bound().max(f32::MIN_POSITIVE);
    // The interval begins at about 1 / (degree + 1)² of the largest eigenvalue. From there on Chebyshev's polynomials of degree 1 to 4
    // leave 0.60, 0.43, 0.41 and 0.38 of a component at most: 1 / T_d((r + 1) / (r − 1)).
    let range = [4.0, 8.0, 16.0, 25.0][degree.clamp(1, 4) - 1];
    Smoothing {
        smoother: Chebyshev::new(largest, range, degree),
        omega: 4.0 / 3.0 / largest,
    }
}

impl<O: Coarsen> SinglePreconditioner<3> for Amg<O> {
    fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, spare: &mut Vec<[f32; 3]>) {
        let mut room = self.room.lock().unwrap_or_else(|e| e.into_inner());
        if self.fine.aggregates().count == 0 {
            z.fill([0.0; 3]);
            return;
        }
        let mut below = Plain {
            problem: Problem {
                amg: self,
                depth: 0,
                rooms: &mut room,
            },
            plain: vec![[0.0; 6]; self.fine.aggregates().count],
        };
        cycle(&self.fine, &self.how, r, z, spare, &mut below);
    }
}
