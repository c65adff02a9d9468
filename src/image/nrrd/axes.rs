//! Owns the axes of an NRRD: which of them are x, y, z, their voxel size and orientation.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::header::Header;
use crate::format::length;
use crate::format::orient::{Affine, column_norms};
use std::path::Path;

pub struct Axes {
    pub n: [usize; 3],
    pub spacing_mm: Option<[f64; 3]>,
    pub affine: Option<Affine>,
}

/// One axis as the header describes it.
#[derive(Debug, Clone, Copy)]
struct Axis<'a> {
    size: usize,
    kind: &'a str,
    /// In the space's units.
    direction: Option<[f64; 3]>,
    spacing_mm: Option<f64>,
}

pub fn axes(header: &Header, path: &Path, notes: &mut Vec<String>) -> Result<Axes> {
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let sizes: Option<Vec<usize>> = header
        .words("sizes")
        .iter()
        .map(|w| w.parse().ok())
        .collect();
    let sizes = sizes.filter(|s| !s.is_empty()).ok_or_else(|| {
        wrong(format!(
            "its sizes should be numbers, they are `{}`",
            header.get("sizes").unwrap_or("missing")
        ))
    })?;
    if let Some(dimension) = header.get("dimension")
        && dimension.parse() != Ok(sizes.len())
    {
        return Err(wrong(format!(
            "has dimension {dimension} and {} sizes",
            sizes.len()
        )));
    }
    let all = each(header, &sizes, path)?;
    let kept = spatial(&all, path)?;
    let n = std::array::from_fn(|a| kept.get(a).map_or(1, |axis| axis.size));
    let affine = affine(header, &kept, path, notes)?;
    let spacing_mm = match &affine {
        Some(rows) => Some(column_norms(rows)),
        None => spacing(&kept, notes),
    };
    let affine =
        affine.filter(|_| header.get("space").is_some() || header.get("spacedimension").is_some());
    Ok(Axes {
        n,
        spacing_mm,
        affine,
    })
}

fn each<'a>(header: &'a Header, sizes: &[usize], path: &Path) -> Result<Vec<Axis<'a>>> {
    let directions = match header.get("spacedirections") {
        Some(text) => Some(
            vectors(text)
                .filter(|v| v.len() == sizes.len())
                .ok_or_else(|| {
                    Error::file(
                        path,
                        format!("its space directions are no vectors, one an axis: `{text}`"),
                        ADVICE,
                    )
                })?,
        ),
        None => None,
    };
    let kinds = header.words("kinds");
    (0..sizes.len())
        .map(|a| {
            Ok(Axis {
                size: sizes[a],
                kind: kinds.get(a).copied().unwrap_or("???"),
                direction: directions.as_ref().and_then(|d| d[a]),
                spacing_mm: own_spacing(header, a, sizes[a], path)?,
            })
        })
        .collect()
}

/// The spacing of an axis without a direction, in mm.
fn own_spacing(header: &Header, a: usize, size: usize, path: &Path) -> Result<Option<f64>> {
    let number = |key| {
        let word = header.words(key).get(a).copied();
        word.and_then(|w| w.parse::<f64>().ok())
            .filter(|v| v.is_finite())
    };
    let spacing = number("spacings").or_else(|| {
        let length = number("axismaxs")? - number("axismins")?;
        match header.words("centerings").get(a)?.to_lowercase().as_str() {
            "cell" => Some(length / size as f64),
            "node" if size > 1 => Some(length / (size - 1) as f64),
            _ => None,
        }
    });
    if spacing.is_some_and(|s| s < 0.0) {
        return Err(Error::file(
            path,
            format!("has a spacing below zero along axis {a}, which reverses it"),
            "reverse the axis and make its spacing positive, or use space directions",
        ));
    }
    let unit = header.quoted("units").get(a).copied().unwrap_or_default();
    Ok(match (spacing, to_mm(unit, path)?) {
        (Some(s), Some(mm)) if s > 0.0 => Some(s * mm),
        _ => None,
    })
}

/// Millimetres per `unit`; None where it is no length. No unit means millimetres.
fn to_mm(unit: &str, path: &Path) -> Result<Option<f64>> {
    match unit.trim() {
        "" => Ok(Some(1.0)),
        pixel if length::is_pixel(pixel) => Ok(None),
        other => length::millimetres_per(other).map(Some).ok_or_else(|| {
            Error::file(
                path,
                format!("gives lengths in `{other}`, which is no known unit of length"),
                "write the units as mm or um",
            )
        }),
    }
}

/// The two or three axes of space. Others may have one value.
fn spatial<'a>(all: &[Axis<'a>], path: &Path) -> Result<Vec<Axis<'a>>> {
    let placed = all.iter().any(|axis| axis.direction.is_some());
    let spatial = |axis: &Axis| {
        let kind = axis.kind.to_lowercase();
        let space = ["???", "none", "domain", "space", "stub", "scalar"];
        space.contains(&kind.as_str()) && (axis.direction.is_some() || !placed)
    };
    for (a, axis) in all.iter().enumerate() {
        if axis.size > 1 && !spatial(axis) {
            return Err(Error::file(
                path,
                format!(
                    "holds {} values a voxel along axis {a} (kind {}), one grey value is expected",
                    axis.size, axis.kind
                ),
                "save one channel or one time as a scan of its own",
            ));
        }
    }
    let mut kept: Vec<Axis> = all.iter().copied().filter(|axis| spatial(axis)).collect();
    // More than three: axes of one voxel go, the last first.
    for a in (0..kept.len()).rev() {
        if kept.len() > 3 && kept[a].size == 1 {
            kept.remove(a);
        }
    }
    if kept.len() == 2 || kept.len() == 3 {
        return Ok(kept);
    }
    Err(Error::file(
        path,
        format!(
            "has sizes {:?}, one scan has three",
            all.iter().map(|axis| axis.size).collect::<Vec<_>>()
        ),
        "save the volume that you want as a file of its own",
    ))
}

/// `(a,b,c)` or `none`, of two to four numbers each: those of space are the first three.
fn vectors(text: &str) -> Option<Vec<Option<[f64; 3]>>> {
    let mut found = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let Some(open) = rest.strip_prefix('(') else {
            rest = rest.strip_prefix("none")?.trim_start();
            found.push(None);
            continue;
        };
        let (inner, after) = open.split_once(')')?;
        let numbers: Vec<f64> = inner
            .split(',')
            .map(|w| w.trim().parse().ok())
            .collect::<Option<_>>()?;
        let vector: [f64; 3] = std::array::from_fn(|c| numbers.get(c).copied().unwrap_or(0.0));
        found.push(vector.iter().any(|v| *v != 0.0).then_some(vector));
        rest = after.trim_start();
    }
    Some(found)
}

/// Directions and origin in RAS, in mm.
fn affine(
    header: &Header,
    kept: &[Axis],
    path: &Path,
    notes: &mut Vec<String>,
) -> Result<Option<Affine>> {
    let columns: Option<Vec<[f64; 3]>> = kept.iter().map(|axis| axis.direction).collect();
    let Some(mut columns) = columns else {
        return Ok(None);
    };
    if let [x, y] = columns[..] {
        columns.push(upright(x, y));
        notes.push(
            "the distance between slices is not in the file: taken as the pixel's height".into(),
        );
    }
    let origin = header.get("spaceorigin").and_then(vectors);
    let origin = origin.and_then(|v| v.first().copied().flatten());
    let signs = signs(header, path, notes)?;
    let units = header.quoted("spaceunits");
    let mut rows = Affine::default();
    for (r, row) in rows.iter_mut().enumerate() {
        let Some(mm) = to_mm(units.get(r).copied().unwrap_or_default(), path)? else {
            return Ok(None);
        };
        let o = origin.map_or(0.0, |o| o[r]);
        *row = [columns[0][r], columns[1][r], columns[2][r], o].map(|v| v * signs[r] * mm);
    }
    let usable = column_norms(&rows)
        .iter()
        .all(|l| l.is_finite() && *l > 0.0);
    match usable {
        true => Ok(Some(rows)),
        false => Err(Error::file(
            path,
            "has space directions that are no finite vectors",
            ADVICE,
        )),
    }
}

/// Along the normal of a slice, as long as its second direction.
fn upright([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let normal = [b * z - c * y, c * x - a * z, a * y - b * x];
    let first = (a * a + b * b + c * c).sqrt();
    normal.map(|v| v / first)
}

/// From the space's axes to right, anterior, superior.
fn signs(header: &Header, path: &Path, notes: &mut Vec<String>) -> Result<[f64; 3]> {
    let Some(space) = header.get("space") else {
        if header.get("spacedimension").is_some() {
            notes.push("the space of the file has no name: its axes are taken as x, y, z".into());
        }
        return Ok([1.0; 3]);
    };
    let space = space.to_lowercase();
    let space = space.strip_suffix("-time").unwrap_or(&space);
    Ok(match space.trim_end_matches('t') {
        "left-posterior-superior" | "lps" => [-1.0, -1.0, 1.0],
        "left-anterior-superior" | "las" => [-1.0, 1.0, 1.0],
        "right-anterior-superior" | "ras" | "scanner-xyz" | "3d-right-handed" => [1.0; 3],
        _ => {
            return Err(Error::file(
                path,
                format!("is in the space `{space}`, whose left and right are not known"),
                "save it in the space left-posterior-superior or right-anterior-superior",
            ));
        }
    })
}

/// Spacings without directions; that of slices is the pixel's height where there is one slice.
fn spacing(kept: &[Axis], notes: &mut Vec<String>) -> Option<[f64; 3]> {
    match kept {
        [x, y] => {
            let (x, y) = (x.spacing_mm?, y.spacing_mm?);
            notes.push(
                "the distance between slices is not in the file: taken as the pixel's height"
                    .into(),
            );
            Some([x, y, y])
        }
        [x, y, z] => Some([x.spacing_mm?, y.spacing_mm?, z.spacing_mm?]),
        _ => None,
    }
}
