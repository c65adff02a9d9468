//! Owns how the ends of a specimen move: from the settings to the displacement of any place on an end.

use crate::grid::Axis;
use crate::measure::apparent::{EndWork, Loaded};
use crate::pipeline::apparent::params::{Ends, SolveParams};
use crate::pipeline::apparent::solved::Moduli;
use crate::result::settings::Motion;
use crate::solver::cg::CgInfo;
use crate::volume::Specimen;

/// The ends' motion of one specimen between its innermost gripped planes.
#[derive(Debug, Clone, Copy)]
pub struct EndMotion {
    /// The load axis.
    pub axis: Axis,
    /// What the ends do against each other.
    pub motion: Motion,
    /// Along the axis; the displacement also of ends that slide.
    pub loaded: Loaded,
    /// Radians of torsion; of bending the tangent of one end's tilt, half the angle.
    turn: f64,
    /// Of the grid, from its corner.
    middle_mm: [f64; 3],
    /// Ends held in all components.
    pub held_sideways: bool,
}

impl EndMotion {
    /// Of a specimen whose innermost gripped planes are `gauge_mm` apart. Unit strains move no ends: theirs is that of a bar.
    pub fn of(specimen: &Specimen, params: &SolveParams, gauge_mm: f64) -> EndMotion {
        let motion = params.load.motion().unwrap_or(Motion::Along);
        let angle = params.angle_deg.to_radians();
        EndMotion {
            axis: params.axis,
            motion,
            loaded: Loaded {
                gauge_mm,
                area_mm2: specimen.area_mm2(params.axis),
                displacement_mm: params.strain * gauge_mm,
            },
            turn: match motion {
                Motion::Tilt(_) => (0.5 * angle).tan(),
                _ => angle,
            },
            middle_mm: specimen.bone.grid.size_mm().map(|length| 0.5 * length),
            held_sideways: params.ends == Ends::Bonded || motion != Motion::Along,
        }
    }

    /// Displacement of a place (mm from the corner of the specimen) that lies `along` the gauge, 0 at the lower end and 1 at the
    /// upper. At the ends it is what is prescribed, between them the start of a solve. Angles are those of a small turn,
    /// `u = φ × r`.
    pub fn at(&self, place_mm: [f64; 3], along: f64) -> [f64; 3] {
        let axis = self.axis.index();
        let mut u = [0.0; 3];
        match self.motion {
            // Labels say what moves.
            Motion::ByLabel => {}
            Motion::Along => u[axis] = self.loaded.displacement_mm * along,
            Motion::Sideways(direction) => {
                u[direction.index()] = self.loaded.displacement_mm * along;
            }
            Motion::Turn => u = turned(axis, self.turn * along, self.from_middle(place_mm)),
            Motion::Tilt(about) => {
                let tilt = self.turn * (2.0 * along - 1.0);
                u[axis] = turned(about.index(), tilt, self.from_middle(place_mm))[axis];
            }
        }
        u
    }

    /// A place from the axis through the middle of the grid.
    pub fn from_middle(&self, place_mm: [f64; 3]) -> [f64; 3] {
        let mut r: [f64; 3] = std::array::from_fn(|a| place_mm[a] - self.middle_mm[a]);
        r[self.axis.index()] = 0.0;
        r
    }

    /// The middle of the grid at a height along the axis.
    pub fn middle_at(&self, height_mm: f64) -> [f64; 3] {
        let mut middle = self.middle_mm;
        middle[self.axis.index()] = height_mm;
        middle
    }

    /// Force, moment and stiffness of the moved end: from the modulus where there is one, else from the energy.
    pub fn work(&self, moduli: &Moduli, info: &CgInfo) -> EndWork {
        let relative = info.energy_error / info.energy;
        match self.motion {
            Motion::Along => {
                let Loaded {
                    gauge_mm,
                    area_mm2,
                    displacement_mm,
                } = self.loaded;
                let stiffness = moduli.e_app_mpa * area_mm2 / gauge_mm;
                let energy = stiffness * displacement_mm.powi(2);
                let relative = moduli.algebraic_error_mpa / moduli.e_app_mpa;
                EndWork::of_displacement(energy, displacement_mm, relative)
            }
            Motion::ByLabel | Motion::Sideways(_) => {
                EndWork::of_displacement(info.energy, self.loaded.displacement_mm, relative)
            }
            Motion::Turn => EndWork::of_turn(info.energy, self.turn, relative),
            // Both ends tilt: their moments' mean does the work of twice the tilt.
            Motion::Tilt(_) => EndWork::of_turn(info.energy, 2.0 * self.turn, relative),
        }
    }

    /// The component of a force on the upper end, or of its moment about the middle, that does the work.
    pub fn working(&self, force: [f64; 3], moment: [f64; 3]) -> f64 {
        match self.motion {
            Motion::Along | Motion::ByLabel => force[self.axis.index()],
            Motion::Sideways(direction) => force[direction.index()],
            Motion::Turn => moment[self.axis.index()],
            Motion::Tilt(about) => moment[about.index()],
        }
    }
}

/// `φ × r` of a turn by `angle` about one axis.
fn turned(about: usize, angle: f64, r: [f64; 3]) -> [f64; 3] {
    let (p, q) = ((about + 1) % 3, (about + 2) % 3);
    let mut u = [0.0; 3];
    u[p] = -angle * r[q];
    u[q] = angle * r[p];
    u
}
