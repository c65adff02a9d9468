//! Owns the supports of smooth elements: grips and sides where ends move, all faces under unit strains.

use crate::discretisation::tetrahedra::nodes::TetMesh;
use crate::measure::stiffness::unit_strain;
use crate::operator::held::Held;
use crate::pipeline::apparent::discretisation::Displacements;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::params::{Conditions, Load};
use crate::pipeline::apparent::voxel_fe::supports::prescribed;

/// Where the grips end along the load axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grips {
    pub axis: usize,
    pub low_mm: f64,
    pub high_mm: f64,
}

impl Grips {
    /// How far a place lies from the lower grip to the upper: 0 to 1.
    pub fn along(&self, at: [f64; 3]) -> f64 {
        ((at[self.axis] - self.low_mm) / (self.high_mm - self.low_mm)).clamp(0.0, 1.0)
    }

    /// Rounding of positions.
    fn near(&self) -> f64 {
        1e-9 * (self.high_mm - self.low_mm)
    }

    pub fn is_gripped(&self, at: [f64; 3]) -> bool {
        let z = at[self.axis];
        z <= self.low_mm + self.near() || self.is_upper(at)
    }

    pub fn is_upper(&self, at: [f64; 3]) -> bool {
        at[self.axis] >= self.high_mm - self.near()
    }
}

/// Unknowns that a motion of the ends holds.
pub fn held(mesh: &TetMesh, grips: &Grips, motion: &EndMotion, load: Load) -> Held {
    let mut held = Held::none(mesh.nodes_mm.len());
    for (node, at) in mesh.nodes_mm.iter().enumerate() {
        let (on, gripped) = (mesh.faces_at(*at), grips.is_gripped(*at));
        for (c, on) in on.into_iter().enumerate() {
            let confined = load == Load::Confined && c != grips.axis && on != 0;
            if confined || gripped && (c == grips.axis || motion.held_sideways) {
                held.hold(node, c);
            }
        }
    }
    held
}

/// A start that meets these supports: the ends' motion, spread evenly between them.
pub fn start(mesh: &TetMesh, grips: &Grips, motion: &EndMotion) -> Displacements {
    let of = |at: &[f64; 3]| motion.at(*at, grips.along(*at));
    mesh.nodes_mm.iter().map(of).collect()
}

/// Calls `visit` with every gripped node, which end it is of, and its place in mm.
pub fn each_end_node(mesh: &TetMesh, grips: &Grips, visit: &mut dyn FnMut(usize, End, [f64; 3])) {
    for (node, at) in mesh.nodes_mm.iter().enumerate() {
        if grips.is_gripped(*at) {
            let end = match grips.is_upper(*at) {
                true => End::Upper,
                false => End::Lower,
            };
            visit(node, end, *at);
        }
    }
}

/// The components of `u = ε x` that a load prescribes on the faces.
pub fn held_faces(mesh: &TetMesh, conditions: Conditions, load: usize) -> Held {
    let mut held = Held::none(mesh.nodes_mm.len());
    for (node, at) in mesh.nodes_mm.iter().enumerate() {
        let on = mesh.faces_at(*at);
        for c in 0..3 {
            if (0..3).any(|face| on[face] != 0 && prescribed(conditions, load, face, c)) {
                held.hold(node, c);
            }
        }
    }
    held
}

/// `u = ε x` of a unit strain, `x` from the middle of the box.
pub fn affine(mesh: &TetMesh, load: usize) -> Displacements {
    let strain = unit_strain(load);
    let of = |at: &[f64; 3]| {
        let x: [f64; 3] = std::array::from_fn(|a| at[a] - 0.5 * mesh.size_mm[a]);
        strain.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
    };
    mesh.nodes_mm.iter().map(of).collect()
}
