//! Owns the figure of a stress–strain curve.

use crate::report::cells::digits;
use crate::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use crate::result::row::Row;
use crate::result::strength::{CurvePoint, OFFSET};

/// Apparent stress over nominal strain, magnitudes, from the origin on, with the line of the offset to the yield that the curve's row
/// has.
pub fn stress_strain(scan: &str, curve: &[CurvePoint], rows: &[Row]) -> Option<Figure> {
    let last = curve.last()?;
    let of = |p: &CurvePoint| Point::new(100.0 * p.strain.abs(), p.stress_mpa.abs());
    let points = [Point::new(0.0, 0.0)]
        .into_iter()
        .chain(curve.iter().map(of));
    let loaded = if last.strain < 0.0 {
        "compression"
    } else {
        "tension or shear"
    };
    let voxel_fe = Curve {
        name: "voxel FE, yielding".to_owned(),
        hue: 0,
        shape: 0,
        mark: Mark::Joined,
        points: points.collect(),
    };
    Some(Figure {
        stem: format!("stress-strain-{scan}"),
        scan: Some(scan.to_owned()),
        title: format!("Stress and strain of {scan}"),
        caption: format!(
            "Apparent stress against nominal strain ({loaded}) of the last solve with --plasticity; {:.1} % of the bone has yielded at the end.",
            100.0 * last.plastic_volume_fraction
        ),
        x: Axis::linear("strain (%)"),
        y: Axis::linear("apparent stress (MPa)"),
        content: Content::Curves(
            [voxel_fe]
                .into_iter()
                .chain(offset_line(scan, curve, rows))
                .collect(),
        ),
        ..Figure::default()
    })
}

/// From the offset on the axis to the yield; of the row whose curve it is.
fn offset_line(scan: &str, curve: &[CurvePoint], rows: &[Row]) -> Option<Curve> {
    let largest = curve.iter().map(|p| p.stress_mpa.abs()).reduce(f64::max);
    let own = rows.iter().rev().filter(|row| row.key.scan == scan);
    let mut strengths = own.filter_map(|row| Some(row.solved.as_ref()?.strength));
    let strength = strengths.find(|s| s.max_stress_mpa.is_some() && s.max_stress_mpa == largest)?;
    let (stress, strain) = strength.yield_stress_mpa.zip(strength.yield_strain)?;
    Some(Curve {
        name: format!(
            "elastic slope from 0.2 % on: yield at {} MPa",
            digits(Some(stress))
        ),
        hue: 1,
        shape: 1,
        mark: Mark::Joined,
        points: vec![
            Point::new(100.0 * OFFSET, 0.0),
            Point::new(100.0 * strain, stress),
        ],
    })
}
