//! Owns what finer load steps and finer elements would change of a strength, from two of each.
//!
//! The error of load steps falls with their length, that of elements of one body at least with their edge. So of a difference between
//! two sizes, `size / (larger − smaller)` times as much is left at `size`, at most.

use crate::result::row::Row;
use crate::result::strength::Strength;

/// What the stated errors hold, and what they do not.
pub const HOLDS: &str = "± of the strength holds load steps, elements and solver, not what the image leaves open about the bone's surface";

/// Yield stress and largest stress of one solve, with what they were found by.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Solve {
    element_mm: f64,
    /// Length of a load step over the load.
    step: f64,
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
            step: 1.0 / row.key.steps? as f64,
            stresses_mpa: [yield_stress_mpa, max_stress_mpa],
            solver: 0.01 * solved.algebraic_error_percent?,
        })
    }
}

/// The strength of `row` with its errors, from `rows` of the same body and load. None without two load steps and two element sizes that
/// converged.
pub fn stated(row: &Row, rows: &[Row]) -> Option<Strength> {
    let own = Solve::of(row)?;
    let known: Vec<Solve> = rows.iter().filter_map(Solve::of).collect();
    let error = |stress: usize| {
        let of_steps = per_size(&known, stress, |s| [s.step, s.element_mm])? * own.step;
        let of_elements = per_size(&known, stress, |s| [s.element_mm, s.step])? * own.element_mm;
        Some((of_steps + of_elements + own.solver) * own.stresses_mpa[stress]?)
    };
    let strength = row.solved.as_ref()?.strength;
    Some(Strength {
        yield_stress_error_mpa: error(0),
        max_stress_error_mpa: Some(error(1)?),
        ..strength
    })
}

/// Relative error of load steps alone at a length `1 / steps`.
pub fn of_steps(rows: &[Row], steps: usize) -> Option<f64> {
    let known: Vec<Solve> = rows.iter().filter_map(Solve::of).collect();
    let of = |stress: usize| per_size(&known, stress, |s| [s.step, s.element_mm]);
    let most = of(1)?.max(of(0).unwrap_or(0.0));
    Some(most / steps as f64)
}

/// Relative change of a stress per change of a size, by the smallest two; `by` has the size, and what must be the same.
fn per_size(known: &[Solve], stress: usize, by: impl Fn(&Solve) -> [f64; 2]) -> Option<f64> {
    let pairs = known.iter().flat_map(|a| known.iter().map(move |b| (a, b)));
    let fits = |(a, b): &(&Solve, &Solve)| by(a)[1] == by(b)[1] && by(a)[0] > by(b)[0];
    let of = |(a, b): (&Solve, &Solve)| {
        let (coarse, fine) = (a.stresses_mpa[stress]?, b.stresses_mpa[stress]?);
        let change = (coarse / fine - 1.0).abs() / (by(a)[0] - by(b)[0]);
        Some((by(a)[0] + by(b)[0], change))
    };
    let smallest = pairs.filter(fits).filter_map(of);
    smallest
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, change)| change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::Settings;

    /// Stresses that are off in proportion to both sizes: 100 (1 + h + step).
    fn row(element_mm: f64, steps: u64) -> Row {
        let stress = 100.0 * (1.0 + element_mm + 1.0 / steps as f64);
        Row {
            key: Settings {
                lp_mm: element_mm,
                steps: Some(steps),
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
        let rows = [row(0.02, 10), row(0.02, 20), row(0.01, 10)];
        for (row, off) in [(&rows[0], 12.0), (&rows[2], 11.0)] {
            let found = stated(row, &rows).unwrap();
            let error = found.max_stress_error_mpa.unwrap();
            // Changes are over the finer value, which is up to a twentieth smaller than that of the row.
            assert!(error >= off && error < 1.05 * off, "{error} {off}");
            assert_eq!(found.yield_stress_error_mpa, None);
            assert_eq!(found.error(), Some(error / found.max_stress_mpa.unwrap()));
        }
        assert!((of_steps(&rows, 10).unwrap() - 0.1).abs() < 0.01);
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
