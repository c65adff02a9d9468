//! `phantom --body`: an analytic body and how it lies in the scan.

use crate::cli::words;
use bonepd_ct::pipeline::phantom::{BodyKind, BodyParams, Orientation};
use clap::Args;

#[derive(Args)]
#[command(next_help_heading = "Body")]
pub struct BodyArgs {
    /// An analytic body in place of the random field: a triply periodic surface (the solid on one side of it, or a sheet
    /// about it), a lattice of round struts, a random foam (struts on the edges of a Voronoi tessellation), or parallel
    /// plates. --bvtv is its volume fraction in the box, before breaks and crack. Finer voxels show the same body
    #[arg(long, value_name = "KIND", value_parser = words::choice::<BodyKind>(KINDS), requires = "cell_mm")]
    body: Option<BodyKind>,
    /// Edge of the cell that repeats; mean distance of a foam's cells; distance of plates from middle to middle
    #[arg(long, value_name = "MM", value_parser = words::positive, requires = "body")]
    cell_mm: Option<f64>,
    /// Angle between the third axis of the body (the normal of plates) and z [default: from the seed]
    #[arg(long, value_name = "DEGREES", value_parser = words::number, requires = "body", allow_negative_numbers = true)]
    tilt_degrees: Option<f64>,
    /// Direction of that tilt, from x about z [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = words::number, requires = "tilt_degrees", allow_negative_numbers = true)]
    azimuth_degrees: Option<f64>,
    /// Width over which the surfaces of joining struts flow into one another, in mean radii; 0 leaves joints sharp
    /// [default: 0.5]
    #[arg(long, value_name = "R", value_parser = words::number, requires = "body")]
    fillet: Option<f64>,
    /// Radii of struts lie within this share of their mean [default: 0]
    #[arg(long, value_name = "F", value_parser = words::number, requires = "body")]
    spread: Option<f64>,
    /// Share of the struts that is broken [default: 0]
    #[arg(long, value_name = "F", value_parser = words::number, requires = "body")]
    broken: Option<f64>,
    /// Width of the breaks, in mean radii of the struts [default: 1]
    #[arg(long, value_name = "R", value_parser = words::positive, requires = "broken")]
    broken_gap: Option<f64>,
    /// A crack of this width across the load; its height, tilt and direction follow from the seed [default: none]
    #[arg(long, value_name = "MM", value_parser = words::positive, requires = "body")]
    crack_mm: Option<f64>,
    /// Share of the section that the crack cuts [default: 0.5]
    #[arg(long, value_name = "F", value_parser = words::number, requires = "crack_mm")]
    crack_share: Option<f64>,
    /// Move the scan over the body
    #[arg(long, value_name = "X,Y,Z", value_parser = words::triple, requires = "body", allow_hyphen_values = true)]
    shift_voxels: Option<[f64; 3]>,
    /// Turn the scan over the body about z
    #[arg(long, value_name = "DEGREES", value_parser = words::number, requires = "body", allow_negative_numbers = true)]
    turn_degrees: Option<f64>,
}

const KINDS: &[&str] = &[
    "gyroid-network",
    "gyroid-sheet",
    "schwarz-p-network",
    "schwarz-p-sheet",
    "schwarz-d-network",
    "schwarz-d-sheet",
    "cubic",
    "bcc",
    "octet",
    "kelvin",
    "foam",
    "plates",
];

impl BodyArgs {
    /// None without `--body`.
    pub fn params(&self, spacing_mm: f64) -> Option<BodyParams> {
        let orientation = self.tilt_degrees.map_or(Orientation::Random, |tilt| {
            let azimuth = self.azimuth_degrees.unwrap_or(0.0);
            Orientation::Tilted { tilt, azimuth }
        });
        Some(BodyParams {
            kind: self.body?,
            cell_mm: self.cell_mm?,
            orientation,
            fillet: self.fillet.unwrap_or(0.5),
            spread: self.spread.unwrap_or(0.0),
            broken: self.broken.unwrap_or(0.0),
            broken_gap: self.broken_gap.unwrap_or(1.0),
            crack_mm: self.crack_mm.unwrap_or(0.0),
            crack_share: self.crack_share.unwrap_or(0.5),
            shift_mm: self
                .shift_voxels
                .unwrap_or([0.0; 3])
                .map(|v| v * spacing_mm),
            turn_degrees: self.turn_degrees.unwrap_or(0.0),
        })
    }
}
