//! Owns `solve --load stiffness` on disk: `stiffness.json`, and what of it goes into a row of `results.csv`.

use crate::error::Result;
use crate::machine::session::Session;
use crate::measure::stiffness::{orthotropic, young_along};
use crate::measure::zysset_curnier::plausible;
use crate::pipeline::apparent::SolveParams;
use crate::pipeline::apparent::stiffness::Stiffness;
use crate::record::stiffness as file;
use crate::record::stiffness::StiffnessRecord;
use crate::result::row::{Marks, Row, Solution};
use crate::volume::Specimen;
use std::path::Path;

/// Name of the file with the stiffness matrix.
pub const RECORD: &str = "stiffness.json";

/// Whether the matrix in `dir` follows from these settings and the mask of this hash.
pub fn is_current(dir: &Path, params: &SolveParams, mask_blake3: &str) -> bool {
    file::record(&dir.join(RECORD)).is_some_and(|record| {
        record.settings == *params
            && record.version == env!("CARGO_PKG_VERSION")
            && record.mask_blake3 == mask_blake3
    })
}

/// The content of `stiffness.json`.
pub fn record(
    solved: &Stiffness,
    specimen: &Specimen,
    params: &SolveParams,
    mask_blake3: &str,
    mil_mm: Option<[f64; 3]>,
) -> StiffnessRecord {
    let own = orthotropic(&solved.matrix_mpa);
    let conditions = format!("{} conditions", params.conditions.name());
    let place = || {
        let of = (specimen.bv_tv(), mil_mm);
        plausible(
            &solved.matrix_mpa,
            own.as_ref(),
            of,
            params.young_mpa,
            &conditions,
        )
    };
    StiffnessRecord {
        mil_mm,
        plausible: params.material.is_none().then(place).flatten(),
        program: env!("CARGO_PKG_NAME").to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scan: specimen.name.clone(),
        mask_blake3: mask_blake3.to_owned(),
        settings: params.clone(),
        boundary_conditions: params.conditions.in_words().to_owned(),
        voigt_order: StiffnessRecord::voigt_order(),
        element_mm: specimen
            .bone
            .grid
            .spacing_mm
            .map(|h| h * params.coarsen as f64 / params.refine as f64),
        bv_tv: specimen.bv_tv(),
        converged: solved.ended.converged(),
        iterations: solved.iterations,
        residual: solved.residual,
        stiffness_mpa: solved.matrix_mpa,
        algebraic_error_mpa: solved.error_mpa,
        asymmetry_mpa: solved.asymmetry_mpa,
        orthotropic: own,
    }
}

/// Writes `stiffness.json`, and says what is in it.
///
/// # Errors
/// A file that cannot be written.
pub fn write(dir: &Path, record: &StiffnessRecord, session: &Session) -> Result<()> {
    file::write(&dir.join(RECORD), record)?;
    say(record, session);
    Ok(())
}

/// Completes a row: E_app is Young's modulus along the load axis that follows from the matrix.
pub fn row(solved: &Stiffness, params: &SolveParams, blank: &Row) -> Row {
    let (e_app, error) = young_along(&solved.matrix_mpa, &solved.error_mpa, params.axis);
    let mut note = format!(
        "E along {} of the matrix in {RECORD}; {}",
        params.axis.name(),
        params.conditions.in_words()
    );
    if e_app == 0.0 {
        note += "; the matrix is not positive definite: bone does not join all faces";
    }
    if !solved.ended.converged() {
        note += "; not converged";
    }
    let solution = Solution {
        sites: Some(solved.elements as u64),
        dropped_sites: Some(solved.dropped as u64),
        unknowns: Some(solved.unknowns as u64),
        iterations: Some(solved.iterations.iter().sum::<usize>() as u64),
        residual: Some(solved.residual),
        converged: Some(solved.ended.converged()),
        e_app_mpa: Some(e_app),
        algebraic_error_mpa: Some(error),
        ..Solution::default()
    };
    Row {
        key: blank.key.clone(),
        solved: Some(solution),
        marks: Marks {
            note: Some(note),
            ..blank.marks.clone()
        },
    }
}

fn say(record: &StiffnessRecord, session: &Session) {
    session.result(format!(
        "{}: apparent stiffness in MPa (11, 22, 33, 23, 13, 12), {}",
        record.scan, record.boundary_conditions
    ));
    for row in &record.stiffness_mpa {
        let words: Vec<String> = row.iter().map(|c| format!("{c:>10.3}")).collect();
        session.result(words.join(" "));
    }
    if let Some(o) = &record.orthotropic {
        let list = |v: &[f64; 3]| v.map(|x| format!("{x:.3}")).join(", ");
        session.result(format!(
            "orthotropic: E1, E2, E3 {} MPa; G23, G13, G12 {} MPa; nu23, nu13, nu12 {}; {:.1} % of the tensor is not orthotropic",
            list(&o.young_mpa),
            list(&o.shear_mpa),
            list(&o.poisson),
            100.0 * o.residual
        ));
    }
    if let Some(place) = &record.plausible {
        session.result(format!("plausible? {}", place.in_words));
    }
}
