//! Owns the eight integration points of one brick: strains from corner displacements, corner forces from stresses, and the change of
//! the stiffness matrix where points soften. Edges are the same for all elements of a mesh.

use crate::physics::hex8::element;
use crate::physics::plasticity::{Softening, Tensor};

/// Displacements (mm) or forces (N) of the corners, `cx + 2 cy + 4 cz`.
pub type Corners = [[f64; 3]; 8];

/// Pairs of corners `a < b`.
pub const PAIRS: usize = 28;

/// The couplings of all pairs of corners, N/mm: entry `9 pair + 3 i + j` is the force on component `i` of the lower corner per
/// displacement of component `j` of the higher one. A corner's coupling with itself balances those with the others.
pub type Couplings<K> = [K; 9 * PAIRS];

/// A precision to keep numbers in.
pub trait Scalar: Copy + Into<f64> + Send + Sync {
    fn of(value: f64) -> Self;
}

impl Scalar for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
}

impl Scalar for f64 {
    fn of(value: f64) -> Self {
        value
    }
}

/// Number of a pair of corners.
pub const fn pair(a: usize, b: usize) -> usize {
    a * (15 - a) / 2 + b - a - 1
}

/// Weight of an edge's end at the point near it, and at the other.
const NEAR: f64 = 0.788_675_134_594_812_9;
const FAR: f64 = 1.0 - NEAR;

/// The points of a brick with edges `h`, in mm.
pub struct Points {
    h: [f64; 3],
    /// Volume per point, mm³.
    weight: f64,
    /// Whether the dilatation is its mean over the element (B-bar; Hughes 1980): plastic flow keeps the volume, and eight
    /// dilatations per element would lock it.
    is_mean: bool,
    /// Gradients of the shape functions at the points, and their means.
    gradients: [[[f64; 3]; 8]; 8],
    mean: [[f64; 3]; 8],
    /// `P` integrated at each point alone.
    deviatoric: [Vec<f64>; 8],
}

/// The two axes across one.
const fn across(axis: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][axis]
}

fn near(point: usize, end: usize) -> f64 {
    if point == end { NEAR } else { FAR }
}

impl Points {
    /// `is_mean` chooses mean dilatation; full integration otherwise.
    pub fn new(h: [f64; 3], is_mean: bool) -> Self {
        let gradients: [_; 8] = std::array::from_fn(|p| element::gradients(h, p));
        let mut mean = [[0.0; 3]; 8];
        for of_point in &gradients {
            for (mean, g) in mean.iter_mut().zip(of_point) {
                (0..3).for_each(|a| mean[a] += 0.125 * g[a]);
            }
        }
        let weight = h[0] * h[1] * h[2] / 8.0;
        Points {
            h,
            weight,
            is_mean,
            deviatoric: gradients.map(|g| deviatoric(&g, weight)),
            gradients,
            mean,
        }
    }

    /// mm³.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Gradients of the displacement: point, component, direction.
    pub fn displacement_gradients(&self, u: &Corners) -> [[[f64; 3]; 3]; 8] {
        let mut out = [[[0.0; 3]; 3]; 8];
        for axis in 0..3 {
            let [b, c] = across(axis);
            for component in 0..3 {
                let edge = |i: usize, j: usize| {
                    let low = i << b | j << c;
                    (u[low | 1 << axis][component] - u[low][component]) / self.h[axis]
                };
                let edges = [[edge(0, 0), edge(0, 1)], [edge(1, 0), edge(1, 1)]];
                // Along the first axis across, then the second.
                for i in 0..2 {
                    let line: [f64; 2] = std::array::from_fn(|j| {
                        near(i, 0) * edges[0][j] + near(i, 1) * edges[1][j]
                    });
                    for j in 0..2 {
                        let value = near(j, 0) * line[0] + near(j, 1) * line[1];
                        let point = i << b | j << c;
                        out[point][component][axis] = value;
                        out[point | 1 << axis][component][axis] = value;
                    }
                }
            }
        }
        out
    }

    /// Strains at the points, engineering shears.
    pub fn strains(&self, u: &Corners) -> [Tensor; 8] {
        let mut strains = self
            .displacement_gradients(u)
            .map(|[x, y, z]| [x[0], y[1], z[2], y[2] + z[1], x[2] + z[0], x[1] + y[0]]);
        if self.is_mean {
            let volumes = strains.map(|e| e[0] + e[1] + e[2]);
            let mean = 0.125 * volumes.iter().sum::<f64>();
            for (strain, volume) in strains.iter_mut().zip(volumes) {
                (0..3).for_each(|a| strain[a] += (mean - volume) / 3.0);
            }
        }
        strains
    }

    /// Corner forces of stresses at the points: the transpose of [`Points::strains`].
    pub fn forces(&self, stresses: &[Tensor; 8]) -> Corners {
        let mut stresses = *stresses;
        if self.is_mean {
            let pressures = stresses.map(|s| (s[0] + s[1] + s[2]) / 3.0);
            let mean = 0.125 * pressures.iter().sum::<f64>();
            for (stress, pressure) in stresses.iter_mut().zip(pressures) {
                (0..3).for_each(|a| stress[a] += mean - pressure);
            }
        }
        let mut forces = [[0.0; 3]; 8];
        for (s, gradients) in stresses.iter().zip(&self.gradients) {
            let [xx, yy, zz, yz, xz, xy] = s.map(|v| v * self.weight);
            for (f, g) in forces.iter_mut().zip(gradients) {
                f[0] += xx * g[0] + xy * g[1] + xz * g[2];
                f[1] += xy * g[0] + yy * g[1] + yz * g[2];
                f[2] += xz * g[0] + yz * g[1] + zz * g[2];
            }
        }
        forces
    }

    /// The change of the stiffness matrix by these softenings, at full precision.
    fn change(&self, softenings: &[Softening; 8]) -> [f64; 9 * PAIRS] {
        let mut k = [0.0; 9 * PAIRS];
        let (mut crossed, mut whole) = ([[0.0; 3]; 8], 0.0);
        for (point, s) in softenings.iter().enumerate() {
            if s.deviatoric == 0.0 && s.nn == 0.0 && s.ii == 0.0 {
                continue;
            }
            for (k, p) in k.iter_mut().zip(&self.deviatoric[point]) {
                *k -= s.deviatoric * p;
            }
            let along = self.along(point, &s.n);
            add(&mut k, self.weight * s.nn, &along, &along);
            if self.is_mean {
                for (sum, b) in crossed.iter_mut().zip(&along) {
                    (0..3).for_each(|a| sum[a] += self.weight * s.ni * b[a]);
                }
                whole += self.weight * s.ii;
            } else if s.ii != 0.0 {
                let g = &self.gradients[point];
                add(&mut k, self.weight * s.ni, &along, g);
                add(&mut k, self.weight * s.ni, g, &along);
                add(&mut k, self.weight * s.ii, g, g);
            }
        }
        if whole != 0.0 {
            add(&mut k, 1.0, &crossed, &self.mean);
            add(&mut k, 1.0, &self.mean, &crossed);
            add(&mut k, whole, &self.mean, &self.mean);
        }
        k
    }

    /// The same as it is kept.
    pub fn couplings<K: Scalar>(&self, softenings: &[Softening; 8]) -> Couplings<K> {
        self.change(softenings).map(K::of)
    }

    /// `n : ε` at a point per corner displacement; `n` has no trace.
    fn along(&self, point: usize, n: &Tensor) -> Corners {
        let [xx, yy, zz, yz, xz, xy] = *n;
        self.gradients[point].map(|[x, y, z]| {
            [
                xx * x + xy * y + xz * z,
                xy * x + yy * y + yz * z,
                xz * x + yz * y + zz * z,
            ]
        })
    }
}

/// `k += scale · left ⊗ right`, the pairs of corners alone.
fn add(k: &mut [f64; 9 * PAIRS], scale: f64, left: &Corners, right: &Corners) {
    let mut at = 0;
    for a in 0..8 {
        for b in a + 1..8 {
            for i in 0..3 {
                for j in 0..3 {
                    k[at] += scale * left[a][i] * right[b][j];
                    at += 1;
                }
            }
        }
    }
}

/// `P` at a point as couplings: `Bᵀ P B` times the point's volume.
fn deviatoric(g: &[[f64; 3]; 8], weight: f64) -> Vec<f64> {
    let mut k = Vec::with_capacity(9 * PAIRS);
    for a in 0..8 {
        for b in a + 1..8 {
            let dot = g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2];
            for i in 0..3 {
                for j in 0..3 {
                    let same = if i == j { dot } else { 0.0 };
                    let symmetric = 0.5 * (same + g[a][j] * g[b][i]);
                    k.push(weight * (symmetric - g[a][i] * g[b][j] / 3.0));
                }
            }
        }
    }
    k
}
