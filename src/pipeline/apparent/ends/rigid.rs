//! Owns rigid motions: which of a body's six its supports leave free, in words, and how they are taken out of displacements.

use faer::{Mat, Side};

/// Part of the largest eigenvalue below which supports do not stop a motion. A turn that is stopped by one voxel's lever in a body of a
/// thousand voxels has 1e-6 of it.
const FREE: f64 = 1e-12;

/// A rigid motion: a shift, and a turn about the body's centre times the body's size, so that both are lengths.
pub type Motion = [f64; 6];

/// Where a body is, and how large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Mean place of its nodes, mm.
    pub centre_mm: [f64; 3],
    /// Root mean square distance of its nodes from there, mm.
    pub size_mm: f64,
}

impl Frame {
    /// What the six motions displace one component of a place by.
    pub fn row(&self, place_mm: [f64; 3], component: usize) -> Motion {
        let x: [f64; 3] = std::array::from_fn(|a| (place_mm[a] - self.centre_mm[a]) / self.size_mm);
        std::array::from_fn(|m| match m {
            0..3 => f64::from(u8::from(m == component)),
            // u = e_k × x.
            _ => match (component + 3 - (m - 3)) % 3 {
                1 => -x[(component + 1) % 3],
                2 => x[(component + 2) % 3],
                _ => 0.0,
            },
        })
    }

    /// A motion in words: a shift, or a turn about an axis.
    pub fn in_words(&self, motion: &Motion) -> String {
        let (t, w) = (
            [motion[0], motion[1], motion[2]],
            [motion[3], motion[4], motion[5]],
        );
        let w = w.map(|v| v / self.size_mm);
        let squared: f64 = w.iter().map(|v| v * v).sum();
        if squared.sqrt() * self.size_mm < 1e-6 * length(t) {
            return format!("a shift along {}", direction(t));
        }
        // The axis goes through c + ω × t / ω².
        let through: [f64; 3] = std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            self.centre_mm[a] + (w[b] * t[c] - w[c] * t[b]) / squared
        });
        let [x, y, z] = through.map(|v| (v * 1e3).round() / 1e3 + 0.0);
        format!("a turn about {} through ({x}, {y}, {z}) mm", direction(w))
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// The name of an axis, or a unit vector.
fn direction(v: [f64; 3]) -> String {
    let unit = v.map(|c| c / length(v));
    match (0..3).find(|&a| unit[a].abs() > 1.0 - 1e-9) {
        Some(a) => ["x", "y", "z"][a].to_owned(),
        None => {
            let [x, y, z] = unit.map(|v| (v * 1e3).round() / 1e3 + 0.0);
            format!("({x}, {y}, {z})")
        }
    }
}

/// Sum of `row rowᵀ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gram(pub [[f64; 6]; 6]);

impl Gram {
    /// Of no rows.
    pub const ZERO: Gram = Gram([[0.0; 6]; 6]);

    /// Adds a row.
    pub fn add(&mut self, row: &Motion) {
        for i in 0..6 {
            for j in 0..6 {
                self.0[i][j] += row[i] * row[j];
            }
        }
    }

    /// Motions that none of the rows stops; shifts and turns about axes as far as they can be separated.
    pub fn free(&self) -> Vec<Motion> {
        let matrix = Mat::from_fn(6, 6, |i, j| self.0[i][j]);
        let Ok(eigen) = matrix.self_adjoint_eigen(Side::Lower) else {
            return Vec::new();
        };
        let values = eigen.S().column_vector();
        let most = (0..6)
            .map(|m| values[m])
            .fold(0.0, f64::max)
            .max(f64::MIN_POSITIVE);
        let free = (0..6).filter(|&m| values[m] <= FREE * most);
        reduced(
            free.map(|m| std::array::from_fn(|i| eigen.U()[(i, m)]))
                .collect(),
        )
    }

    /// The motion whose displacements have these products with the rows: `G⁻¹ b` of motions that the rows stop.
    pub fn solve(&self, b: &Motion) -> Motion {
        let matrix = Mat::from_fn(6, 6, |i, j| self.0[i][j]);
        let Ok(eigen) = matrix.self_adjoint_eigen(Side::Lower) else {
            return [0.0; 6];
        };
        let values = eigen.S().column_vector();
        let most = (0..6).map(|m| values[m]).fold(0.0, f64::max);
        let mut x = [0.0; 6];
        for m in (0..6).filter(|&m| values[m] > FREE * most) {
            let along: f64 = (0..6).map(|i| eigen.U()[(i, m)] * b[i]).sum();
            (0..6).for_each(|i| x[i] += along / values[m] * eigen.U()[(i, m)]);
        }
        x
    }
}

/// The same space in vectors that each have a component that no other has, of turns first.
fn reduced(mut all: Vec<Motion>) -> Vec<Motion> {
    let mut done = 0;
    for pivot in [3, 4, 5, 0, 1, 2] {
        let best =
            (done..all.len()).max_by(|&a, &b| all[a][pivot].abs().total_cmp(&all[b][pivot].abs()));
        let Some(best) = best.filter(|&b| all[b][pivot].abs() > 1e-6) else {
            continue;
        };
        all.swap(done, best);
        let scale = all[done][pivot];
        all[done].iter_mut().for_each(|v| *v /= scale);
        let own = all[done];
        for (i, other) in all.iter_mut().enumerate() {
            let part = other[pivot];
            if i != done {
                (0..6).for_each(|k| other[k] -= part * own[k]);
            }
        }
        done += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame {
        centre_mm: [1.0, 2.0, 3.0],
        size_mm: 2.0,
    };

    fn free(held: &[([f64; 3], usize)]) -> Vec<String> {
        let mut gram = Gram::ZERO;
        held.iter()
            .for_each(|(at, c)| gram.add(&FRAME.row(*at, *c)));
        gram.free().iter().map(|m| FRAME.in_words(m)).collect()
    }

    #[test]
    fn what_is_left_free_is_named() {
        let plane = [
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [0.0, 4.0, 0.0],
            [4.0, 4.0, 0.0],
        ];
        let rollers: Vec<_> = plane.map(|p| (p, 2)).to_vec();
        let left = free(&rollers);
        assert_eq!(left.len(), 3, "{left:?}");
        assert!(left[0].starts_with("a turn about z"), "{left:?}");
        assert_eq!(left[1..], ["a shift along x", "a shift along y"]);
        // A line of hinges along y at x = 4, z = 0.
        let hinges: Vec<_> = (0..3)
            .flat_map(|c| [([4.0, 0.0, 0.0], c), ([4.0, 4.0, 0.0], c)])
            .collect();
        let left = free(&hinges);
        assert_eq!(left.len(), 1);
        assert!(
            left[0].starts_with("a turn about y through (4, ") && left[0].ends_with(", 0) mm"),
            "{left:?}"
        );
        let whole: Vec<_> = plane
            .iter()
            .flat_map(|p| (0..3).map(move |c| (*p, c)))
            .collect();
        assert_eq!(free(&whole), [""; 0]);
        assert_eq!(free(&[]).len(), 6);
    }

    #[test]
    fn a_rigid_motion_is_found_again() {
        let motion = [0.1, -0.2, 0.3, 0.01, 0.02, -0.03];
        let places = [
            [0.0, 0.0, 0.0],
            [4.0, 1.0, 0.0],
            [0.0, 4.0, 2.0],
            [4.0, 4.0, 7.0],
        ];
        let (mut gram, mut b) = (Gram::ZERO, [0.0; 6]);
        for (at, c) in places.iter().flat_map(|p| (0..3).map(move |c| (*p, c))) {
            let row = FRAME.row(at, c);
            let u: f64 = (0..6).map(|m| row[m] * motion[m]).sum();
            gram.add(&row);
            (0..6).for_each(|m| b[m] += row[m] * u);
        }
        let found = gram.solve(&b);
        assert!(
            (0..6).all(|m| (found[m] - motion[m]).abs() < 1e-12),
            "{found:?}"
        );
    }
}
