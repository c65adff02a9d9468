//! Owns the figure of a stress–strain curve.

use crate::report::figure::{Axis, Content, Curve, Figure, Mark, Point};
use crate::result::strength::CurvePoint;

/// Apparent stress over nominal strain, both in the sign of the load's size; the origin is put first.
pub fn stress_strain(scan: &str, curve: &[CurvePoint]) -> Option<Figure> {
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
        content: Content::Curves(vec![Curve {
            name: "voxel FE, yielding".to_owned(),
            hue: 0,
            shape: 0,
            mark: Mark::Joined,
            points: points.collect(),
        }]),
        ..Figure::default()
    })
}
