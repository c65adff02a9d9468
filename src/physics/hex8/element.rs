//! Owns the stiffness of one 8-node brick.

/// 24 × 24, unknown `3 corner + component`; corner `cx + 2 cy + 4 cz`.
pub type ElementMatrix = [[f64; 24]; 24];

/// How the volumetric strain is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Integration {
    /// 2 × 2 × 2 Gauss points, exact for a brick. Locks as ν → ½.
    #[default]
    Full,
    /// The dilatation is replaced by its mean over the element (B-bar; Hughes 1980), which does not lock.
    MeanDilatation,
    /// Stiffness of both, the second with this share (0 to 1) and the first with the rest.
    Blend(f64),
}

/// Poisson's ratio up to which elements are integrated in full.
pub const FULL_POISSON: f64 = 0.4;

/// Poisson's ratio from which on the dilatation is averaged over each element.
pub const MEAN_POISSON: f64 = 0.49;

impl Integration {
    /// The rule for a Poisson's ratio: full integration up to 0.4, mean dilatation from 0.49 on, between them a blend whose
    /// share grows linearly, so that moduli change continuously with the ratio. The part of λ that is integrated in full
    /// never exceeds 1.44 E (1.43 E at 0.4), so the blend locks no more than full integration at 0.4 does.
    pub fn of(poisson: f64) -> Integration {
        let share = (poisson - FULL_POISSON) / (MEAN_POISSON - FULL_POISSON);
        match share {
            _ if share <= 0.0 => Integration::Full,
            _ if share >= 1.0 => Integration::MeanDilatation,
            _ => Integration::Blend(share),
        }
    }

    /// Share of the dilatation that is averaged.
    fn mean_share(self) -> f64 {
        match self {
            Integration::Full => 0.0,
            Integration::MeanDilatation => 1.0,
            Integration::Blend(share) => share,
        }
    }
}

/// Stiffness in N/mm of a brick with edges `h` (mm), Young's modulus `young_mpa` and Poisson's ratio `poisson`:
/// `K = ∫ Bᵀ D B dV`, isotropic `D`.
pub fn stiffness(h: [f64; 3], young_mpa: f64, poisson: f64, rule: Integration) -> ElementMatrix {
    let mu = young_mpa / (2.0 * (1.0 + poisson));
    let lambda = young_mpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let volume = h[0] * h[1] * h[2];
    let weight = volume / 8.0;
    let mut k = [[0.0; 24]; 24];
    let mut mean = [0.0; 24];
    for point in 0..8 {
        let g = gradients(h, point);
        let dilatation: [f64; 24] = std::array::from_fn(|i| g[i / 3][i % 3]);
        for i in 0..24 {
            mean[i] += dilatation[i] / 8.0;
            for j in 0..24 {
                k[i][j] += weight * mu * shear(&g, i, j);
                // Mean dilatation also changes the dilatational third of the shear term, 2μ/3 (∇·)²; both are put
                // in below where that rule asks for it.
                k[i][j] += weight * bulk(lambda, mu, rule, false) * dilatation[i] * dilatation[j];
            }
        }
    }
    let all = volume * bulk(lambda, mu, rule, true);
    for i in 0..24 {
        for j in 0..24 {
            k[i][j] += all * mean[i] * mean[j];
        }
    }
    k
}

/// The factor of the pointwise (`mean` false) and of the averaged dilatation squared.
fn bulk(lambda: f64, mu: f64, rule: Integration, mean: bool) -> f64 {
    let share = rule.mean_share();
    match mean {
        false => (1.0 - share) * lambda - share * (2.0 / 3.0 * mu),
        true => share * (lambda + 2.0 / 3.0 * mu),
    }
}

/// `2 ε_i : ε_j` of two unknowns at a point.
fn shear(g: &[[f64; 3]; 8], i: usize, j: usize) -> f64 {
    let (ga, a, gb, b) = (g[i / 3], i % 3, g[j / 3], j % 3);
    let same = if a == b {
        ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2]
    } else {
        0.0
    };
    same + ga[b] * gb[a]
}

/// Gradients (1/mm) of the eight shape functions at a Gauss point.
pub(super) fn gradients(h: [f64; 3], point: usize) -> [[f64; 3]; 8] {
    let s = 0.5 / 3f64.sqrt();
    let at: [f64; 3] = std::array::from_fn(|a| {
        if point >> a & 1 == 1 {
            0.5 + s
        } else {
            0.5 - s
        }
    });
    std::array::from_fn(|corner| {
        let value = |a: usize| {
            if corner >> a & 1 == 1 {
                at[a]
            } else {
                1.0 - at[a]
            }
        };
        let slope = |a: usize| (if corner >> a & 1 == 1 { 1.0 } else { -1.0 }) / h[a];
        [
            slope(0) * value(1) * value(2),
            value(0) * slope(1) * value(2),
            value(0) * value(1) * slope(2),
        ]
    })
}

/// The largest eigenvalue of `D⁻¹K`, `D` the 3 × 3 diagonal blocks of `K`, rounded up.
pub fn eigenvalue_bound(k: &ElementMatrix) -> f64 {
    // A start without symmetry, and steps enough for eigenvalues that lie close together.
    let mut x: [f64; 24] = std::array::from_fn(|i| (1.3 * i as f64 + 0.2).sin());
    let mut largest = 0.0;
    for _ in 0..400 {
        let y = k.map(|row| row.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>());
        let energy: f64 = x.iter().zip(&y).map(|(a, b)| a * b).sum();
        let z = divided_by_blocks(k, &y);
        let image: f64 = y.iter().zip(&z).map(|(a, b)| a * b).sum();
        largest = image / energy;
        let shrink = image.sqrt().recip();
        x = z.map(|v| v * shrink);
    }
    1.001 * largest
}

/// `D⁻¹ y` by Cramer's rule, block by block.
fn divided_by_blocks(k: &ElementMatrix, y: &[f64; 24]) -> [f64; 24] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [0, 1, 2].map(|i: usize| {
            let (j, l) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[l] - a[l] * b[j]
        })
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let mut z = [0.0; 24];
    for corner in 0..8 {
        let column = |c: usize| [0, 1, 2].map(|r| k[3 * corner + r][3 * corner + c]);
        let (a, b, c) = (column(0), column(1), column(2));
        let right = [0, 1, 2].map(|r| y[3 * corner + r]);
        let determinant = dot(a, cross(b, c));
        z[3 * corner] = dot(right, cross(b, c)) / determinant;
        z[3 * corner + 1] = dot(a, cross(right, c)) / determinant;
        z[3 * corner + 2] = dot(a, cross(b, right)) / determinant;
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy of a homogeneous strain is that of the solid; a rigid motion stores none.
    #[test]
    fn homogeneous_strain_stores_the_energy_of_the_solid() {
        let (h, e, nu) = ([0.02, 0.03, 0.05], 1000.0, 0.3);
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = e / (2.0 * (1.0 + nu));
        let grad = [[0.1, 0.4, -0.2], [0.3, -0.5, 0.7], [0.0, 0.2, 0.6]];
        let sym = |a: usize, b: usize| 0.5 * (grad[a][b] + grad[b][a]);
        let trace: f64 = (0..3).map(|a| sym(a, a)).sum();
        let square: f64 = (0..9).map(|i| sym(i / 3, i % 3).powi(2)).sum();
        let exact = (0.5 * lambda * trace * trace + mu * square) * h[0] * h[1] * h[2];
        for rule in [
            Integration::Full,
            Integration::MeanDilatation,
            Integration::Blend(0.3),
        ] {
            let k = stiffness(h, e, nu, rule);
            let spin = energy(
                &k,
                h,
                [[0.0, 1.0, 2.0], [-1.0, 0.0, 3.0], [-2.0, -3.0, 0.0]],
            );
            assert!((energy(&k, h, grad) / exact - 1.0).abs() < 1e-12);
            assert!(spin.abs() < 1e-12 * exact);
        }
    }

    fn energy(k: &ElementMatrix, h: [f64; 3], grad: [[f64; 3]; 3]) -> f64 {
        let u: [f64; 24] = std::array::from_fn(|i| {
            let x: [f64; 3] = std::array::from_fn(|a| ((i / 3) >> a & 1) as f64 * h[a]);
            (0..3).map(|b| grad[i % 3][b] * x[b]).sum()
        });
        let forces = k.map(|row| row.iter().zip(&u).map(|(a, b)| a * b).sum::<f64>());
        0.5 * forces.iter().zip(&u).map(|(f, u)| f * u).sum::<f64>()
    }
    /// No step anywhere in Poisson's ratio: entries of neighbouring ratios differ by what λ does, and not more.
    #[test]
    fn the_stiffness_is_continuous_in_poissons_ratio() {
        let of = |nu: f64| stiffness([0.02; 3], 1000.0, nu, Integration::of(nu));
        let step = 1e-7;
        for nu in [0.3, FULL_POISSON, 0.45, MEAN_POISSON] {
            let (below, above) = (of(nu - step), of(nu + step));
            let largest = below[0][0];
            for (a, b) in below.iter().flatten().zip(above.iter().flatten()) {
                assert!((a - b).abs() < 1e-4 * largest, "ν = {nu}: {a} {b}");
            }
        }
    }

    /// What is integrated in full of λ, the part that locks, stays near its value at the last ratio of full integration.
    #[test]
    fn a_blend_locks_no_more_than_full_integration_at_its_bound() {
        let pointwise = |nu: f64| {
            let lambda = nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
            (1.0 - Integration::of(nu).mean_share()) * lambda
        };
        let most = (0..100).map(|k| pointwise(0.4 + 0.00099 * f64::from(k)));
        let most = most.fold(0.0, f64::max);
        assert!((1.42..1.44).contains(&most), "{most}");
    }
}
