//! Owns the stiffness of a brick in the modes of its corners: sums and differences along x, y and z.
//!
//! Mode `m` of a component is `Σ_c ±u_c`, with a minus for each axis whose bit is in `m` and not in the corner `c`: mode 0 is
//! the translation, 1, 2 and 4 are the mean gradients, 3, 5 and 6 twist faces, 7 is the hourglass. A brick of an isotropic
//! solid is symmetric about three planes, so all but 45 of the 576 entries vanish in this basis.

use super::element::ElementMatrix;

/// What is left of a brick's stiffness, N/mm per unit of a mode (a sum of eight displacements).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modal<S> {
    /// Mean normal gradients of x, y, z: xx, yy, zz, yz, xz, xy.
    pub normal: [S; 6],
    /// Mean shear gradients in the planes yz, xz, xy: for each the first component's, the second's, and both.
    pub shear: [[S; 3]; 3],
    /// Bending, as [`BENDING`] lists its pairs.
    pub bending: [[S; 3]; 3],
    /// Twist, as `normal`.
    pub twist: [S; 6],
    /// The hourglass of each component.
    pub hourglass: [S; 3],
}

/// Mode and component.
type Place = (usize, usize);

const NORMAL: [Place; 3] = [(1, 0), (2, 1), (4, 2)];
/// The planes yz, xz, xy.
pub const SHEAR: [[Place; 2]; 3] = [[(2, 2), (4, 1)], [(1, 2), (4, 0)], [(1, 1), (2, 0)]];
pub const BENDING: [[Place; 2]; 3] = [[(3, 0), (6, 2)], [(3, 1), (5, 2)], [(5, 0), (6, 1)]];
const TWIST: [Place; 3] = [(6, 0), (5, 1), (3, 2)];

/// `±1`: the part of a corner in a mode.
fn sign(mode: usize, corner: usize) -> f64 {
    match (mode & !corner).count_ones() % 2 {
        0 => 1.0,
        _ => -1.0,
    }
}

/// `Hᵀ K H / 64`, unknown `3 mode + component`.
fn in_modes(k: &ElementMatrix) -> ElementMatrix {
    let mut half = [[0.0; 24]; 24];
    let mut all = half;
    for (i, row) in half.iter_mut().enumerate() {
        for (j, v) in row.iter_mut().enumerate() {
            let of = |c: usize| sign(j / 3, c) * k[i][3 * c + j % 3];
            *v = (0..8).map(of).sum();
        }
    }
    for (i, row) in all.iter_mut().enumerate() {
        for (j, v) in row.iter_mut().enumerate() {
            let of = |c: usize| sign(i / 3, c) * half[3 * c + i % 3][j];
            *v = (0..8).map(of).sum::<f64>() / 64.0;
        }
    }
    all
}

impl Modal<f64> {
    /// Of the stiffness matrix of a brick of an isotropic solid.
    pub fn new(k: &ElementMatrix) -> Self {
        let all = in_modes(k);
        let largest = all.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        // What rounding left is zero: products with it would fall below what single precision holds in full, and such take a
        // hundred times as long.
        let at = |(m, a): Place, (n, b): Place| match all[3 * m + a][3 * n + b] {
            v if v.abs() > 1e-12 * largest => v,
            _ => 0.0,
        };
        let three = |p: [Place; 3]| {
            [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)].map(|(i, j)| at(p[i], p[j]))
        };
        let two = |[p, q]: [Place; 2]| [at(p, p), at(q, q), at(p, q)];
        Modal {
            normal: three(NORMAL),
            shear: SHEAR.map(two),
            bending: BENDING.map(two),
            twist: three(TWIST),
            hourglass: [0, 1, 2].map(|a| at((7, a), (7, a))),
        }
    }
}

impl<S: Copy> Modal<S> {
    /// The same with each number as `f` of it.
    pub fn map<T>(&self, f: impl Fn(S) -> T + Copy) -> Modal<T> {
        Modal {
            normal: self.normal.map(f),
            shear: self.shear.map(|v| v.map(f)),
            bending: self.bending.map(|v| v.map(f)),
            twist: self.twist.map(f),
            hourglass: self.hourglass.map(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::hex8::element::{Integration, stiffness};

    /// Nothing but the 45 entries is left, for bricks of all shapes and rules.
    #[test]
    fn the_modes_of_a_brick_hardly_couple() {
        for rule in [
            Integration::Full,
            Integration::MeanDilatation,
            Integration::Blend(0.3),
        ] {
            let all = in_modes(&stiffness([0.02, 0.03, 0.05], 1000.0, 0.3, rule));
            let largest = all.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            let kept = all.iter().flatten();
            assert_eq!(kept.filter(|v| v.abs() > 1e-12 * largest).count(), 45);
            let modal = Modal::new(&stiffness([0.02, 0.03, 0.05], 1000.0, 0.3, rule));
            let three = |v: [f64; 6]| v[..3].iter().chain(&v[3..]).chain(&v[3..]).sum::<f64>();
            let pairs = modal.shear.iter().chain(&modal.bending);
            let pairs = pairs.map(|[a, b, c]| a + b + 2.0 * c).sum::<f64>();
            let sum = three(modal.normal) + three(modal.twist) + pairs;
            let sum = sum + modal.hourglass.iter().sum::<f64>();
            let of_all = all.iter().flatten().sum::<f64>();
            assert!((sum - of_all).abs() < 1e-12 * largest, "{sum} {of_all}");
        }
    }
}
