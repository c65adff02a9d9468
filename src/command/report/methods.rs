//! Owns what the folders of scans say of how they were segmented and solved, for the methods section.

use super::{Folder, Folders};
use crate::command::answer;
use crate::grid::Axis;
use crate::pipeline::segment::Align;
use crate::record::results;
use crate::record::specimen::SegmentRecord;
use crate::report::Report;
use crate::report::methods::{Criterion, Known, Segmented, Threshold, condition};

/// What is known of the scans of `report`; `failed` further scans have no results.
pub(super) fn known(report: &Report, folders: &Folders, failed: usize) -> Known {
    let mut known = Known {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        failed,
        ..Known::default()
    };
    let condition = condition(report);
    let mut targets: Vec<Option<f64>> = Vec::new();
    for line in &report.answers.lines {
        let Some(Folder { dir, record }) = folders.get(&line.scan) else {
            continue;
        };
        known.segmented.push(segmented(record));
        let target = condition
            .as_ref()
            .and_then(|condition| answer::facts(dir, record).targets.of(condition));
        if !targets.contains(&target) {
            targets.push(target);
        }
        for (pistoia, labels) in results::criteria(dir) {
            let criterion = Criterion { pistoia, labels };
            if !known.criteria.contains(&criterion) {
                known.criteria.push(criterion);
            }
        }
    }
    // Of scans with different targets each row says its own.
    if let [target] = targets[..] {
        known.target = target;
    }
    known
}

fn segmented(record: &SegmentRecord) -> Segmented {
    let (settings, results) = (&record.settings, &record.results);
    let all = results.bone_voxels + results.removed_voxels;
    Segmented {
        scan: record.scan.clone(),
        voxel_mm: results.spacing_mm,
        placed: placed(record),
        gaussian_voxels: settings.gaussian_voxels,
        threshold: match (settings.labels.is_empty(), settings.otsu) {
            (false, _) => Threshold::Labels(settings.labels.clone()),
            (true, true) => Threshold::Otsu { at: results.lower },
            (true, false) => Threshold::Window {
                lower: results.lower,
                upper: results.upper,
            },
        },
        unit: record.input.unit.clone(),
        tv_definition: results.tv_definition.clone(),
        plane_cut_mm: settings.plane_cut_mm,
        keep_all: settings.keep_all,
        removed_share: match all {
            0 => 0.0,
            all => results.removed_voxels as f64 / all as f64,
        },
        has_morphometry: results.morphometry.is_some(),
    }
}

/// What was done to the scan before its bone was found, in this order.
fn placed(record: &SegmentRecord) -> Vec<String> {
    let settings = &record.settings;
    let mut done = Vec::new();
    if let Some(crop) = settings.crop {
        let ranges = crop.map(|[first, end]| format!("{first} to {}", end - 1));
        done.push(format!("cropped to voxels {}", ranges.join(", ")));
    }
    if settings.turn != Axis::Z {
        done.push(format!(
            "turned so that their {} axis became z",
            settings.turn.name()
        ));
    }
    if let Some([x, y, z]) = settings.resample_mm {
        done.push(match x == y && y == z {
            true => format!("resampled to voxels of {x} mm"),
            false => format!("resampled to voxels of {x} × {y} × {z} mm"),
        });
    }
    match settings.align {
        Some(Align::Fabric) => done.push(
            "rotated so that the direction of the longest mean intercept length became z"
                .to_owned(),
        ),
        Some(Align::Direction([x, y, z])) => {
            done.push(format!(
                "rotated so that the direction ({x}, {y}, {z}) became z"
            ));
        }
        None => {}
    }
    done
}
