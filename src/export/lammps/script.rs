//! Owns the LAMMPS input script next to the data: the published steps of compression.

use crate::discretisation::lattice::sites::Sites;
use crate::error::Result;
use crate::io::atomic;
use std::path::Path;

/// The steps, with places for what differs from lattice to lattice.
const STEPS: &str = include_str!("steps.lammps");

/// What the script needs in addition to the lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Specimen {
    /// Along z, pores included.
    pub length_mm: f64,
    /// Its cross-section, pores included.
    pub area_mm2: f64,
    /// Of a site of weight 1.
    pub young_mpa: f64,
}

/// Writes `script`, which reads the data file next to it. Grips are those of `solve` on the same lattice: all planes within `grip_mm` of
/// the ends, at least the end planes. Each increment prints a line `INCREMENT i displacement_mm .. energy_nmm .. force_n .. e_app_mpa ..`.
/// Poisson's ratios other than ¼ stop it, in words.
///
/// # Errors
/// An unwritable file.
pub fn write(script: &Path, data: &Path, sites: &Sites, specimen: Specimen) -> Result<()> {
    let name = |path: &Path| {
        path.file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
    };
    let lp = sites.frame.lp_mm;
    let values = [
        ("@DATA@", name(data)),
        ("@SCRIPT@", name(script)),
        // Bonds must be seen whole from both of their ends.
        ("@CUTOFF@", (3.0 * lp).to_string()),
        ("@SLACK@", (1e-9 * sites.frame.step_mm).to_string()),
        ("@LENGTH@", specimen.length_mm.to_string()),
        ("@AREA@", specimen.area_mm2.to_string()),
        ("@YOUNG@", specimen.young_mpa.to_string()),
        ("@LP@", lp.to_string()),
    ];
    let text = values
        .iter()
        .fold(STEPS.to_owned(), |text, (place, value)| {
            text.replace(place, value)
        });
    atomic::write(script, text)
}
