//! Owns what a DICOM file says of each frame: its place and its scale, from functional groups or from the top.

use super::ADVICE;
use super::coding::Scale;
use super::elements::{Set, Tag};
use super::scale;
use crate::error::{Error, Result};
use std::path::Path;

/// One slice.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Which of the files, and which of its frames.
    pub file: usize,
    pub index: usize,
    /// Distances of rows, then of columns.
    pub pixel_mm: Option<[f64; 2]>,
    pub position_mm: Option<[f64; 3]>,
    /// The last decimal that positions are written to.
    pub digit_mm: f64,
    /// Unit vectors along a row, then along a column.
    pub directions: Option<[f64; 6]>,
    pub location_mm: Option<f64>,
    pub instance: Option<f64>,
    /// Distance to the next slice, or the thickness.
    pub distance_mm: Option<f64>,
    pub scale: Scale,
}

/// Functional groups of one frame: its own, then those shared by all.
struct Groups<'a, 'b> {
    own: Option<&'b Set<'a>>,
    shared: Option<&'b Set<'a>>,
    top: &'b Set<'a>,
}

impl<'a, 'b> Groups<'a, 'b> {
    /// Where an attribute is looked up: in the group that it belongs to, else at the top.
    fn of(&self, group: Tag, tag: Tag) -> &'b Set<'a> {
        let has = |set: &&'b Set<'a>| set.get(tag).is_some();
        let inner = |set: Option<&'b Set<'a>>| set.and_then(|s| s.item(group)).filter(has);
        inner(self.own)
            .or_else(|| inner(self.shared))
            .unwrap_or(self.top)
    }

    fn decimals<const N: usize>(&self, group: Tag, tag: Tag) -> Option<[f64; N]> {
        self.of(group, tag).decimals(tag)?.try_into().ok()
    }
}

const POSITION: [Tag; 2] = [[0x20, 0x9113], [0x20, 0x32]];
const ORIENTATION: [Tag; 2] = [[0x20, 0x9116], [0x20, 0x37]];
const MEASURES: Tag = [0x28, 0x9110];

pub fn frames(
    set: &Set,
    path: &Path,
    file: usize,
    count: usize,
    signed: bool,
) -> Result<Vec<Frame>> {
    let own = set.items([0x5200, 0x9230]);
    if !own.is_empty() && own.len() != count {
        return Err(Error::file(
            path,
            format!(
                "describes {} frames and says that it holds {count}",
                own.len()
            ),
            ADVICE,
        ));
    }
    let offsets = match set.decimals([0x3004, 0xC]) {
        Some(offsets) if offsets.len() == count => offsets,
        _ => Vec::new(),
    };
    let backwards = set.decimal([0x18, 0x88]).is_some_and(|mm| mm < 0.0);
    if count > 1 && own.is_empty() && offsets.is_empty() && backwards {
        return Err(Error::file(
            path,
            "has a SpacingBetweenSlices below zero: its frames run against their normal",
            ADVICE,
        ));
    }
    (0..count)
        .map(|index| {
            let groups = Groups {
                own: own.get(index),
                shared: set.item([0x5200, 0x9229]),
                top: set,
            };
            let mut frame = frame(&groups, path, (file, index), signed)?;
            if count > 1 && own.is_empty() {
                frame.shift(offsets.get(index).copied());
            }
            Ok(frame)
        })
        .collect()
}

fn frame(
    groups: &Groups,
    path: &Path,
    (file, index): (usize, usize),
    signed: bool,
) -> Result<Frame> {
    let top = groups.top;
    let directions = groups.decimals::<6>(ORIENTATION[0], ORIENTATION[1]);
    let directions = directions.filter(|d| d.iter().any(|v| *v != 0.0));
    if directions.is_some_and(|d| !are_unit(&d)) {
        return Err(Error::file(
            path,
            format!(
                "ImageOrientationPatient should be two unit vectors at a right angle, it is {directions:?}"
            ),
            ADVICE,
        ));
    }
    let distance = |tag| groups.decimals::<1>(MEASURES, tag).map(|[v]| v);
    let positive = |v: &f64| *v > 0.0;
    let placed = groups.of(POSITION[0], POSITION[1]);
    Ok(Frame {
        file,
        index,
        pixel_mm: groups
            .decimals(MEASURES, [0x28, 0x30])
            .filter(|p: &[f64; 2]| p.iter().all(positive)),
        position_mm: groups.decimals(POSITION[0], POSITION[1]),
        digit_mm: last_digit(&placed.text(POSITION[1]).unwrap_or_default()),
        directions,
        location_mm: top.decimal([0x20, 0x1041]),
        instance: top.decimal([0x20, 0x13]),
        distance_mm: distance([0x18, 0x88])
            .or_else(|| distance([0x18, 0x50]))
            .map(f64::abs)
            .filter(positive),
        scale: scale::scale(groups.of(scale::GROUP, scale::SLOPE), top, path, signed)?,
    })
}

impl Frame {
    /// A frame of an older multi-frame file lies along the normal of the first, by its offset. Without offsets only the first
    /// frame's place is known.
    fn shift(&mut self, offset_mm: Option<f64>) {
        let (Some(offset), Some(position), Some(directions)) =
            (offset_mm, self.position_mm, self.directions)
        else {
            self.location_mm = None;
            if self.index > 0 {
                self.position_mm = None;
            }
            return;
        };
        let normal = normal(&directions);
        self.position_mm = Some(std::array::from_fn(|r| position[r] + offset * normal[r]));
    }
}

fn are_unit(d: &[f64; 6]) -> bool {
    let (a, b) = ([d[0], d[1], d[2]], [d[3], d[4], d[5]]);
    (dot(a, a) - 1.0).abs() < 1e-2 && (dot(b, b) - 1.0).abs() < 1e-2 && dot(a, b).abs() < 1e-2
}

/// 0.01 for `12.3\0.25`: the last decimal of the number with most. Numbers with an exponent count as exact.
fn last_digit(text: &str) -> f64 {
    if text.contains(['e', 'E']) {
        return 0.0;
    }
    let decimals = text
        .split('\\')
        .map(|w| w.trim().split_once('.').map_or(0, |(_, d)| d.len()));
    10f64.powi(-(decimals.max().unwrap_or(0).min(17) as i32))
}

pub fn normal(d: &[f64; 6]) -> [f64; 3] {
    let [a, b, c, x, y, z] = *d;
    let n = [b * z - c * y, c * x - a * z, a * y - b * x];
    let length = dot(n, n).sqrt();
    n.map(|v| v / length)
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
