//! Owns the rigid motions of aggregates: made orthonormal, and dropped where an aggregate cannot have them.

/// Row-major 6 × 6.
pub type Mat6 = [[f64; 6]; 6];

/// An orthonormal basis of an aggregate's motions `B` (n × 6): `Q = B basis`, `B = Q motions`. Motions that the
/// aggregate cannot have (it is a point or a line, or is held) are zero columns of `Q`.
#[derive(Debug, Clone, Copy)]
pub struct Basis {
    pub basis: Mat6,
    pub motions: Mat6,
}

/// What is left of a motion after the earlier ones, squared and relative, below which it is dropped.
/// Not smaller: a motion kept is scaled up by the root of its inverse, and so is the rounding of single precision.
const DROP: f64 = 1e-3;

/// From `gram = BᵀB`, by Cholesky; `scale` is the squared norm a full motion would have.
pub fn orthonormalise(gram: &Mat6, scale: f64) -> Basis {
    orthonormalise_to(gram, scale, DROP)
}

/// The same with another threshold. `basis basisᵀ` is the inverse of `gram` on what is kept.
pub fn orthonormalise_to(gram: &Mat6, scale: f64, drop: f64) -> Basis {
    let mut motions = [[0.0; 6]; 6];
    let mut basis = [[0.0; 6]; 6];
    for k in 0..6 {
        let mut left = gram[k][k];
        for row in motions.iter().take(k) {
            left -= row[k] * row[k];
        }
        if left <= drop * gram[k][k].max(scale) || left <= 0.0 {
            continue;
        }
        let pivot = left.sqrt();
        for j in k..6 {
            let known: f64 = (0..k).map(|m| motions[m][k] * motions[m][j]).sum();
            motions[k][j] = (gram[k][j] - known) / pivot;
        }
        for a in 0..=k {
            let unit = if a == k { 1.0 } else { 0.0 };
            let known: f64 = (0..k).map(|m| basis[a][m] * motions[m][k]).sum();
            basis[a][k] = (unit - known) / pivot;
        }
    }
    Basis { basis, motions }
}

/// Turns motions about one centre into motions about another: amplitudes `(t, w)` with `u(x) = t + w/ρ × (x − c)`
/// become those about `c + d` with radius `rho_to`.
pub fn carry(d: [f64; 3], rho_from: f64, rho_to: f64) -> Mat6 {
    let mut m = [[0.0; 6]; 6];
    for a in 0..3 {
        m[a][a] = 1.0;
        m[3 + a][3 + a] = rho_to / rho_from;
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        // (w × d)_a = w_b d_c − w_c d_b
        m[a][3 + b] = d[c] / rho_from;
        m[a][3 + c] = -d[b] / rho_from;
    }
    m
}

pub fn multiply(a: &Mat6, b: &Mat6) -> Mat6 {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `sum += aᵀ a`.
pub fn add_gram(sum: &mut Mat6, a: &[[f64; 6]]) {
    for row in a {
        for i in 0..6 {
            for j in 0..6 {
                sum[i][j] += row[i] * row[j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_points_loses_the_turn_about_itself_only() {
        let mut gram = [[0.0; 6]; 6];
        let rows: Vec<[f64; 6]> = (-2..=2)
            .flat_map(|i| {
                carry([0.0, 0.0, f64::from(i)], 2.0, 2.0)
                    .into_iter()
                    .take(3)
            })
            .collect();
        add_gram(&mut gram, &rows);
        let b = orthonormalise(&gram, 5.0);
        let mut q = [[0.0; 6]; 6];
        let product: Vec<[f64; 6]> = rows
            .iter()
            .map(|r| std::array::from_fn(|j| (0..6).map(|k| r[k] * b.basis[k][j]).sum()))
            .collect();
        add_gram(&mut q, &product);
        for i in 0..6 {
            for j in 0..6 {
                let expected = if i == j && i != 5 { 1.0 } else { 0.0 };
                assert!((q[i][j] - expected).abs() < 1e-12);
            }
        }
        for (r, q) in rows.iter().zip(&product) {
            for j in 0..6 {
                let back: f64 = (0..6).map(|k| q[k] * b.motions[k][j]).sum();
                assert!((back - r[j]).abs() < 1e-12);
            }
        }
    }
}
