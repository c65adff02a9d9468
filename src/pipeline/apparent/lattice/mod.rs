//! Owns what lattices of all kinds share as discretisations: their row, supports and moduli.

pub mod connected;
mod cost;
mod mixed_tissue;
pub mod sites;
mod stress;

use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::sites::Grips;
use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision, Operator};
use crate::physics::lattice::Virial;
use crate::pipeline::apparent::discretisation::{Displacements, Places, System};
use crate::pipeline::apparent::lattice::stress::Stress;
use crate::pipeline::apparent::params::{Ends, Load, SolveParams};
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::lattice::Case;
use crate::result::settings::{BoundaryRule, CellType, Method, Settings};
use crate::solver::amg::AmgParams;
use crate::solver::cg::CgInfo;
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
    match params.load {
        Load::Uniaxial | Load::Confined => Ok(()),
        Load::Stiffness => Err(Error::setting(
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

impl<'a> Placed<'a> {
    fn plane(&self, site: usize) -> i32 {
        self.indices[site][self.frame.axis.index()]
    }

    fn loaded(&self, specimen: &Specimen, params: &SolveParams) -> Loaded {
        let gauge_mm = f64::from(self.grips.high - self.grips.low) * self.frame.step_mm;
        Loaded {
            gauge_mm,
            area_mm2: specimen.area_mm2(params.axis),
            displacement_mm: params.strain * gauge_mm,
        }
    }

    /// Unknowns that the grips and, where sides are confined, the sides hold.
    fn held(&self, params: &SolveParams) -> Held {
        let axis = params.axis.index();
        let mut held = Held::none(self.indices.len());
        for s in 0..self.indices.len() {
            let gripped = self.grips.holds(self.plane(s));
            for c in 0..3 {
                let on_side = self.frame.on_side(self.indices[s], c);
                let confined = params.load == Load::Confined && c != axis && on_side;
                let bonded = gripped && (c == axis || params.ends == Ends::Bonded);
                if confined || bonded {
                    held.hold(s, c);
                }
            }
        }
        held
    }

    /// A start that meets these supports: the field of a homogeneous bar.
    fn bar(&self, displacement_mm: f64) -> Displacements {
        let axis = self.frame.axis.index();
        let Grips { low, high } = self.grips;
        let of = |s: usize| {
            let along = f64::from(self.plane(s).clamp(low, high) - low);
            let mut u = [0.0; 3];
            u[axis] = displacement_mm * along / f64::from(high - low);
            u
        };
        (0..self.indices.len()).map(of).collect()
    }

    fn system<O: MixedPrecision, C: Coarsen, M: Virial>(
        self,
        operator: &'a O,
        springs: C,
        goal: Option<Stress<'a, M>>,
        (params, displacement_mm): (&SolveParams, f64),
        places: Option<Places>,
    ) -> System<'a, O, C, Stress<'a, M>> {
        System {
            operator,
            coarsen: springs,
            multigrid: AmgParams::lattice(self.frame.lp_mm),
            goal,
            held: self.held(params),
            start: Box::new(move |_| self.bar(displacement_mm)),
            sites: self.indices.len(),
            dropped: self.dropped,
            places,
        }
    }

    /// The headline is from the energy, or from the stress where that was the goal of the solve.
    fn assess<M: Operator<3> + Virial>(
        &self,
        stress: &Stress<M>,
        loaded: &Loaded,
        u: &[[f64; 3]],
        info: &CgInfo,
    ) -> Moduli {
        let (axis, sites) = (self.frame.axis.index(), self.indices.len());
        let mut force = vec![[0.0; 3]; sites];
        stress.model.apply(u, &mut force);
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
