//! Owns the solve of one lattice: supports, conjugate gradients, apparent moduli.

use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::measure::row::Row;
use crate::operator::Operator;
use crate::operator::held::Held;
use crate::par::sum_chunks;
use crate::physics::lattice::multigrid::Springs;
use crate::physics::lattice::{self, Lattice};
use crate::solve::amg::{Amg, AmgParams};
use crate::solve::cg::{CgInfo, CgParams, CgStep};
use crate::solve::fallback::minimise_or_fall_back;
use crate::stage::lattice::{Boundary, Case, build};
use crate::stage::solve::solved::{Moduli, Solved};
use crate::stage::solve::{Ends, Load, SolveParams};
use crate::topology::sites::Sites;
use crate::volume::Specimen;

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
    params.check()?;
    if params.load == Load::Stiffness {
        return Err(Error::setting(
            "load",
            "unit strains need faces, and a lattice ends half a cell inside the volume's sides",
            "add --method voxel-fe, or use --load uniaxial",
        ));
    }
    let moduli =
        lattice::Moduli::new(case.structure, case.lp_mm, params.young_mpa, params.poisson)?;
    let sites = build(specimen, case, params.axis, params.grip_mm)?;
    if sites.is_empty() {
        return Ok(Solved::disconnected(sites.dropped));
    }
    let model = Lattice::new(&sites, moduli);
    let loaded = Loaded {
        gauge_mm: sites.gauge_length_mm(),
        area_mm2: specimen.area_mm2(params.axis),
        displacement_mm: params.strain * sites.gauge_length_mm(),
    };
    let (held, mut u) = supports(&sites, params, loaded.displacement_mm);
    let cg = CgParams {
        // Firm's headline is a linear functional: off to first order in the energy norm, so the energy must be known
        // to the square of the tolerance.
        energy_tolerance: match case.boundary {
            Boundary::Firm => params.tolerance.powi(2),
            _ => params.tolerance,
        },
        max_iterations: params.max_iterations,
        ..CgParams::default()
    };
    let springs = Springs::new(&model);
    let amg = Amg::new(&springs, &held, &AmgParams::lattice(case.lp_mm));
    let info = minimise_or_fall_back(&model, &held, &amg, &mut u, &cg, observe);
    Ok(Solved {
        sites: sites.len(),
        dropped: sites.dropped,
        unknowns: held.free::<3>(),
        iterations: info.iterations,
        residual: info.residual,
        ended: info.ended,
        moduli: assess(&model, &sites, case.boundary, &loaded, &u, &info),
    })
}

/// Which unknowns are held, and a start that meets them: the field of a homogeneous bar.
fn supports(sites: &Sites, params: &SolveParams, displacement_mm: f64) -> (Held, Vec<[f64; 3]>) {
    let axis = params.axis.index();
    let grips = sites.grips;
    let mut held = Held::none(sites.len());
    let mut u = vec![[0.0; 3]; sites.len()];
    for (s, u) in u.iter_mut().enumerate() {
        let plane = sites.plane(s);
        let along = f64::from(plane.clamp(grips.low, grips.high) - grips.low);
        u[axis] = displacement_mm * along / f64::from(grips.high - grips.low);
        let gripped = grips.holds(plane);
        for c in 0..3 {
            let confined = params.load == Load::Confined && c != axis && sites.on_side(s, c);
            let bonded = gripped && (c == axis || params.ends == Ends::Bonded);
            if confined || bonded {
                held.hold(s, c);
            }
        }
    }
    (held, u)
}

fn assess(
    model: &Lattice,
    sites: &Sites,
    boundary: Boundary,
    loaded: &Loaded,
    u: &[[f64; 3]],
    info: &CgInfo,
) -> Moduli {
    let axis = sites.frame.axis.index();
    let mut force = vec![[0.0; 3]; sites.len()];
    model.apply(u, &mut force);
    let high = |s: &usize| sites.plane(*s) >= sites.grips.high;
    let reaction: f64 = (0..sites.len()).filter(high).map(|s| force[s][axis]).sum();
    let firm = boundary == Boundary::Firm;
    let virial = sum_chunks(sites.len(), |range| {
        let counted = |s: &usize| !firm || sites.fully_coordinated(*s);
        range.filter(counted).map(|s| model.site_virial(u, s)).sum()
    });
    let from_energy_mpa = loaded.from_energy(info.energy);
    let from_stress_mpa = loaded.from_virial(virial);
    let relative = info.energy_error / info.energy;
    let (e_app_mpa, algebraic_error_mpa) = if firm {
        (from_stress_mpa, relative.sqrt() * from_stress_mpa.abs())
    } else {
        (from_energy_mpa, relative * from_energy_mpa)
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
pub fn label(row: Row, case: &Case) -> Row {
    let [x, y, z] = case.registration_mm;
    Row {
        method: "lattice".into(),
        structure: case.structure.name().into(),
        boundary: Some(case.boundary.name().into()),
        lp_mm: case.lp_mm,
        registration: Some(format!("{x};{y};{z}")),
        ..row
    }
}
