//! Owns what one brick more or less changes of the energy of a solved body, to first order: the nodes of that brick move, all others stay.
//!
//! With displacements `u`, in equilibrium with stiffness `A` around the brick's eight nodes, and the brick's own stiffness `K`:
//! a brick taken away frees `½ uᵀKu + ½ (Ku)ᵀ(A − K)⁻¹(Ku)`, one that is added stores `½ uᵀKu − ½ (Ku)ᵀ(A + K)⁻¹(Ku)`, where new nodes start at
//! 0. Of single bricks in a flat face the first is more than the energy density there times their volume, the second less.

use super::element::ElementMatrix;
use crate::discretisation::voxels::VoxelMesh;
use crate::operator::held::Held;

/// Pivots below this share of a node's own stiffness belong to nodes that nothing holds.
const LEAST_PIVOT: f64 = 1e-6;

const SIZE: usize = 24;

/// A solved mesh of bricks of one stiffness.
pub struct Solved<'a> {
    pub mesh: &'a VoxelMesh,
    pub stiffness: &'a ElementMatrix,
    pub held: &'a Held,
    /// In mm.
    pub u: &'a [[f64; 3]],
}

impl Solved<'_> {
    fn node(&self, at: [i64; 3]) -> Option<usize> {
        let at = at.map(|v| usize::try_from(v).ok());
        let [Some(x), Some(y), Some(z)] = at else {
            return None;
        };
        self.mesh.node([x, y, z])
    }

    pub fn has_brick(&self, at: [i64; 3]) -> bool {
        self.node(at)
            .is_some_and(|node| self.mesh.has_element(node))
    }

    /// Energy in N mm that the brick at `at` (indices in the grid) frees when it is taken away, or stores when it is added. None where
    /// a brick that is added touches fewer than four nodes.
    pub fn change(&self, at: [i64; 3]) -> Option<f64> {
        let taken = self.has_brick(at);
        let nodes: [Option<usize>; 8] =
            std::array::from_fn(|c| self.node(std::array::from_fn(|a| at[a] + corner(c, a))));
        if nodes.iter().flatten().count() < 4 {
            return None;
        }
        let sign = if taken { -1.0 } else { 1.0 };
        let mut around = self.around(at);
        for (i, row) in around.iter_mut().enumerate() {
            // Of one that is taken away the sum over neighbours is what is left already.
            let own = if taken { 0.0 } else { 1.0 };
            (0..SIZE).for_each(|j| row[j] += own * self.stiffness[i][j]);
        }
        let u: [f64; SIZE] =
            std::array::from_fn(|i| nodes[i / 3].map_or(0.0, |node| self.u[node][i % 3]));
        let force: [f64; SIZE] =
            std::array::from_fn(|i| (0..SIZE).map(|j| self.stiffness[i][j] * u[j]).sum());
        let energy: f64 = 0.5 * (0..SIZE).map(|i| u[i] * force[i]).sum::<f64>();
        let is_free = |i: usize| nodes[i / 3].is_none_or(|node| !self.held.is_held(node, i % 3));
        let free: [bool; SIZE] = std::array::from_fn(is_free);
        let least = LEAST_PIVOT * self.stiffness[0][0];
        Some(energy - sign * 0.5 * relaxed(&mut around, force, free, least))
    }

    /// Stiffness of the eight nodes of a brick by the bricks around it, without its own.
    fn around(&self, at: [i64; 3]) -> Box<ElementMatrix> {
        let mut sum = Box::new([[0.0; SIZE]; SIZE]);
        for o in 0..27i64 {
            let offset = [o % 3 - 1, o / 3 % 3 - 1, o / 9 - 1];
            if o == 13 || !self.has_brick(std::array::from_fn(|a| at[a] + offset[a])) {
                continue;
            }
            // The neighbour's corner at each corner of this brick.
            let theirs: [Option<usize>; 8] = std::array::from_fn(|c| {
                let place: [i64; 3] = std::array::from_fn(|a| corner(c, a) - offset[a]);
                let inside = place.iter().all(|p| (0..2).contains(p));
                inside.then(|| (place[0] + 2 * place[1] + 4 * place[2]) as usize)
            });
            for (p, q) in (0..64).map(|pq| (pq / 8, pq % 8)) {
                if let (Some(own_p), Some(own_q)) = (theirs[p], theirs[q]) {
                    for (r, s) in (0..9).map(|rs| (rs / 3, rs % 3)) {
                        sum[3 * p + r][3 * q + s] += self.stiffness[3 * own_p + r][3 * own_q + s];
                    }
                }
            }
        }
        sum
    }
}

fn corner(c: usize, axis: usize) -> i64 {
    (c >> axis & 1) as i64
}

/// `fᵀ S⁻¹ f` on the free unknowns, by Cholesky's factors; unknowns without stiffness bear nothing.
fn relaxed(s: &mut ElementMatrix, force: [f64; SIZE], free: [bool; SIZE], least: f64) -> f64 {
    let mut sum = 0.0;
    let mut y = force;
    for j in 0..SIZE {
        let pivot = s[j][j];
        if !free[j] || pivot < least {
            continue;
        }
        sum += y[j] * y[j] / pivot;
        for i in (j + 1..SIZE).filter(|i| free[*i]) {
            let by = s[i][j] / pivot;
            y[i] -= by * y[j];
            for k in j + 1..SIZE {
                s[i][k] -= by * s[j][k];
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::voxels::Planes;
    use crate::grid::{Axis, Grid};
    use crate::physics::hex8::element::{Integration, stiffness};

    /// A compressed block of `n` bricks: strained alike everywhere.
    fn of_block<T>(
        n: [usize; 3],
        bone: impl Fn([usize; 3]) -> bool,
        read: impl Fn(&Solved) -> T,
    ) -> T {
        let grid = Grid::new(n, [1.0; 3]);
        let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        let voxels: Vec<u8> = (0..grid.len()).map(|i| u8::from(bone(at(i)))).collect();
        let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
        let mesh = VoxelMesh::new(grid, &voxels, |b| *b != 0, grips).unwrap();
        let k = stiffness([1.0; 3], 1000.0, 0.0, Integration::Full);
        let exists = |node: usize| mesh.around[node] != 0;
        let u: Vec<[f64; 3]> = (0..mesh.len())
            .map(|node| match exists(node) {
                true => [0.0, 0.0, -0.01 * f64::from(mesh.indices(node)[2])],
                false => [0.0; 3],
            })
            .collect();
        let mut held = Held::none(mesh.len());
        for node in (0..mesh.len()).filter(|node| exists(*node)) {
            let z = mesh.indices(node)[2] as usize;
            if z == 0 || z == n[2] {
                held.hold(node, 2);
            }
        }
        read(&Solved {
            mesh: &mesh,
            stiffness: &k,
            held: &held,
            u: &u,
        })
    }

    /// All nodes of a plate one brick thick are held along the load. Without Poisson's effect nothing moves when a brick goes or comes: its own energy is
    /// all that changes, `½ 1000 0.01²`.
    #[test]
    fn a_brick_between_plates_frees_and_stores_its_own_energy() {
        let own = 0.5 * 1000.0 * 1e-4;
        let freed = of_block([5, 5, 1], |_| true, |s| s.change([2, 2, 0]).unwrap());
        assert!((freed / own - 1.0).abs() < 1e-9, "{freed}");
        let stored = of_block(
            [5, 5, 1],
            |at| at != [2, 2, 0],
            |s| s.change([2, 2, 0]).unwrap(),
        );
        assert!((stored / own - 1.0).abs() < 1e-9, "{stored}");
    }

    /// A pit in a flat face frees more than the energy of its brick, a brick on that face stores less.
    #[test]
    fn a_pit_frees_more_than_a_bump_stores() {
        let own = 0.5 * 1000.0 * 1e-4;
        let half = |at: [usize; 3]| at[0] < 4;
        let pit = of_block([7, 7, 7], half, |s| s.change([3, 3, 3]).unwrap());
        let bump = of_block([7, 7, 7], half, |s| s.change([4, 3, 3]).unwrap());
        assert!(pit > 1.1 * own && pit < 3.0 * own, "{}", pit / own);
        assert!(bump < own && bump > 0.1 * own, "{}", bump / own);
        let far = of_block([7, 7, 7], half, |s| s.change([6, 3, 3]));
        assert_eq!(far, None);
    }
}
