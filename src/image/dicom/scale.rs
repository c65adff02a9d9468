//! Owns what stored values of a DICOM frame mean: a line or a table to a unit.

use super::ADVICE;
use super::coding::{Scale, Table};
use super::elements::{Set, Tag};
use crate::error::{Error, Result};
use crate::format::calibration::unit_named;
use std::path::Path;

/// The functional group of enhanced files that holds the scale.
pub const GROUP: Tag = [0x28, 0x9145];
pub const SLOPE: Tag = [0x28, 0x1053];
const INTERCEPT: Tag = [0x28, 0x1052];
const KIND: Tag = [0x28, 0x1054];
const TABLE: Tag = [0x28, 0x3000];

/// `set` is where the slope is, `top` the file's own elements, `signed` whether stored values are.
pub fn scale(set: &Set, top: &Set, path: &Path, signed: bool) -> Result<Scale> {
    if let Some(item) = top.item(TABLE) {
        return Ok(Scale {
            slope: 1.0,
            intercept: 0.0,
            table: Some(table(item, path, signed)?),
            unit: item.text([0x28, 0x3004]).and_then(|word| unit_named(&word)),
        });
    }
    let number = |tag, default| match set.text(tag) {
        None => Ok(default),
        Some(text) => set.decimal(tag).ok_or_else(|| {
            Error::file(
                path,
                format!("its rescale slope or intercept is `{text}`, which is no number"),
                ADVICE,
            )
        }),
    };
    let (slope, intercept) = (number(SLOPE, 1.0)?, number(INTERCEPT, 0.0)?);
    if slope == 0.0 {
        return Err(Error::file(
            path,
            "has a rescale slope of 0, which makes all values one",
            ADVICE,
        ));
    }
    let scaled = set.get(SLOPE).is_some() || set.get(INTERCEPT).is_some();
    let unit = match set.text(KIND) {
        Some(word) => unit_named(&word),
        None => (scaled && is_ct(top)).then(|| "HU".to_string()),
    };
    Ok(Scale {
        slope,
        intercept,
        table: None,
        unit,
    })
}

/// Where a CT does not say what it is scaled to, it is HU (PS3.3, C.8.2.1).
fn is_ct(top: &Set) -> bool {
    let class = top.text([8, 0x16]).unwrap_or_default();
    let ct = [
        "1.2.840.10008.5.1.4.1.1.2",
        "1.2.840.10008.5.1.4.1.1.2.1",
        "1.2.840.10008.5.1.4.1.1.2.2",
    ];
    top.text([8, 0x60]).as_deref() == Some("CT") || ct.contains(&class.as_str())
}

/// Modality LUT: its first stored value, and the values from there on.
fn table(item: &Set, path: &Path, signed: bool) -> Result<Table> {
    let values = item.shorts([0x28, 0x3006]);
    let (Some(&[count, first, _]), false) = (
        item.shorts([0x28, 0x3002]).first_chunk::<3>(),
        values.is_empty(),
    ) else {
        return Err(Error::file(
            path,
            "has a Modality LUT without its table",
            ADVICE,
        ));
    };
    let count = if count == 0 {
        65536
    } else {
        usize::from(count)
    };
    if values.len() < count {
        return Err(Error::file(
            path,
            format!(
                "has a Modality LUT of {} values where it promises {count}",
                values.len()
            ),
            ADVICE,
        ));
    }
    Ok(Table {
        first: match signed {
            true => i32::from(first as i16),
            false => i32::from(first),
        },
        values: values[..count].iter().map(|&v| f32::from(v)).collect(),
    })
}
