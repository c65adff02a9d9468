//! Owns the E_app table: one line per scan, structure and lattice parameter, one column per way of finding the modulus.

use super::{Model, distinct};
use crate::result::row::Row;
use crate::result::settings::CellType;
use serde::{Deserialize, Serialize};

/// One line of the E_app table. `_over_tissue` is E_app over the tissue's Young's modulus.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Line {
    pub scan: String,
    pub structure: CellType,
    pub lp_mm: f64,
    /// The settings in which lines of this table differ, in words.
    pub condition: Option<String>,
    pub bv_tv: f64,
    pub young_mpa: f64,
    pub floppy_mpa: Option<f64>,
    pub firm_mpa: Option<f64>,
    pub ffb_mpa: Option<f64>,
    pub graded_mpa: Option<f64>,
    pub voxel_fe_mpa: Option<f64>,
    pub graded_extrapolated_mpa: Option<f64>,
    pub voxel_fe_extrapolated_mpa: Option<f64>,
    pub geometry_fe_mpa: Option<f64>,
    pub floppy_over_tissue: Option<f64>,
    pub firm_over_tissue: Option<f64>,
    pub ffb_over_tissue: Option<f64>,
    pub graded_over_tissue: Option<f64>,
    pub voxel_fe_over_tissue: Option<f64>,
    pub graded_extrapolated_over_tissue: Option<f64>,
    pub voxel_fe_extrapolated_over_tissue: Option<f64>,
    pub geometry_fe_over_tissue: Option<f64>,
    /// All solves of the line together.
    pub wall_s: Option<f64>,
    /// Stated error of the solver, and of discretisation and shape together, of each model's modulus in MPa, by [`Model`]. Not a column: the rows of
    /// `results.csv` hold them.
    #[serde(skip)]
    pub errors_mpa: [[Option<f64>; 2]; Model::ALL.len()],
}

impl Line {
    pub fn modulus(&self, model: Model) -> Option<f64> {
        match model {
            Model::Floppy => self.floppy_mpa,
            Model::Firm => self.firm_mpa,
            Model::Ffb => self.ffb_mpa,
            Model::Graded => self.graded_mpa,
            Model::VoxelFe => self.voxel_fe_mpa,
            Model::GradedLimit => self.graded_extrapolated_mpa,
            Model::VoxelFeLimit => self.voxel_fe_extrapolated_mpa,
            Model::GeometryFe => self.geometry_fe_mpa,
        }
    }

    /// Stated error of the solver, and of discretisation and shape together, in MPa, each where there is one.
    pub fn stated_errors(&self, model: Model) -> [Option<f64>; 2] {
        self.errors_mpa[model as usize]
    }

    fn add(&mut self, model: Model, row: &Row) {
        self.errors_mpa[model as usize] = row.stated_errors_mpa();
        let (modulus, ratio) = match model {
            Model::Floppy => (&mut self.floppy_mpa, &mut self.floppy_over_tissue),
            Model::Firm => (&mut self.firm_mpa, &mut self.firm_over_tissue),
            Model::Ffb => (&mut self.ffb_mpa, &mut self.ffb_over_tissue),
            Model::Graded => (&mut self.graded_mpa, &mut self.graded_over_tissue),
            Model::VoxelFe => (&mut self.voxel_fe_mpa, &mut self.voxel_fe_over_tissue),
            Model::GradedLimit => (
                &mut self.graded_extrapolated_mpa,
                &mut self.graded_extrapolated_over_tissue,
            ),
            Model::VoxelFeLimit => (
                &mut self.voxel_fe_extrapolated_mpa,
                &mut self.voxel_fe_extrapolated_over_tissue,
            ),
            Model::GeometryFe => (&mut self.geometry_fe_mpa, &mut self.geometry_fe_over_tissue),
        };
        *modulus = row.e_app_mpa();
        *ratio = row.e_app_mpa().map(|e| e / row.key.young_mpa);
        // Times of means and limits are those of their solves.
        if !row.key.is_derived() {
            self.wall_s = match (self.wall_s, row.wall_s()) {
                (Some(a), Some(b)) => Some(a + b),
                (a, b) => a.or(b),
            };
        }
    }
}

/// The table of `rows`, in their order.
pub fn lines(rows: &[Row]) -> Vec<Line> {
    let varying = varying_settings(rows);
    let mut lines: Vec<Line> = Vec::new();
    for row in rows {
        let Some(model) = Model::of(row) else {
            continue;
        };
        let condition = condition(row, &varying);
        let same = |line: &&mut Line| {
            line.scan == row.key.scan
                && line.structure == row.key.structure
                && line.lp_mm == row.key.lp_mm
                && line.condition == condition
        };
        match lines.iter_mut().find(same) {
            Some(line) => line.add(model, row),
            None => {
                let mut line = Line {
                    scan: row.key.scan.clone(),
                    structure: row.key.structure,
                    lp_mm: row.key.lp_mm,
                    condition,
                    bv_tv: row.key.bv_tv,
                    young_mpa: row.key.young_mpa,
                    ..Line::default()
                };
                line.add(model, row);
                lines.push(line);
            }
        }
    }
    lines
}

/// The settings of a row that may set it apart from another of the same scan, structure and lattice parameter, in words.
fn settings(row: &Row) -> [String; 8] {
    let key = &row.key;
    let [x, y, z] = key.registration_mm.unwrap_or([0.0; 3]);
    [
        format!("axis {}", key.axis.name()),
        format!("load {}", key.load.name()),
        format!("ends {}", key.supports.name()),
        // By a law the bone's mean modulus is the scan's own, no setting.
        match &key.material {
            Some(law) => format!("tissue {law}"),
            None => format!("E {} MPa", key.young_mpa),
        },
        format!("ν {}", key.poisson),
        format!("strain {}", key.strain),
        format!("grip {} mm", key.grip_mm),
        format!("registration {x};{y};{z}"),
    ]
}

/// Which of the settings differ among `rows`.
pub(super) fn varying_settings(rows: &[Row]) -> [bool; 8] {
    let all: Vec<_> = rows.iter().map(settings).collect();
    std::array::from_fn(|i| distinct(all.iter().map(|s| &s[i])).len() > 1)
}

/// The settings of `row` that differ among the rows of its table, in words; None where none does.
pub(super) fn condition(row: &Row, varying: &[bool; 8]) -> Option<String> {
    let words: Vec<String> = settings(row)
        .into_iter()
        .zip(varying)
        .filter_map(|(words, varies)| varies.then_some(words))
        .collect();
    (!words.is_empty()).then(|| words.join(", "))
}
