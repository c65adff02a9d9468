//! Owns the count of mechanisms: motions that cost next to no energy and are not rigid motions of the whole.

use crate::error::{Error, Result};
use crate::operator::Operator;
use crate::operator::held::Held;
use crate::operator::probe::{Probed, probe};
use crate::operator::sparse::Sparse;
use crate::solver::direct::inertia::negative_eigenvalues;
use crate::solver::lanczos::lowest;
use faer::{Mat, Side};

/// Share of the largest eigenvalue of the diagonally scaled operator below which a motion counts as free.
const FREE: f64 = 1e-8;

/// Eigenvalues of the diagonally scaled operator `D^−½ K D^−½` below 1e-8 of its largest, rigid motions that the
/// supports leave apart. The largest is found by Lanczos, the count by inertia: mechanisms share the eigenvalue zero,
/// and of equal eigenvalues Lanczos sees one. `at` and `reach` as in [`probe`]; positions in any unit.
///
/// # Errors
/// A model too large to factorise.
pub fn mechanisms(
    operator: &impl Operator<3>,
    held: &Held,
    at: &[[i32; 3]],
    reach: i32,
) -> Result<usize> {
    let probed = probe(operator, held, at, reach);
    if probed.unknowns.is_empty() {
        return Ok(0);
    }
    let largest = largest_eigenvalue(&probed.scaled(0.0));
    let free = negative_eigenvalues(&probed.scaled(FREE * largest)).map_err(|found| {
        Error::specimen(
            format!("counting mechanisms by a factorisation failed: {found}"),
            "leave --mechanisms out, crop the specimen, or choose larger elements",
        )
    })?;
    Ok(free.saturating_sub(rigid_motions(operator, held, at, &probed)))
}

/// The inverse that [`lowest`] asks for is the matrix itself, so its lowest eigenvalue is the reciprocal of the largest.
fn largest_eigenvalue(a: &Sparse) -> f64 {
    let ones = vec![1.0; a.n()];
    let mut y = vec![0.0; a.n()];
    let found = lowest(1, &ones, 0.0, |x| {
        a.apply(x, &mut y);
        x.copy_from_slice(&y);
    });
    found
        .modes
        .first()
        .map_or(1.0, |mode| mode.eigenvalue.recip())
}

/// Rigid motions of the whole that move no held component.
fn rigid_motions(
    operator: &impl Operator<3>,
    held: &Held,
    at: &[[i32; 3]],
    probed: &Probed,
) -> usize {
    let mut diagonal = vec![[0.0; 3]; operator.sites()];
    operator.diagonal(&mut diagonal);
    let count = probed.unknowns.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|a| {
        probed
            .unknowns
            .iter()
            .map(|u| f64::from(at[u.0][a]))
            .sum::<f64>()
            / count
    });
    // Of three turns: u = e_k × x.
    let motion = |site: usize, c: usize| -> [f64; 6] {
        let x: [f64; 3] = std::array::from_fn(|a| f64::from(at[site][a]) - mean[a]);
        std::array::from_fn(|m| match m {
            0..3 => f64::from(u8::from(m == c)),
            _ => match (c + 3 - (m - 3)) % 3 {
                1 => -x[(c + 1) % 3],
                2 => x[(c + 2) % 3],
                _ => 0.0,
            },
        })
    };
    let gram = |keep: &dyn Fn(usize, usize) -> bool| {
        let mut g = Mat::<f64>::zeros(6, 6);
        for (site, diagonal) in diagonal.iter().enumerate() {
            for c in (0..3).filter(|&c| diagonal[c] > 0.0 && keep(site, c)) {
                let m = motion(site, c);
                (0..36).for_each(|k| g[(k / 6, k % 6)] += m[k / 6] * m[k % 6]);
            }
        }
        g
    };
    let (all, stopped) = (gram(&|_, _| true), gram(&|site, c| held.is_held(site, c)));
    let scale: [f64; 6] = std::array::from_fn(|m| all[(m, m)].max(1.0).sqrt().recip());
    let scaled = Mat::from_fn(6, 6, |i, j| stopped[(i, j)] * scale[i] * scale[j]);
    match scaled.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) => (0..6)
            .filter(|&m| eigen.S().column_vector()[m] < 1e-10)
            .count(),
        Err(_) => 0,
    }
}
