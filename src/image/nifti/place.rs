//! Owns where a NIfTI file's voxels are: unit of length, affine, voxel size.

use super::header::{Header, Version};
use crate::error::{Error, Result};
use crate::format::length;
use crate::format::orient::{Affine, column_norms};
use std::path::Path;

/// Spacing and affine in millimetres.
pub struct Place {
    pub spacing_mm: Option<[f64; 3]>,
    pub affine: Option<Affine>,
}

pub fn place(h: &Header, path: &Path, notes: &mut Vec<String>) -> Result<Place> {
    let to_mm = unit_mm(h, path, notes)?;
    let affine = affine(h, notes).map(|rows| rows.map(|row| row.map(|v| v * to_mm)));
    if affine.is_none() {
        notes.push(match h.version {
            Version::Analyze => "Analyze 7.5 does not say which side is left: axes are kept as stored".into(),
            _ => "the file holds no orientation (neither sform nor qform is set): axes are kept as stored".into(),
        });
    }
    Ok(Place {
        spacing_mm: spacing(h, affine.as_ref(), to_mm, notes),
        affine,
    })
}

/// Millimetres per unit of length in the header.
fn unit_mm(h: &Header, path: &Path, notes: &mut Vec<String>) -> Result<f64> {
    if !h.vox_units.is_empty() {
        return length::millimetres_per(&h.vox_units).ok_or_else(|| {
            Error::file(
                path,
                format!(
                    "gives its voxel size in `{}`, which is no known unit of length",
                    h.vox_units
                ),
                "write vox_units as mm or um, or save it as NIfTI",
            )
        });
    }
    match h.xyzt_units & 7 {
        1 => Ok(1000.0),
        2 => Ok(1.0),
        3 => Ok(1e-3),
        0 => {
            notes.push("the header does not say its unit of length: millimetres assumed".into());
            Ok(1.0)
        }
        code => Err(Error::file(
            path,
            format!(
                "gives its voxel size in NIfTI unit {code}, which does not exist (1 is metre, 2 millimetre, 3 micrometre)"
            ),
            "set xyzt_units and save it again",
        )),
    }
}

/// sform if set, else qform if set, else none: the order that the standard recommends for aligned images. One that is not
/// finite or singular counts as not set.
fn affine(h: &Header, notes: &mut Vec<String>) -> Option<Affine> {
    let usable = |rows: &Affine| {
        let finite = rows.iter().flatten().all(|v| v.is_finite());
        finite && column_norms(rows).iter().all(|&l| l > 0.0)
    };
    let sform = (h.sform_code > 0).then_some(h.srow);
    let qform = (h.qform_code > 0).then(|| qform(h));
    match (sform.filter(usable), qform.filter(usable)) {
        (Some(s), Some(q)) => {
            if let Some(degrees) = angle_deg(&s, &q).filter(|angle| *angle > 0.5) {
                notes.push(format!(
                    "sform and qform differ by {degrees:.1}°: the sform is used"
                ));
            }
            Some(s)
        }
        (s, q) => s.or(q),
    }
}

/// The largest angle between the same axis in both.
fn angle_deg(a: &Affine, b: &Affine) -> Option<f64> {
    let (na, nb) = (column_norms(a), column_norms(b));
    (0..3)
        .map(|c| {
            let dot: f64 = (0..3).map(|r| a[r][c] * b[r][c]).sum();
            (dot / (na[c] * nb[c])).clamp(-1.0, 1.0).acos().to_degrees()
        })
        .reduce(f64::max)
}

/// Rotation of a quaternion times spacing, third column times qfac (`nifti1.h`, method 2).
pub(super) fn qform(h: &Header) -> Affine {
    let [b, c, d] = h.quatern;
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let r = [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c - a * d),
            2.0 * (b * d + a * c),
        ],
        [
            2.0 * (b * c + a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d - a * b),
        ],
        [
            2.0 * (b * d - a * c),
            2.0 * (c * d + a * b),
            a * a + d * d - b * b - c * c,
        ],
    ];
    let qfac = if h.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let scale = [h.pixdim[1], h.pixdim[2], h.pixdim[3] * qfac];
    std::array::from_fn(|i| {
        [
            r[i][0] * scale[0],
            r[i][1] * scale[1],
            r[i][2] * scale[2],
            h.qoffset[i],
        ]
    })
}

fn spacing(
    h: &Header,
    affine: Option<&Affine>,
    to_mm: f64,
    notes: &mut Vec<String>,
) -> Option<[f64; 3]> {
    let pixdim: [f64; 3] = std::array::from_fn(|a| h.pixdim[a + 1].abs() * to_mm);
    let usable = |s: &[f64; 3]| s.iter().all(|&v| v.is_finite() && v > 0.0);
    let found = match affine.map(column_norms).filter(usable) {
        Some(s) if !usable(&pixdim) || (0..3).any(|a| (s[a] / pixdim[a] - 1.0).abs() > 1e-3) => {
            notes.push(format!(
                "pixdim {pixdim:?} and the affine's spacing {s:?} differ: the affine is used"
            ));
            s
        }
        _ if usable(&pixdim) => pixdim,
        _ => return None,
    };
    if found == [1.0; 3] && h.xyzt_units & 7 == 0 && h.vox_units.is_empty() {
        notes.push(
            "voxel size 1 × 1 × 1 without a unit is what programs write when they do not know it: give --spacing".into(),
        );
    }
    Some(found)
}
