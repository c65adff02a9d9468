//! Owns the apparent stiffness as a file: JSON, the 6 x 6 matrix itself or an object that holds it as `stiffness_mpa`.

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::measure::stiffness::{Orthotropic, Six};
use crate::measure::zysset_curnier::Plausible;
use crate::pipeline::apparent::SolveParams;
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Deserialize)]
#[serde(untagged)]
enum File {
    Bare(Six),
    Named { stiffness_mpa: Six },
}

/// The content of `stiffness.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StiffnessRecord {
    pub program: String,
    pub version: String,
    pub scan: String,
    /// BLAKE3 of the mask it belongs to.
    pub mask_blake3: String,
    pub settings: SolveParams,
    /// In words.
    pub boundary_conditions: String,
    /// Which stress and strain each row and column is of; shears are engineering shears.
    pub voigt_order: [String; 6],
    pub element_mm: [f64; 3],
    pub bv_tv: f64,
    pub converged: bool,
    /// Of each unit strain.
    pub iterations: [usize; 6],
    pub residual: f64,
    pub stiffness_mpa: Six,
    /// Estimated algebraic error of each entry.
    pub algebraic_error_mpa: Six,
    /// Largest difference of two entries that symmetry makes one, before their mean was taken.
    pub asymmetry_mpa: f64,
    /// None for a stiffness that is not positive definite.
    pub orthotropic: Option<Orthotropic>,
    /// Mean intercept lengths of the bone, the longest first; None where they were not measured.
    #[serde(default)]
    pub mil_mm: Option<[f64; 3]>,
    /// Where the tensor lies among published ones; None for tissue that is not one modulus.
    #[serde(default)]
    pub plausible: Option<Plausible>,
}

/// One line of `stiffness.csv`: the orthotropic constants of a scan; None for a stiffness that is not positive definite.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StiffnessLine {
    pub scan: String,
    pub subject: Option<String>,
    pub group: Option<String>,
    pub conditions: String,
    /// Edges, `x;y;z` where they differ.
    pub element_mm: String,
    pub bv_tv: f64,
    pub e1_mpa: Option<f64>,
    pub e2_mpa: Option<f64>,
    pub e3_mpa: Option<f64>,
    pub g23_mpa: Option<f64>,
    pub g13_mpa: Option<f64>,
    pub g12_mpa: Option<f64>,
    pub nu23: Option<f64>,
    pub nu13: Option<f64>,
    pub nu12: Option<f64>,
    /// Share of the tensor that no orthotropic tensor holds.
    pub not_orthotropic: Option<f64>,
    /// Unit vectors of the frame in the axes of the scan, `x;y;z`.
    pub axis1: Option<String>,
    pub axis2: Option<String>,
    pub axis3: Option<String>,
}

impl StiffnessLine {
    /// `subject` and `group` are those of the manifest.
    pub fn of(
        record: &StiffnessRecord,
        subject: Option<String>,
        group: Option<String>,
    ) -> StiffnessLine {
        let rounded = |v: f64| (v * 1e9).round() / 1e9;
        let triple = |v: [f64; 3]| v.map(|x| rounded(x).to_string()).join(";");
        let [x, y, z] = record.element_mm.map(rounded);
        let constants = record.orthotropic.as_ref();
        let [e1, e2, e3] = [0, 1, 2].map(|i| constants.map(|o| o.young_mpa[i]));
        let [g23, g13, g12] = [0, 1, 2].map(|i| constants.map(|o| o.shear_mpa[i]));
        let [nu23, nu13, nu12] = [0, 1, 2].map(|i| constants.map(|o| o.poisson[i]));
        StiffnessLine {
            scan: record.scan.clone(),
            subject,
            group,
            conditions: record.boundary_conditions.clone(),
            element_mm: match x == y && y == z {
                true => x.to_string(),
                false => triple(record.element_mm),
            },
            bv_tv: record.bv_tv,
            e1_mpa: e1,
            e2_mpa: e2,
            e3_mpa: e3,
            g23_mpa: g23,
            g13_mpa: g13,
            g12_mpa: g12,
            nu23,
            nu13,
            nu12,
            not_orthotropic: constants.map(|o| o.residual),
            axis1: constants.map(|o| triple(o.axes[0])),
            axis2: constants.map(|o| triple(o.axes[1])),
            axis3: constants.map(|o| triple(o.axes[2])),
        }
    }
}

impl StiffnessRecord {
    pub fn voigt_order() -> [String; 6] {
        ["11", "22", "33", "23", "13", "12"].map(str::to_owned)
    }
}

/// Writes `stiffness.json`, whole or not at all.
pub fn write(path: &Path, record: &StiffnessRecord) -> Result<()> {
    let text = serde_json::to_string_pretty(record).expect("plain data");
    atomic::write(path, text)
}

/// What `solve --load stiffness` left; None where there is nothing of this version.
pub fn record(path: &Path) -> Option<StiffnessRecord> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

/// Reads a stiffness in MPa, Voigt order 11, 22, 33, 23, 13, 12 with engineering shears. Its symmetric part is kept:
/// apparent stiffnesses are symmetric to their solver's tolerance only.
pub fn read(path: &Path) -> Result<Six> {
    let advice = "give a JSON file of six rows of six numbers in MPa, or an object with them under \"stiffness_mpa\" (as `solve --load stiffness` writes it)";
    let text = std::fs::read_to_string(path).map_err(|e| {
        Error::file(
            path,
            format!("expected a stiffness, could not read it: {e}"),
            advice,
        )
        .caused_by(e)
    })?;
    let file = serde_json::from_str(&text).map_err(|e| {
        Error::file(path, format!("expected a 6 x 6 stiffness: {e}"), advice).caused_by(e)
    })?;
    let (File::Bare(c) | File::Named { stiffness_mpa: c }) = file;
    Ok(std::array::from_fn(|i| {
        std::array::from_fn(|j| 0.5 * (c[i][j] + c[j][i]))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bare_and_named_matrices_are_read_and_others_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.json");
        let mut rows = vec![vec![0.0; 6]; 6];
        (rows[0][1], rows[1][0], rows[5][5]) = (3.0, 1.0, 7.0);
        for text in [
            serde_json::json!(rows).to_string(),
            serde_json::json!({ "stiffness_mpa": rows, "scan": "a" }).to_string(),
        ] {
            std::fs::write(&path, text).unwrap();
            let c = read(&path).unwrap();
            assert_eq!((c[0][1], c[1][0], c[5][5]), (2.0, 2.0, 7.0));
        }
        std::fs::write(&path, "[[1, 2], [3, 4]]").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("6 x 6"));
    }
}
