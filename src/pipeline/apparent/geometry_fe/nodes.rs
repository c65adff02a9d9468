//! Owns the nodes of smooth elements as supports see them.

use super::GeometryModel;
use crate::error::{Error, Result};
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::ends::supports::{Node, Nodes};
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::Specimen;

/// Where the grips end along the load axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grips {
    pub axis: usize,
    pub low_mm: f64,
    pub high_mm: f64,
}

impl Grips {
    /// # Errors
    /// Grips that meet.
    pub fn of(specimen: &Specimen, params: &SolveParams) -> Result<Grips> {
        let grip_mm = match params.load.motion() {
            None => 0.0,
            Some(_) => params.grip_mm,
        };
        let length = specimen.length_mm(params.axis);
        if length <= 2.0 * grip_mm {
            return Err(Error::setting(
                "solve.grip_mm",
                format!("two grips of {grip_mm} mm meet in a specimen {length} mm long"),
                "give a grip of less than half the length",
            ));
        }
        Ok(Grips {
            axis: params.axis.index(),
            low_mm: grip_mm,
            high_mm: length - grip_mm,
        })
    }

    /// How far a place lies from the lower grip to the upper: 0 to 1.
    pub fn along(&self, at: [f64; 3]) -> f64 {
        ((at[self.axis] - self.low_mm) / (self.high_mm - self.low_mm)).clamp(0.0, 1.0)
    }

    /// The end whose grip holds a place, but for the rounding of positions.
    pub fn end(&self, at: [f64; 3]) -> Option<End> {
        let near = 1e-9 * (self.high_mm - self.low_mm);
        End::at(at[self.axis], self.low_mm + near, self.high_mm - near)
    }
}

impl Nodes for GeometryModel {
    fn count(&self) -> usize {
        self.model.mesh.nodes_mm.len()
    }

    fn each(&self, mut visit: impl FnMut(usize, Node)) {
        let mesh = &self.model.mesh;
        for (number, &place_mm) in mesh.nodes_mm.iter().enumerate() {
            let node = Node {
                place_mm,
                on_side: mesh.faces_at(place_mm).map(|face| face != 0),
                end: self.grips.end(place_mm),
                along: self.grips.along(place_mm),
            };
            visit(number, node);
        }
    }
}
