//! The programs of `examples/` do what they say.

#[path = "../examples/scan_to_modulus.rs"]
#[allow(dead_code, reason = "a program's main")]
mod scan_to_modulus;

#[path = "../examples/scene.rs"]
#[allow(dead_code, reason = "a program's main")]
mod scene;

use std::path::Path;

#[test]
fn a_scan_has_a_modulus_and_its_error() {
    let out = tempfile::tempdir().unwrap();
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/trabecular.nii.gz");
    let (e_app, error) = scan_to_modulus::scan_to_modulus(&scan, out.path()).unwrap();
    let (e_app, error) = (e_app.unwrap(), error.unwrap());
    assert!(
        0.0 < error && error < e_app && e_app < 10_000.0,
        "{e_app} ± {error}"
    );
}

#[test]
fn a_scene_has_a_record() {
    let out = tempfile::tempdir().unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/scene-heat-disc.toml");
    let record = scene::run(&file, out.path()).unwrap().unwrap();
    assert!(record.summary.converged && record.summary.points > 0);
}
