//! Text as Windows writes it: lines that end in CR LF, folders divided by backslashes. It gives what Unix's text gives, on
//! every system.

use crate::cli::{bonepd, run};
use crate::cohort::{cohort, text, timeless};
use crate::formats::{bytes_of, volume};
use bonepd_ct::image::scan;
use std::fs;
use std::path::Path;

fn as_windows_writes(unix: &str) -> String {
    unix.replace('\n', "\r\n")
}

#[test]
fn a_recipe_and_a_manifest_give_the_same_rows() {
    let (dir, _, recipe) = cohort(2);
    let manifest = "path,name,group\nscans/s1.nii.gz,left,OA\nscans/s2.nii.gz,right,control\n";
    let rows = |name: &str, recipe_text: &str, manifest_text: &str| {
        let (recipe, list) = (
            dir.path().join(format!("{name}.toml")),
            dir.path().join(format!("{name}.csv")),
        );
        fs::write(&recipe, recipe_text).unwrap();
        fs::write(&list, manifest_text).unwrap();
        let out = dir.path().join(name);
        let (code, _, stderr) = run(&["run", text(&recipe), text(&list), "-o", text(&out)]);
        assert_eq!(code, 0, "{stderr}");
        timeless(&out)
    };
    let recipe = fs::read_to_string(recipe).unwrap();
    let unix = rows("unix", &recipe, manifest);
    let divided = as_windows_writes(&manifest.replace('/', "\\"));
    let windows = rows("windows", &as_windows_writes(&recipe), &divided);
    assert_eq!(unix, windows);
    assert_eq!(unix.lines().count(), 13);
}

#[test]
fn headers_name_their_voxels_in_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("data")).unwrap();
    fs::write(dir.path().join("data/v.raw"), bytes_of(&volume())).unwrap();
    let headers = [
        (
            "a.mhd",
            "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementSpacing = 0.02 0.02 0.02\nElementDataFile = data/v.raw\n",
        ),
        (
            "b.nhdr",
            "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nspacings: 0.02 0.02 0.02\nendian: little\nencoding: raw\ndata file: data/v.raw\n",
        ),
    ];
    for (name, header) in headers {
        let path = dir.path().join(name);
        let values = |header: &str| {
            fs::write(&path, header).unwrap();
            scan::read(&path, None).unwrap().volume.as_slice().to_vec()
        };
        let unix = values(header);
        let windows = values(&as_windows_writes(&header.replace("data/", "data\\")));
        assert!(unix.len() == 60 && unix.contains(&-900.0), "{name}");
        assert_eq!(unix, windows, "{name}");
    }
}

/// A strip of a square, its corners in a file.
#[test]
fn a_scene_and_its_outline_give_the_same_history() {
    let dir = tempfile::tempdir().unwrap();
    let at = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/square-fixed-ratio-10.toml");
    let scene = fs::read_to_string(at).unwrap().replace("\r\n", "\n");
    let rectangle = "geometry.rectangle.size = [1.0, 0.30000000000000004]";
    assert!(scene.contains(rectangle));
    fs::create_dir(dir.path().join("lines")).unwrap();
    let corners = "x,y\n0,0\n1,0\n1,0.3\n0,0.3\n";
    let history = |name: &str, scene: &str, corners: &str| {
        fs::write(dir.path().join("lines/corners.csv"), corners).unwrap();
        let (file, out) = (dir.path().join("scene.toml"), dir.path().join(name));
        fs::write(&file, scene).unwrap();
        let scene = bonepd()
            .args(["scene", text(&file), "-o", text(&out)])
            .output()
            .unwrap();
        assert!(
            scene.status.success(),
            "{}",
            String::from_utf8_lossy(&scene.stderr)
        );
        fs::read_to_string(out.join("history.csv")).unwrap()
    };
    let outlined =
        |file: &str| scene.replace(rectangle, &format!("geometry.polygon.file = '{file}'"));
    let unix = history("unix", &outlined("lines/corners.csv"), corners);
    let windows = history(
        "windows",
        &as_windows_writes(&outlined("lines\\corners.csv")),
        &as_windows_writes(corners),
    );
    assert_eq!(unix, windows);
    assert!(unix.lines().count() > 80);
}
