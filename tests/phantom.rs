//! `phantom` and `info` through the built program.

use crate::cli::run;

fn json(stdout: &str) -> serde_json::Value {
    serde_json::from_str(stdout).unwrap()
}

#[test]
fn a_phantom_goes_through_segment_as_image_and_as_slices_alike() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let make = |out: &str| {
        let (code, stdout, stderr) = run(&[
            "phantom",
            "-o",
            out,
            "--size-mm",
            "1.2,1,1.4",
            "--spacing-mm",
            "0.04",
            "--bvtv",
            "0.25",
            "--seed",
            "3",
            "--json",
        ]);
        assert_eq!(code, 0, "{stderr}");
        json(&stdout)
    };
    let made = make(&at("p.nii.gz"));
    assert_eq!(made["voxels"], serde_json::json!([30, 25, 35]));
    assert!((made["bv_tv"].as_f64().unwrap() - 0.25).abs() < 0.01);
    assert_eq!(make(&at("slices")), made);
    let segment = |input: &str, out: &str| {
        let (code, stdout, stderr) = run(&[
            "segment", input, "-o", out, "--lower", "200", "--upper", "5600", "--json",
        ]);
        assert_eq!(code, 0, "{stderr}");
        json(&stdout)["results"].clone()
    };
    let image = segment(&at("p.nii.gz"), &at("a"));
    assert_eq!(segment(&at("slices"), &at("b")), image);
    // Blur and noise at 3.75 voxels a strut: measured 0.249.
    assert!(
        (image["bv_tv"].as_f64().unwrap() - 0.25).abs() < 0.02,
        "{image}"
    );
    // A folder that holds something is left alone.
    let (code, _, stderr) = run(&[
        "phantom",
        "-o",
        &at("slices"),
        "--size-mm",
        "1",
        "--spacing-mm",
        "0.1",
        "--bvtv",
        "0.2",
    ]);
    assert_eq!(code, 2);
    assert!(stderr.contains("not empty"), "{stderr}");
}

#[test]
fn impossible_phantoms_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("p.nii.gz");
    for (bvtv, more, said) in [
        ("0.9", vec![], "bvtv"),
        ("0.2", vec!["--thickness-mm", "5"], "thickness-mm"),
        ("0.2", vec!["--perforation", "0.9"], "perforation"),
        ("0.2", vec!["--mask", "m.png"], "m.png"),
    ] {
        let mut args = vec![
            "phantom",
            "-o",
            out.to_str().unwrap(),
            "--size-mm",
            "1",
            "--spacing-mm",
            "0.1",
            "--bvtv",
            bvtv,
        ];
        args.extend(more);
        let (code, _, stderr) = run(&args);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(said), "{stderr}");
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn info_tells_size_spacing_and_grey_values() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("p.nii.gz");
    let out = out.to_str().unwrap();
    run(&[
        "phantom",
        "-o",
        out,
        "--size-mm",
        "1",
        "--spacing-mm",
        "0.05",
        "--bvtv",
        "0.2",
    ]);
    let (code, stdout, stderr) = run(&["info", out]);
    assert_eq!(code, 0, "{stderr}");
    for words in [
        "20 × 20 × 20",
        "0.05 × 0.05 × 0.05 mm",
        "NIfTI-1 (gzip), int16",
        "percentiles",
    ] {
        assert!(stdout.contains(words), "{words} is not in\n{stdout}");
    }
    let (code, stdout, _) = run(&["info", out, "--json"]);
    assert_eq!(
        (code, json(&stdout)["spacing_mm"].clone()),
        (0, serde_json::json!([0.05, 0.05, 0.05]))
    );
}

/// The sample scans are what their README says: the same voxels from its commands.
#[test]
fn the_sample_scans_come_from_their_commands() {
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data");
    let readme = std::fs::read_to_string(samples.join("README.md")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let commands: Vec<&str> = readme
        .lines()
        .filter(|l| l.starts_with("bonepd-ct phantom"))
        .collect();
    assert_eq!(commands.len(), 5);
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().skip(1).collect();
        let name = words[2];
        let made = dir.path().join(name);
        let mut words = words.clone();
        words[2] = made.to_str().unwrap();
        assert_eq!(run(&words).0, 0, "{command}");
        let read =
            |path: &std::path::Path| bonepd_ct::image::scan::read(path, None).unwrap().volume;
        let (made, kept) = (read(&made), read(&samples.join(name)));
        assert_eq!(made.grid, kept.grid, "{name}");
        assert!(
            made.as_slice() == kept.as_slice(),
            "{name} differs from what its command makes"
        );
    }
}

#[test]
fn a_body_is_seen_by_partial_volumes_and_finer_voxels_show_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let body = |out: &str, spacing: &str, more: &[&str]| {
        let mut args = vec!["phantom", "-o", out, "--size-mm", "1", "--bvtv", "0.25"];
        args.extend([
            "--spacing-mm",
            spacing,
            "--body",
            "foam",
            "--cell-mm",
            "0.5",
        ]);
        args.extend(["--broken", "0.2", "--json"]);
        args.extend(more);
        run(&args)
    };
    let volume = |spacing: &str| {
        let (code, stdout, stderr) = body(&at(&format!("{spacing}.nii.gz")), spacing, &[]);
        assert_eq!(code, 0, "{stderr}");
        json(&stdout)["bv_tv"].as_f64().unwrap()
    };
    let (coarse, fine) = (volume("0.05"), volume("0.025"));
    // Breaks take bone away; the middles of voxels are a count of the volume.
    assert!(
        fine < 0.25 && (coarse / fine - 1.0).abs() < 0.03,
        "{coarse} {fine}"
    );
    // No noise: greys are shares of bone, and all between the two values.
    let (_, stdout, _) = run(&["info", &at("0.05.nii.gz"), "--json"]);
    let info = json(&stdout);
    assert_eq!(info["grey_min"].as_f64(), Some(-1000.0), "{info}");
    assert_eq!(info["grey_max"].as_f64(), Some(1400.0), "{info}");
    for more in [
        vec!["--thickness-mm", "0.2"],
        vec!["--debris", "1"],
        vec!["--fillet", "3"],
        vec!["--body", "sponge"],
    ] {
        let (code, _, stderr) = body(&at("no.nii.gz"), "0.05", &more);
        assert_eq!(code, 2, "{more:?} {stderr}");
    }
    assert!(!dir.path().join("no.nii.gz").exists());
}
