//! Owns a body of bonded points as an operator: one pair of blocks for each bond of the stencil, and a factor for each
//! bond of the body only where something (a surface correction, fracture) makes bonds differ.

use super::bond::Blocks;
use crate::discretisation::plane::family::Family;
use crate::operator::Operator;
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use rayon::prelude::*;

/// What is left of a broken bond's stiffness: keeps the operator positive definite where a piece has come loose, at a
/// relative error of this size elsewhere.
pub const RESIDUAL: f64 = 1e-9;

/// A body with `D` unknowns per point.
#[derive(Debug, Clone)]
pub struct Body<const D: usize> {
    pub family: Family,
    pub blocks: Vec<Blocks<D>>,
    /// One factor per bond of the family's list; empty when all are one.
    factor: Vec<f64>,
}

/// Points per parallel task.
const CHUNK: usize = 256;

impl<const D: usize> Body<D> {
    /// `blocks` in the order of the family's stencil; each point must have a row in the family.
    pub fn new(family: Family, blocks: Vec<Blocks<D>>) -> Self {
        Body {
            family,
            blocks,
            factor: Vec::new(),
        }
    }

    /// Multiplies each bond by 2 V₀/(V_p + V_q), V the volume of a point's family (the volume method of Le and Bobaru
    /// for surfaces). `counted` overrides a point's volume (in cells), for the layers of a larger body.
    pub fn correct_surfaces(&mut self, counted: impl Fn(usize) -> Option<f64>) {
        let family = &self.family;
        let whole: f64 = family.stencil.bonds.iter().map(|b| b.share).sum();
        let own = |p: usize| family.of(p).map(|(_, b)| b.share).sum();
        let volume: Vec<f64> = (0..family.rows())
            .map(|p| counted(p).unwrap_or_else(|| own(p)))
            .collect();
        self.factor = (0..family.rows())
            .flat_map(|p| family.of(p).map(move |(q, _)| (p, q)))
            .map(|(p, q)| 2.0 * whole / (volume[p] + volume[q]))
            .collect();
    }

    /// Factor of the bond at place `slot` of the family's list.
    pub fn factor(&self, slot: usize) -> f64 {
        self.factor.get(slot).copied().unwrap_or(1.0)
    }

    /// Multiplies the bond listed at both `slots` by `by`.
    pub fn scale(&mut self, slots: [usize; 2], by: f64) {
        if self.factor.is_empty() {
            self.factor = vec![1.0; self.family.len()];
        }
        for slot in slots {
            self.factor[slot] *= by;
        }
    }

    /// Multiplies every listed bond by `by` of its place in the list, its two points and its kind; both places of a bond must get
    /// the same.
    pub fn scale_each(&mut self, mut by: impl FnMut(usize, usize, usize, usize) -> f64) {
        let mut factor = Vec::with_capacity(self.family.len());
        for p in 0..self.family.rows() {
            for slot in self.family.range(p) {
                let (q, kind) = self.family.kind(slot);
                factor.push(self.factor(slot) * by(slot, p, q, kind));
            }
        }
        self.factor = factor;
    }

    /// Values stored to tell the bonds of this body apart.
    pub fn bond_values(&self) -> usize {
        self.factor.len()
    }

    /// Neighbours of `p` with the bond's place in the list, its kind in the stencil and its factor.
    pub fn row(&self, p: usize) -> impl Iterator<Item = (usize, usize, f64)> {
        self.family.range(p).map(move |slot| {
            let (q, kind) = self.family.kind(slot);
            (q, kind, self.factor(slot))
        })
    }

    /// Tᵀ A T in compressed rows, the lower triangle only (what a factorisation reads). `extra` is added to the
    /// diagonal of each value; empty: nothing.
    pub fn assemble(&self, reduction: &Reduction, extra: &[f64]) -> Sparse {
        let site = |q: usize| (reduction.equation(q) / D, reduction.equation(q) % D);
        let below = |q: usize, value: usize| reduction.unknown(value).filter(|&c| c <= q);
        let mut a = Sparse::from_pattern(reduction.unknowns(), |q, list| {
            let (p, _) = site(q);
            let points = self.row(p).map(|(other, _, _)| other).chain([p]);
            let values = points.flat_map(|point| (0..D).map(move |d| point * D + d));
            list.extend(values.filter_map(|value| below(q, value)).map(|c| c as u32));
        });
        a.fill(|rows| {
            for q in rows.range() {
                let (p, i) = site(q);
                let mut own = [0.0; D];
                for (other, kind, factor) in self.row(p) {
                    let b = &self.blocks[kind];
                    for (d, own) in own.iter_mut().enumerate() {
                        *own += factor * b.own[i][d];
                        if let Some(c) = below(q, other * D + d) {
                            rows.add(q, c, factor * b.cross[i][d]);
                        }
                    }
                }
                for (d, value) in own.into_iter().enumerate() {
                    if let Some(c) = below(q, p * D + d) {
                        rows.add(q, c, value);
                    }
                }
                rows.add(q, q, extra.get(p * D + i).copied().unwrap_or(0.0));
            }
        });
        a
    }

    /// Σ over bonds: x·A x/2, the energy per mm of thickness.
    pub fn energy(&self, x: &[[f64; D]]) -> f64 {
        let mut y = vec![[0.0; D]; x.len()];
        self.apply(x, &mut y);
        0.5 * crate::par::dot(x, &y)
    }
}

impl<const D: usize> Operator<D> for Body<D> {
    fn sites(&self) -> usize {
        self.family.rows()
    }

    fn apply(&self, x: &[[f64; D]], y: &mut [[f64; D]]) {
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, y)| {
            for (k, out) in y.iter_mut().enumerate() {
                let p = chunk * CHUNK + k;
                *out = [0.0; D];
                for (q, kind, factor) in self.row(p) {
                    let force = self.blocks[kind].apply(&x[p], &x[q]);
                    for (sum, f) in out.iter_mut().zip(force) {
                        *sum += factor * f;
                    }
                }
            }
        });
    }

    fn diagonal(&self, d: &mut [[f64; D]]) {
        for (p, out) in d.iter_mut().enumerate() {
            *out = [0.0; D];
            for (_, kind, factor) in self.row(p) {
                for (i, value) in out.iter_mut().enumerate() {
                    *value += factor * self.blocks[kind].own[i][i];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::plane::Points;
    use crate::discretisation::plane::family::Stencil;
    use crate::physics::continuum_molecular::bond::{Moduli, bonds};
    use crate::physics::continuum_molecular::micromoduli::Micromoduli;
    use crate::physics::continuum_molecular::tensor::PlaneTensor;

    fn body<const D: usize>(zeta: f64) -> (Points, Body<D>) {
        let points = Points::from_box([-6.0, -6.0], 1.0, [12, 12], |p| p[0].hypot(p[1]) < 5.9);
        let stencil = Stencil::new(1.0, 3.0, true).unwrap();
        let tensor = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
        let micro = Micromoduli::new(&tensor.turned(zeta), 3.0);
        let blocks = bonds(&stencil)
            .iter()
            .map(|b| {
                let psi = b.psi();
                let k = Moduli {
                    axial: micro.axial(psi),
                    shear: micro.shear(psi),
                    bending: 0.1,
                };
                b.stiffness(&k, 1.0)
            })
            .collect();
        let family = Family::new(&points, points.len(), stencil);
        (points, Body::new(family, blocks))
    }

    fn noise<const D: usize>(n: usize, seed: f64) -> Vec<[f64; D]> {
        (0..n)
            .map(|i| std::array::from_fn(|d| ((i * D + d) as f64 * 0.7 + seed).sin()))
            .collect()
    }

    /// Symmetric, and without force under rigid motion, with surface correction and a broken bond.
    #[test]
    fn laws_of_an_elastic_operator() {
        let (points, mut body) = body::<3>(0.3);
        body.correct_surfaces(|_| None);
        let slot = body.family.range(40).start;
        let (q, _) = body.family.kind(slot);
        let back = body
            .family
            .range(q)
            .find(|&s| body.family.kind(s).0 == 40)
            .unwrap();
        body.scale([slot, back], RESIDUAL);
        let (x, y) = (noise::<3>(points.len(), 0.1), noise::<3>(points.len(), 0.9));
        let mut out = vec![[0.0; 3]; points.len()];
        body.apply(&x, &mut out);
        let xy = crate::par::dot(&y, &out);
        body.apply(&y, &mut out);
        let yx = crate::par::dot(&x, &out);
        assert!((xy - yx).abs() < 1e-14 * xy.abs(), "{xy} {yx}");
        let turn: Vec<[f64; 3]> = points
            .positions()
            .iter()
            .map(|p| [0.3 - p[1], 0.2 + p[0], 1.0])
            .collect();
        body.apply(&turn, &mut out);
        assert!(
            out.iter().flatten().all(|f| f.abs() < 1e-14),
            "rigid motion"
        );
    }

    /// Under an affine displacement with the rotation of its gradient, full families are in equilibrium: no force and
    /// no moment (the patch test), for any material angle.
    #[test]
    fn patch_residual_vanishes_on_full_families() {
        for zeta in [0.0, 0.4, 1.1] {
            let (points, body) = body::<3>(zeta);
            let f = [[0.2, 0.7], [-0.4, -0.1]];
            let x: Vec<[f64; 3]> = points
                .positions()
                .iter()
                .map(|p| {
                    [
                        f[0][0] * p[0] + f[0][1] * p[1],
                        f[1][0] * p[0] + f[1][1] * p[1],
                        0.5 * (f[1][0] - f[0][1]),
                    ]
                })
                .collect();
            let mut out = vec![[0.0; 3]; points.len()];
            body.apply(&x, &mut out);
            let full = |p: &usize| body.family.range(*p).len() == body.family.stencil.bonds.len();
            let worst = (0..points.len())
                .filter(full)
                .flat_map(|p| out[p])
                .fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!((0..points.len()).any(|p| full(&p)));
            assert!(worst < 1e-15, "zeta = {zeta}: {worst}");
        }
    }

    #[test]
    fn the_stiffness_is_the_second_difference_of_the_energy() {
        let (points, body) = body::<3>(0.2);
        let k = Micromoduli::new(
            &PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0])
                .unwrap()
                .turned(0.2),
            3.0,
        );
        let x = noise::<3>(points.len(), 0.4);
        let all = bonds(&body.family.stencil);
        let direct: f64 = (0..points.len())
            .flat_map(|p| body.row(p).map(move |(q, kind, _)| (p, q, kind)))
            .map(|(p, q, kind)| {
                let b = &all[kind];
                let moduli = Moduli {
                    axial: k.axial(b.psi()),
                    shear: k.shear(b.psi()),
                    bending: 0.1,
                };
                0.5 * b.energy(&moduli, &b.deformation(&x[p], &x[q])) * b.volume_mm2
            })
            .sum();
        assert!((body.energy(&x) / direct - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_body_without_differences_stores_no_bond_values() {
        assert_eq!(body::<2>(0.0).1.bond_values(), 0);
    }
}
