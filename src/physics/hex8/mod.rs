//! Owns voxel finite elements: linear elasticity on a mesh of equal 8-node bricks, one modulus for all.

// Small fixed matrices read best by index.
#![allow(clippy::needless_range_loop)]

pub mod element;
pub mod fields;
pub mod flips;
pub mod heterogeneous;
mod kernel;
mod modes;
pub mod plastic;
mod stencils;

use crate::discretisation::voxels::VoxelMesh;
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use element::{ElementMatrix, Integration};
use kernel::Elements;
use modes::Modal;
use rayon::prelude::*;
use std::ops::Range;
use stencils::{Couplings, Stencils};

/// `A u` is the vector of nodal forces (N) of the displacements `u` (mm), without any support.
pub struct Hex8 {
    pub mesh: VoxelMesh,
    modal: Modal<f64>,
    stencils: Stencils,
    couplings: Couplings,
    /// Of one element, so of all together.
    eigenvalue_bound: f64,
}

impl Hex8 {
    /// `young_mpa` in MPa, `−1 < poisson < ½`.
    pub fn new(mesh: VoxelMesh, young_mpa: f64, poisson: f64, rule: Integration) -> Self {
        let k = element::stiffness(mesh.grid.spacing_mm, young_mpa, poisson, rule);
        Hex8::of_matrix(mesh, &k)
    }

    /// Elements that all have the stiffness matrix `k`, in N/mm.
    pub fn of_matrix(mesh: VoxelMesh, k: &ElementMatrix) -> Self {
        let stencils = Stencils::new(k);
        Hex8 {
            mesh,
            modal: Modal::new(k),
            couplings: Couplings::new(&stencils),
            eigenvalue_bound: element::eigenvalue_bound(k),
            stencils,
        }
    }

    fn elements<'a, S>(&'a self, modal: &'a [Modal<[S; 8]>]) -> Elements<'a, S> {
        Elements {
            mesh: &self.mesh,
            modal,
            factor: &[],
            kind: &[],
        }
    }
}

impl Operator<3> for Hex8 {
    fn sites(&self) -> usize {
        self.mesh.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let chunk = self.chunk();
        y.par_chunks_mut(chunk).enumerate().for_each(|(c, y)| {
            self.rows_f64(c * chunk..c * chunk + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut()
            .zip(&self.mesh.around)
            .for_each(|(d, &around)| *d = self.stencils.diagonal(around));
    }
}

impl Coarsen for Hex8 {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        positions(&self.mesh, sites, x);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let mut columns = Vec::with_capacity(27);
        for segment in self.mesh.segments_in(sites) {
            for (i, node) in (0u32..).zip(segment.nodes()) {
                let (places, blocks) = self.couplings.of(self.mesh.around[node]);
                columns.clear();
                columns.extend(
                    places
                        .iter()
                        .map(|p| segment.rows[p.row as usize] + i + u32::from(p.dx) - 1),
                );
                visit(node, &columns, blocks);
            }
        }
    }

    fn each_diagonal(&self, sites: Range<usize>, visit: &mut dyn FnMut(usize, &Block)) {
        let around = &self.mesh.around[sites.clone()];
        sites
            .zip(around)
            .for_each(|(node, &around)| visit(node, &self.stencils.own(around)));
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.mesh.reach(sites)
    }

    fn hinges(&self, sites: Range<usize>, hinges: &mut [bool]) {
        let around = &self.mesh.around[sites];
        let pairs = hinges.iter_mut().zip(around);
        pairs.for_each(|(hinge, &around)| *hinge = !share_faces(around));
    }

    fn is_uniform(&self) -> bool {
        true
    }

    fn chunk(&self) -> usize {
        kernel::chunk(&self.mesh)
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let modal = [kernel::wide(&self.modal)];
        kernel::rows(self.elements(&modal), sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        let modal = [kernel::wide(&self.modal.map(|v| v as f32))];
        kernel::rows(self.elements(&modal), sites, x, y);
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.eigenvalue_bound
    }
}

/// Whether the elements around a node (bit `x + 2 y + 4 z`) all hang together by faces.
const fn share_faces(around: u8) -> bool {
    // From the lowest element, what faces lead to; no path is longer than seven steps.
    let mut reached = around & around.wrapping_neg();
    let mut step = 0;
    while step < 7 {
        let x = (reached & 0x55) << 1 | (reached & 0xAA) >> 1;
        let y = (reached & 0x33) << 2 | (reached & 0xCC) >> 2;
        let z = reached.rotate_left(4);
        reached |= around & (x | y | z);
        step += 1;
    }
    reached == around
}

/// Where nodes are, in mm.
fn positions(mesh: &VoxelMesh, sites: Range<usize>, x: &mut [[f64; 3]]) {
    let h = mesh.grid.spacing_mm;
    for segment in mesh.segments_in(sites.clone()) {
        let own = segment.nodes();
        let out = &mut x[own.start - sites.start..own.end - sites.start];
        for (i, x) in (0u32..).zip(out) {
            let at = [segment.at[0] + i, segment.at[1], segment.at[2]];
            *x = std::array::from_fn(|a| f64::from(at[a]) * h[a]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::voxels::Planes;
    use crate::grid::{Axis, Grid};

    fn random(n: [usize; 3], percent: u64, seed: u64) -> Hex8 {
        let mut state = seed * 7919 + 1;
        let mask: Vec<u8> = (0..n.iter().product())
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
                u8::from((state >> 33) % 100 < percent)
            })
            .collect();
        let grid = Grid::new(n, [0.02, 0.03, 0.05]);
        let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
        let mesh = VoxelMesh::new(grid, &mask, |&b| b != 0, grips).unwrap();
        Hex8::new(mesh, 1000.0, 0.3, Integration::Full)
    }

    fn vector(n: usize) -> Vec<[f64; 3]> {
        (0..n)
            .map(|i| std::array::from_fn(|a| ((i * 3 + a) as f64 * 0.7).sin()))
            .collect()
    }

    #[test]
    fn elements_that_meet_in_an_edge_or_a_corner_share_no_face() {
        for around in [0b1, 0b11, 0b1111_1111, 0b0111_0101, 0b0001_0111] {
            assert!(share_faces(around), "{around:b}");
        }
        for around in [0b1001, 0b1000_0001, 0b0110_0000, 0b1001_1001] {
            assert!(!share_faces(around), "{around:b}");
        }
    }

    /// Against element by element assembly from positions alone, in all precisions and instruction sets, sparse to solid.
    #[test]
    fn gathered_forces_equal_forces_element_by_element() {
        for (seed, percent) in [(0, 20), (1, 45), (2, 45), (3, 70), (4, 95), (5, 100)] {
            let op = random([11, 7, 6], percent, seed);
            let x = vector(op.sites());
            let exact = by_elements(&op.mesh, &x, |_| 1.0);
            let scale = exact.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            let double = [kernel::wide(&op.modal)];
            let single = [kernel::wide(&op.modal.map(|v| v as f32))];
            kernel::each_way_f64(|way, rows| {
                let mut y = vec![[0.0; 3]; x.len()];
                rows(op.elements(&double), 0..x.len(), &x, &mut y);
                assert!(worst(&exact, &y) < 1e-13 * scale, "{way}, {percent} %");
            });
            let x32: Vec<[f32; 3]> = x.iter().map(|v| v.map(|c| c as f32)).collect();
            kernel::each_way_f32(|way, rows| {
                let mut y32 = vec![[0.0; 3]; x.len()];
                rows(op.elements(&single), 0..x.len(), &x32, &mut y32);
                let y: Vec<[f64; 3]> = y32.iter().map(|v| v.map(f64::from)).collect();
                // Measured 4e-7.
                assert!(worst(&exact, &y) < 3e-6 * scale, "{way}, {percent} %");
            });
        }
    }

    #[test]
    fn forces_of_heterogeneous_elements_are_those_of_each_times_its_factor() {
        let op = heterogeneous([11, 7, 6], 2);
        let x = vector(op.sites());
        let exact = by_elements(op.mesh(), &x, factor);
        let scale = exact.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut y = vec![[0.0; 3]; x.len()];
        op.apply(&x, &mut y);
        assert!(worst(&exact, &y) < 1e-13 * scale);
        let x32: Vec<[f32; 3]> = x.iter().map(|v| v.map(|c| c as f32)).collect();
        let mut y32 = vec![[0.0; 3]; x.len()];
        op.rows_f32(0..x.len(), &x32, &mut y32);
        let y: Vec<[f64; 3]> = y32.iter().map(|v| v.map(f64::from)).collect();
        assert!(worst(&exact, &y) < 3e-6 * scale);
    }

    /// Elements of two Poisson's ratios apply what two meshes do, each with the other's elements of no stiffness.
    #[test]
    fn elements_of_two_kinds_have_their_own_ratio_each() {
        let rule = Integration::Full;
        let kinds = [(0.3, rule), (0.45, Integration::MeanDilatation)];
        let second = |e: usize| e % 3 < 1;
        let mesh = random([11, 7, 6], 50, 5).mesh;
        let x = vector(mesh.len());
        let mixed =
            heterogeneous::Heterogeneous::of_kinds(mesh.clone(), 1000.0, &kinds, factor, |e| {
                second(e).into()
            });
        check_rows(&mixed);
        let mut exact = vec![[0.0; 3]; x.len()];
        for (kind, &(nu, rule)) in kinds.iter().enumerate() {
            let own = |e: usize| {
                if usize::from(second(e)) == kind {
                    factor(e)
                } else {
                    0.0
                }
            };
            let part = heterogeneous::Heterogeneous::new(mesh.clone(), 1000.0, nu, rule, own);
            let mut y = vec![[0.0; 3]; x.len()];
            part.apply(&x, &mut y);
            for (sum, y) in exact.iter_mut().zip(&y) {
                (0..3).for_each(|a| sum[a] += y[a]);
            }
        }
        let scale = exact.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut y = vec![[0.0; 3]; x.len()];
        mixed.apply(&x, &mut y);
        assert!(worst(&exact, &y) < 1e-13 * scale);
    }

    /// Rounded coefficients do not sum to zero; differences of what is equal do.
    #[test]
    fn a_translation_pulls_at_nothing_in_single_precision() {
        let x = |n: usize| vec![[1.1f32, -0.7, 123.4]; n];
        let op = random([11, 7, 6], 45, 1);
        let mut y = x(op.sites());
        op.rows_f32(0..y.len(), &x(op.sites()), &mut y);
        assert!(y.iter().flatten().all(|f| *f == 0.0));
        let op = heterogeneous([11, 7, 6], 2);
        let mut y = x(op.sites());
        op.rows_f32(0..y.len(), &x(op.sites()), &mut y);
        assert!(y.iter().flatten().all(|f| *f == 0.0));
    }

    /// To the last bit: what a task has of its neighbours' bricks is what they have.
    #[test]
    fn any_range_of_rows_is_that_of_the_whole() {
        for (seed, percent) in [(0, 20), (1, 45), (3, 70), (5, 100)] {
            let op = random([19, 7, 6], percent, seed);
            let n = op.sites();
            let x: Vec<[f32; 3]> = vector(n).iter().map(|v| v.map(|c| c as f32)).collect();
            let mut whole = vec![[0.0; 3]; n];
            op.rows_f32(0..n, &x, &mut whole);
            for length in [1, 2, 7, 50, n / 3] {
                let mut parts = vec![[0.0; 3]; n];
                for (c, part) in parts.chunks_mut(length).enumerate() {
                    let start = c * length;
                    op.rows_f32(start..start + part.len(), &x, part);
                }
                assert_eq!(parts, whole, "{percent} %, {length} at a time");
            }
        }
    }

    #[test]
    fn rows_are_what_the_operator_applies() {
        let op = random([9, 6, 5], 50, 3);
        check_rows(&op);
        check_rows(&heterogeneous([9, 6, 5], 3));
    }

    /// Factors that differ from element to element.
    fn heterogeneous(n: [usize; 3], seed: u64) -> heterogeneous::Heterogeneous {
        let mesh = random(n, 50, seed).mesh;
        heterogeneous::Heterogeneous::new(mesh, 1000.0, 0.3, Integration::Full, factor)
    }

    fn factor(element: usize) -> f32 {
        0.25 + (element % 7) as f32
    }

    fn check_rows(op: &impl Coarsen) {
        let x = vector(op.sites());
        let mut y = vec![[0.0; 3]; x.len()];
        op.apply(&x, &mut y);
        let mut sites = 0..op.sites();
        op.each_row(0..op.sites(), &mut |site, columns, blocks| {
            assert_eq!(sites.next(), Some(site));
            let (mut sum, y) = ([0.0; 3], y[site]);
            for (column, block) in columns.iter().zip(blocks) {
                let reach = op.reach(site..site + 1);
                assert!(reach.contains(&(*column as usize)));
                for a in 0..3 {
                    for b in 0..3 {
                        sum[a] += f64::from(block[a][b]) * x[*column as usize][b];
                    }
                }
            }
            assert!((0..3).all(|a| (sum[a] - y[a]).abs() < 1e-4));
        });
        assert_eq!(sites.next(), None);
    }

    fn worst(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        let gaps = a.iter().flatten().zip(b.iter().flatten());
        gaps.fold(0.0, |m, (p, q)| m.max((p - q).abs()))
    }

    fn by_elements(mesh: &VoxelMesh, x: &[[f64; 3]], f: impl Fn(usize) -> f32) -> Vec<[f64; 3]> {
        let numbers: std::collections::HashMap<[u32; 3], usize> = (0..mesh.len())
            .filter(|&i| mesh.around[i] != 0)
            .map(|i| (mesh.indices(i), i))
            .collect();
        let k = element::stiffness(mesh.grid.spacing_mm, 1000.0, 0.3, Integration::Full);
        let mut y = vec![[0.0; 3]; x.len()];
        for (node, element) in mesh.low_corner_elements().enumerate() {
            let Some(element) = element else { continue };
            let factor = f64::from(f(element));
            let at = mesh.indices(node);
            let corners: [usize; 8] = std::array::from_fn(|c| {
                numbers[&std::array::from_fn(|a| at[a] + (c >> a & 1) as u32)]
            });
            for i in 0..24 {
                for j in 0..24 {
                    y[corners[i / 3]][i % 3] += factor * k[i][j] * x[corners[j / 3]][j % 3];
                }
            }
        }
        y
    }
}
