//! Owns one ten-node element: slopes of its barycentric coordinates, and the blocks of its stiffness.

use crate::discretisation::tetrahedra::nodes::EDGES;

/// A bound of the largest eigenvalue of an element's `D⁻¹K`, `D` its 3 × 3 diagonal blocks.
pub const EIGENVALUE_BOUND: f64 = 4.0;

/// Volume, and the slopes of the coordinates of corners 1, 2 and 3; that of corner 0 is the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    pub slopes: [[f64; 3]; 3],
    pub volume: f64,
}

impl Shape {
    pub fn of([a, b, c, d]: [[f64; 3]; 4]) -> Shape {
        let minus = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
        let cross = |p: [f64; 3], q: [f64; 3]| {
            [0, 1, 2].map(|i| p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3])
        };
        let [b, c, d] = [b, c, d].map(minus);
        let six = {
            let n = cross(b, c);
            n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
        };
        let slopes = [cross(c, d), cross(d, b), cross(b, c)].map(|n| n.map(|v| v / six));
        Shape {
            slopes,
            volume: six / 6.0,
        }
    }

    /// Of all four corners.
    pub fn all(&self) -> [[f64; 3]; 4] {
        let [b, c, d] = self.slopes;
        let a = [0, 1, 2].map(|i| -(b[i] + c[i] + d[i]));
        [a, b, c, d]
    }

    pub fn unpacked(&self) -> [f64; 10] {
        std::array::from_fn(|i| match i {
            9 => self.volume,
            _ => self.slopes[i / 3][i % 3],
        })
    }

    pub fn packed(&self) -> [f32; 10] {
        self.unpacked().map(|v| v as f32)
    }

    /// Force on node `a` per displacement of node `b`; Lamé's moduli λ, μ.
    pub fn block(&self, [lambda, mu]: [f64; 2], a: usize, b: usize) -> [[f64; 3]; 3] {
        let slopes = self.all();
        let mut sum = [[0.0; 3]; 3];
        for (i, j, weight) in
            terms(a).flat_map(|(i, p)| terms(b).map(move |(j, q)| (i, j, product(p, q))))
        {
            let (g, h) = (slopes[i], slopes[j]);
            let both = g[0] * h[0] + g[1] * h[1] + g[2] * h[2];
            for r in 0..3 {
                for c in 0..3 {
                    let shear = g[c] * h[r] + if r == c { both } else { 0.0 };
                    sum[r][c] += weight * self.volume * (lambda * g[r] * h[c] + mu * shear);
                }
            }
        }
        sum
    }
}

/// A node's shape function has the slope `Σ p ∇λ_i`; these are the corners `i` and the linear functions `p`: `4 λ_k + constant`.
fn terms(node: usize) -> impl Iterator<Item = (usize, (usize, f64))> + Clone {
    let pairs = match node {
        0..4 => [Some((node, (node, -1.0))), None],
        _ => {
            let [i, j] = EDGES[node - 4];
            [Some((j, (i, 0.0))), Some((i, (j, 0.0)))]
        }
    };
    pairs.into_iter().flatten()
}

/// Mean over the element of `(4 λ_k + c)(4 λ_l + d)`.
fn product((k, c): (usize, f64), (l, d): (usize, f64)) -> f64 {
    let both = if k == l { 0.1 } else { 0.05 };
    16.0 * both + c + d + c * d
}

/// Row `corner` of the four-node element with the same corners, by columns.
pub fn linear_row(shape: &[f32; 10], [lambda, mu]: [f32; 2], corner: usize) -> [[[f32; 3]; 3]; 4] {
    let [b, c, d] = [0, 1, 2].map(|i| [shape[3 * i], shape[3 * i + 1], shape[3 * i + 2]]);
    let slopes = [[0, 1, 2].map(|i| -(b[i] + c[i] + d[i])), b, c, d];
    let g = slopes[corner];
    slopes.map(|h| {
        let both = mu * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2]);
        let entry = |r: usize, c: usize| {
            let shear = mu * g[c] * h[r] + if r == c { both } else { 0.0 };
            shape[9] * (lambda * g[r] * h[c] + shear)
        };
        std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c)))
    })
}
