//! Owns what follows from an apparent stiffness matrix: moduli along an axis, the best orthotropic frame and its constants.
//!
//! Voigt order 11, 22, 33, 23, 13, 12 with engineering shears; MPa.

// Small fixed matrices read best by index.
#![allow(clippy::needless_range_loop)]

use crate::grid::Axis;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use serde::{Deserialize, Serialize};

pub type Six = [[f64; 6]; 6];
type Three = [[f64; 3]; 3];

/// The two indices of a Voigt index.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// The strain tensor of a unit Voigt strain: ½ in each of the two places of a unit engineering shear.
pub fn unit_strain(load: usize) -> Three {
    let [a, b] = PAIRS[load];
    let mut strain = [[0.0; 3]; 3];
    strain[a][b] += 0.5;
    strain[b][a] += 0.5;
    strain
}

/// Compliance in 1/MPa; None unless the stiffness is positive definite.
pub fn compliance(stiffness: &Six) -> Option<Six> {
    let llt = Mat::from_fn(6, 6, |i, j| stiffness[i][j])
        .llt(Side::Lower)
        .ok()?;
    let inverse = llt.solve(Mat::<f64>::identity(6, 6));
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|j| inverse[(i, j)])
    }))
}

/// Young's modulus along an axis under that stress alone, and how far it is off when the stiffness is off by `error`.
/// Zero for a stiffness that is not positive definite.
pub fn young_along(stiffness: &Six, error: &Six, axis: Axis) -> (f64, f64) {
    let Some(s) = compliance(stiffness) else {
        return (0.0, 0.0);
    };
    let a = axis.index();
    let young = s[a][a].recip();
    let off: f64 = (0..36)
        .map(|k| (s[a][k / 6] * error[k / 6][k % 6] * s[k % 6][a]).abs())
        .sum();
    (young, young * young * off)
}

/// The orthotropic stiffness nearest to a stiffness, in its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Orthotropic {
    /// Unit vectors 1, 2, 3 of the frame in the axes of the volume; right-handed, stiffest first.
    pub axes: Three,
    /// E1, E2, E3.
    pub young_mpa: [f64; 3],
    /// G23, G13, G12.
    pub shear_mpa: [f64; 3],
    /// ν_ab: contraction along b under stress along a. ν23, ν13, ν12.
    pub poisson: [f64; 3],
    /// ν32, ν31, ν21.
    pub poisson_transposed: [f64; 3],
    /// E1 / E3.
    pub degree_of_anisotropy: f64,
    /// ‖C − C_orthotropic‖ / ‖C‖ over the tensor's 81 components: 0 where three planes of symmetry exist.
    pub residual: f64,
}

/// The frame in which the components that orthotropy forbids are smallest (van Rietbergen et al. 1996), found by
/// turning about one axis at a time. None where the stiffness is not positive definite in that frame.
pub fn orthotropic(stiffness: &Six) -> Option<Orthotropic> {
    let size = norm(stiffness, |_, _| true);
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut best = (identity, norm(stiffness, forbidden));
    for start in [identity].into_iter().chain(starts(stiffness)) {
        let found = improve(stiffness, start);
        // The volume's own axes, unless others are better than rounding.
        if found.1 < best.1 - 1e-14 * size {
            best = found;
        }
    }
    let frame = in_order(stiffness, best.0)?;
    let c = seen_from(stiffness, &frame);
    let s = compliance(&only_orthotropic(&c))?;
    let young_mpa: [f64; 3] = std::array::from_fn(|a| s[a][a].recip());
    let ratio = |a: usize, b: usize| -s[b][a] / s[a][a];
    Some(Orthotropic {
        axes: frame,
        young_mpa,
        shear_mpa: [3, 4, 5].map(|i| s[i][i].recip()),
        poisson: [ratio(1, 2), ratio(0, 2), ratio(0, 1)],
        poisson_transposed: [ratio(2, 1), ratio(2, 0), ratio(1, 0)],
        degree_of_anisotropy: young_mpa[0] / young_mpa[2],
        residual: (norm(&c, forbidden) / size).sqrt(),
    })
}

/// The same tensor in axes whose unit vectors are the rows of `frame`: `C' = M C Mᵀ` with Bond's matrix M.
pub fn seen_from(stiffness: &Six, frame: &Three) -> Six {
    let m: Six = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let ([p, q], [a, b]) = (PAIRS[i], PAIRS[j]);
            let straight = frame[p][a] * frame[q][b];
            if a == b {
                straight
            } else {
                straight + frame[p][b] * frame[q][a]
            }
        })
    });
    let half: Six = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..6).map(|k| m[i][k] * stiffness[k][j]).sum())
    });
    std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| half[i][k] * m[j][k]).sum()))
}

/// Sum of squares of the tensor's components at the places asked for; a shear index stands for two of them.
fn norm(c: &Six, place: impl Fn(usize, usize) -> bool) -> f64 {
    let times = |i: usize| if i < 3 { 1.0 } else { 2.0 };
    (0..36)
        .map(|k| (k / 6, k % 6))
        .filter(|&(i, j)| place(i, j))
        .map(|(i, j)| times(i) * times(j) * c[i][j].powi(2))
        .sum()
}

/// Components that vanish in the frame of an orthotropic material.
fn forbidden(i: usize, j: usize) -> bool {
    i != j && (i > 2 || j > 2)
}

fn only_orthotropic(c: &Six) -> Six {
    std::array::from_fn(|i| std::array::from_fn(|j| if forbidden(i, j) { 0.0 } else { c[i][j] }))
}

/// Frames to start from: eigenvectors of the two contractions C_ijkk and C_ikjk (Cowin & Mehrabadi 1987), and turns
/// of the volume's axes, since the search is local.
fn starts(c: &Six) -> Vec<Three> {
    let voigt = |a: usize, b: usize| {
        PAIRS
            .iter()
            .position(|p| *p == [a.min(b), a.max(b)])
            .expect("all pairs are listed")
    };
    let dilatation = |a: usize, b: usize| (0..3).map(|k| c[voigt(a, b)][k]).sum::<f64>();
    let contraction = |a: usize, b: usize| (0..3).map(|k| c[voigt(a, k)][voigt(b, k)]).sum::<f64>();
    let mut frames = vec![eigenvectors(dilatation), eigenvectors(contraction)];
    for k in 1..8 {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(k) / 8.0;
        let frame = [0, 1, 2].iter().fold(frames[0], |frame, &axis| {
            turned(&frame, axis, turn * (1.0 + axis as f64))
        });
        frames.push(frame);
    }
    frames
}

fn eigenvectors(entry: impl Fn(usize, usize) -> f64) -> Three {
    let eigen = Mat::from_fn(3, 3, &entry).self_adjoint_eigen(Side::Lower);
    match eigen {
        Ok(e) => std::array::from_fn(|i| std::array::from_fn(|j| e.U()[(j, i)])),
        Err(_) => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    }
}

/// The frame turned about its own `axis`.
fn turned(frame: &Three, axis: usize, angle: f64) -> Three {
    let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
    let (s, c) = angle.sin_cos();
    let mut out = *frame;
    for k in 0..3 {
        out[p][k] = c * frame[p][k] + s * frame[q][k];
        out[q][k] = c * frame[q][k] - s * frame[p][k];
    }
    out
}

/// Turns about each axis in turn until nothing is gained. Returns the frame and what is left.
fn improve(stiffness: &Six, mut frame: Three) -> (Three, f64) {
    let left = |frame: &Three| norm(&seen_from(stiffness, frame), forbidden);
    let mut now = left(&frame);
    for _ in 0..200 {
        let before = now;
        for axis in 0..3 {
            let angle = best_turn(|angle| left(&turned(&frame, axis, angle)));
            let there = turned(&frame, axis, angle);
            let value = left(&there);
            if value < now {
                (frame, now) = (there, value);
            }
        }
        if now >= before * (1.0 - 1e-9) {
            break;
        }
    }
    (frame, now)
}

/// Where a turn about one axis leaves least. A quarter turn only renames axes, and components are of degree four in
/// the sine and cosine, their squares of degree eight: `f = a0 + a1 cos 4θ + b1 sin 4θ + a2 cos 8θ + b2 sin 8θ`, exactly.
fn best_turn(f: impl Fn(f64) -> f64) -> f64 {
    const SAMPLES: usize = 8;
    let step = std::f64::consts::FRAC_PI_2 / SAMPLES as f64;
    let values: [f64; SAMPLES] = std::array::from_fn(|k| f(k as f64 * step));
    let term = |order: f64| {
        let sum = |wave: fn(f64) -> f64| {
            let parts = values.iter().enumerate();
            parts
                .map(|(k, v)| v * wave(order * k as f64 * step))
                .sum::<f64>()
                / (0.5 * SAMPLES as f64)
        };
        (order, sum(f64::cos), sum(f64::sin))
    };
    let terms = [term(4.0), term(8.0)];
    let at = |theta: f64, derivative: u8| {
        let one = |&(n, a, b): &(f64, f64, f64)| {
            let (s, c) = (n * theta).sin_cos();
            match derivative {
                0 => a * c + b * s,
                1 => n * (b * c - a * s),
                _ => -n * n * (a * c + b * s),
            }
        };
        terms.iter().map(one).sum::<f64>()
    };
    let coarse = (0..64).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_2 / 64.0);
    let mut theta = coarse
        .min_by(|a, b| at(*a, 0).total_cmp(&at(*b, 0)))
        .unwrap_or(0.0);
    for _ in 0..4 {
        if at(theta, 2) > 0.0 {
            theta -= at(theta, 1) / at(theta, 2);
        }
    }
    theta
}

/// The frame's axes by falling Young's modulus (equal ones stay in the order of the volume's axes), right-handed.
fn in_order(stiffness: &Six, frame: Three) -> Option<Three> {
    let s = compliance(&only_orthotropic(&seen_from(stiffness, &frame)))?;
    let mut rows: Vec<(f64, [f64; 3])> = (0..3).map(|a| (s[a][a].recip(), frame[a])).collect();
    let nearest = |row: &[f64; 3]| {
        let largest = |a: &usize, b: &usize| row[*a].abs().total_cmp(&row[*b].abs());
        (0..3).max_by(largest).unwrap_or(0)
    };
    rows.sort_by_key(|(_, row)| nearest(row));
    rows.sort_by(|a, b| {
        let equal = (a.0 / b.0 - 1.0).abs() < 1e-9;
        if equal {
            std::cmp::Ordering::Equal
        } else {
            b.0.total_cmp(&a.0)
        }
    });
    let mut out: Three = std::array::from_fn(|a| {
        let row = rows[a].1;
        let sign = row[nearest(&row)].signum();
        row.map(|v| sign * v)
    });
    let [a, b, c] = out;
    let volume = (0..3)
        .map(|k| {
            let (p, q) = ((k + 1) % 3, (k + 2) % 3);
            a[k] * (b[p] * c[q] - b[q] * c[p])
        })
        .sum::<f64>();
    if volume < 0.0 {
        out[2] = out[2].map(|v| -v);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Orthotropic constants of the order of trabecular bone, in MPa: E 900, 500, 300.
    fn bone() -> Six {
        let (e, g) = ([900.0, 500.0, 300.0], [120.0, 150.0, 200.0]);
        let nu = [0.25, 0.3, 0.35]; // ν23, ν13, ν12
        let mut s = [[0.0; 6]; 6];
        for a in 0..3 {
            s[a][a] = 1.0 / e[a];
            s[3 + a][3 + a] = 1.0 / g[a];
        }
        for (a, b, nu) in [(1, 2, nu[0]), (0, 2, nu[1]), (0, 1, nu[2])] {
            s[a][b] = -nu / e[a];
            s[b][a] = s[a][b];
        }
        compliance(&s).unwrap()
    }

    fn frame(angles: [f64; 3]) -> Three {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        (0..3).fold(identity, |f, axis| turned(&f, axis, angles[axis]))
    }

    #[test]
    fn a_turned_orthotropic_material_is_recognised() {
        for angles in [
            [0.0; 3],
            [0.3, -0.5, 1.1],
            [2.0, 0.7, -0.4],
            [0.78, 0.02, 0.4],
        ] {
            let q = frame(angles);
            let back: Three = std::array::from_fn(|i| std::array::from_fn(|j| q[j][i]));
            // In the volume's axes: the material's axes are the rows of q.
            let found = orthotropic(&seen_from(&bone(), &back)).unwrap();
            assert!(found.residual < 1e-6, "{angles:?}: {found:?}");
            for a in 0..3 {
                let along: f64 = (0..3).map(|k| found.axes[a][k] * q[a][k]).sum();
                assert!((along.abs() - 1.0).abs() < 1e-9, "{angles:?}: {found:?}");
                let e = [900.0, 500.0, 300.0][a];
                assert!((found.young_mpa[a] / e - 1.0).abs() < 1e-6, "{found:?}");
            }
            assert!(
                (found.poisson[0] - 0.25).abs() < 1e-6 && (found.poisson[2] - 0.35).abs() < 1e-6
            );
            assert!((found.shear_mpa[0] / 120.0 - 1.0).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn what_is_not_orthotropic_says_so() {
        let mut c = bone();
        (c[0][3], c[3][0]) = (60.0, 60.0);
        (c[1][5], c[5][1]) = (-40.0, -40.0);
        let found = orthotropic(&c).unwrap();
        let here = (norm(&c, forbidden) / norm(&c, |_, _| true)).sqrt();
        assert!(found.residual > 0.01 && found.residual <= here, "{found:?}");
        // No other frame is better: a random search.
        let mut state = 1u64;
        let size = norm(&c, |_, _| true);
        for _ in 0..3000 {
            let angles = std::array::from_fn(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
                (state >> 40) as f64
            });
            let there = norm(&seen_from(&c, &frame(angles)), forbidden);
            assert!((there / size).sqrt() > found.residual - 1e-9);
        }
    }

    #[test]
    fn the_modulus_along_an_axis_is_that_of_free_sides() {
        let c = bone();
        let error: Six = std::array::from_fn(|i| std::array::from_fn(|j| 1e-3 * c[i][j].abs()));
        for (axis, e) in [(Axis::X, 900.0), (Axis::Y, 500.0), (Axis::Z, 300.0)] {
            let (young, off) = young_along(&c, &error, axis);
            assert!((young / e - 1.0).abs() < 1e-12);
            // At least what scaling the whole matrix by 1.001 does.
            assert!(off > 0.999e-3 * e && off < 1e-2 * e, "{off}");
        }
        assert_eq!(young_along(&[[0.0; 6]; 6], &error, Axis::X), (0.0, 0.0));
    }
}
