//! Owns triply periodic minimal surfaces: the solid on one side (network) or about the surface (sheet).

use super::super::waves::turn;
use super::frame::Vec3;
use std::f64::consts::TAU;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surface {
    Gyroid,
    SchwarzP,
    SchwarzD,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Periodic {
    pub surface: Surface,
    pub sheet: bool,
    /// Edge of the cubic cell.
    pub cell_mm: f64,
    /// Where the cell's corner lies, in cells.
    pub shift: Vec3,
}

impl Periodic {
    /// Grows with the distance from the middle of the solid; never faster than the distance itself, in mm.
    pub fn value(&self, p: Vec3) -> f64 {
        let [[cx, sx], [cy, sy], [cz, sz]] =
            std::array::from_fn(|a| turn(p[a] / self.cell_mm + self.shift[a]));
        // The steepest slope that a sum can have, per radian.
        let (f, steepest) = match self.surface {
            Surface::Gyroid => (sx * cy + sy * cz + sz * cx, 6f64.sqrt()),
            Surface::SchwarzP => (cx + cy + cz, 3f64.sqrt()),
            Surface::SchwarzD => (
                sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz,
                6f64.sqrt(),
            ),
        };
        let mm = f * self.cell_mm / (TAU * steepest);
        if self.sheet { mm.abs() } else { mm }
    }
}
