//! Owns the record of one solve, a row of `results.csv`: the settings that it follows from, what was solved, and marks.

mod columns;

use crate::result::settings::Settings;
use crate::result::strength::Strength;
use columns::Columns;
use serde::{Deserialize, Serialize};

/// One row of results. In files it is flat: a column for each value, in the order of `columns.rs`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(try_from = "Columns", into = "Columns")]
pub struct Row {
    /// What the row follows from.
    pub key: Settings,
    /// None before the solve.
    pub solved: Option<Solution>,
    /// What is known of it apart from that.
    pub marks: Marks,
}

/// Numbers of a solve. What does not apply, or is not known, is None.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solution {
    /// Lattice sites or elements that carry load.
    pub sites: Option<u64>,
    /// Volume of the model that carries load (cells of sites, of connected and weighted lattices their bone; elements) over TV.
    pub model_bv_tv: Option<f64>,
    /// Sites or elements left out because nothing connects them to both ends.
    pub dropped_sites: Option<u64>,
    /// Degrees of freedom.
    pub unknowns: Option<u64>,
    /// Iterations of the solver.
    pub iterations: Option<u64>,
    /// Relative residual at the end.
    pub residual: Option<f64>,
    /// Whether the error of the solver is below the tolerance.
    pub converged: Option<bool>,
    /// The headline: energy for all others; stress of the fully coordinated sites for firm.
    pub e_app_mpa: Option<f64>,
    /// For checks: from the force at the ends. Of firm rows far too large: padded sites carry load.
    pub e_app_reaction_mpa: Option<f64>,
    /// For checks: from the mean stress of all sites (firm: of the fully coordinated ones).
    pub e_app_stress_mpa: Option<f64>,
    /// Estimated error that the solver left in `e_app_mpa`.
    pub algebraic_error_mpa: Option<f64>,
    /// Of modulus, stiffness, force and moment alike, over their value.
    pub algebraic_error_percent: Option<f64>,
    /// Of the moved end, magnitudes: along its displacement, or about the axis of its turn (of bending the mean of both ends).
    pub force_n: Option<f64>,
    /// The moment of bending and torsion.
    pub moment_nmm: Option<f64>,
    /// Force over the displacement of the ends.
    pub stiffness_n_per_mm: Option<f64>,
    /// Estimated error of the resolution.
    pub discretization_error_mpa: Option<f64>,
    /// What voxels, and the blur of the scan, leave open about the bone's surface.
    pub shape_error_mpa: Option<f64>,
    /// Relative change of E_app per relative change of bone volume, all of the surface moved by one length.
    pub threshold_sensitivity: Option<f64>,
    /// Energy density at the surface over that of all bone: stated errors scale with it.
    pub surface_energy_ratio: Option<f64>,
    /// Wall time of the solve; longer where scans share the cores (`run --jobs`).
    pub wall_s: Option<f64>,
    /// Largest resident memory of the process during the solve. None where several scans share the process.
    pub peak_mib: Option<f64>,
    /// Motions that cost next to no energy, rigid motions of the whole apart; where `--mechanisms` asks for them.
    pub mechanisms: Option<u64>,
    /// By Pistoia's criterion, on request.
    pub failure: Option<FailureLoad>,
    /// Of tissue that yields.
    pub strength: Strength,
}

/// Failure; magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FailureLoad {
    /// What the load is multiplied by.
    pub factor: f64,
    /// None under bending and torsion.
    pub load_n: Option<f64>,
    /// None under forces.
    pub moment_nmm: Option<f64>,
    /// Displacement of the ends. None under bending and torsion.
    pub displacement_mm: Option<f64>,
    /// Nominal strain. None under bending and torsion.
    pub strain: Option<f64>,
}

/// What is known of a row or of its specimen apart from the solve.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Marks {
    /// The model lost the path that the bone has, or has nothing to measure it by: its modulus of 0 is not the bone's.
    pub is_no_answer: bool,
    /// What a reader must know of this row (no path between the faces, not converged, ...).
    pub note: Option<String>,
    /// From a manifest.
    pub group: Option<String>,
    /// From a manifest: who the scan is of.
    pub subject: Option<String>,
    /// Quick estimate of the struts' thickness, 2 BV / BS.
    pub mean_thickness_mm: Option<f64>,
    /// Of the whole mask, where `segment --morphometry` measured it: mean local thickness of bone and of pores,
    /// connectivity density, degree of anisotropy by mean intercept lengths.
    pub tb_th_mm: Option<f64>,
    /// Mean local thickness of the pores (Tb.Sp).
    pub tb_sp_mm: Option<f64>,
    /// Connectivity density (Conn.D).
    pub conn_d_per_mm3: Option<f64>,
    /// Degree of anisotropy (DA); 1 is isotropic.
    pub da: Option<f64>,
}

impl Row {
    /// The headline modulus; None before the solve and under loads that have none.
    pub fn e_app_mpa(&self) -> Option<f64> {
        self.solved.as_ref()?.e_app_mpa
    }

    /// Whether the error of the solver is below the tolerance; None before the solve.
    pub fn converged(&self) -> Option<bool> {
        self.solved.as_ref()?.converged
    }

    /// Wall time of the solve in seconds.
    pub fn wall_s(&self) -> Option<f64> {
        self.solved.as_ref()?.wall_s
    }

    /// Stated errors in MPa: of the solver; of the discretisation and of the shape together, None unless both are known.
    pub fn stated_errors_mpa(&self) -> [Option<f64>; 2] {
        let Some(s) = &self.solved else {
            return [None, None];
        };
        let model = s.discretization_error_mpa.zip(s.shape_error_mpa);
        [s.algebraic_error_mpa, model.map(|(d, shape)| d + shape)]
    }

    /// Takes all stated errors out of the row.
    pub fn state_no_errors(&mut self) {
        if let Some(solved) = &mut self.solved {
            solved.algebraic_error_mpa = None;
            solved.algebraic_error_percent = None;
            solved.discretization_error_mpa = None;
            solved.shape_error_mpa = None;
        }
    }

    /// Everything that is stated of the modulus, in MPa: algebraic, discretisation and shape error. None unless the last two
    /// are known. None where no bone joins the loaded faces: a threshold alone can change that.
    pub fn error_mpa(&self) -> Option<f64> {
        if self.is_disconnected() {
            return None;
        }
        let [algebraic, model] = self.stated_errors_mpa();
        Some(algebraic.unwrap_or(0.0) + model?)
    }

    /// The same over the modulus.
    pub fn error(&self) -> Option<f64> {
        let e_app_mpa = self.e_app_mpa().filter(|e| *e > 0.0)?;
        Some(self.error_mpa()? / e_app_mpa).filter(|e| e.is_finite())
    }

    /// The relative error of what the row answers: of the strength where tissue yields, else of the modulus. None where it is not stated.
    pub fn answered_error(&self) -> Option<f64> {
        match self.key.plasticity {
            None => self.error(),
            Some(_) => self.solved.as_ref()?.strength.error(),
        }
    }

    /// Whether no bone carries load from face to face: E_app is 0.
    pub fn is_disconnected(&self) -> bool {
        self.carries_nothing() && !self.is_no_answer()
    }

    /// Whether the model carries no load, be it that of the bone or not.
    pub fn carries_nothing(&self) -> bool {
        self.load_carried() == Some(0.0)
    }

    /// The number that answers the load: modulus, force in N or moment in N mm.
    pub fn load_carried(&self) -> Option<f64> {
        let solved = self.solved.as_ref()?;
        let loads = solved.force_n.or(solved.moment_nmm);
        match self.key.load.has_modulus() {
            true => solved.e_app_mpa,
            false => loads,
        }
    }

    /// Force in N, or moment in N mm, of the moved end, a magnitude.
    pub fn load_carried_by_ends(&self) -> Option<f64> {
        let solved = self.solved.as_ref()?;
        solved.force_n.or(solved.moment_nmm)
    }

    /// Failure by Pistoia's criterion; None where it was not asked for.
    pub fn failure(&self) -> Option<FailureLoad> {
        self.solved.as_ref()?.failure
    }

    /// Whether the model lost the path that the bone has, or has nothing to measure it by: its modulus of 0 is not the bone's.
    pub fn is_no_answer(&self) -> bool {
        self.marks.is_no_answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::table::{read, to_csv, write};
    use crate::result::settings::{BoundaryRule, CellType, Conditions, Load, Method, Supports};

    /// The contract's columns, in order; more may follow.
    const COLUMNS: &str = "scan,method,structure,boundary,lp_mm,registration,voxel_mm,young_mpa,poisson,load,ends,axis,\
        strain,grip_mm,tv_definition,tv_mm3,bv_tv,sites,dropped_sites,unknowns,iterations,residual,converged,e_app_mpa,\
        e_app_reaction_mpa,e_app_stress_mpa,algebraic_error_mpa,discretization_error_mpa,wall_s,peak_mib";

    fn row() -> Row {
        Row {
            key: Settings {
                scan: "core, \"left\"".to_owned(),
                method: Method::VoxelFe,
                structure: CellType::Hex8,
                boundary: Some(BoundaryRule::Extrapolated),
                lp_mm: 0.1 + 0.2,
                registration_mm: Some([0.0, -0.01, 1e-7]),
                voxel_mm: [0.02, 0.02, 0.03],
                load: Load::Stiffness,
                supports: Supports::Faces(Conditions::Mixed),
                ..Settings::default()
            },
            solved: Some(Solution {
                residual: Some(1.0 / 3.0 * 1e-12),
                sites: Some(7),
                converged: Some(false),
                failure: Some(FailureLoad {
                    load_n: Some(2.5),
                    factor: 0.5,
                    ..FailureLoad::default()
                }),
                ..Solution::default()
            }),
            marks: Marks {
                da: Some(1.25),
                ..Marks::default()
            },
        }
    }

    #[test]
    fn the_columns_are_the_contracts() {
        assert!(to_csv::<Row>(&[]).starts_with(COLUMNS));
    }

    #[test]
    fn values_are_words_and_missing_ones_are_na() {
        let text = to_csv(&[row()]);
        let line = text.lines().nth(1).unwrap();
        assert!(
            line.starts_with(
                "\"core, \"\"left\"\"\",voxel-fe,hex8,extrapolated,0.30000000000000004,0;-0.01;0.0000001,0.02;0.02;0.03,\
                 0.0,0.0,stiffness,mixed,z,"
            ),
            "{line}"
        );
        assert!(
            line.contains(",2.5,0.5,NA,NA,NA,1.25,NA,NA,NA,NA,"),
            "{line}"
        );
    }

    #[test]
    fn rows_survive_writing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        write(&path, &[row(), Row::default()]).unwrap();
        assert_eq!(read::<Row>(&path).unwrap(), [row(), Row::default()]);
    }

    #[test]
    fn a_table_of_something_else_is_refused_with_its_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        let whole = to_csv(&[Row::default()]);
        for (from, to, expected) in [
            (",0.0,", ",thick,", "lp_mm"),
            ("lattice", "plates", "plates"),
            (
                ",sc,",
                ",hcp,",
                "one of sc, bcc, fcc, hex8, tet10, found `hcp`",
            ),
            (",sc,NA,", ",sc,ffg,", "ffb, extrapolated, found `ffg`"),
            (
                ",free,",
                ",glued,",
                "bonded, kinematic, mixed, symshear, labels, found `glued`",
            ),
            ("NA,0,0.0", "1;2,0,0.0", "registration"),
            ("method", "methods", "missing field `method`"),
        ] {
            let text = whole.replacen(from, to, 1);
            assert_ne!(text, whole, "{from}");
            std::fs::write(&path, text).unwrap();
            let words = read::<Row>(&path).unwrap_err().to_string();
            assert!(
                words.contains("results.csv") && words.contains(expected),
                "{expected}: {words}"
            );
        }
    }
}
