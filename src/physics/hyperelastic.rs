//! Owns energies of the deformation gradient in the plane: St. Venant-Kirchhoff, Neo-Hooke, and the local limits of bonds.

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
    /// `μ (tr FᵀF − 2 − 2 ln J)/2 + λ (ln J)²/2`: Neo-Hooke, with the stiffness of St. Venant-Kirchhoff at rest.
    NeoHooke { lambda: f64, mu: f64 },
    /// `Σ a (|F n| − 1)² + b γ²` over directions `n` with weights `[a, b]`, γ the rotation of the direction less that of the point,
    /// which is the one of least energy: the limit of bonds that resist shear.
    ShearBonds(Vec<([f64; 2], [f64; 2])>),
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

    /// Neo-Hooke with the constants of [`Energy::plane_stress`].
    pub fn neo_hooke(young: f64, poisson: f64) -> Energy {
        Energy::NeoHooke {
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

    /// Bonds that resist shear in all directions alike: `(λ + μ)/π` and `(μ − λ)/π` of the plane-stress constants, by the rule of
    /// [`Energy::isotropic_bonds`], which is the case ν = 1/3.
    pub fn isotropic_shear_bonds(young: f64, poisson: f64) -> Energy {
        const ANGLES: usize = 64;
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - poisson));
        let mu = 0.5 * young / (1.0 + poisson);
        let share = 2.0 / ANGLES as f64;
        let direction = |k: usize| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / ANGLES as f64).sin_cos();
            ([c, s], [share * (lambda + mu), share * (mu - lambda)])
        };
        Energy::ShearBonds((0..ANGLES).map(direction).collect())
    }

    pub fn response(&self, f: &Plane) -> Response {
        match self {
            Energy::StVenantKirchhoff { lambda, mu } => st_venant_kirchhoff(*lambda, *mu, f),
            Energy::Bonds(directions) => bonds(directions, f),
            Energy::NeoHooke { lambda, mu } => neo_hooke(*lambda, *mu, f),
            Energy::ShearBonds(directions) => shear_bonds(directions, f),
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

/// With `G = F⁻ᵀ`: `P = μ (F − G) + λ ln J G`, and `∂G_iJ/∂F_kL = −G_iL G_kJ`.
fn neo_hooke(lambda: f64, mu: f64, f: &Plane) -> Response {
    let j = f[0][0] * f[1][1] - f[0][1] * f[1][0];
    let g = [[f[1][1] / j, -f[1][0] / j], [-f[0][1] / j, f[0][0] / j]];
    let (log, square) = (j.ln(), f.as_flattened().iter().map(|v| v * v).sum::<f64>());
    let mut tangent = [[[[0.0; 2]; 2]; 2]; 2];
    for (i, j, k, l) in indices() {
        let unit = if i == k && j == l { mu } else { 0.0 };
        tangent[i][j][k][l] =
            unit + lambda * g[i][j] * g[k][l] + (mu - lambda * log) * g[i][l] * g[k][j];
    }
    Response {
        energy: 0.5 * mu * (square - 2.0 - 2.0 * log) + 0.5 * lambda * log * log,
        stress: [0, 1].map(|i| [0, 1].map(|j| mu * f[i][j] + (lambda * log - mu) * g[i][j])),
        tangent,
    }
}

/// The point's rotation is the mean of the directions' by `b`, at which the energy is stationary: the stress is the partial derivative,
/// and the tangent loses what the rotation gives way.
fn shear_bonds(directions: &[([f64; 2], [f64; 2])], f: &Plane) -> Response {
    let along = directions
        .iter()
        .map(|(n, [a, _])| (*n, *a))
        .collect::<Vec<_>>();
    let mut sum = bonds(&along, f);
    let moved = |n: &[f64; 2]| [0, 1].map(|i| f[i][0] * n[0] + f[i][1] * n[1]);
    let angle = |n: &[f64; 2]| {
        let v = moved(n);
        (n[0] * v[1] - n[1] * v[0]).atan2(n[0] * v[0] + n[1] * v[1])
    };
    let whole: f64 = directions.iter().map(|(_, [_, b])| b).sum();
    let turned: f64 = directions
        .iter()
        .map(|(n, [_, b])| b * angle(n))
        .sum::<f64>()
        / whole;
    let mut give = [[0.0; 2]; 2];
    for (n, [_, b]) in directions {
        let v = moved(n);
        let length = v[0].hypot(v[1]);
        let u = v.map(|x| x / length);
        let t = [-u[1] / length, u[0] / length];
        let gamma = angle(n) - turned;
        sum.energy += b * gamma * gamma;
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            sum.stress[i][j] += 2.0 * b * gamma * t[i] * n[j];
            give[i][j] += 2.0 * b * t[i] * n[j];
        }
        for (i, j, k, l) in indices() {
            let bent = (t[i] * u[k] + u[i] * t[k]) / length;
            sum.tangent[i][j][k][l] += 2.0 * b * (t[i] * t[k] - gamma * bent) * n[j] * n[l];
        }
    }
    for (i, j, k, l) in indices() {
        sum.tangent[i][j][k][l] -= give[i][j] * give[k][l] / (2.0 * whole);
    }
    sum
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
            Energy::neo_hooke(2.0, 0.2),
            Energy::isotropic_shear_bonds(2.0, 0.2),
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

    /// At rest all laws of one Poisson's ratio have its plane-stress moduli, and turn without energy.
    #[test]
    fn laws_of_any_poissons_ratio_share_their_stiffness_at_rest() {
        let rest = [[1.0, 0.0], [0.0, 1.0]];
        let (s, c) = 0.7_f64.sin_cos();
        for poisson in [-0.3, 0.2, 0.3] {
            let (young, exact) = (2.0, 2.0 / (1.0 - poisson * poisson));
            for energy in [
                Energy::neo_hooke(young, poisson),
                Energy::isotropic_shear_bonds(young, poisson),
            ] {
                let t = energy.response(&rest).tangent;
                assert!((t[0][0][0][0] - exact).abs() < 1e-12);
                assert!((t[0][0][1][1] - poisson * exact).abs() < 1e-12);
                let shear = 0.5 * young / (1.0 + poisson);
                assert!((t[0][1][0][1] - shear).abs() < 1e-12);
                assert!((t[0][1][1][0] - shear).abs() < 1e-12);
                assert!(energy.response(&[[c, -s], [s, c]]).energy < 1e-15);
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
