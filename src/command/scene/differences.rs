//! Owns maps and numbers of the difference between two scenes on the same points.

use crate::discretisation::plane::Points;
use crate::draw::map;
use crate::draw::map::Range;
use crate::error::{Error, Result};
use crate::export::points as files;
use crate::io::atomic;
use crate::result::statistics::regression::regression;
use std::path::{Path, PathBuf};

/// Scalar fields by name.
pub type Scalars = Vec<(String, Vec<f64>)>;

/// Times nearer than this, relative to their size, are the same.
const SAME_TIME: f64 = 1e-9;

/// The fields that another scene left.
pub struct Other {
    folder: PathBuf,
    /// Times, and the file of each.
    files: Vec<(f64, PathBuf)>,
}

impl Other {
    /// # Errors
    /// A folder without fields, or with those of other points.
    pub fn open(folder: &Path, points: &Points) -> Result<Self> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries
            .filter_map(|e| Some((time_of(&e.file_name().to_string_lossy())?, e.path())))
            .collect();
        files.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, first)) = files.first() else {
            return Err(Error::file(
                folder,
                "output.minus names it, but it holds no fields (fields_t*.csv) of a scene",
                "run that scene first, or correct output.minus",
            ));
        };
        let found = files::read_positions(first)?;
        let near = |p: usize| {
            let (at, here) = (found[p], points.position(p));
            (0..2).all(|d| (at[d] - here[d]).abs() < 1e-6 * points.spacing)
        };
        if found.len() != points.len() || !(0..points.len()).all(near) {
            return Err(Error::file(
                first,
                "its points are not those of this scene",
                "compare scenes of one geometry and spacing",
            ));
        }
        Ok(Other {
            folder: folder.to_path_buf(),
            files,
        })
    }

    fn at(&self, t: f64) -> Option<&Path> {
        let same = |other: f64| (other - t).abs() <= SAME_TIME * t.abs().max(other.abs());
        let found = self.files.iter().find(|(other, _)| same(*other))?;
        Some(&found.1)
    }
}

/// The time in a name `fields_t{time}.csv`.
pub fn time_of(name: &str) -> Option<f64> {
    name.strip_prefix("fields_t")?
        .strip_suffix(".csv")?
        .parse()
        .ok()
}

/// Writes the first of each time's `maps` less that of the other scene, at the times both have. Words for the times that
/// the other has not.
pub fn write(
    out: &Path,
    maps: &[(f64, Scalars)],
    points: &Points,
    other: &Other,
) -> Result<Option<String>> {
    let mut rows = vec![
        "t,mean,mean_abs,p95_abs,max_abs,share_above_0.1,share_above_0.3,correlation".to_owned(),
    ];
    let mut missing = Vec::new();
    for (t, scalars) in maps {
        let Some((name, values)) = scalars.first() else {
            continue;
        };
        let Some(file) = other.at(*t) else {
            missing.push(t.to_string());
            continue;
        };
        let minus = files::read_column(file, name)?;
        let minus: Vec<f64> = minus.into_iter().map(|(_, v)| v).collect();
        let change: Vec<f64> = values.iter().zip(&minus).map(|(a, b)| a - b).collect();
        let alike = correlation(values, &minus);
        rows.push(format!("{},{alike}", difference_row(*t, &change)));
        let range = Range {
            low: -0.3,
            high: 0.3,
        };
        let picture = map::draw(points, &change, range, *t);
        map::write_png(&out.join(format!("difference_t{t}.png")), &picture)?;
    }
    atomic::write(&out.join("difference.csv"), rows.join("\n") + "\n")?;
    Ok((!missing.is_empty()).then(|| {
        format!(
            "no difference at t = {}: {} has no fields of that time",
            missing.join(", "),
            other.folder.display()
        )
    }))
}

/// Pearson's correlation of two maps: how alike they are but for a level and a scale. No number where a map does not vary.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let fit = regression(b, a);
    fit.map_or(f64::NAN, |fit| fit.r2.sqrt().copysign(fit.slope))
}

/// A line of `difference.csv` but for the correlation.
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

#[cfg(test)]
mod tests {
    use super::correlation;

    /// By hand: deviations -1, 0, 1 and 1, -2, 1 of [1, 2, 3] and [4, 1, 4] have no product; level and scale do not matter.
    #[test]
    fn correlations_of_maps() {
        assert!(correlation(&[1.0, 2.0, 3.0], &[4.0, 1.0, 4.0]).abs() < 1e-12);
        assert!((correlation(&[1.0, 2.0, 4.0], &[12.0, 14.0, 18.0]) - 1.0).abs() < 1e-12);
        assert!((correlation(&[1.0, 2.0, 4.0], &[-1.0, -2.0, -4.0]) + 1.0).abs() < 1e-12);
        assert!(correlation(&[1.0, 2.0, 3.0], &[5.0, 5.0, 5.0]).is_nan());
    }
}
