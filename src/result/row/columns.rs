//! Owns the columns of `results.csv`, in their order. Missing values are `None` here and `NA` in the file.

use crate::grid::Axis;
use crate::result::notes::NO_ANSWER;
use crate::result::row::{FailureLoad, Marks, Row, Solution};
use crate::result::settings::load_steps::LoadSteps;
use crate::result::settings::{
    BoundaryRule, CellType, Elements, Load, Method, Sed, Settings, Supports,
};
use crate::result::strength::Strength;
use serde::{Deserialize, Serialize};

/// A row as files hold it. What the columns mean is at the fields of [`Settings`], [`Solution`] and [`Marks`].
#[derive(Serialize, Deserialize)]
pub(super) struct Columns {
    scan: String,
    method: Method,
    structure: CellType,
    boundary: Option<BoundaryRule>,
    lp_mm: f64,
    /// `x;y;z` in mm.
    registration: Option<String>,
    /// One edge where voxels are cubes, `x;y;z` otherwise.
    voxel_mm: String,
    young_mpa: f64,
    poisson: f64,
    load: Load,
    ends: Supports,
    axis: Axis,
    strain: f64,
    grip_mm: f64,
    tv_definition: String,
    tv_mm3: f64,
    bv_tv: f64,
    sites: Option<u64>,
    dropped_sites: Option<u64>,
    unknowns: Option<u64>,
    iterations: Option<u64>,
    residual: Option<f64>,
    converged: Option<bool>,
    e_app_mpa: Option<f64>,
    e_app_reaction_mpa: Option<f64>,
    e_app_stress_mpa: Option<f64>,
    algebraic_error_mpa: Option<f64>,
    discretization_error_mpa: Option<f64>,
    wall_s: Option<f64>,
    peak_mib: Option<f64>,
    mean_thickness_mm: Option<f64>,
    tolerance: Option<f64>,
    note: Option<String>,
    group: Option<String>,
    subject: Option<String>,
    mechanisms: Option<u64>,
    material: Option<String>,
    failure_load_n: Option<f64>,
    failure_factor: Option<f64>,
    tb_th_mm: Option<f64>,
    tb_sp_mm: Option<f64>,
    conn_d_per_mm3: Option<f64>,
    da: Option<f64>,
    #[serde(default)]
    elements: Option<Elements>,
    #[serde(default)]
    shape_error_mpa: Option<f64>,
    /// Algebraic, discretisation and shape error together.
    #[serde(default)]
    error_mpa: Option<f64>,
    #[serde(default)]
    threshold_sensitivity: Option<f64>,
    #[serde(default)]
    surface_energy_ratio: Option<f64>,
    #[serde(default)]
    angle_deg: Option<f64>,
    #[serde(default)]
    stiffness_n_per_mm: Option<f64>,
    #[serde(default)]
    force_n: Option<f64>,
    #[serde(default)]
    moment_nmm: Option<f64>,
    #[serde(default)]
    algebraic_error_percent: Option<f64>,
    #[serde(default)]
    failure_moment_nmm: Option<f64>,
    #[serde(default)]
    failure_displacement_mm: Option<f64>,
    #[serde(default)]
    failure_strain: Option<f64>,
    #[serde(default)]
    sed: Option<Sed>,
    #[serde(default)]
    plasticity: Option<String>,
    #[serde(default)]
    steps: Option<LoadSteps>,
    #[serde(default)]
    yield_stress_mpa: Option<f64>,
    #[serde(default)]
    yield_strain: Option<f64>,
    #[serde(default)]
    max_stress_mpa: Option<f64>,
    #[serde(default)]
    yield_stress_error_mpa: Option<f64>,
    #[serde(default)]
    max_stress_error_mpa: Option<f64>,
    #[serde(default)]
    model_bv_tv: Option<f64>,
    #[serde(default)]
    supports: Option<String>,
}

impl From<Row> for Columns {
    fn from(row: Row) -> Self {
        let error_mpa = row.error_mpa();
        let Row { key, solved, marks } = row;
        let solved = solved.unwrap_or_default();
        Columns {
            scan: key.scan,
            method: key.method,
            structure: key.structure,
            boundary: key.boundary,
            lp_mm: key.lp_mm,
            registration: key.registration_mm.map(triple),
            voxel_mm: edges(key.voxel_mm),
            young_mpa: key.young_mpa,
            poisson: key.poisson,
            load: key.load,
            ends: key.supports,
            axis: key.axis,
            strain: key.strain,
            grip_mm: key.grip_mm,
            tv_definition: key.tv_definition,
            tv_mm3: key.tv_mm3,
            bv_tv: key.bv_tv,
            sites: solved.sites,
            dropped_sites: solved.dropped_sites,
            unknowns: solved.unknowns,
            iterations: solved.iterations,
            residual: solved.residual,
            converged: solved.converged,
            e_app_mpa: solved.e_app_mpa,
            e_app_reaction_mpa: solved.e_app_reaction_mpa,
            e_app_stress_mpa: solved.e_app_stress_mpa,
            algebraic_error_mpa: solved.algebraic_error_mpa,
            discretization_error_mpa: solved.discretization_error_mpa,
            wall_s: solved.wall_s,
            peak_mib: solved.peak_mib,
            mean_thickness_mm: marks.mean_thickness_mm,
            tolerance: key.tolerance,
            note: marks.note,
            group: marks.group,
            subject: marks.subject,
            mechanisms: solved.mechanisms,
            material: key.material,
            failure_load_n: solved.failure.and_then(|f| f.load_n),
            failure_factor: solved.failure.map(|f| f.factor),
            tb_th_mm: marks.tb_th_mm,
            tb_sp_mm: marks.tb_sp_mm,
            conn_d_per_mm3: marks.conn_d_per_mm3,
            da: marks.da,
            elements: key.elements,
            shape_error_mpa: solved.shape_error_mpa,
            error_mpa,
            threshold_sensitivity: solved.threshold_sensitivity,
            surface_energy_ratio: solved.surface_energy_ratio,
            angle_deg: key.angle_deg,
            stiffness_n_per_mm: solved.stiffness_n_per_mm,
            force_n: solved.force_n,
            moment_nmm: solved.moment_nmm,
            algebraic_error_percent: solved.algebraic_error_percent,
            failure_moment_nmm: solved.failure.and_then(|f| f.moment_nmm),
            failure_displacement_mm: solved.failure.and_then(|f| f.displacement_mm),
            failure_strain: solved.failure.and_then(|f| f.strain),
            sed: key.sed,
            plasticity: key.plasticity,
            steps: key.steps,
            yield_stress_mpa: solved.strength.yield_stress_mpa,
            yield_strain: solved.strength.yield_strain,
            max_stress_mpa: solved.strength.max_stress_mpa,
            yield_stress_error_mpa: solved.strength.yield_stress_error_mpa,
            max_stress_error_mpa: solved.strength.max_stress_error_mpa,
            model_bv_tv: solved.model_bv_tv,
            supports: key.held_by,
        }
    }
}

impl TryFrom<Columns> for Row {
    type Error = String;

    fn try_from(c: Columns) -> Result<Self, String> {
        let key = Settings {
            scan: c.scan,
            method: c.method,
            structure: c.structure,
            boundary: c.boundary,
            lp_mm: c.lp_mm,
            elements: c.elements,
            registration_mm: match c.registration {
                Some(words) => Some(lengths("registration", &words)?),
                None => None,
            },
            voxel_mm: lengths("voxel_mm", &c.voxel_mm)?,
            young_mpa: c.young_mpa,
            poisson: c.poisson,
            load: c.load,
            supports: c.ends,
            axis: c.axis,
            strain: c.strain,
            angle_deg: c.angle_deg,
            grip_mm: c.grip_mm,
            tv_definition: c.tv_definition,
            tv_mm3: c.tv_mm3,
            bv_tv: c.bv_tv,
            tolerance: c.tolerance,
            material: c.material,
            sed: c.sed,
            plasticity: c.plasticity,
            steps: c.steps,
            held_by: c.supports,
        };
        let solved = Solution {
            sites: c.sites,
            model_bv_tv: c.model_bv_tv,
            dropped_sites: c.dropped_sites,
            unknowns: c.unknowns,
            iterations: c.iterations,
            residual: c.residual,
            converged: c.converged,
            e_app_mpa: c.e_app_mpa,
            e_app_reaction_mpa: c.e_app_reaction_mpa,
            e_app_stress_mpa: c.e_app_stress_mpa,
            algebraic_error_mpa: c.algebraic_error_mpa,
            algebraic_error_percent: c.algebraic_error_percent,
            force_n: c.force_n,
            moment_nmm: c.moment_nmm,
            stiffness_n_per_mm: c.stiffness_n_per_mm,
            discretization_error_mpa: c.discretization_error_mpa,
            shape_error_mpa: c.shape_error_mpa,
            threshold_sensitivity: c.threshold_sensitivity,
            surface_energy_ratio: c.surface_energy_ratio,
            wall_s: c.wall_s,
            peak_mib: c.peak_mib,
            mechanisms: c.mechanisms,
            strength: Strength {
                yield_stress_mpa: c.yield_stress_mpa,
                yield_strain: c.yield_strain,
                max_stress_mpa: c.max_stress_mpa,
                yield_stress_error_mpa: c.yield_stress_error_mpa,
                max_stress_error_mpa: c.max_stress_error_mpa,
            },
            failure: c.failure_factor.map(|factor| FailureLoad {
                factor,
                load_n: c.failure_load_n,
                moment_nmm: c.failure_moment_nmm,
                displacement_mm: c.failure_displacement_mm,
                strain: c.failure_strain,
            }),
        };
        Ok(Row {
            key,
            solved: (solved != Solution::default()).then_some(solved),
            marks: Marks {
                // Files hold it as words.
                is_no_answer: c
                    .note
                    .as_deref()
                    .is_some_and(|note| note.contains(NO_ANSWER)),
                note: c.note,
                group: c.group,
                subject: c.subject,
                mean_thickness_mm: c.mean_thickness_mm,
                tb_th_mm: c.tb_th_mm,
                tb_sp_mm: c.tb_sp_mm,
                conn_d_per_mm3: c.conn_d_per_mm3,
                da: c.da,
            },
        })
    }
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("{x};{y};{z}")
}

fn edges(mm: [f64; 3]) -> String {
    let [x, y, z] = mm;
    if x == y && y == z {
        x.to_string()
    } else {
        triple(mm)
    }
}

/// Three lengths, or one for all.
fn lengths(column: &str, words: &str) -> Result<[f64; 3], String> {
    let parts: Result<Vec<f64>, _> = words.split(';').map(str::parse).collect();
    match parts.as_deref() {
        Ok(&[x]) => Ok([x; 3]),
        Ok(&[x, y, z]) => Ok([x, y, z]),
        _ => Err(format!(
            "expected a length or three as x;y;z in column `{column}`, found `{words}`"
        )),
    }
}
