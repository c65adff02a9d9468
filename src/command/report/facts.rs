//! Owns what a scan's page says of its input and its segmentation.

use crate::grid::Axis;
use crate::measure::morphometry::Morphometry;
use crate::record::specimen::SegmentRecord;

/// Key and value, in the order of the page.
pub(super) fn facts(record: &SegmentRecord) -> Vec<(String, String)> {
    let results = &record.results;
    let three = |values: [String; 3]| values.join(" × ");
    let mut facts = vec![
        ("input", record.input.path.display().to_string()),
        ("BLAKE3 of the input", record.input.blake3.clone()),
        ("format", record.input.format.clone()),
        ("voxels", three(results.voxels.map(|n| n.to_string()))),
        (
            "voxel size (mm)",
            three(results.spacing_mm.map(|h| h.to_string())),
        ),
        ("threshold", threshold(record)),
        ("BV (mm³)", format!("{:.4}", results.bv_mm3)),
        (
            "TV (mm³)",
            format!("{:.4}, {}", results.tv_mm3, results.tv_definition),
        ),
        ("BV/TV", format!("{:.4}", results.bv_tv)),
        (
            "voxels removed as unconnected",
            results.removed_voxels.to_string(),
        ),
    ];
    if record.settings.turn != Axis::Z {
        let turned = format!("its {} axis is now z", record.settings.turn.name());
        facts.push(("turned", turned));
    }
    if let Some(r) = results.rotation {
        let [x, y, z] = r.direction;
        let words = format!(
            "by {:.1}°, ({x:.3}, {y:.3}, {z:.3}) is now z; a box of {:.0} % of the volume",
            r.angle_deg,
            100.0 * r.kept
        );
        facts.push(("rotated", words));
    }
    if let Some([low, high]) = results.plane_cut_mm {
        facts.push(("ends cut flat (mm)", format!("{low:.3} and {high:.3}")));
    }
    if let Some(t) = results.mean_thickness_mm {
        facts.push(("mean strut thickness (mm)", format!("{t:.3}")));
    }
    let own = |(key, value): (&str, String)| (key.to_owned(), value);
    let mut facts: Vec<(String, String)> = facts.into_iter().map(own).collect();
    let measured = results.morphometry.iter().flat_map(Morphometry::listed);
    facts.extend(measured.map(|(name, value, unit)| match unit {
        "" => (name.to_owned(), value),
        unit => (format!("{name} ({unit})"), value),
    }));
    let warnings = results.warnings.iter().cloned();
    facts.extend(warnings.map(|warning| ("warning".to_owned(), warning)));
    facts
}

fn threshold(record: &SegmentRecord) -> String {
    let labels = &record.settings.labels;
    if !labels.is_empty() {
        let words: Vec<String> = labels.iter().map(i32::to_string).collect();
        return format!("labels {}", words.join(", "));
    }
    let (lower, upper) = (record.results.lower, record.results.upper);
    let unit = record
        .input
        .unit
        .as_deref()
        .unwrap_or("in the image's units");
    // Otsu's threshold has digits that mean nothing.
    let bound =
        |v: Option<f64>| v.map_or("∞".to_owned(), |v| ((v * 1e3).round() / 1e3).to_string());
    format!(
        "{}: {} to {} {unit}",
        record.results.threshold,
        bound(lower),
        bound(upper)
    )
}
