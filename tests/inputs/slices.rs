//! Folders of slices: logs beside them, results among them, names of all kinds, slices that do not fit.

use super::write::{Order, Page, Value, tiff};
use super::{documented, program};
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;
use std::path::Path;

fn slice(k: usize) -> Page {
    Page::grey(4, 3, (0..12).map(|i| (100 * k + i) as u64).collect())
}

fn write(folder: &Path, name: impl AsRef<Path>, page: &Page) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(
        folder.join(name),
        tiff(std::slice::from_ref(page), Order::default()),
    )
    .unwrap();
}

/// Three slices and a log.
fn logged(log: &str) -> Stored {
    let dir = tempfile::tempdir().unwrap();
    (0..3).for_each(|k| write(dir.path(), format!("s_rec{k:04}.tif"), &slice(k)));
    std::fs::write(dir.path().join("s_rec.log"), log).unwrap();
    scan::stored(dir.path()).unwrap()
}

#[test]
fn every_key_of_a_log_does_what_the_table_says() {
    let plain = "[Reconstruction]\nPixel Size (um)=20\n";
    let size = |log: &str| logged(log).spacing_mm;
    assert_eq!(size(plain), Some([0.02; 3]));
    for row in documented(include_str!("../../src/image/slices/skyscan.rs")) {
        let (section, key) = (&row[0], &row[1]);
        let found = logged(&format!("{plain}[{section}]\n{key}=7\n"));
        match row[2].split(':').next().unwrap() {
            "harmless" => {
                assert_eq!(
                    (found.spacing_mm, found.notes),
                    (Some([0.02; 3]), logged(plain).notes),
                    "{key}"
                );
            }
            "said" => {
                let both = format!(
                    "{plain}Result Image Width (pixels)=7\nResult Image Height (pixels)=3\n"
                );
                assert!(
                    logged(&both).notes.join("").contains("7 × 3 pixels"),
                    "{key}"
                );
            }
            "read" => {
                let seen = match key.as_str() {
                    "Pixel Size (um)" => found.spacing_mm == Some([0.007; 3]),
                    "Section to Section Step" => found.spacing_mm == Some([0.02, 0.02, 0.14]),
                    "Image Pixel Size (um)" => {
                        let scan = logged("[Acquisition]\nImage Pixel Size (um)=7\n");
                        scan.spacing_mm == Some([0.007; 3])
                            && scan.notes.join("").contains("projections")
                    }
                    _ => panic!("no log for {key}"),
                };
                assert!(seen, "{key}");
            }
            other => panic!("{key}: `{other}` is no word of the table"),
        }
    }
}

#[test]
fn a_log_is_taken_before_tags() {
    let dir = tempfile::tempdir().unwrap();
    for k in [100, 102, 104] {
        let page = slice(k / 100)
            .with(282, Value::Rational(500, 1))
            .with(283, Value::Rational(500, 1))
            .with(296, Value::Short(vec![3]));
        write(dir.path(), format!("s_rec{k}.tif"), &page);
    }
    assert_eq!(
        scan::stored(dir.path()).unwrap().spacing_mm,
        Some([0.02; 3])
    );
    let log = "[Reconstruction]\nPixel Size (um)=17.5\nSection to Section Step=2\n";
    std::fs::write(dir.path().join("s_rec.log"), log).unwrap();
    let found = scan::stored(dir.path()).unwrap();
    assert_eq!(found.spacing_mm, Some([0.0175, 0.0175, 0.035]));
    let notes = found.notes.join("\n");
    assert!(
        notes.contains("Section to Section Step=2") && notes.contains("own tags"),
        "{notes}"
    );
}

#[test]
fn slices_that_do_not_fit_are_refused() {
    for (other, said) in [
        (
            Page {
                bits: 8,
                ..slice(2)
            },
            "slice of uint8 in a scan whose first slice (s0.tif) is uint16",
        ),
        (
            slice(2)
                .with(282, Value::Rational(400, 1))
                .with(283, Value::Rational(400, 1))
                .with(296, Value::Short(vec![3])),
            "has pixels of 0.025 × 0.025 mm",
        ),
        (
            slice(2).with(
                270,
                Value::Ascii(b"ImageJ=1.54f\ncf=0\nc0=1\nc1=2\n".to_vec()),
            ),
            "calibrated",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let tagged = |k| {
            slice(k)
                .with(282, Value::Rational(500, 1))
                .with(283, Value::Rational(500, 1))
                .with(296, Value::Short(vec![3]))
        };
        (0..2).for_each(|k| write(dir.path(), format!("s{k}.tif"), &tagged(k)));
        write(dir.path(), "s2.tif", &other);
        let words = scan::stored(dir.path())
            .map(|s| s.n)
            .unwrap_err()
            .to_string();
        assert!(words.contains(said), "{words}");
    }
}

#[test]
fn results_do_not_lie_among_slices() {
    let dir = tempfile::tempdir().unwrap();
    let slices = dir.path().join("slices");
    (0..3).for_each(|k| write(&slices, format!("s{k}.tif"), &slice(k)));
    let words = ["--spacing", "0.02", "--lower", "100", "-o"];
    let (code, said) = program(
        dir.path(),
        &[&["segment", "slices"], &words[..], &["slices"]].concat(),
    );
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("the scan's own slices"), "{said}");
    // An older program did it: its pictures are no slices.
    for name in ["segment.json", "segment.png", "bone.png", "sites.png"] {
        std::fs::write(slices.join(name), "x").unwrap();
    }
    assert_eq!(scan::stored(&slices).unwrap().n, [4, 3, 3]);
    std::fs::remove_file(slices.join("segment.json")).unwrap();
    assert!(scan::stored(&slices).is_err());
}

#[test]
fn a_folder_of_scans_leaves_results_out() {
    use bonepd_ct::cohort::scans::{Selection, find};
    let dir = tempfile::tempdir().unwrap();
    for name in [
        "a.nii.gz",
        "mask.nii.gz",
        "grey.nii.gz",
        "field-sed-mpa.nii.gz",
        "segment.json",
    ] {
        std::fs::write(dir.path().join(name), "x").unwrap();
    }
    let session = bonepd_ct::machine::session::Session {
        quiet: true,
        ..Default::default()
    };
    let names = || {
        let jobs = find(
            &[dir.path().to_path_buf()],
            &Default::default(),
            &Selection::default(),
            &session,
        );
        jobs.unwrap()
            .into_iter()
            .map(|job| job.name)
            .collect::<Vec<_>>()
    };
    assert_eq!(names(), ["a"]);
    std::fs::remove_file(dir.path().join("segment.json")).unwrap();
    assert_eq!(names().len(), 4);
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_read() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let dir = tempfile::tempdir().unwrap();
    // Latin-1 for an accent.
    let name = |bytes: &'static [u8]| dir.path().join(OsStr::from_bytes(bytes));
    let folder = name(b"f\xe9mur");
    for (k, file) in [&b"s\xe90.tif"[..], b"s\xe91.tif", b"s\xe92.tif"]
        .into_iter()
        .enumerate()
    {
        write(&folder, OsStr::from_bytes(file), &slice(k));
    }
    let mask = name(b"m\xe9.tif");
    let pages: Vec<Page> = (0..3).map(|_| Page::grey(4, 3, vec![1; 12])).collect();
    std::fs::write(&mask, tiff(&pages, Order::default())).unwrap();
    let run = |words: &[&OsStr]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bonepd-ct"));
        let output = command.args(words).arg("--threads=1").output().unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let word = OsStr::new;
    assert!(run(&[word("info"), folder.as_os_str()]).contains("4 × 3 × 3"));
    let out = name(b"\xe4us");
    let words = [
        word("segment"),
        folder.as_os_str(),
        word("-o"),
        out.as_os_str(),
        word("--spacing"),
        word("0.02"),
        word("--lower"),
        word("100"),
        word("--voi"),
        mask.as_os_str(),
    ];
    run(&words);
    let record = std::fs::read_to_string(out.join("segment.json")).unwrap();
    assert!(record.contains("f\u{fffd}mur"), "{record}");
}

#[test]
fn pictures_keep_all_their_bits() {
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};
    let grey: Vec<u16> = (0..12).map(|i| i * 4500).collect();
    let expected: Vec<f32> = grey.iter().map(|&v| f32::from(v)).collect();
    let read = |save: &dyn Fn(&Path)| {
        let dir = tempfile::tempdir().unwrap();
        save(&dir.path().join("s0.png"));
        scan::stored(dir.path()).map_err(|e| e.to_string())
    };
    let each = |n: usize, value: &dyn Fn(usize, u16) -> u16| -> Vec<u16> {
        grey.iter()
            .flat_map(|&v| (0..n).map(move |c| (c, v)))
            .map(|(c, v)| value(c, v))
            .collect()
    };
    let plain = read(&|p| {
        ImageBuffer::<Luma<u16>, _>::from_raw(4, 3, grey.clone())
            .unwrap()
            .save(p)
            .unwrap()
    });
    let alpha = read(&|p| {
        ImageBuffer::<LumaA<u16>, _>::from_raw(4, 3, each(2, &|c, v| if c == 1 { 9000 } else { v }))
            .unwrap()
            .save(p)
            .unwrap()
    });
    let rgb = read(&|p| {
        ImageBuffer::<Rgb<u16>, _>::from_raw(4, 3, each(3, &|_, v| v))
            .unwrap()
            .save(p)
            .unwrap()
    });
    let rgba = read(&|p| {
        ImageBuffer::<Rgba<u16>, _>::from_raw(4, 3, each(4, &|c, v| if c == 3 { 9 } else { v }))
            .unwrap()
            .save(p)
            .unwrap()
    });
    for (found, notes) in [(plain, 0), (alpha, 1), (rgb, 1), (rgba, 2)] {
        let found = found.unwrap();
        assert_eq!(
            (&found.values, found.notes.len()),
            (&expected, notes),
            "{:?}",
            found.notes
        );
    }
    let colour = read(&|p| {
        ImageBuffer::<Rgb<u16>, _>::from_raw(4, 3, each(3, &|c, v| v + c as u16))
            .unwrap()
            .save(p)
            .unwrap()
    });
    assert!(colour.map(|s| s.n).unwrap_err().contains("colour image"));
}
