//! Owns `info`: what is known of a scan, without segmenting it.

use crate::error::Result;
pub use crate::format::calibration::Calibration;
use crate::format::calibration::GreyUnit;
use crate::format::orient::Turn;
use crate::image::array::headerless::Contents;
use crate::image::scan;
use crate::mask::{threshold, unmeasured, usable};
use crate::pipeline::segment::implausible_voxels;
use serde::Serialize;
use std::path::Path;

/// What a scan's file says, and what its grey values are.
#[derive(Debug, Clone, Serialize)]
pub struct ScanInfo {
    /// Name of the scan, as in results.
    pub scan: String,
    /// The format of the file, in words.
    pub format: String,
    /// Along x, y, z of the axes turned to the file's orientation, as all commands use them.
    pub voxels: [usize; 3],
    /// None where the file does not say. Along the same axes.
    pub spacing_mm: Option<[f64; 3]>,
    /// Edges of the whole volume along the same axes; None where the file gives no voxel size.
    pub size_mm: Option<[f64; 3]>,
    /// Unit of the grey values where known.
    pub unit: Option<String>,
    /// Least finite value that is no padding; None where there is none.
    pub grey_min: Option<f32>,
    /// Largest such value.
    pub grey_max: Option<f32>,
    /// Mean of such values.
    pub grey_mean: Option<f64>,
    /// Grey values below which 1, 25, 50, 75 and 99 % of the voxels lie.
    pub grey_percentiles: Vec<f32>,
    /// Otsu's threshold of the values as they are, unsmoothed: a first guess, not a calibration.
    pub otsu: Option<f64>,
    /// Share of the voxels at or above it.
    pub otsu_share: Option<f64>,
    /// Values and their voxels where they are few: a labelled scan or a mask.
    pub labels: Vec<(f32, u64)>,
    /// The file's calibration of grey values; None where it has none.
    pub calibration: Option<Calibration>,
    /// Values from the first to the second stand for no measurement, by the file's word: no part of the numbers above. None
    /// where no voxel holds one.
    pub padding: Option<[f32; 2]>,
    /// Number of voxels that hold padding.
    pub padding_voxels: u64,
    /// Number of NaN and infinite voxels.
    pub non_finite_voxels: u64,
    /// BLAKE3 hash of the scan, in hexadecimal digits.
    pub blake3: String,
    /// Further facts of the format. Names of persons are left out.
    pub details: Vec<(String, String)>,
    /// What a reader must know of the file.
    pub notes: Vec<String>,
    /// One line per fact, for people.
    #[serde(skip)]
    pub lines: Vec<String>,
}

/// Reads a scan and says what is known of it.
///
/// # Errors
/// A file that cannot be read, or that is no scan.
pub fn info(file: &Path) -> Result<ScanInfo> {
    info_of(file, None)
}

/// The same; `raw` is what is in a file without a header.
pub fn info_of(file: &Path, raw: Option<Contents>) -> Result<ScanInfo> {
    let mut stored = scan::stored_as(file, raw)?;
    let hidden = unmeasured::hide(&mut stored.values, stored.padding);
    let (otsu, notes) = otsu(&stored.values);
    stored.notes.extend(notes);
    let mut values = stored.values;
    let all = values.len() as u64;
    values.retain(|v| v.is_finite());
    let padding_voxels = hidden.map_or(0, |h| h.voxels);
    let non_finite = all - values.len() as u64 - padding_voxels;
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64;
    let some = !values.is_empty();
    let above = |t: f64| values.iter().filter(|v| f64::from(**v) >= t).count();
    let otsu_share = otsu.map(|t| above(t) as f64 / values.len() as f64);
    let labels = labels(&values);
    let at = ranked(&mut values, &[0.0, 0.01, 0.25, 0.5, 0.75, 0.99, 1.0]);
    let turn = stored.affine.as_ref().and_then(Turn::of);
    let from = turn.map_or([0, 1, 2], |turn| turn.from);
    let voxels = from.map(|a| stored.n[a]);
    let spacing = stored.spacing_mm.map(|s| from.map(|a| s[a]));
    let size = spacing.map(|s| std::array::from_fn(|a| s[a] * voxels[a] as f64));
    let mut info = ScanInfo {
        scan: scan::name(file),
        format: stored.format,
        voxels,
        spacing_mm: spacing,
        size_mm: size,
        unit: stored.unit,
        grey_min: some.then(|| at[0]),
        grey_max: some.then(|| at[6]),
        grey_mean: some.then_some(mean),
        grey_percentiles: at.get(1..6).unwrap_or_default().to_vec(),
        otsu,
        otsu_share,
        labels,
        calibration: stored.calibration,
        padding: hidden.map(|h| h.range),
        padding_voxels,
        non_finite_voxels: non_finite,
        blake3: scan::hash(file)?,
        details: stored.details,
        notes: stored.notes,
        lines: Vec::new(),
    };
    info.notes
        .extend(spacing.into_iter().flat_map(implausible_voxels));
    if let Some(turn) = turn {
        let words = if turn.is_identity() {
            "canonical (x right, y front, z up)".into()
        } else {
            format!("axes are turned: {}", turn.words())
        };
        info.details.push(("orientation".into(), words));
    }
    if from != [0, 1, 2] {
        let [i, j, k] = stored.n;
        let size = stored.spacing_mm.map(triple);
        let size = size.map_or(String::new(), |size| format!(", {size} mm each"));
        let words = format!("{i} × {j} × {k} voxels along i, j, k{size}");
        info.details.push(("as stored".into(), words));
    }
    info.lines = lines(&info);
    Ok(info)
}

/// Otsu's threshold and what it leaves out; None where there is one value only.
fn otsu(values: &[f32]) -> (Option<f64>, Vec<String>) {
    let Some(ends) = usable::extremes(values) else {
        return (None, Vec::new());
    };
    let (padding, range) = usable::padding(values, &ends);
    let (range, outliers) = usable::without_outliers(values, range, ends.finite);
    let [low, high] = range;
    if low >= high {
        return (None, Vec::new());
    }
    let counts = threshold::histogram(values, low, high);
    let found = threshold::otsu(&counts, f64::from(low), f64::from(high));
    let notes = usable::left_out(&padding, range, outliers, values.len() as u64);
    (found, notes)
}

/// More different values than this are grey values.
const MOST_LABELS: usize = 12;

/// Whole numbers and how often they occur; empty where values are many or broken.
fn labels(values: &[f32]) -> Vec<(f32, u64)> {
    let mut found: Vec<(f32, u64)> = Vec::new();
    for &value in values {
        match found.iter().position(|label| label.0 == value) {
            Some(at) => found[at].1 += 1,
            None if found.len() == MOST_LABELS || value.fract() != 0.0 => return Vec::new(),
            None => found.push((value, 1)),
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// The values at these shares (rising) of the way from the least to the largest. They are reordered; nothing of no values.
fn ranked(values: &mut [f32], shares: &[f64]) -> Vec<f32> {
    let Some(last) = values.len().checked_sub(1) else {
        return Vec::new();
    };
    let (mut found, mut first) = (Vec::new(), 0);
    for share in shares {
        let at = (last as f64 * share).round() as usize;
        // Those before `first` are smaller than all others.
        let (_, value, _) = values[first..].select_nth_unstable_by(at - first, f32::total_cmp);
        found.push(*value);
        first = at;
    }
    found
}

fn triple(v: [f64; 3]) -> String {
    format!("{} × {} × {}", short(v[0]), short(v[1]), short(v[2]))
}

fn lines(info: &ScanInfo) -> Vec<String> {
    let [nx, ny, nz] = info.voxels;
    let mut lines = vec![
        format!("scan         {}", info.scan),
        format!("format       {}", info.format),
        format!("voxels       {nx} × {ny} × {nz}"),
        match info.spacing_mm {
            Some(s) => format!("voxel size   {} mm", triple(s)),
            None => "voxel size   not in the file: give --spacing".into(),
        },
    ];
    lines.extend(
        info.size_mm
            .map(|s| format!("size         {} mm", triple(s))),
    );
    let unit = info.unit.as_deref().unwrap_or("unit not in the file");
    if let (Some(min), Some(max), Some(mean)) = (info.grey_min, info.grey_max, info.grey_mean) {
        lines.push(format!(
            "grey values  {min} to {max}, mean {} ({unit})",
            short(mean)
        ));
        let p = &info.grey_percentiles;
        lines.push(format!(
            "percentiles  1 %: {}, 25 %: {}, 50 %: {}, 75 %: {}, 99 %: {}",
            p[0], p[1], p[2], p[3], p[4]
        ));
    }
    lines.extend(suggestion(info));
    if let Some([low, high]) = info.padding {
        let values = match low == high {
            true => low.to_string(),
            false => format!("{low} to {high}"),
        };
        let voxels: usize = info.voxels.iter().product();
        lines.push(format!(
            "padding      {values} in {:.1} % of the voxels: no measurement (taken as pore)",
            100.0 * info.padding_voxels as f64 / voxels.max(1) as f64
        ));
    }
    if info.non_finite_voxels > 0 {
        lines.push(format!(
            "not finite   {} voxels (taken as pore)",
            info.non_finite_voxels
        ));
    }
    lines.push(format!("blake3       {}", info.blake3));
    lines.extend(
        info.details
            .iter()
            .map(|(key, value)| format!("{key:<12} {value}")),
    );
    lines.extend(info.notes.iter().map(|note| format!("note         {note}")));
    lines
}

/// What to segment by: the labels of a labelled scan, or Otsu's threshold.
fn suggestion(info: &ScanInfo) -> Vec<String> {
    let voxels: usize = info.voxels.iter().product();
    let percent = |count: f64| 100.0 * count / voxels.max(1) as f64;
    let mut lines = Vec::new();
    if !info.labels.is_empty() {
        let words: Vec<String> = info
            .labels
            .iter()
            .map(|&(value, count)| format!("{value}: {:.2} %", percent(count as f64)))
            .collect();
        lines.push(format!("labels       {}", words.join(", ")));
        let bone: Vec<String> = info
            .labels
            .iter()
            .filter(|l| l.0 > 0.0)
            .map(|l| l.0.to_string())
            .collect();
        if !bone.is_empty() && info.labels.len() > 1 {
            lines.push(format!("suggestion   segment --labels {}", bone.join(",")));
        }
        return lines;
    }
    let (Some(t), Some(share)) = (info.otsu, info.otsu_share) else {
        return lines;
    };
    let mut line = format!(
        "Otsu         {}, {:.1} % of the voxels lie above",
        short(t),
        100.0 * share
    );
    let mut lower = "--lower";
    if let Some(calibration) = info.calibration {
        if calibration.line(GreyUnit::Hu, Path::new("")).is_ok() {
            lower = "--units hu --lower";
        }
        for unit in [GreyUnit::Hu, GreyUnit::Mgha] {
            if let Ok(([slope, intercept], name)) = calibration.line(unit, Path::new("")) {
                line += &format!("; {} {name}", short(slope * t + intercept));
            }
        }
    }
    lines.push(line);
    lines.push(format!(
        "suggestion   segment --otsu, or {lower} with the threshold of your protocol; look at segment.png"
    ));
    lines
}

/// Six significant digits, without trailing zeros.
fn short(v: f64) -> f64 {
    if v == 0.0 || !v.is_finite() {
        return v;
    }
    let digits = 5 - v.abs().log10().floor() as i32;
    let scale = 10f64.powi(digits);
    (v * scale).round() / scale
}
