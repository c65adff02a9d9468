//! Owns what a methods section says of the scans and of how bone was found in them.

use super::words::{by_scan, counted, list, percent, scans, settings};
use super::{Known, Segmented, Threshold};
use crate::report::{Report, distinct};

pub fn text(report: &Report, known: &Known) -> String {
    let mut text = studied(report, known);
    let all = &known.segmented[..];
    if all.is_empty() {
        return text;
    }
    text += &format!(" {}.", voxels(all));
    text += &by_scan(all, |s| &s.scan, placed);
    text += &by_scan(all, |s| &s.scan, smoothed);
    text += &thresholds(all);
    text += &by_scan(all, |s| &s.scan, |s| Some(volume_of_interest(s)));
    text += &by_scan(all, |s| &s.scan, flat_ends);
    text += &connected(all);
    if all.iter().any(|s| s.has_morphometry) {
        text += " Trabecular thickness and separation were measured by largest spheres (Hildebrand and Rüegsegger 1997), connectivity density by the Euler characteristic, and the degree of anisotropy by mean intercept lengths.";
    }
    text
}

/// How many scans, of whom, with which program.
fn studied(report: &Report, known: &Known) -> String {
    let lines = &report.answers.lines;
    let named = distinct(lines.iter().filter_map(|l| l.subject.as_deref()));
    let groups = distinct(lines.iter().filter_map(|l| l.group.as_deref()));
    let mut text = counted(lines.len(), "scan");
    if !named.is_empty() {
        text += &format!(" of {}", counted(named.len(), "subject"));
    }
    if !groups.is_empty() {
        let size = |group: &&str| {
            let own = || lines.iter().filter(|l| l.group.as_deref() == Some(group));
            let subjects = distinct(own().filter_map(|l| l.subject.as_deref())).len();
            let of = match subjects {
                0 => String::new(),
                n => format!(" of {}", counted(n, "subject")),
            };
            format!("{group} ({}{of})", counted(own().count(), "scan"))
        };
        let sizes: Vec<String> = groups.iter().map(size).collect();
        text += &format!(" in {}: {},", counted(groups.len(), "group"), list(&sizes));
    }
    let was = match lines.len() {
        1 => "was",
        _ => "were",
    };
    text += &format!(" {was} analysed with bonepd-ct {}.", known.version);
    if known.failed > 0 {
        text += &format!(
            " {} could not be analysed.",
            counted(known.failed, "further scan")
        );
    }
    let apart: Vec<&str> = report.answers.apart.iter().map(String::as_str).collect();
    if !apart.is_empty() {
        text += &format!(
            " {} of these ({}) had other conditions than those below and are in no comparison.",
            apart.len(),
            scans(&apart)
        );
    }
    text
}

fn voxels(all: &[Segmented]) -> String {
    let cubes = all
        .iter()
        .all(|s| s.voxel_mm[0] == s.voxel_mm[1] && s.voxel_mm[1] == s.voxel_mm[2]);
    match cubes {
        true => format!(
            "The voxel size was {} mm",
            settings(all.iter().map(|s| s.voxel_mm[0]))
        ),
        false => {
            let along = |a: usize| settings(all.iter().map(|s| s.voxel_mm[a]));
            format!(
                "The voxel size was {} × {} × {} mm",
                along(0),
                along(1),
                along(2)
            )
        }
    }
}

fn placed(s: &Segmented) -> Option<String> {
    let verb = format!("Scans were {}", list(&s.placed));
    (!s.placed.is_empty()).then_some(verb)
}

fn smoothed(s: &Segmented) -> Option<String> {
    let width = settings([s.gaussian_voxels]);
    let unit = match s.gaussian_voxels == 1.0 {
        true => "voxel",
        false => "voxels",
    };
    Some(match (&s.threshold, s.gaussian_voxels > 0.0) {
        (Threshold::Labels(_), _) => return None,
        (_, true) => {
            format!("Grey values were smoothed with a Gaussian filter (σ = {width} {unit})")
        }
        (_, false) => "Grey values were not filtered".to_owned(),
    })
}

/// Thresholds that are listed with their scans; of more there is a range for each kind.
const MOST_THRESHOLDS: usize = 4;

fn unit(s: &Segmented) -> String {
    match s.unit.as_deref() {
        None | Some("native") => "in the units of the image".to_owned(),
        Some(unit) => unit.to_owned(),
    }
}

/// How bone was found, scan by scan, or a sentence for each kind of threshold and unit.
fn thresholds(all: &[Segmented]) -> String {
    let own = |s: &Segmented| threshold(&[s], &unit(s));
    if distinct(all.iter().map(own)).len() > MOST_THRESHOLDS {
        return thresholds_by_kind(all) + " The value of each scan stands in its `segment.json`.";
    }
    let otsu = otsu_by_scan(all);
    let is_said =
        |s: &Segmented| otsu.is_some() && matches!(s.threshold, Threshold::Otsu { at: Some(_) });
    let others = by_scan(all, |s| &s.scan, |s| (!is_said(s)).then(|| own(s)));
    otsu.unwrap_or_default() + &others
}

/// Otsu's thresholds, each with its scans, in one sentence; None where all are one.
fn otsu_by_scan(all: &[Segmented]) -> Option<String> {
    let value = |s: &Segmented| match s.threshold {
        Threshold::Otsu { at: Some(at) } => Some(format!("{} {}", settings([four(at)]), unit(s))),
        _ => None,
    };
    let values = distinct(all.iter().filter_map(value));
    let pair = |wanted: &String| {
        let own = all.iter().filter(|s| value(s).as_ref() == Some(wanted));
        let names: Vec<&str> = own.map(|s| s.scan.as_str()).collect();
        format!("{wanted} ({})", scans(&names))
    };
    let pairs: Vec<String> = values.iter().map(pair).collect();
    (pairs.len() > 1).then(|| {
        format!(
            " Bone was found by Otsu's threshold (Otsu 1979): {}.",
            list(&pairs)
        )
    })
}

/// Otsu's threshold without digits that follow from the histogram: four are plenty.
fn four(v: f64) -> f64 {
    format!("{v:.3e}").parse().unwrap_or(v)
}

fn thresholds_by_kind(all: &[Segmented]) -> String {
    let kind = |s: &Segmented| (discriminant(&s.threshold), s.unit.clone());
    let kinds = distinct(all.iter().map(kind));
    let alike = kinds.len() == 1;
    let sentence = |k: &(u8, Option<String>)| {
        let of: Vec<&Segmented> = all.iter().filter(|s| kind(s) == *k).collect();
        let names: Vec<&str> = of.iter().map(|s| s.scan.as_str()).collect();
        let words = threshold(&of, &unit(of[0]));
        match alike {
            true => format!(" {words}."),
            false => format!(" {words} (of {}).", scans(&names)),
        }
    };
    kinds.iter().map(sentence).collect()
}

fn discriminant(threshold: &Threshold) -> u8 {
    match threshold {
        Threshold::Window { lower, upper } => {
            u8::from(lower.is_some()) + 2 * u8::from(upper.is_some())
        }
        Threshold::Otsu { .. } => 4,
        Threshold::Labels(_) => 5,
    }
}

/// Of scans whose thresholds are of one kind.
fn threshold(of: &[&Segmented], unit: &str) -> String {
    let bounds = |upper: bool| {
        let bound = |s: &&Segmented| match &s.threshold {
            Threshold::Window { upper: Some(v), .. } if upper => Some(*v),
            Threshold::Window { lower: Some(v), .. } if !upper => Some(*v),
            Threshold::Otsu { at } => at.map(four),
            _ => None,
        };
        settings(of.iter().filter_map(bound))
    };
    match &of[0].threshold {
        Threshold::Labels(_) => {
            let labels = distinct(of.iter().flat_map(|s| match &s.threshold {
                Threshold::Labels(labels) => labels.clone(),
                _ => Vec::new(),
            }));
            let labels: Vec<String> = labels.iter().map(i32::to_string).collect();
            format!(
                "Bone was what a segmentation had labelled {}",
                list(&labels)
            )
        }
        Threshold::Otsu { .. } => format!(
            "Bone was found by Otsu's threshold (Otsu 1979), {} {unit}",
            bounds(false)
        ),
        Threshold::Window { lower, upper } => match (lower, upper) {
            (Some(_), Some(_)) => format!(
                "Voxels with values from {} to {} {unit} were bone",
                bounds(false),
                bounds(true)
            ),
            (Some(_), None) => format!(
                "Voxels with values of {} {unit} or more were bone",
                bounds(false)
            ),
            _ => format!(
                "Voxels with values of {} {unit} or less were bone",
                bounds(true)
            ),
        },
    }
}

fn volume_of_interest(s: &Segmented) -> String {
    match s.tv_definition.as_str() {
        "box" => "The volume of interest was the whole box of the scan".to_owned(),
        other => format!("The volume of interest was: {other}"),
    }
}

fn flat_ends(s: &Segmented) -> Option<String> {
    let tile = settings([s.plane_cut_mm?]);
    Some(format!(
        "Both ends were cut flat, to planes with bone in every tile of {tile} mm that held any"
    ))
}

fn connected(all: &[Segmented]) -> String {
    let says = |s: &Segmented| {
        Some(match s.keep_all {
            true => "All bone was kept, connected or not".to_owned(),
            false => "Only the largest 6-connected component of bone was kept".to_owned(),
        })
    };
    let mut text = by_scan(all, |s| &s.scan, |s| says(s));
    let most = all
        .iter()
        .max_by(|a, b| a.removed_share.total_cmp(&b.removed_share));
    match most.filter(|s| s.removed_share > 0.0) {
        Some(most) if all.len() > 1 => {
            text += &format!(
                " This removed at most {} of a scan's bone voxels ({}).",
                percent(most.removed_share),
                most.scan
            );
        }
        Some(one) => {
            text += &format!(
                " This removed {} of the bone voxels.",
                percent(one.removed_share)
            );
        }
        None => {}
    }
    text
}
