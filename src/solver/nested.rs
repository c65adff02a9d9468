//! Owns the preconditioner of elements of higher order: a smoother on them, multigrid on those of lower order inside them.
//!
//! One symmetric cycle: Chebyshev polynomials of `D⁻¹A` before and after the correction by [`Amg`]. In single precision.

use crate::operator::held::Held;
use crate::operator::nested::Nested;
use crate::operator::{Operator, SinglePreconditioner};
use crate::par::CHUNK;
use crate::solver::amg::{Amg, AmgParams};
use rayon::prelude::*;
use std::sync::Mutex;

/// Degree of the smoother, and the part of the spectrum that it damps: the largest eigenvalue over this.
const DEGREE: usize = 2;
const RANGE: f32 = 8.0;

/// `z ≈ A⁻¹ r` by one cycle.
pub struct TwoLevel<'a, O: Nested> {
    operator: &'a O,
    inverse: Vec<[f32; 6]>,
    held: Held,
    amg: Amg<&'a O::Coarse>,
    largest: f32,
    /// Used by one cycle at a time.
    room: Mutex<Room>,
}

struct Room {
    residual: Vec<[f32; 3]>,
    direction: Vec<[f32; 3]>,
    image: Vec<[f32; 3]>,
    coarse: [Vec<[f32; 3]>; 3],
}

impl<'a, O: Nested> TwoLevel<'a, O> {
    /// `params` are of multigrid on the coarser operator.
    pub fn new(operator: &'a O, held: &Held, params: &AmgParams) -> Self {
        let coarse = operator.coarse();
        let of_coarse = operator.held_of_coarse(held);
        let (fine, few) = (operator.sites(), coarse.sites());
        let vector = |n: usize| vec![[0f32; 3]; n];
        TwoLevel {
            operator,
            inverse: operator.inverse_diagonal(held),
            amg: Amg::new(coarse, &of_coarse, params),
            held: of_coarse,
            largest: operator.eigenvalue_bound() as f32,
            room: Mutex::new(Room {
                residual: vector(fine),
                direction: vector(fine),
                image: vector(fine),
                coarse: [vector(few), vector(few), vector(few)],
            }),
        }
    }

    /// Sites of each level, finest first.
    pub fn levels(&self) -> Vec<usize> {
        [self.inverse.len()]
            .into_iter()
            .chain(self.amg.levels())
            .collect()
    }

    /// Adds to `z` what the smoother makes of the residual, and leaves the new residual where that is asked for.
    fn smooth(&self, room: &mut Room, z: &mut [[f32; 3]], wants_residual: bool) {
        let (most, least) = (self.largest, self.largest / RANGE);
        let (middle, half) = (0.5 * (most + least), 0.5 * (most - least));
        let ratio = middle / half;
        let mut rho = 1.0 / ratio;
        self.step(room, z, [0.0, 1.0 / middle]);
        for k in 1..=DEGREE {
            if k == DEGREE && !wants_residual {
                break;
            }
            let Room {
                residual,
                direction,
                image,
                ..
            } = room;
            self.operator
                .apply_single(direction, image, |first, image| {
                    for (q, r) in image.iter_mut().zip(&residual[first..]) {
                        (0..3).for_each(|c| q[c] = r[c] - q[c]);
                    }
                    0.0
                });
            std::mem::swap(residual, image);
            if k < DEGREE {
                let next = 1.0 / (2.0 * ratio - rho);
                self.step(room, z, [next * rho, 2.0 * next / half]);
                rho = next;
            }
        }
    }

    /// `d = keep d + by D⁻¹ r`, `z += d`.
    fn step(&self, room: &mut Room, z: &mut [[f32; 3]], [keep, by]: [f32; 2]) {
        room.direction
            .par_chunks_mut(CHUNK)
            .zip(z.par_chunks_mut(CHUNK))
            .zip(
                room.residual
                    .par_chunks(CHUNK)
                    .zip(self.inverse.par_chunks(CHUNK)),
            )
            .for_each(|((d, z), (r, inverse))| {
                for (((d, z), r), inverse) in d.iter_mut().zip(z).zip(r).zip(inverse) {
                    let scaled = times(inverse, r);
                    for c in 0..3 {
                        d[c] = keep * d[c] + by * scaled[c];
                        z[c] += d[c];
                    }
                }
            });
    }
}

fn times([xx, yy, zz, yz, xz, xy]: &[f32; 6], r: &[f32; 3]) -> [f32; 3] {
    [
        xx * r[0] + xy * r[1] + xz * r[2],
        xy * r[0] + yy * r[1] + yz * r[2],
        xz * r[0] + yz * r[1] + zz * r[2],
    ]
}

impl<O: Nested> SinglePreconditioner<3> for TwoLevel<'_, O> {
    fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, _: &mut Vec<[f32; 3]>) {
        let room = &mut *self.room.lock().unwrap_or_else(|e| e.into_inner());
        room.residual.copy_from_slice(r);
        z.fill([0.0; 3]);
        self.smooth(room, z, true);
        let [b, x, spare] = &mut room.coarse;
        self.operator.restrict(&room.residual, b);
        clear(&self.held, b);
        self.amg.apply_single(b, x, spare);
        self.operator.add_prolonged(x, z);
        self.operator
            .apply_single(z, &mut room.residual, |first, image| {
                for (q, r) in image.iter_mut().zip(&r[first..]) {
                    (0..3).for_each(|c| q[c] = r[c] - q[c]);
                }
                0.0
            });
        self.smooth(room, z, false);
    }
}

fn clear(held: &Held, v: &mut [[f32; 3]]) {
    for (v, &bits) in v.iter_mut().zip(&held.0).filter(|(_, bits)| **bits != 0) {
        (0..3)
            .filter(|c| bits & (1 << c) != 0)
            .for_each(|c| v[c] = 0.0);
    }
}
