//! Owns energies of the deformation gradient in the plane: St. Venant-Kirchhoff, and the local limits of harmonic bonds.

/// `F[i][J]`, and stresses alike.
pub type Plane = [[f64; 2]; 2];

/// Energy density of a unit of reference area, unit thickness.
#[derive(Debug, Clone, PartialEq)]
pub enum Energy {
    /// `λ (tr E)²/2 + μ tr E²` (Schaller et al. 2022, eq 23).
    StVenantKirchhoff { lambda: f64, mu: f64 },
    /// `Σ a (|F n| − 1)²` over directions `n` with weights `a`: what a peridynamic body of harmonic bonds tends to when
    /// its horizon shrinks.
    Bonds(Vec<([f64; 2], f64)>),
}

/// Energy, first Piola-Kirchhoff stress `P[i][J]` and its derivative `∂P[i][J]/∂F[k][L]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub energy: f64,
    pub stress: Plane,
    pub tangent: [[Plane; 2]; 2],
}

impl Energy {
    /// St. Venant-Kirchhoff in plane stress: `λ = Eν/((1+ν)(1−ν))`, `μ = E/(2(1+ν))`.
    pub fn plane_stress(young: f64, poisson: f64) -> Energy {
        Energy::StVenantKirchhoff {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - poisson)),
            mu: 0.5 * young / (1.0 + poisson),
        }
    }

    /// Harmonic bonds in all directions alike: `3E/(4π) ∫ (|F n| − 1)² dψ`, by a rule of 64 angles (the integrand is
    /// smooth and periodic, so the rule is exact to rounding).
    pub fn isotropic_bonds(young: f64) -> Energy {
        const ANGLES: usize = 64;
        let share =
            3.0 * young / (4.0 * std::f64::consts::PI) * std::f64::consts::TAU / ANGLES as f64;
        let direction = |k: usize| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / ANGLES as f64).sin_cos();
            ([c, s], share)
        };
        Energy::Bonds((0..ANGLES).map(direction).collect())
    }

    pub fn response(&self, f: &Plane) -> Response {
        match self {
            Energy::StVenantKirchhoff { lambda, mu } => st_venant_kirchhoff(*lambda, *mu, f),
            Energy::Bonds(directions) => bonds(directions, f),
        }
    }
}

fn st_venant_kirchhoff(lambda: f64, mu: f64, f: &Plane) -> Response {
    let dot = |a: usize, b: usize| f[0][a] * f[0][b] + f[1][a] * f[1][b];
    let e = [
        [0.5 * (dot(0, 0) - 1.0), 0.5 * dot(0, 1)],
        [0.5 * dot(0, 1), 0.5 * (dot(1, 1) - 1.0)],
    ];
    let trace = e[0][0] + e[1][1];
    let square = e[0][0] * e[0][0] + 2.0 * e[0][1] * e[0][1] + e[1][1] * e[1][1];
    let unit = |a: usize, b: usize| f64::from(a == b);
    let s = |a: usize, b: usize| lambda * trace * unit(a, b) + 2.0 * mu * e[a][b];
    let outer = |i: usize, k: usize| f[i][0] * f[k][0] + f[i][1] * f[k][1];
    let mut tangent = [[[[0.0; 2]; 2]; 2]; 2];
    for (i, j, k, l) in indices() {
        tangent[i][j][k][l] = unit(i, k) * s(j, l)
            + lambda * f[i][j] * f[k][l]
            + mu * (f[i][l] * f[k][j] + unit(j, l) * outer(i, k));
    }
    let stress = [0, 1].map(|i| [0, 1].map(|j| f[i][0] * s(0, j) + f[i][1] * s(1, j)));
    Response {
        energy: 0.5 * lambda * trace * trace + mu * square,
        stress,
        tangent,
    }
}

fn bonds(directions: &[([f64; 2], f64)], f: &Plane) -> Response {
    let mut sum = Response {
        energy: 0.0,
        stress: [[0.0; 2]; 2],
        tangent: [[[[0.0; 2]; 2]; 2]; 2],
    };
    for (n, a) in directions {
        let t = [0, 1].map(|i| f[i][0] * n[0] + f[i][1] * n[1]);
        let stretch = t[0].hypot(t[1]);
        let pull = 2.0 * a * (1.0 - 1.0 / stretch);
        sum.energy += a * (stretch - 1.0).powi(2);
        for (i, row) in sum.stress.iter_mut().enumerate() {
            (0..2).for_each(|j| row[j] += pull * t[i] * n[j]);
        }
        let along = 2.0 * a / stretch.powi(3);
        for (i, j, k, l) in indices() {
            let both = if i == k { pull } else { 0.0 };
            sum.tangent[i][j][k][l] += (both + along * t[i] * t[k]) * n[j] * n[l];
        }
    }
    sum
}

fn indices() -> impl Iterator<Item = (usize, usize, usize, usize)> {
    (0..16).map(|q| (q >> 3, (q >> 2) & 1, (q >> 1) & 1, q & 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stress_and_tangent_match_differences() {
        let f = [[1.1, 0.07], [-0.04, 0.93]];
        let h = 1e-6;
        for energy in [
            Energy::plane_stress(2.0, 1.0 / 3.0),
            Energy::isotropic_bonds(2.0),
        ] {
            let here = energy.response(&f);
            for (k, l) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let shifted = |by: f64| {
                    let mut g = f;
                    g[k][l] += by;
                    energy.response(&g)
                };
                let (up, down) = (shifted(h), shifted(-h));
                let stress = (up.energy - down.energy) / (2.0 * h);
                assert!((stress - here.stress[k][l]).abs() < 1e-9);
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let tangent = (up.stress[i][j] - down.stress[i][j]) / (2.0 * h);
                    assert!((tangent - here.tangent[i][j][k][l]).abs() < 1e-8);
                }
            }
        }
    }

    /// Spec A2: the exact stiffness at rest is C1111 = 1.125 E, C1122 = 0.375 E for both laws.
    #[test]
    fn both_laws_share_their_stiffness_at_rest() {
        let rest = [[1.0, 0.0], [0.0, 1.0]];
        for energy in [
            Energy::plane_stress(1.0, 1.0 / 3.0),
            Energy::isotropic_bonds(1.0),
        ] {
            let t = energy.response(&rest).tangent;
            assert!((t[0][0][0][0] - 1.125).abs() < 1e-12);
            assert!((t[0][0][1][1] - 0.375).abs() < 1e-12);
            assert!((t[0][1][0][1] - 0.375).abs() < 1e-12);
        }
    }
}
