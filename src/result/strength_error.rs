//! Owns what finer load steps and finer elements would change of a strength, from two of each.
//!
//! The error of load steps falls with their length. That of elements of one body falls with a power of their edge: about 1 where struts are
//! several voxels thick, 0.4 where voxels meet in edges (`reports/strength.md`). The power is fitted to three sizes; of two it is taken for
//! 1/2. With the power `p` a difference between two sizes leaves `sizeᵖ / (largerᵖ − smallerᵖ)` times as much at `size`.

use crate::result::row::Row;
use crate::result::settings::load_steps::LoadSteps;
use crate::result::strength::Strength;

/// What the stated errors hold, and what they do not.
pub const HOLDS: &str = "± of the strength holds load steps, elements and solver, not what the image leaves open about the bone's surface";

/// Power of the elements' edge where two sizes are all that is known: that of notches, which the corners of voxels are.
const ORDER: f64 = 0.5;

/// Least and largest power that is taken from three sizes: a fit to three numbers is not trusted beyond.
const ORDERS: [f64; 2] = [0.3, 1.0];

/// Yield stress and largest stress of one solve, with what they were found by.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Solve {
    element_mm: f64,
    steps: LoadSteps,
    stresses_mpa: [Option<f64>; 2],
    /// Relative error of the solver.
    solver: f64,
}

impl Solve {
    /// None of a row that is not converged, or of tissue that does not yield.
    fn of(row: &Row) -> Option<Solve> {
        let solved = row.solved.as_ref()?;
        let Strength {
            yield_stress_mpa,
            max_stress_mpa,
            ..
        } = solved.strength;
        (row.converged() == Some(true)).then_some(Solve {
            element_mm: row.key.lp_mm,
            steps: row.key.steps?,
            stresses_mpa: [yield_stress_mpa, max_stress_mpa],
            solver: 0.01 * solved.algebraic_error_percent?,
        })
    }
}

/// The strength of `row` with its errors, from `rows` of the same body and load. None without two load steps and two element sizes that
/// converged.
pub fn stated(row: &Row, rows: &[Row]) -> Option<Strength> {
    let own = Solve::of(row)?;
    let known = alike(rows, own.steps);
    let error = |stress: usize| {
        let of_steps = Sizes::of(&known, stress, |s| [s.steps.length(), s.element_mm])?;
        let of_elements = Sizes::of(&known, stress, |s| [s.element_mm, s.steps.length()])?;
        let left = of_steps.left(own.steps.length(), 1.0)
            + of_elements.left(own.element_mm, of_elements.order());
        Some((left + own.solver) * own.stresses_mpa[stress]?)
    };
    let strength = row.solved.as_ref()?.strength;
    Some(Strength {
        yield_stress_error_mpa: error(0),
        max_stress_error_mpa: Some(error(1)?),
        ..strength
    })
}

/// The solves whose load steps are chosen in the same way.
fn alike(rows: &[Row], steps: LoadSteps) -> Vec<Solve> {
    let solves = rows.iter().filter_map(Solve::of);
    solves.filter(|s| s.steps.is_of_one_kind(steps)).collect()
}

/// Relative error of load steps alone.
pub fn of_steps(rows: &[Row], steps: LoadSteps) -> Option<f64> {
    let known = alike(rows, steps);
    let left = |stress: usize| {
        let sizes = Sizes::of(&known, stress, |s| [s.steps.length(), s.element_mm])?;
        Some(sizes.left(steps.length(), 1.0))
    };
    Some(left(1)?.max(left(0).unwrap_or(0.0)))
}

/// A stress at two sizes or more, all else equal: size and stress, the smallest first.
struct Sizes(Vec<[f64; 2]>);

impl Sizes {
    /// The series with the smallest two sizes; `by` has the size, and what must be the same.
    fn of(known: &[Solve], stress: usize, by: impl Fn(&Solve) -> [f64; 2]) -> Option<Sizes> {
        let series = |other: f64| {
            let own = known.iter().filter(|s| by(s)[1] == other);
            let mut points: Vec<[f64; 2]> = own
                .filter_map(|s| Some([by(s)[0], s.stresses_mpa[stress]?]))
                .collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            points.dedup_by_key(|point| point[0]);
            points
        };
        let all = known.iter().map(|s| series(by(s)[1]));
        let smallest = all.filter(|points| points.len() > 1);
        smallest
            .min_by(|a, b| (a[0][0] + a[1][0]).total_cmp(&(b[0][0] + b[1][0])))
            .map(Sizes)
    }

    /// Power of the size with which the stress tends to its limit.
    fn order(&self) -> f64 {
        let [fine, middle, coarse] = match self.0[..] {
            [a, b, c, ..] => [a, b, c],
            _ => return ORDER,
        };
        let fallen = (coarse[1] - middle[1]) / (middle[1] - fine[1]);
        let ratio = |p: f64| {
            let [f, m, c] = [fine, middle, coarse].map(|point| point[0].powf(p));
            (c - m) / (m - f)
        };
        // The ratio of the two changes rises with the power.
        let [mut low, mut high] = ORDERS;
        if fallen.is_nan() || fallen <= ratio(low) {
            return low;
        }
        for _ in 0..40 {
            let p = 0.5 * (low + high);
            match ratio(p) < fallen {
                true => low = p,
                false => high = p,
            }
        }
        low
    }

    /// Relative error at `size`, by the change between the smallest two.
    fn left(&self, size: f64, order: f64) -> f64 {
        let [fine, coarse] = [self.0[0], self.0[1]];
        let change = (coarse[1] / fine[1] - 1.0).abs();
        change * size.powf(order) / (coarse[0].powf(order) - fine[0].powf(order))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::Settings;

    /// Stresses that are off in proportion to both sizes: 100 (1 + h + step).
    fn row(element_mm: f64, steps: u32) -> Row {
        let stress = 100.0 * (1.0 + element_mm + 1.0 / f64::from(steps));
        Row {
            key: Settings {
                lp_mm: element_mm,
                steps: Some(LoadSteps::Even(steps)),
                plasticity: Some("von-mises:68".to_owned()),
                ..Settings::default()
            },
            solved: Some(Solution {
                converged: Some(true),
                algebraic_error_percent: Some(0.0),
                strength: Strength {
                    max_stress_mpa: Some(stress),
                    ..Strength::default()
                },
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    #[test]
    fn errors_of_first_order_are_stated_as_they_are() {
        let rows = [row(0.03, 10), row(0.03, 20), row(0.02, 10), row(0.01, 10)];
        for (row, off) in [(&rows[0], 13.0), (&rows[3], 11.0)] {
            let found = stated(row, &rows).unwrap();
            let error = found.max_stress_error_mpa.unwrap();
            // Changes are over the finer value, which is up to a twentieth smaller than that of the row.
            assert!(error >= off && error < 1.05 * off, "{error} {off}");
            assert_eq!(found.yield_stress_error_mpa, None);
            assert_eq!(found.error(), Some(error / found.max_stress_mpa.unwrap()));
        }
        assert!((of_steps(&rows, LoadSteps::Even(10)).unwrap() - 0.1).abs() < 0.01);
    }

    /// Elements whose error falls with the power 0.4, as where voxels meet in edges.
    #[test]
    fn a_slow_limit_is_covered_by_three_sizes() {
        let known: Vec<Solve> = [1.0, 0.5, 1.0 / 3.0]
            .map(|element_mm: f64| Solve {
                element_mm,
                steps: LoadSteps::Even(10),
                stresses_mpa: [None, Some(2.2 + 5.6 * element_mm.powf(0.4))],
                solver: 0.0,
            })
            .to_vec();
        let sizes = Sizes::of(&known, 1, |s| [s.element_mm, s.steps.length()]).unwrap();
        assert!((sizes.order() - 0.4).abs() < 1e-6, "{}", sizes.order());
        let fine = 2.2 + 5.6 * (1.0_f64 / 3.0).powf(0.4);
        let left = fine * sizes.left(1.0 / 3.0, sizes.order());
        assert!((left / (fine - 2.2) - 1.0).abs() < 1e-6, "{left}");
        // Of two sizes less is known: the power is taken for a half.
        let two = Sizes(sizes.0[1..].to_vec());
        assert_eq!(two.order(), ORDER);
    }

    #[test]
    fn nothing_is_stated_of_less_than_two_of_each() {
        let [a, b, mut c] = [row(0.02, 10), row(0.02, 20), row(0.01, 10)];
        assert_eq!(stated(&a, &[a.clone(), b.clone()]), None);
        assert_eq!(stated(&a, &[a.clone(), c.clone()]), None);
        c.solved.as_mut().unwrap().converged = Some(false);
        assert_eq!(stated(&a, &[a.clone(), b, c]), None);
    }
}
