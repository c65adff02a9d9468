//! From a scan to its apparent modulus, through the library: `cargo run --release --example scan_to_modulus -- SCAN OUT`.

use bonepd_ct::command::{segment, solve};
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::lattice::LatticeParams;
use bonepd_ct::pipeline::segment::SegmentParams;
use bonepd_ct::result::settings::Method;
use std::path::{Path, PathBuf};

/// Thresholds the scan by Otsu's method, compresses one voxel element a voxel by 1 %, and returns E_app and its stated error in MPa.
pub fn scan_to_modulus(scan: &Path, out: &Path) -> Result<(Option<f64>, Option<f64>)> {
    let session = Session {
        quiet: true,
        ..Session::default()
    };
    let threshold = SegmentParams {
        otsu: true,
        ..SegmentParams::default()
    };
    segment::segment(scan, out, None, &threshold, &session)?;
    let params = SolveParams {
        method: Method::VoxelFe,
        young_mpa: 10_000.0,
        strain: -0.01,
        grip_mm: 0.0,
        ..SolveParams::default()
    };
    let rows = solve::solve(out, &LatticeParams::default(), &params, &session)?;
    Ok((rows[0].e_app_mpa(), rows[0].error_mpa()))
}

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let scan = words
        .next()
        .unwrap_or("sample_data/trabecular.nii.gz".to_owned());
    let out = PathBuf::from(words.next().unwrap_or("out-example".to_owned()));
    match scan_to_modulus(Path::new(&scan), &out)? {
        (Some(e_app), Some(error)) => println!("E_app {e_app:.1} ± {error:.1} MPa"),
        (Some(e_app), None) => println!("E_app {e_app:.1} MPa, error not stated"),
        (None, _) => println!("no modulus"),
    }
    Ok(())
}
