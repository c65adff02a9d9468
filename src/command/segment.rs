//! Owns `segment` on disk: a scan in, `mask.nii.gz`, `segment.json` and pictures out, and reading them back.

use crate::draw::{map, picture, still, view};
use crate::error::{Error, Result};
use crate::format::calibration::GreyUnit;
use crate::format::orient::Turn;
use crate::grid::{Axis, Grid};
use crate::image::scan::{self, Reading, Scan};
use crate::io::atomic;
use crate::machine::session::Session;
use crate::mask::unmeasured::{self, Hidden};
use crate::pipeline::segment as stage;
use crate::pipeline::segment::{SegmentParams, SegmentSummary, Voi};
use crate::record::results;
use crate::record::specimen::{self, SegmentedScan};
pub use crate::record::specimen::{Input, SegmentRecord};
use crate::volume::{Specimen, Volume};
use rayon::prelude::*;
use std::path::Path;

/// Segments `input` (a file, or a folder of slices) into `dir`. What is up to date (same input, settings and version)
/// is kept unless the session forces. `name` overrides the scan's own.
pub fn segment(
    input: &Path,
    dir: &Path,
    name: Option<&str>,
    params: &SegmentParams,
    session: &Session,
) -> Result<SegmentRecord> {
    refuse_own_input(input, dir)?;
    if !session.dry_run {
        atomic::sweep(dir);
    }
    let voi_blake3 = match &params.voi {
        Voi::Mask(path) => Some(scan::hash(path)?),
        _ => None,
    };
    let kept = specimen::record(dir).filter(|kept| {
        let is_of_it = name.is_none_or(|name| name == kept.scan);
        !session.force && is_of_it && is_whole(kept, dir, params)
    });
    let (blake3, whole) = match kept {
        Some(kept) => {
            let blake3 = scan::hash(input)?;
            if kept.input.blake3 == blake3 && kept.input.voi_blake3 == voi_blake3 {
                session.say(format!("{}: up to date", dir.display()));
                results::set_aside_stale(dir, session);
                return Ok(kept);
            }
            (blake3, read(input, name, params, session)?)
        }
        // Both at once: what one has read from the disk, the other finds in memory.
        None => {
            let read = || read(input, name, params, session);
            let (blake3, whole) = rayon::join(|| scan::hash(input), read);
            (blake3?, whole?)
        }
    };
    let segmented = whole.segmented(params)?;
    let record = whole.record(params, segmented.summary, blake3, voi_blake3);
    say(&record, session);
    if !session.dry_run {
        write(dir, &record, &segmented.scan, &segmented.specimen)?;
        results::set_aside_stale(dir, session);
    }
    Ok(record)
}

/// Results among the slices of a scan would be taken for slices later.
fn refuse_own_input(input: &Path, dir: &Path) -> Result<()> {
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if !input.is_dir() || !same(input, dir) {
        return Ok(());
    }
    Err(Error::file(
        dir,
        "is the folder of the scan's own slices: results would lie among them",
        "give another folder with -o",
    ))
}

/// Reads and segments; nothing is written.
///
/// # Errors
/// As [`segment`].
pub fn in_memory(
    input: &Path,
    name: Option<&str>,
    params: &SegmentParams,
    session: &Session,
) -> Result<Specimen> {
    let whole = read(input, name, params, session)?;
    let scan = &whole.scan;
    let warnings = scan.warnings.iter().cloned();
    warnings
        .chain(threshold_in_counts(scan, params))
        .for_each(|warning| session.warn_of(Some(&scan.name), warning));
    Ok(whole.segmented(params)?.specimen)
}

/// Segments values in memory, x fastest, of `n` voxels along x, y, z; nothing is written. `params` have the voxel size, and the
/// volume of interest unless that is the mask `voi` on the same voxels.
///
/// # Errors
/// As [`segment`].
pub fn of_values(
    (n, values): ([usize; 3], Vec<f32>),
    voi: Option<Vec<u8>>,
    name: &str,
    params: &SegmentParams,
    session: &Session,
) -> Result<SegmentedScan> {
    params.check()?;
    if params.raw.is_some() || params.units.is_some() {
        return Err(Error::setting(
            "raw, units",
            "they say how a file is read, and these values are in memory",
            "leave them out",
        ));
    }
    let spacing_mm = params.spacing_mm.ok_or_else(|| {
        let advice = "give it in millimetres (for example 0.0195)";
        Error::setting("spacing_mm", "an array has no voxel size", advice)
    })?;
    let grid = Grid::new(n, spacing_mm);
    let voi = voi.map(|voxels| Volume::from_vec(grid, voxels));
    let scan = scan::of_values(name, Volume::from_vec(grid, values));
    let whole = whole(scan, voi, params, session)?;
    let segmented = whole.segmented(params)?;
    let specimen = segmented.specimen;
    let record = whole.record(params, segmented.summary, String::new(), None);
    say(&record, session);
    Ok(SegmentedScan::in_memory(specimen, record))
}

/// A scan that was read, and what goes with it.
struct Whole {
    scan: Scan,
    /// The mask that is its volume of interest, if one is.
    voi_mask: Option<Volume<u8>>,
    /// Voxels that are no measurement, which are NaN in the scan now.
    hidden: Option<Hidden>,
}

impl Whole {
    fn segmented(&self, params: &SegmentParams) -> Result<stage::Segmented<'_>> {
        stage::segment_measured(
            &self.scan.name,
            &self.scan.volume,
            params,
            self.voi_mask.as_ref(),
            self.hidden.as_ref(),
        )
    }

    /// What was segmented, how, and what came out.
    fn record(
        &self,
        params: &SegmentParams,
        mut summary: SegmentSummary,
        blake3: String,
        voi_blake3: Option<String>,
    ) -> SegmentRecord {
        let scan = &self.scan;
        let warnings = &mut summary.warnings;
        warnings.extend(scan.warnings.iter().cloned());
        warnings.extend(threshold_in_counts(scan, params));
        warnings.extend(values_out_of_unit(scan, params));
        SegmentRecord {
            program: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
            scan: scan.name.clone(),
            input: Input {
                path: scan.path.clone(),
                blake3,
                voi_blake3,
                format: scan.format.clone(),
                unit: scan.unit.clone(),
                axes: axes(scan, params),
                notes: scan.notes.clone(),
            },
            settings: params.clone(),
            results: summary,
        }
    }
}

fn read(
    input: &Path,
    name: Option<&str>,
    params: &SegmentParams,
    session: &Session,
) -> Result<Whole> {
    let mut scan = scan::read_as(input, &reading(params))?;
    if let Some(name) = name {
        scan.name = name.to_owned();
    }
    whole(scan, None, params, session)
}

/// The scan with all that its segmentation takes; `voi` is its volume of interest where that was read before.
fn whole(
    mut scan: Scan,
    voi: Option<Volume<u8>>,
    params: &SegmentParams,
    session: &Session,
) -> Result<Whole> {
    stage::refuse_impossible_voxels(scan.volume.grid.spacing_mm)?;
    let voi_mask = match &params.voi {
        _ if voi.is_some() => voi,
        Voi::Mask(path) => {
            let mut notes = Vec::new();
            let mask = stage::laid::on(&scan, path, &mut notes)?;
            scan.notes.extend(notes);
            Some(specimen::mask_of(&mask))
        }
        _ => None,
    };
    scan.notes
        .iter()
        .for_each(|note| session.note_of(&scan.name, note));
    let hidden = unmeasured::hide(scan.volume.as_mut_slice(), scan.padding);
    Ok(Whole {
        scan,
        voi_mask,
        hidden,
    })
}

fn reading(params: &SegmentParams) -> Reading {
    Reading {
        spacing_mm: params.spacing_mm,
        unit: params.units,
        raw: params.raw,
    }
}

/// A threshold that was meant in HU and taken in a scanner's counts selects something else, and nothing looks amiss: said
/// unless counts were asked for.
fn threshold_in_counts(scan: &Scan, params: &SegmentParams) -> Option<String> {
    let calibration = scan.calibration?;
    let stored = scan.unit.as_deref() == Some("native");
    if !stored || !params.has_window() || params.units == Some(GreyUnit::Native) {
        return None;
    }
    let bounds = [("lower", params.lower), ("upper", params.upper)];
    let said = |line: Option<([f64; 2], &str)>| -> String {
        let words = bounds.iter().filter_map(|&(name, bound)| match line {
            None => Some(format!("{name} {}", bound?)),
            Some(([slope, intercept], unit)) => {
                Some(format!("{name} {:.1} {unit}", slope * bound? + intercept))
            }
        });
        words.collect::<Vec<_>>().join(", ")
    };
    let hu = calibration.line(GreyUnit::Hu, &scan.path).ok();
    let counts = said(None);
    Some(match hu {
        Some(line) => format!(
            "the threshold ({counts}) was taken in the scanner's stored counts, not in HU: by the file's calibration it is {}. If it was meant in HU, give --units hu (in a recipe: units = \"hu\"); for mg HA/cm³ mgha, and native if counts are meant",
            said(Some(line))
        ),
        None => format!(
            "the threshold ({counts}) was taken in the scanner's stored counts: the file holds no calibration to HU. Give it in counts, with --units native, or a file that kept its calibration"
        ),
    })
}

/// From the file's axes to those of the specimen. A rotated specimen has a grid of its own: it is written as it is.
fn axes(scan: &Scan, params: &SegmentParams) -> Turn {
    if params.align.is_some() {
        return Turn::default();
    }
    let to_z = Turn {
        from: std::array::from_fn(|a| (params.turn.index() + 1 + a) % 3),
        ..Turn::default()
    };
    scan.turn.then(&to_z)
}

/// Values that cannot be in the unit that was asked for: an export that scaled them, or a header that lost its slope.
fn values_out_of_unit(scan: &Scan, params: &SegmentParams) -> Option<String> {
    let (name, low, high) = match (params.units?, scan.unit.as_deref()) {
        (GreyUnit::Hu, _) | (GreyUnit::HuWhereKnown, Some("HU")) => ("HU", -5000.0, 40_000.0),
        (GreyUnit::Mgha, _) => ("mg HA/cm³", -2000.0, 10_000.0),
        _ => return None,
    };
    let values = scan.volume.as_slice().par_iter().filter(|v| v.is_finite());
    let outside = values.filter(|v| !(low..=high).contains(*v)).count();
    let share = outside as f64 / scan.volume.grid.len() as f64;
    (share > 0.01).then(|| {
        format!(
            "{:.0} % of the values lie outside {low} to {high} {name}, where bone, water and air are: check the unit (--units) and how the scan was exported",
            100.0 * share
        )
    })
}

/// The specimen that `segment` left in `dir`.
///
/// # Errors
/// No segmented scan there, a damaged one.
pub fn load(dir: &Path) -> Result<Specimen> {
    Ok(specimen::load(dir)?.specimen)
}

/// Whether what is kept was made with these settings by this version, and is all there.
fn is_whole(kept: &SegmentRecord, dir: &Path, params: &SegmentParams) -> bool {
    kept.version == env!("CARGO_PKG_VERSION")
        && kept.settings == *params
        && dir.join(specimen::MASK).is_file()
        && [specimen::PICTURE, specimen::STILL, specimen::VIEW]
            .iter()
            .all(|picture| dir.join(picture).is_file())
        && (!params.keeps_grey() || dir.join(specimen::GREY).is_file())
}

fn write(
    dir: &Path,
    record: &SegmentRecord,
    scan: &Volume<f32>,
    specimen: &Specimen,
) -> Result<()> {
    atomic::create_dir(dir)?;
    // An old record must not vouch for a new mask, should the program be stopped between the two.
    let _ = std::fs::remove_file(dir.join(specimen::RECORD));
    pictures(dir, scan, specimen)?;
    specimen::write(dir, specimen, record)
}

/// The specimen's long axis is z whatever it was in the scan.
fn pictures(dir: &Path, scan: &Volume<f32>, specimen: &Specimen) -> Result<()> {
    let bone = &specimen.bone;
    picture::write(&dir.join(specimen::PICTURE), scan, bone)?;
    map::write_shaded_png(&dir.join(specimen::STILL), still::bone(bone, Axis::Z))?;
    let view = view::page(&specimen.name, bone, Axis::Z, None);
    atomic::write(&dir.join(specimen::VIEW), view)?;
    // Sites of lattices of another mask.
    let _ = std::fs::remove_file(dir.join(specimen::SITES));
    Ok(())
}

fn say(record: &SegmentRecord, session: &Session) {
    let r = &record.results;
    let [nx, ny, nz] = r.voxels;
    session.say(format!(
        "{}: {nx} × {ny} × {nz} voxels, {}",
        record.scan, record.input.format
    ));
    if r.threshold == "otsu" {
        session.say(format!(
            "{}: Otsu's threshold {}",
            record.scan,
            r.lower.unwrap_or(f64::NAN)
        ));
    }
    if let Some(turn) = &r.rotation {
        let [x, y, z] = turn.direction;
        session.say(format!(
            "{}: turned by {:.1}°: ({x:.3}, {y:.3}, {z:.3}) of the scan is now z; a box of {:.0} % of its volume",
            record.scan,
            turn.angle_deg,
            100.0 * turn.kept
        ));
    }
    if let Some([low, high]) = r.plane_cut_mm {
        session.say(format!(
            "{}: ends cut flat, {low:.3} mm off the lower and {high:.3} mm off the upper",
            record.scan
        ));
    }
    session.result(format!(
        "{}: {} bone voxels, BV {:.4} mm³, TV {:.4} mm³ ({}), BV/TV {:.4}; {} voxels in {} smaller pieces removed",
        record.scan,
        r.bone_voxels,
        r.bv_mm3,
        r.tv_mm3,
        r.tv_definition,
        r.bv_tv,
        r.removed_voxels,
        if r.removed_voxels > 0 { r.components - 1 } else { 0 },
    ));
    if let Some(t) = r.mean_thickness_mm {
        session.result(format!(
            "{}: mean strut thickness about {t:.3} mm (2 BV/BS)",
            record.scan
        ));
    }
    if let Some(m) = &r.morphometry {
        let words = m.listed().map(|(name, value, unit)| match unit {
            "" => format!("{name} {value}"),
            unit => format!("{name} {value} {unit}"),
        });
        session.result(format!("{}: {}", record.scan, words.join(", ")));
    }
    r.notes
        .iter()
        .for_each(|note| session.note_of(&record.scan, note));
    r.warnings
        .iter()
        .for_each(|w| session.warn_of(Some(&record.scan), w));
}
