//! Owns what an analytic body is made from.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The analytic bodies: a network is what lies on one side of a periodic surface, a sheet a wall along it; then struts, and plates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyKind {
    /// One side of the gyroid.
    GyroidNetwork,
    /// A wall along the gyroid.
    GyroidSheet,
    /// One side of Schwarz's P surface.
    SchwarzPNetwork,
    /// A wall along Schwarz's P surface.
    SchwarzPSheet,
    /// One side of Schwarz's D surface.
    SchwarzDNetwork,
    /// A wall along Schwarz's D surface.
    SchwarzDSheet,
    /// Struts along the edges of cubes.
    Cubic,
    /// Struts from the middle of a cube to its corners.
    Bcc,
    /// Struts between nearest nodes of a face-centred lattice.
    Octet,
    /// Struts along the edges of truncated octahedra.
    Kelvin,
    /// Struts along the edges of Voronoi cells about scattered seeds.
    Foam,
    /// Parallel plates.
    Plates,
}

impl BodyKind {
    /// Whether it is made of struts, which may break.
    pub fn has_struts(self) -> bool {
        use BodyKind::{Bcc, Cubic, Foam, Kelvin, Octet};
        matches!(self, Cubic | Bcc | Octet | Kelvin | Foam)
    }
}

/// How the body's own axes lie in the box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// By the seed.
    Random,
    /// The third axis this many degrees from z, towards this many from x.
    Tilted {
        /// Degrees from z.
        tilt: f64,
        /// Degrees from x.
        azimuth: f64,
    },
}

/// An analytic body and how it lies in the scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyParams {
    /// What it is made of.
    pub kind: BodyKind,
    /// Edge of the cell that repeats; mean distance of a foam's cells; from plate to plate.
    pub cell_mm: f64,
    /// How its axes lie in the box.
    pub orientation: Orientation,
    /// Width over which struts' surfaces flow into one another, in mean radii; 0 leaves joints sharp.
    pub fillet: f64,
    /// Struts' radii lie within this share of their mean.
    pub spread: f64,
    /// Share of the struts that is broken.
    pub broken: f64,
    /// Width of the break, in mean radii.
    pub broken_gap: f64,
    /// Width of a crack across the load; 0 is none.
    pub crack_mm: f64,
    /// Share of the section that the crack cuts.
    pub crack_share: f64,
    /// The scan is moved by this much over the body.
    pub shift_mm: [f64; 3],
    /// The scan is turned about z over the body.
    pub turn_degrees: f64,
}

impl BodyParams {
    /// Refuses what cannot be made in a box of this shortest edge.
    pub fn check(&self, spacing_mm: f64, shortest_mm: f64) -> Result<()> {
        let range = |key: &str, v: f64, low: f64, high: f64, advice: &str| {
            if v >= low && v <= high {
                return Ok(());
            }
            let found = format!("{v} is not between {low} and {high}");
            Err(Error::setting(key, found, advice))
        };
        let cell = "a cell is some 5 to 50 voxels and at most twice the box";
        range(
            "cell-mm",
            self.cell_mm,
            2.0 * spacing_mm,
            2.0 * shortest_mm,
            cell,
        )?;
        if self.kind.has_struts() {
            let least = shortest_mm / 20.0;
            range(
                "cell-mm",
                self.cell_mm,
                least,
                2.0 * shortest_mm,
                "at most 20 cells of struts fit",
            )?;
        } else if self.broken > 0.0 {
            return Err(Error::setting(
                "broken",
                "this body has no struts to break",
                "choose a lattice or the foam, or give --crack-mm",
            ));
        }
        range("fillet", self.fillet, 0.0, 2.0, "0.5 is usual")?;
        range("spread", self.spread, 0.0, 0.8, "0.3 is usual for foams")?;
        range(
            "broken",
            self.broken,
            0.0,
            1.0,
            "give a share of the struts",
        )?;
        range(
            "broken-gap",
            self.broken_gap,
            0.01,
            4.0,
            "in mean radii of the struts",
        )?;
        range(
            "crack-mm",
            self.crack_mm,
            0.0,
            shortest_mm,
            "a crack is narrower than the box",
        )?;
        range(
            "crack-share",
            self.crack_share,
            0.0,
            1.0,
            "give a share of the section",
        )?;
        for shift in self.shift_mm {
            range(
                "shift-voxels",
                shift,
                -shortest_mm,
                shortest_mm,
                "a share of a voxel is usual",
            )?;
        }
        range(
            "turn-degrees",
            self.turn_degrees,
            -360.0,
            360.0,
            "give degrees about z",
        )
    }
}
