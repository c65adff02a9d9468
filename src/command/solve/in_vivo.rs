//! Owns the end of a run of unit loads: the daily loads that even out the tissue's loading, as a table, a field and its picture.

use super::OpenScan;
use crate::command::fields::Fields;
use crate::error::{Error, Result};
use crate::grid::Axis;
use crate::machine::session::Session;
use crate::measure::load_history::{Estimate, estimate};
use crate::measure::pistoia::Pistoia;
use crate::pipeline::apparent::fields::{FieldVolume, Place, Recorded};
use crate::pipeline::apparent::tissue::Tissue;
use crate::record::in_vivo::{self, IN_VIVO, InVivoLine};
use crate::result::row::Row;
use crate::volume::Volume;
use std::path::Path;

/// The energy density of one solved load, and its row.
pub struct UnitField {
    /// Its row.
    pub row: Row,
    /// Strain energy density by voxel of the scan, MPa.
    pub sed_mpa: Volume<f32>,
}

/// Writes the loads that, added up, bring the tissue nearest to `target_mpa` everywhere, from the unit loads that `scan` kept.
///
/// # Errors
/// Loads that were not solved or strain nothing, files that cannot be written.
pub fn combine(
    scan: &mut OpenScan,
    dir: &Path,
    (target_mpa, criterion): (f64, Pistoia),
    axis: Axis,
    session: &Session,
) -> Result<()> {
    let units = scan.unit_fields.take().unwrap_or_default();
    if let Some(unit) = units.iter().find(|u| u.row.converged() != Some(true)) {
        return Err(Error::setting(
            "in_vivo_mpa",
            format!(
                "the unit load {} did not converge",
                unit.row.key.load.name()
            ),
            "raise max_iterations or tolerance, or leave in_vivo_mpa out of the recipe",
        ));
    }
    let load = |unit: &UnitField| unit.row.load_carried_by_ends().filter(|l| *l > 0.0);
    let loads: Option<Vec<f64>> = units.iter().map(load).collect();
    let bone: Vec<usize> = match units.first() {
        None => Vec::new(),
        Some(first) => (0..first.sed_mpa.as_slice().len())
            .filter(|v| units.iter().any(|u| u.sed_mpa.as_slice()[*v] > 0.0))
            .collect(),
    };
    let of_bone = |unit: &UnitField| bone.iter().map(|v| unit.sed_mpa.as_slice()[*v]).collect();
    let energies: Vec<Vec<f32>> = units.iter().map(of_bone).collect();
    let found = loads.and_then(|loads| Some((estimate(&energies, &loads, target_mpa)?, loads)));
    let Some((found, loads)) = found else {
        return Err(Error::setting(
            "in_vivo_mpa",
            "the unit loads strain no bone: no daily loads follow from them",
            "check that bone joins both ends (segment.png), or leave in_vivo_mpa out of the recipe",
        ));
    };
    let strains = bone.iter().zip(&found.combined_mpa).map(|(v, sed)| {
        let young = young_mpa(&scan.tissue, *v);
        ((2.0 * f64::from(*sed) / young).sqrt() as f32, 1.0)
    });
    let failures = criterion.failures(strains.collect());
    let own = failures.iter().find(|f| f.criterion == criterion);
    let lines = lines(&units, &loads, &found, target_mpa, own.map(|f| f.factor));
    in_vivo::write(dir, &lines)?;
    field(scan, &bone, &found).write(dir, &scan.specimen, axis)?;
    session.result(in_words(&lines, dir));
    Ok(())
}

/// Young's modulus of a voxel.
fn young_mpa(tissue: &Tissue, voxel: usize) -> f64 {
    match tissue {
        Tissue::Uniform(solid) => solid.young_mpa,
        Tissue::Mixed(mixed) => mixed.mean_mpa * f64::from(mixed.factor[voxel]),
    }
}

fn lines(
    units: &[UnitField],
    loads: &[f64],
    found: &Estimate,
    target_mpa: f64,
    failure_factor: Option<f64>,
) -> Vec<InVivoLine> {
    let line = |(i, unit): (usize, &UnitField)| InVivoLine {
        scan: unit.row.key.scan.clone(),
        load: unit.row.key.load,
        unit: match unit.row.key.load.is_by_angle() {
            true => "N mm".to_owned(),
            false => "N".to_owned(),
        },
        unit_load: loads[i],
        amplitude: found.amplitudes[i],
        factor: found.factors[i],
        energy_share: found.shares[i],
        target_mpa,
        mean_mpa: found.mean_mpa,
        sd_mpa: found.sd_mpa,
        failure_factor,
    };
    units.iter().enumerate().map(line).collect()
}

/// The combined field on the scan's grid.
fn field(scan: &OpenScan, bone: &[usize], found: &Estimate) -> Fields {
    let mask = &scan.specimen.bone;
    let mut values = vec![0f32; mask.grid.len()];
    bone.iter()
        .zip(&found.combined_mpa)
        .for_each(|(v, sed)| values[*v] = *sed);
    let mut volume = Volume::from_vec(mask.grid, values);
    volume.affine = mask.affine;
    let field = FieldVolume {
        name: "sed_in_vivo_mpa".to_owned(),
        components: vec![volume],
        labels: &[],
        place: Place::Voxels,
        about: "energy density of the estimated daily loads, MPa, capped at 95 %".to_owned(),
    };
    let recorded = Recorded {
        fields: vec![field],
        ..Recorded::default()
    };
    Fields::of(String::new(), recorded, scan.axes)
}

fn in_words(lines: &[InVivoLine], dir: &Path) -> String {
    let load = |l: &InVivoLine| format!("{} {:.4} {}", l.load.name(), l.amplitude, l.unit);
    let loads: Vec<String> = lines.iter().map(load).collect();
    let [mean, sd, target] = lines
        .first()
        .map_or([0.0; 3], |l| [l.mean_mpa, l.sd_mpa, l.target_mpa]);
    let failure = lines.first().and_then(|l| l.failure_factor);
    let failure = failure.map_or(String::new(), |f| {
        format!("; failure at {f:.3} times these loads")
    });
    format!(
        "daily loads: {}; energy density {mean:.5} ± {sd:.5} MPa (SD; aimed at {target}){failure}; table: {}",
        loads.join(", "),
        dir.join(IN_VIVO).display()
    )
}
