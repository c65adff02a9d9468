//! Owns the solve stage: material, load, supports and accuracy in, apparent moduli out.

use crate::error::{Error, Result};
use crate::grid::Axis;
use crate::measure::apparent::Loaded;
use crate::operator::Operator;
use crate::operator::held::{Constrained, Held};
use crate::par::sum_chunks;
use crate::physics::lattice::{self, Lattice};
use crate::solve::cg::{CgInfo, CgParams, CgStep, Ended, minimise};
use crate::solve::jacobi::Jacobi;
use crate::stage::lattice::{Boundary, Case, build};
use crate::topology::sites::Sites;
use crate::volume::Specimen;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    #[default]
    Lattice,
    VoxelFe,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Load {
    #[default]
    Uniaxial,
    /// Sides held against lateral motion.
    Confined,
    /// All six unit strains: the apparent stiffness matrix.
    Stiffness,
}

/// What the gripped sites may do sideways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Ends {
    #[default]
    Free,
    Bonded,
}

/// Settings of `solve`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveParams {
    pub method: Method,
    pub young_mpa: f64,
    pub poisson: f64,
    /// Nominal strain u / L_g; negative is compression.
    pub strain: f64,
    /// Thickness of each grip; 0: the end planes.
    pub grip_mm: f64,
    pub load: Load,
    pub ends: Ends,
    pub axis: Axis,
    /// Relative algebraic error allowed in the headline modulus (0.001 is 0.1 %).
    pub tolerance: f64,
    pub max_iterations: usize,
}

impl Default for SolveParams {
    fn default() -> Self {
        SolveParams {
            method: Method::Lattice,
            young_mpa: 1000.0,
            poisson: 0.3,
            strain: -0.01,
            grip_mm: 0.0,
            load: Load::Uniaxial,
            ends: Ends::Free,
            axis: Axis::Z,
            tolerance: 1e-3,
            max_iterations: 200_000,
        }
    }
}

/// A number with the part of it that the solver left undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// The headline (see [`crate::measure::row::Row::e_app_mpa`]).
    pub e_app_mpa: f64,
    pub from_energy_mpa: f64,
    pub from_reaction_mpa: f64,
    /// Over all sites; for firm over the fully coordinated ones.
    pub from_stress_mpa: f64,
    /// Estimated algebraic error of the headline.
    pub algebraic_error_mpa: f64,
}

/// A solved model.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    pub sites: usize,
    pub dropped: usize,
    pub unknowns: usize,
    pub iterations: usize,
    pub residual: f64,
    pub ended: Ended,
    pub moduli: Moduli,
}

impl Solved {
    /// The result of a structure that does not connect the faces.
    fn disconnected(dropped: usize) -> Self {
        let zero = Moduli {
            e_app_mpa: 0.0,
            from_energy_mpa: 0.0,
            from_reaction_mpa: 0.0,
            from_stress_mpa: 0.0,
            algebraic_error_mpa: 0.0,
        };
        Solved {
            sites: 0,
            dropped,
            unknowns: 0,
            iterations: 0,
            residual: 0.0,
            ended: Ended::ResidualTolerance,
            moduli: zero,
        }
    }

    /// Whether bone connects the loaded faces.
    pub fn connected(&self) -> bool {
        self.sites > 0
    }
}

impl SolveParams {
    /// Refuses what is no elastic material, no load or no accuracy.
    pub fn check(&self) -> Result<()> {
        let rules = [
            (
                "solve.young_mpa",
                self.young_mpa,
                self.young_mpa > 0.0,
                "a modulus in MPa above 0 (the paper: 1000)",
            ),
            (
                "solve.poisson",
                self.poisson,
                self.poisson > -1.0 && self.poisson < 0.5,
                "a ratio above -1 and below 0.5 (bone: 0.3; at 0.5 the material is incompressible and has no stiffness matrix)",
            ),
            (
                "solve.strain",
                self.strain,
                self.strain != 0.0,
                "a strain other than 0; negative is compression (the paper: -0.0042)",
            ),
            (
                "solve.grip_mm",
                self.grip_mm,
                self.grip_mm >= 0.0,
                "a thickness in mm; 0 grips the end planes (the paper: 0.6)",
            ),
            (
                "solve.tolerance",
                self.tolerance,
                self.tolerance > 0.0 && self.tolerance < 1.0,
                "a relative error between 0 and 1 (0.001 is 0.1 %)",
            ),
        ];
        for (key, value, ok, expected) in rules {
            if !ok || !value.is_finite() {
                return Err(Error::setting(
                    key,
                    format!("not usable: {value}"),
                    format!("give {expected}"),
                ));
            }
        }
        if self.max_iterations == 0 {
            return Err(Error::setting(
                "solve.max_iterations",
                "0 iterations solve nothing",
                "give 1 or more",
            ));
        }
        Ok(())
    }
}

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
            "the apparent stiffness matrix is computed by the voxel-fe method only",
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
    let preconditioner = Jacobi::new(&Constrained {
        inner: &model,
        held: &held,
    });
    let info = minimise(&model, &held, &preconditioner, &mut u, &cg, observe);
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
    for s in 0..sites.len() {
        let plane = sites.plane(s);
        let along = f64::from(plane.clamp(grips.low, grips.high) - grips.low);
        u[s][axis] = displacement_mm * along / f64::from(grips.high - grips.low);
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
