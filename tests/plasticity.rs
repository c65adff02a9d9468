//! Tissue that yields: the laws at a point, bodies against closed forms and themselves, CalculiX, the command.

mod adaptive;
mod bodies;
mod calculix;
mod closed_forms;
mod command;
mod hard;
mod points;
mod stated;

use crate::cli::run;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::volume::Volume;
use std::path::Path;

/// The folder of a scan with these values, segmented by `words`, in `dir`.
fn written_and_segmented(dir: &Path, grid: Grid, values: Vec<f32>, words: &[&str]) -> String {
    let scan = dir.join("scan.nii.gz");
    nifti::write_field(&scan, &[Volume::from_vec(grid, values)], "body").unwrap();
    let out = dir.join("out").to_str().unwrap().to_owned();
    let scan = scan.to_str().unwrap();
    let (code, _, said) = run(&[&["segment", scan, "-o", &out, "--quiet"], words].concat());
    assert_eq!(code, 0, "{said}");
    out
}
