//! Owns the solve of one lattice: supports, conjugate gradients, apparent moduli.

use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::sites::Grips;
use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision, Operator};
use crate::physics::lattice;
use crate::physics::lattice::Lattice;
use crate::physics::lattice::connected::{ConnectedLattice, ConnectedSprings};
use crate::physics::lattice::multigrid::Springs;
use crate::pipeline::apparent::fields::SiteFields;
use crate::pipeline::apparent::mechanisms::mechanisms;
use crate::pipeline::apparent::mixed_tissue::Blend;
use crate::pipeline::apparent::solved::{Moduli, Solved};
use crate::pipeline::apparent::stress::Stress;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{Ends, Load, SolveParams};
use crate::pipeline::lattice::{Boundary, Case, build_connected, build_of, values_of};
use crate::result::settings::{BoundaryRule, CellType, Method, Settings};
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::cg::fallback::minimise_or_fall_back;
use crate::solver::cg::{CgInfo, CgParams, CgStep};
use crate::volume::Specimen;
use rayon::prelude::*;

/// Solves one lattice of a specimen.
///
/// # Errors
/// Settings that do not fit the specimen or the lattice.
pub fn solve_lattice(
    specimen: &Specimen,
    case: &Case,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> Result<Solved> {
    Ok(solve_recorded(specimen, case, params, observe)?.0)
}

/// The same, with the fields that the settings ask for.
pub fn solve_recorded(
    specimen: &Specimen,
    case: &Case,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> Result<(Solved, Option<SiteFields>)> {
    params.check()?;
    if params.load == Load::Stiffness {
        return Err(Error::setting(
            "load",
            "unit strains need faces, and a lattice ends half a cell inside the volume's sides",
            "add --method voxel-fe, or use --load uniaxial",
        ));
    }
    let tissue = Tissue::of(specimen, params)?;
    let blend = Blend::of(&tissue, case)?;
    let moduli = blend.moduli;
    if case.is_connected() && blend.springs.is_some() {
        return Err(Error::setting(
            "solve.material",
            "graded SC lattices are of one tissue",
            "use firm and floppy lattices, or add --method voxel-fe",
        ));
    }
    if case.is_connected() {
        if params.mechanisms {
            return Err(Error::setting(
                "mechanisms",
                "pieces of bone that share a graded lattice's site share its place on the grid, too",
                "count mechanisms on firm and floppy lattices or with --method voxel-fe",
            ));
        }
        let pieces = build_connected(specimen, case, params.axis, params.grip_mm)?;
        if pieces.is_empty() {
            return Ok((Solved::disconnected(pieces.dropped), None));
        }
        let laid = Laid {
            frame: &pieces.frame,
            indices: &pieces.indices,
            grips: pieces.grips,
            dropped: pieces.dropped,
        };
        let model = ConnectedLattice::new(&pieces, moduli);
        let springs = ConnectedSprings(&model);
        let stress = Stress {
            model: &model,
            counts: None,
        };
        let (solved, u) = solve_model(
            &model, &springs, &stress, &laid, specimen, case, params, observe,
        );
        let energy = |s| model.site_energy(&u, s);
        let fraction = |s: usize| f64::from(pieces.fractions[s]);
        let fields = SiteFields::of(&params.fields, laid.places(), &u, energy, fraction);
        return Ok((solved, fields));
    }
    let springs = blend.springs.as_deref();
    let sites = build_of(specimen, springs, case, params.axis, params.grip_mm)?;
    if sites.is_empty() {
        return Ok((Solved::disconnected(sites.dropped), None));
    }
    let laid = Laid {
        frame: &sites.frame,
        indices: &sites.indices,
        grips: sites.grips,
        dropped: sites.dropped,
    };
    let model = match &blend.volumetric {
        None => Lattice::new(&sites, moduli),
        Some(tissue) => {
            let by_site = values_of(specimen, tissue, case, &sites);
            let volumetric = by_site.into_iter().map(|v| v * moduli.t).collect();
            Lattice::with_volumetric(&sites, moduli, volumetric)
        }
    };
    let springs = Springs::new(&model);
    let counts = (case.boundary == Boundary::Firm).then(|| {
        let all = (0..sites.len()).into_par_iter();
        all.map(|s| sites.fully_coordinated(s)).collect()
    });
    let stress = Stress {
        model: &model,
        counts,
    };
    let mechanisms = match params.mechanisms {
        true => Some(count_mechanisms(&model, &laid, moduli, params)?),
        false => None,
    };
    let (solved, u) = solve_model(
        &model, &springs, &stress, &laid, specimen, case, params, observe,
    );
    let energy = |s| model.site_energy(&u, s);
    let fraction = |s: usize| sites.weights.as_ref().map_or(1.0, |weights| weights[s]);
    let fields = SiteFields::of(&params.fields, laid.places(), &u, energy, fraction);
    let solved = Solved {
        mechanisms,
        ..solved
    };
    Ok((solved, fields))
}

/// A bond spans up to two grid steps along an axis (SC: one); volumetric sums couple the ends of two bonds.
fn count_mechanisms(
    model: &Lattice,
    laid: &Laid,
    moduli: lattice::Moduli,
    params: &SolveParams,
) -> Result<usize> {
    let bonds = if moduli.t == 0.0 { 1 } else { 2 };
    let reach = bonds * laid.frame.structure.steps_per_lp() as i32;
    mechanisms(model, &supports(laid, params, 0.0).0, laid.indices, reach)
}

/// Where a lattice's sites lie, of whichever kind they are.
struct Laid<'a> {
    frame: &'a Frame,
    indices: &'a [[i32; 3]],
    grips: Grips,
    dropped: usize,
}

impl Laid<'_> {
    fn places(&self) -> (&Frame, &[[i32; 3]]) {
        (self.frame, self.indices)
    }

    fn plane(&self, site: usize) -> i32 {
        self.indices[site][self.frame.axis.index()]
    }

    /// Distance of the innermost gripped planes in mm.
    fn gauge_mm(&self) -> f64 {
        f64::from(self.grips.high - self.grips.low) * self.frame.step_mm
    }
}

#[allow(clippy::too_many_arguments)] // what a solve is made of, once
fn solve_model(
    model: &impl MixedPrecision,
    springs: &impl Coarsen,
    stress: &impl Functional<3>,
    laid: &Laid,
    specimen: &Specimen,
    case: &Case,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> (Solved, Vec<[f64; 3]>) {
    let loaded = Loaded {
        gauge_mm: laid.gauge_mm(),
        area_mm2: specimen.area_mm2(params.axis),
        displacement_mm: params.strain * laid.gauge_mm(),
    };
    let (held, mut u) = supports(laid, params, loaded.displacement_mm);
    let cg = CgParams {
        energy_tolerance: params.tolerance,
        max_iterations: params.max_iterations,
        ..CgParams::default()
    };
    // Firm's headline is a linear functional, off to first order where the energy is off to second.
    let goal = (case.boundary == Boundary::Firm).then_some(stress);
    let amg = Amg::new(springs, &held, &AmgParams::lattice(case.lp_mm));
    let info = minimise_or_fall_back(model, &held, &amg, &mut u, &cg, goal, observe);
    drop(amg);
    let solved = Solved {
        sites: laid.indices.len(),
        dropped: laid.dropped,
        unknowns: held.free::<3>(),
        iterations: info.iterations,
        residual: info.residual,
        ended: info.ended,
        moduli: assess(model, stress, laid, &loaded, &u, &info),
        mechanisms: None,
    };
    (solved, u)
}

/// Which unknowns are held, and a start that meets them: the field of a homogeneous bar.
fn supports(laid: &Laid, params: &SolveParams, displacement_mm: f64) -> (Held, Vec<[f64; 3]>) {
    let axis = params.axis.index();
    let grips = laid.grips;
    let mut held = Held::none(laid.indices.len());
    let mut u = vec![[0.0; 3]; laid.indices.len()];
    for (s, u) in u.iter_mut().enumerate() {
        let plane = laid.plane(s);
        let along = f64::from(plane.clamp(grips.low, grips.high) - grips.low);
        u[axis] = displacement_mm * along / f64::from(grips.high - grips.low);
        let gripped = grips.holds(plane);
        for c in 0..3 {
            let on_side = laid.frame.on_side(laid.indices[s], c);
            let confined = params.load == Load::Confined && c != axis && on_side;
            let bonded = gripped && (c == axis || params.ends == Ends::Bonded);
            if confined || bonded {
                held.hold(s, c);
            }
        }
    }
    (held, u)
}

fn assess(
    model: &impl Operator<3>,
    stress: &impl Functional<3>,
    laid: &Laid,
    loaded: &Loaded,
    u: &[[f64; 3]],
    info: &CgInfo,
) -> Moduli {
    let (axis, sites) = (laid.frame.axis.index(), laid.indices.len());
    let mut force = vec![[0.0; 3]; sites];
    model.apply(u, &mut force);
    let high = |s: &usize| laid.plane(*s) >= laid.grips.high;
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

/// The columns that tell which lattice a row is of.
pub fn label(key: Settings, case: &Case) -> Settings {
    Settings {
        method: Method::Lattice,
        structure: CellType::Lattice(case.structure),
        boundary: Some(BoundaryRule::Sites(case.boundary)),
        lp_mm: case.lp_mm,
        registration_mm: Some(case.registration_mm),
        ..key
    }
}
