//! Owns strains and energies of solved elements.

use super::Tet10;
use crate::discretisation::tetrahedra::nodes::EDGES;

/// Strains at the corners of an element: xx, yy, zz, yz, xz, xy, shears halved.
pub type Corners = [[f64; 6]; 4];

impl Tet10 {
    /// The slope of the displacement `u` of all nodes at the corners of element `e`.
    fn slopes(&self, e: usize, u: &[[f64; 3]]) -> [[[f64; 3]; 3]; 4] {
        let ten = &self.mesh.elements[e];
        let slopes = self.shape(e).all();
        let u = |local: usize| u[ten[local] as usize];
        std::array::from_fn(|k| {
            let mut g = [[0.0; 3]; 3];
            for (j, slope) in slopes.iter().enumerate() {
                let edge = EDGES.iter().position(|p| *p == [k, j] || *p == [j, k]);
                let by = match edge {
                    None => u(k).map(|v| 3.0 * v),
                    Some(edge) => {
                        let (middle, corner) = (u(4 + edge), u(j));
                        std::array::from_fn(|c| 4.0 * middle[c] - corner[c])
                    }
                };
                for c in 0..3 {
                    (0..3).for_each(|d| g[c][d] += by[c] * slope[d]);
                }
            }
            g
        })
    }

    /// Strains at the corners of element `e`.
    pub fn strains(&self, e: usize, u: &[[f64; 3]]) -> Corners {
        self.slopes(e, u).map(|g| {
            let half = |p: usize, q: usize| 0.5 * (g[p][q] + g[q][p]);
            [
                g[0][0],
                g[1][1],
                g[2][2],
                half(1, 2),
                half(0, 2),
                half(0, 1),
            ]
        })
    }

    /// Strain energy density in MPa of element `e` under a strain.
    pub fn density_mpa(&self, e: usize, strain: &[f64; 6]) -> f64 {
        let [lambda, mu] = self.lame_mpa(e);
        let trace = strain[0] + strain[1] + strain[2];
        let squares: f64 = strain[..3].iter().map(|s| s * s).sum();
        let shears: f64 = strain[3..].iter().map(|s| 2.0 * s * s).sum();
        0.5 * lambda * trace * trace + mu * (squares + shears)
    }

    /// Mean energy density over element `e`: energy over volume.
    pub fn mean_density_mpa(&self, e: usize, corners: &Corners) -> f64 {
        let sum: [f64; 6] = std::array::from_fn(|s| corners.iter().map(|c| c[s]).sum());
        let all: f64 = corners.iter().map(|c| self.density_mpa(e, c)).sum();
        (all + self.density_mpa(e, &sum)) / 20.0
    }
}

/// The strain where the barycentric coordinates are `at`.
pub fn within(corners: &Corners, at: [f64; 4]) -> [f64; 6] {
    std::array::from_fn(|s| (0..4).map(|k| at[k] * corners[k][s]).sum())
}
