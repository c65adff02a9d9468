//! Owns what a DICOM file says of its frames: size, coding, place and scale of each. Names of persons are not looked at.

use super::compressed::{self, Codec};
use super::elements::{Data, PIXEL_DATA, Set, Tag};
use super::pixels::{Coding, Scale};
use super::scale;
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

pub const ADVICE: &str =
    "convert the series to NIfTI (dcm2niix), or export it again as uncompressed DICOM";

/// The file's elements, however they are coded.
pub fn data(path: &Path) -> Result<Data> {
    let bytes = std::fs::read(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
    })?;
    Data::new(bytes).map_err(|fault| unsound(path, &fault))
}

pub fn unsound(path: &Path, fault: &str) -> Error {
    Error::file(path, format!("is no sound DICOM file: {fault}"), ADVICE)
}

/// A file with pixels.
#[derive(Debug, Clone)]
pub struct Image {
    pub path: PathBuf,
    pub rows: usize,
    pub columns: usize,
    pub series: String,
    pub coding: Coding,
    pub codec: Option<Codec>,
    pub frames: Vec<Frame>,
    /// Stored values that stand for no measurement.
    pub padding: Option<[f32; 2]>,
    pub lossy: bool,
    /// It names further scales of its values, which are not used.
    pub other_scales: bool,
}

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

/// What one file of a folder turned out to be.
#[derive(Debug, Clone)]
pub enum Found {
    Image(Box<Image>),
    /// A directory, a report, a presentation: what it calls itself.
    Other(String),
}

/// Reads all but the pixels of the `file`-th file.
pub fn found(path: &Path, file: usize) -> Result<Found> {
    let data = data(path)?;
    let set = data.elements().map_err(|fault| unsound(path, &fault))?;
    let whole = |tag| set.short(tag).map(usize::from).filter(|v| *v > 0);
    let (Some(rows), Some(columns)) = (whole([0x28, 0x10]), whole([0x28, 0x11])) else {
        let modality = set.text([8, 0x60]).unwrap_or_else(|| "none".into());
        return Ok(Found::Other(format!("modality {modality}")));
    };
    let coding = coding(&set, path)?;
    let codec = match data.is_compressed() {
        true => Some(codec(&data.syntax, path)?),
        false => None,
    };
    if data.syntax == "1.2.840.10008.1.2.2" && coding.bytes == 1 {
        return Err(Error::file(
            path,
            "holds 8-bit pixels in big-endian words, whose order differs from program to program",
            ADVICE,
        ));
    }
    let count = set.decimal([0x28, 8]).unwrap_or(1.0);
    if !(1.0..=65536.0).contains(&count) {
        return Err(Error::file(
            path,
            format!("says that it holds {count} frames"),
            ADVICE,
        ));
    }
    Ok(Found::Image(Box::new(Image {
        path: path.to_path_buf(),
        rows,
        columns,
        series: set.text([0x20, 0xE]).unwrap_or_default(),
        frames: frames(&set, path, file, count as usize, coding.signed)?,
        padding: padding(&set, &coding),
        lossy: set.text([0x28, 0x2110]).as_deref() == Some("01"),
        other_scales: !set.items([0x40, 0x9096]).is_empty(),
        coding,
        codec,
    })))
}

fn codec(syntax: &str, path: &Path) -> Result<Codec> {
    compressed::codec(syntax).ok_or_else(|| {
        Error::file(
            path,
            format!("is compressed as {}, which is not read", compressed::name(syntax)),
            "decompress it (gdcmconv --raw IN OUT, or for JPEG dcmdjpeg), or convert the series to NIfTI (dcm2niix)",
        )
    })
}

/// How one sample is stored.
fn coding(set: &Set, path: &Path) -> Result<Coding> {
    let refused = |found: String, advice: &str| Err(Error::file(path, found, advice));
    let photometric = set.text([0x28, 4]).unwrap_or_else(|| "MONOCHROME2".into());
    let samples = set.short([0x28, 2]).unwrap_or(1);
    if samples != 1 || !photometric.starts_with("MONOCHROME") {
        return refused(
            format!(
                "is a colour image ({photometric}, {samples} samples a pixel), grey values are expected"
            ),
            "remove it from the folder, or export grey values",
        );
    }
    if set.get([0x7FE0, 8]).is_some() || set.get([0x7FE0, 9]).is_some() {
        return refused(
            "holds pixels that are floating-point numbers, which are not read".into(),
            ADVICE,
        );
    }
    let allocated = set.short([0x28, 0x100]).unwrap_or(0);
    match allocated {
        8 | 16 => {}
        1 => {
            return refused(
                "holds 1-bit pixels (a segmentation), which are not read".into(),
                "convert it to NIfTI (dcmqi: segimage2itkimage)",
            );
        }
        other => {
            return refused(
                format!("holds {other}-bit pixels, which are not read"),
                ADVICE,
            );
        }
    }
    if set.get(PIXEL_DATA).is_none() {
        return refused("holds no pixels: it may be cut off".into(), ADVICE);
    }
    let stored = set.short([0x28, 0x101]).unwrap_or(allocated);
    let high = set.short([0x28, 0x102]).unwrap_or(stored.saturating_sub(1));
    if stored == 0 || stored > allocated || high >= allocated || high + 1 < stored {
        return refused(
            format!("says that {stored} bits up to bit {high} are stored of {allocated}"),
            ADVICE,
        );
    }
    Ok(Coding {
        bytes: usize::from(allocated / 8),
        stored: u32::from(stored),
        high: u32::from(high),
        signed: set.short([0x28, 0x103]) == Some(1),
    })
}

fn padding(set: &Set, coding: &Coding) -> Option<[f32; 2]> {
    let number = |tag| {
        let v = set.short(tag)?;
        Some(match coding.signed {
            true => f32::from(v as i16),
            false => f32::from(v),
        })
    };
    let value = number([0x28, 0x120])?;
    let limit = number([0x28, 0x121]).unwrap_or(value);
    Some([value.min(limit), value.max(limit)])
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

fn frames(set: &Set, path: &Path, file: usize, count: usize, signed: bool) -> Result<Vec<Frame>> {
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
