//! Owns what lattices of all kinds share as discretisations: their row, supports and moduli.

pub mod connected;
mod cost;
mod mixed_tissue;
pub mod sites;
mod stress;
mod thin;

use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::sites::Grips;
use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::operator::{Functional, MixedPrecision};
use crate::physics::lattice::Virial;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::{EndSites, Places, System};
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::ends::supports::{self, Node, Nodes};
use crate::pipeline::apparent::fields::Equilibrated;
use crate::pipeline::apparent::lattice::stress::Stress;
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::lattice::Case;
use crate::result::settings::{BoundaryRule, CellType, Method, Motion, Settings};
use crate::solver::amg::AmgParams;
use crate::volume::Specimen;

/// The settings that say which lattice a row is of.
fn label(key: Settings, case: &Case) -> Settings {
    Settings {
        method: Method::Lattice,
        structure: CellType::Lattice(case.structure),
        boundary: Some(BoundaryRule::from(case.boundary)),
        lp_mm: case.lp_mm,
        registration_mm: Some(case.registration_mm),
        ..key
    }
}

fn refuse_unit_strains(params: &SolveParams) -> Result<()> {
    match params.load.motion() {
        Some(_) => Ok(()),
        None => Err(Error::setting(
            "load",
            "unit strains need faces, and a lattice ends half a cell inside the volume's sides",
            "add --method voxel-fe, or use --load uniaxial",
        )),
    }
}

/// Where the sites of a lattice are, and between which grips.
#[derive(Clone, Copy)]
struct Placed<'a> {
    frame: &'a Frame,
    indices: &'a [[i32; 3]],
    grips: Grips,
    dropped: usize,
}

impl Nodes for Placed<'_> {
    fn count(&self) -> usize {
        self.indices.len()
    }

    fn each(&self, mut visit: impl FnMut(usize, Node)) {
        let Grips { low, high } = self.grips;
        for (site, &at) in self.indices.iter().enumerate() {
            let plane = self.plane(site);
            let node = Node {
                place_mm: self.frame.position_mm(at),
                on_side: std::array::from_fn(|c| self.frame.on_side(at, c)),
                end: End::at(plane, low, high),
                along: f64::from(plane.clamp(low, high) - low) / f64::from(high - low),
            };
            visit(site, node);
        }
    }
}

impl<'a> Placed<'a> {
    fn plane(&self, site: usize) -> i32 {
        self.indices[site][self.frame.axis.index()]
    }

    fn motion(&self, specimen: &Specimen, params: &SolveParams) -> EndMotion {
        let gauge_mm = f64::from(self.grips.high - self.grips.low) * self.frame.step_mm;
        EndMotion::of(specimen, params, gauge_mm)
    }

    /// The sites of the gripped planes.
    fn ends(self, motion: EndMotion) -> EndSites<'a> {
        let axis = self.frame.axis.index();
        let height = |plane: i32| {
            let mut at = [0; 3];
            at[axis] = plane;
            self.frame.position_mm(at)[axis]
        };
        EndSites {
            motion,
            planes_mm: [self.grips.low, self.grips.high].map(height),
            each: Box::new(move |visit| supports::each_end_node(&self, visit)),
        }
    }

    fn system<O: MixedPrecision, C: Precondition, M: Virial>(
        self,
        operator: &'a O,
        springs: C,
        goal: Option<Stress<'a, M>>,
        (params, motion): (&SolveParams, EndMotion),
        volume_mm3: f64,
        places: Option<Places>,
    ) -> System<'a, O, C, Stress<'a, M>> {
        System {
            operator,
            coarsen: springs,
            multigrid: AmgParams::lattice(self.frame.lp_mm),
            // The stress along the axis is that of ends that come nearer or part.
            goal: goal.filter(|_| motion.motion == Motion::Along),
            held: supports::held(&self, &motion, params.load),
            start: Box::new(move |_| supports::start(&self, &motion)),
            ends: self.ends(motion),
            by_label: None,
            load_steps: None,
            sites: self.indices.len(),
            dropped: self.dropped,
            volume_mm3,
            places,
        }
    }

    /// The headline is from the energy, or from the stress where that was the goal of the solve.
    fn assess<M: Virial>(
        &self,
        stress: &Stress<M>,
        loaded: &Loaded,
        &Equilibrated { u, force, info, .. }: &Equilibrated,
    ) -> Moduli {
        let (axis, sites) = (self.frame.axis.index(), self.indices.len());
        let high = |s: &usize| self.plane(*s) >= self.grips.high;
        let reaction: f64 = (0..sites).filter(high).map(|s| force[s][axis]).sum();
        let from_energy_mpa = loaded.from_energy(info.energy);
        let from_stress_mpa = loaded.from_virial(stress.of(u));
        let relative = info.energy_error / info.energy;
        let (e_app_mpa, algebraic_error_mpa) = match info.goal_error {
            Some(error) => (from_stress_mpa, loaded.from_virial(error).abs()),
            None => (from_energy_mpa, relative * from_energy_mpa),
        };
        Moduli {
            e_app_mpa,
            from_energy_mpa,
            from_reaction_mpa: loaded.from_reaction(reaction),
            from_stress_mpa,
            algebraic_error_mpa,
        }
    }
}
