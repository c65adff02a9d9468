//! Names of patients stay in the headers they stand in: no byte that the program writes or says holds one.

use crate::cli::run;
use crate::formats::{bytes_of, dicom, sound_files, volume};
use flate2::read::GzDecoder;
use std::io::Read;
use std::path::{Path, PathBuf};
use tiff::encoder::{TiffEncoder, colortype::GrayI16};
use tiff::tags::Tag;

/// What is hidden in the headers below.
const SECRETS: [&str; 4] = ["Zwiebelfisch", "Jane", "Kuckuck", "19530417"];

fn holds(bytes: &[u8]) -> Option<&'static str> {
    let found = |secret: &str| bytes.windows(secret.len()).any(|w| w == secret.as_bytes());
    SECRETS.into_iter().find(|secret| found(secret))
}

/// One scan per format, each with all the names that its header has room for.
fn scans(dir: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    let keep = |name: &str, bytes: &[u8]| {
        let path = dir.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        assert!(holds(bytes).is_some(), "{name} hides nothing");
        path
    };
    let data = bytes_of(&volume());
    let with = |head: &str| [head.as_bytes(), &data].concat();
    for (name, mut bytes) in sound_files() {
        match name {
            // db_name, descrip, aux_file, intent_name.
            "a.nii" => [14, 148, 228, 328].into_iter().for_each(|at| {
                bytes[at..at + 12].copy_from_slice(b"Zwiebelfisch");
            }),
            "a.aim" | "a.isq" => {}
            _ => continue,
        }
        paths.push(keep(name, &bytes));
    }
    paths.push(keep(
        "c.mha",
        &with("ObjectType = Image\nName = Jane\nComment = Zwiebelfisch\nPatientName = Jane\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementSpacing = 0.02 0.02 0.02\nElementDataFile = LOCAL\n"),
    ));
    paths.push(keep(
        "d.nrrd",
        &with("NRRD0004\n# Zwiebelfisch\ncontent: Jane\ntype: short\ndimension: 3\nsizes: 5 4 3\nspacings: 0.02 0.02 0.02\nendian: little\nencoding: raw\nDICOM_0010_0010_PatientName:=Jane\n\n"),
    ));
    for k in 0..3 {
        let slice = dicom(&data[40 * k..40 * (k + 1)], false);
        let text = |words: String| words.into_bytes();
        let slice = replaced(&slice, b"0\\0\\0 ", &text(format!("0\\0\\{} ", k + 1)));
        keep(&format!("series/{k}.dcm"), &slice);
    }
    paths.push(dir.join("series"));
    paths.push(keep("e.tif", &tiff_stack()));
    paths
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|w| w == from);
    let Some(at) = at else { return bytes.to_vec() };
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

fn tiff_stack() -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    for slice in volume().as_slice().chunks(20) {
        let mut image = encoder.new_image::<GrayI16>(5, 4).unwrap();
        for tag in [Tag::ImageDescription, Tag::Artist, Tag::Software] {
            image.encoder().write_tag(tag, "Zwiebelfisch Jane").unwrap();
        }
        image.write_data(slice).unwrap();
    }
    out.into_inner()
}

/// Every file below, what is compressed twice.
fn search(dir: &Path, what: &str) -> usize {
    let mut files = 0;
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files += search(&path, what);
            continue;
        }
        files += 1;
        let mut bytes = std::fs::read(&path).unwrap();
        if path.extension().is_some_and(|e| e == "gz") {
            let mut inside = Vec::new();
            GzDecoder::new(&bytes[..]).read_to_end(&mut inside).unwrap();
            bytes.extend(inside);
        }
        let found = holds(&bytes);
        assert_eq!(found, None, "{what}: {} holds it", path.display());
    }
    files
}

fn quiet(what: &str, words: &[&str]) {
    let (code, stdout, stderr) = run(words);
    assert_eq!(code, 0, "{what}: {stderr}");
    for said in [stdout, stderr] {
        assert_eq!(holds(said.as_bytes()), None, "{what} {words:?}: {said}");
    }
}

#[test]
fn names_never_leave_a_header() {
    let dir = tempfile::tempdir().unwrap();
    let recipe = dir.path().join("all.toml");
    // Everything is bone.
    let text = "[segment]\nlower = -5000.0\nspacing_mm = [0.02, 0.02, 0.02]\nkeep_grey = true\n[solve]\nmethod = \"voxel-fe\"\n";
    std::fs::write(&recipe, text).unwrap();
    let scans = scans(&dir.path().join("scans"));
    assert_eq!(scans.len(), 7);
    for scan in scans {
        let name = scan.file_name().unwrap().to_str().unwrap();
        let out = |kind: &str| dir.path().join(format!("out-{kind}-{name}"));
        let (input, one, all) = (scan.to_str().unwrap(), out("segment"), out("run"));
        quiet(name, &["info", input]);
        quiet(name, &["info", input, "--json"]);
        let one = one.to_str().unwrap();
        let bone = [
            "--lower",
            "-5000",
            "--spacing",
            "0.02",
            "--keep-grey",
            "--json",
        ];
        quiet(
            name,
            &[&["segment", input, "-o", one, "-v"], &bone[..]].concat(),
        );
        quiet(
            name,
            &[
                "run",
                recipe.to_str().unwrap(),
                input,
                "-o",
                all.to_str().unwrap(),
                "--json",
            ],
        );
        assert!(search(Path::new(one), name) >= 4);
        assert!(search(&all, name) >= 8);
    }
}

/// What is refused is told without the header's words.
#[test]
fn names_do_not_come_out_in_errors() {
    let dir = tempfile::tempdir().unwrap();
    for (name, head) in [
        (
            "a.mha",
            "ObjectType = Image\nPatientName = Jane\nNDims = 3\nDimSize = 5 4\nElementDataFile = LOCAL\n",
        ),
        (
            "a.nrrd",
            "NRRD0004\n# Zwiebelfisch\ncontent: Jane\ntype: short\ndimension: 3\nsizes: 5 4\n\n",
        ),
        ("b.nrrd", "NRRD0004\nPatient Jane\n\n"),
        ("b.mha", "Patient Jane\nNDims = 3\n"),
    ] {
        let path = dir.path().join(name);
        std::fs::write(&path, head).unwrap();
        let (code, stdout, stderr) = run(&["info", path.to_str().unwrap()]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{name}");
        assert_eq!(holds(stderr.as_bytes()), None, "{name}: {stderr}");
    }
}
