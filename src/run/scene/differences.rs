//! Owns maps and numbers of the difference between two scenes on the same points.

use super::writer::Scalars;
use crate::error::{Error, Result};
use crate::io::map::{self, Range};
use crate::io::{atomic, points as files};
use crate::topology::plane::Points;
use std::path::Path;

/// Writes the first of each time's `maps` less that of another run on the same points, at the times both have.
pub fn write(out: &Path, maps: &[(f64, Scalars)], points: &Points, other: &Path) -> Result<()> {
    let mut rows =
        vec!["t,mean,mean_abs,p95_abs,max_abs,share_above_0.1,share_above_0.3".to_owned()];
    for (t, scalars) in maps {
        let Some((name, values)) = scalars.first() else {
            continue;
        };
        let file = other.join(format!("fields_t{t}.csv"));
        if !file.exists() {
            continue;
        }
        let minus = files::read_column(&file, name)?;
        let near = |p: usize| {
            let (at, here) = (minus[p].0, points.position(p));
            (0..2).all(|d| (at[d] - here[d]).abs() < 1e-6 * points.spacing)
        };
        if minus.len() != points.len() || !(0..points.len()).all(near) {
            return Err(Error::file(
                file,
                "its points are not those of this scene",
                "compare scenes of one geometry and spacing",
            ));
        }
        let change: Vec<f64> = values.iter().zip(&minus).map(|(a, (_, b))| a - b).collect();
        rows.push(difference_row(*t, &change));
        let picture = map::draw(
            points,
            &change,
            Range {
                low: -0.3,
                high: 0.3,
            },
            *t,
        );
        map::write_png(&out.join(format!("difference_t{t}.png")), &picture)?;
    }
    atomic::write(&out.join("difference.csv"), rows.join("\n") + "\n")
}

/// A line of `difference.csv`.
fn difference_row(t: f64, change: &[f64]) -> String {
    let n = change.len() as f64;
    let mut size: Vec<f64> = change.iter().map(|v| v.abs()).collect();
    size.sort_unstable_by(f64::total_cmp);
    let above = |limit: f64| size.iter().filter(|v| **v > limit).count() as f64 / n;
    let mean = change.iter().sum::<f64>() / n;
    let mean_abs = size.iter().sum::<f64>() / n;
    let p95 = size[((size.len() - 1) as f64 * 0.95) as usize];
    format!(
        "{t},{mean},{mean_abs},{p95},{},{},{}",
        size[size.len() - 1],
        above(0.1),
        above(0.3)
    )
}
