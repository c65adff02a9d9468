//! Owns the record of one solve: a row of `results.csv`. Missing values are `None` here and `NA` in the file.

use serde::{Deserialize, Serialize};

/// One row of `results.csv`, its columns in the order of the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct Row {
    pub scan: String,
    /// `lattice` or `voxel-fe`.
    pub method: String,
    /// `sc`, `bcc`, `fcc` or `hex8`.
    pub structure: String,
    /// `firm`, `floppy`, `graded`, `ffb`, `extrapolated`; None for voxel FE.
    pub boundary: Option<String>,
    /// Lattice parameter, or element size for voxel FE.
    pub lp_mm: f64,
    /// Offset of the lattice, `x;y;z` in mm.
    pub registration: Option<String>,
    /// Voxel edge; `x;y;z` where they differ.
    pub voxel_mm: String,
    pub young_mpa: f64,
    pub poisson: f64,
    pub load: String,
    pub ends: String,
    pub axis: String,
    pub strain: f64,
    /// 0 for end planes.
    pub grip_mm: f64,
    pub tv_definition: String,
    pub tv_mm3: f64,
    pub bv_tv: f64,
    pub sites: Option<u64>,
    pub dropped_sites: Option<u64>,
    pub unknowns: Option<u64>,
    pub iterations: Option<u64>,
    pub residual: Option<f64>,
    pub converged: Option<bool>,
    /// The headline: energy for floppy, graded and voxel FE; stress of the fully coordinated sites for firm.
    pub e_app_mpa: Option<f64>,
    pub e_app_reaction_mpa: Option<f64>,
    pub e_app_stress_mpa: Option<f64>,
    pub algebraic_error_mpa: Option<f64>,
    pub discretization_error_mpa: Option<f64>,
    pub wall_s: Option<f64>,
    pub peak_mib: Option<f64>,
    /// Quick estimate of the struts' thickness, 2 BV / BS.
    pub mean_thickness_mm: Option<f64>,
    /// Relative algebraic error asked for in the headline.
    pub tolerance: Option<f64>,
    /// What a reader must know of this row (no path between the faces, not converged, ...).
    pub note: Option<String>,
    /// From a manifest.
    pub group: Option<String>,
    pub subject: Option<String>,
    /// Motions that cost next to no energy, rigid motions of the whole apart; where `--mechanisms` asks for them.
    pub mechanisms: Option<u64>,
    /// The law by which tissue differs from voxel to voxel; `young_mpa` is then the bone's mean.
    pub material: Option<String>,
    /// By Pistoia's criterion, on request: magnitude of the reaction at failure, and what the load is multiplied by.
    pub failure_load_n: Option<f64>,
    pub failure_factor: Option<f64>,
    /// Of the whole mask, where `segment --morphometry` measured it: mean local thickness of bone and of pores,
    /// connectivity density, degree of anisotropy by mean intercept lengths.
    pub tb_th_mm: Option<f64>,
    pub tb_sp_mm: Option<f64>,
    pub conn_d_per_mm3: Option<f64>,
    pub da: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::table::{read, to_csv, write};

    /// The contract's columns, in order; more may follow.
    const COLUMNS: &str = "scan,method,structure,boundary,lp_mm,registration,voxel_mm,young_mpa,poisson,load,ends,axis,\
        strain,grip_mm,tv_definition,tv_mm3,bv_tv,sites,dropped_sites,unknowns,iterations,residual,converged,e_app_mpa,\
        e_app_reaction_mpa,e_app_stress_mpa,algebraic_error_mpa,discretization_error_mpa,wall_s,peak_mib";

    fn row() -> Row {
        Row {
            scan: "core, \"left\"".to_owned(),
            lp_mm: 0.1 + 0.2,
            voxel_mm: "0.02".to_owned(),
            residual: Some(1.0 / 3.0 * 1e-12),
            sites: Some(7),
            converged: Some(false),
            ..Row::default()
        }
    }

    #[test]
    fn the_columns_are_the_contracts() {
        assert!(to_csv::<Row>(&[]).starts_with(COLUMNS));
    }

    #[test]
    fn missing_values_are_na() {
        let text = to_csv(&[row()]);
        assert!(
            text.lines().nth(1).unwrap().ends_with(",NA,NA,NA,NA"),
            "{text}"
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
    fn a_table_of_something_else_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        std::fs::write(&path, "scan,lp_mm\na,thick\n").unwrap();
        let words = read::<Row>(&path).unwrap_err().to_string();
        assert!(
            words.contains("results.csv") && words.contains("lp_mm"),
            "{words}"
        );
    }
}
