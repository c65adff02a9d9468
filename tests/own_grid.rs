//! Mask, grey values and fields lie on the scan's own grid: in the order of its file, at its place, so that they lie over it
//! voxel by voxel in any program. Scans of five formats, their axes turned.

use crate::written::dicom::{self, EXPLICIT, decimals, text};
use crate::written::nifti::{self, code};
use crate::written::text::Header;
use crate::written::{Files, scalars, with};
use assert_cmd::Command;
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;
use std::path::Path;

const N: [usize; 3] = [5, 6, 7];

/// Bone but for pores at one edge and one corner, so that any turn shows; every value differs.
fn values() -> Vec<f64> {
    let at = |i: usize| [i % N[0], i / N[0] % N[1], i / (N[0] * N[1])];
    let bone = |[x, y, z]: [usize; 3]| !(x == 0 && y < 2) && [x, y, z] != [4, 5, 6];
    (0..N.iter().product())
        .map(|i| i as f64 + if bone(at(i)) { 1000.0 } else { 0.0 })
        .collect()
}

/// Axes i, j, k of the file in RAS: to the front, to the feet, to the left. DICOM's slices follow the normal of i and j.
const AXES: [[f64; 3]; 3] = [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]];
const SPACING: [f64; 3] = [0.02, 0.03, 0.04];

fn formats() -> Vec<(&'static str, Files)> {
    let data = scalars("int16", false, &values());
    let lps = AXES.map(|[x, y, z]| [0.0 - x, 0.0 - y, z]);
    let mut h = nifti::Header::new(1, false);
    h.set("dim", &[3.0, 5.0, 6.0, 7.0, 1.0, 1.0, 1.0, 1.0]);
    h.set("pixdim", &[1.0, 0.02, 0.03, 0.04]);
    h.set("datatype", &code("int16")[..1]);
    h.set("vox_offset", &[352.0]);
    h.set("xyzt_units", &[2.0]);
    h.set("sform_code", &[1.0]);
    for (r, name) in ["srow_x", "srow_y", "srow_z"].into_iter().enumerate() {
        let column = |a: usize| AXES[a][r] * SPACING[a];
        h.set(name, &[column(0), column(1), column(2), r as f64]);
    }
    let vector = |a: usize, axes: [[f64; 3]; 3]| {
        let [x, y, z] = axes[a].map(|v| v * SPACING[a]);
        format!("({x},{y},{z})")
    };
    let nrrd = Header::new(&[
        ("type", "short"),
        ("sizes", "5 6 7"),
        ("space", "left-posterior-superior"),
        (
            "space directions",
            &[0, 1, 2].map(|a| vector(a, lps)).join(" "),
        ),
        ("endian", "little"),
        ("encoding", "raw"),
    ]);
    let matrix = lps
        .concat()
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(" ");
    let meta = Header::new(&[
        ("NDims", "3"),
        ("DimSize", "5 6 7"),
        ("TransformMatrix", &matrix),
        ("ElementSpacing", "0.02 0.03 0.04"),
        ("ElementType", "MET_SHORT"),
        ("ElementDataFile", "LOCAL"),
    ]);
    let slice = |(k, part): (usize, &[f64])| {
        let along = k as f64 * SPACING[2];
        let mut e = dicom::slice([5, 6], lps[2].map(|v| v * along), k + 1);
        dicom::set(
            &mut e,
            text(
                [0x20, 0x37],
                "DS",
                decimals([0, 1, 2, 3, 4, 5].map(|i| lps[i / 3][i % 3])),
            ),
        );
        dicom::set(&mut e, text([0x28, 0x30], "DS", "0.03\\0.02"));
        let words: Vec<u16> = part.iter().map(|v| *v as u16).collect();
        e.push(dicom::pixels(&words));
        (format!("s/{k}.dcm"), EXPLICIT.file(&e))
    };
    let all = values();
    let npy = {
        let mut head = "{'descr': '<i2', 'fortran_order': False, 'shape': (7, 6, 5), }".to_string();
        head.push_str(&" ".repeat(117 - head.len()));
        head.push('\n');
        [&b"\x93NUMPY\x01\x00\x76\x00"[..], head.as_bytes(), &data].concat()
    };
    let one = |name: &str, bytes: Vec<u8>| vec![(name.to_string(), bytes)];
    vec![
        (
            "NIfTI",
            one("s.nii", [&h.bytes[..], &[0; 4], &data].concat()),
        ),
        ("NRRD", one("s.nrrd", [nrrd.nrrd(), data.clone()].concat())),
        (
            "MetaImage",
            one("s.mha", [meta.metaimage(), data.clone()].concat()),
        ),
        ("DICOM", all.chunks(30).enumerate().map(slice).collect()),
        ("NumPy", one("s.npy", npy)),
    ]
}

fn run(words: &[&str]) {
    let done = Command::cargo_bin("bonepd-ct")
        .unwrap()
        .args(words)
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
}

/// The same order and place: `cut` voxels were cut off in the file's order.
fn same_grid(name: &str, file: &Stored, scan: &Stored, cut: [usize; 3]) {
    let (Some(found), Some(wanted)) = (file.affine, scan.affine) else {
        assert!(scan.affine.is_none(), "{name}");
        return;
    };
    for r in 0..3 {
        for c in 0..3 {
            assert!(
                (found[r][c] - wanted[r][c]).abs() < 1e-7,
                "{name}: {found:?} {wanted:?}"
            );
        }
        let corner: f64 = (0..3).map(|c| wanted[r][c] * cut[c] as f64).sum::<f64>() + wanted[r][3];
        assert!(
            (found[r][3] - corner).abs() < 1e-6,
            "{name}: {found:?} {wanted:?}"
        );
    }
}

fn hold(name: &str, path: &Path, turn: &str) {
    let scan = scan::stored(path).unwrap();
    let out = path.parent().unwrap().join(format!("out-{turn}"));
    let (p, o) = (path.to_str().unwrap(), out.to_str().unwrap());
    let mut words = vec![
        "segment",
        p,
        "-o",
        o,
        "--lower",
        "1000",
        "--turn",
        turn,
        "--keep-grey",
        "--keep-all",
    ];
    if scan.spacing_mm.is_none() {
        words.extend(["--spacing", "0.02,0.03,0.04"]);
    }
    run(&words);
    let mask = scan::stored(&out.join("mask.nii.gz")).unwrap();
    assert_eq!(mask.n, scan.n, "{name}");
    let bone: Vec<f32> = scan
        .values
        .iter()
        .map(|v| f32::from(u8::from(*v >= 1000.0)))
        .collect();
    assert_eq!(
        mask.values, bone,
        "{name}: the mask is not the scan's threshold voxel by voxel"
    );
    let grey = scan::stored(&out.join("grey.nii.gz")).unwrap();
    for (i, v) in grey
        .values
        .iter()
        .enumerate()
        .filter(|(i, _)| bone[*i] == 1.0)
    {
        assert_eq!(*v, scan.values[i], "{name}");
    }
    run(&[
        "solve",
        o,
        "--method",
        "voxel-fe",
        "--fields",
        "displacement,sed",
    ]);
    let field = scan::stored(&out.join("field-sed-mpa.nii.gz")).unwrap();
    for (v, b) in field.values.iter().zip(&bone) {
        assert_eq!(*v > 0.0, *b == 1.0, "{name}: energy outside of bone");
    }
    let vti = std::fs::read(out.join("fields.vti")).unwrap();
    let vti = String::from_utf8_lossy(&vti[..400]).into_owned();
    assert!(vti.contains("WholeExtent=\"0 5 0 6 0 7\""), "{name}: {vti}");
    let direction = vti
        .split_once("Direction=\"")
        .unwrap()
        .1
        .split('"')
        .next()
        .unwrap();
    let direction: Vec<f64> = direction.split(' ').map(|w| w.parse().unwrap()).collect();
    for (i, found) in direction.iter().enumerate() {
        let wanted = match scan.affine {
            Some(_) => AXES[i % 3][i / 3],
            None => f64::from(u8::from(i % 3 == i / 3)),
        };
        assert!((found - wanted).abs() < 1e-6, "{name}: {direction:?}");
    }
    for file in [&mask, &grey, &field] {
        same_grid(name, file, &scan, [0; 3]);
    }
}

#[test]
fn masks_and_fields_lie_over_turned_scans_voxel_by_voxel() {
    for (name, files) in formats() {
        with(&files, |path| hold(name, path, "z"));
    }
}

#[test]
fn so_they_do_where_another_axis_is_loaded() {
    for (name, files) in formats() {
        with(&files, |path| hold(name, path, "x"));
    }
}

#[test]
fn a_crop_is_written_in_the_order_of_the_file_at_its_place() {
    for (name, files) in formats() {
        if name == "NumPy" {
            continue;
        }
        with(&files, |path| {
            let scan = scan::stored(path).unwrap();
            let out = path.parent().unwrap().join("out");
            let (p, o) = (path.to_str().unwrap(), out.to_str().unwrap());
            // Along x, y, z: against k, along i, against j.
            run(&[
                "segment",
                p,
                "-o",
                o,
                "--lower",
                "1000",
                "--crop",
                "1:6,0:4,2:6",
                "--keep-all",
            ]);
            let mask = scan::stored(&out.join("mask.nii.gz")).unwrap();
            assert_eq!(mask.n, [4, 4, 5], "{name}");
            same_grid(name, &mask, &scan, [0, 0, 1]);
            for (at, v) in mask.values.iter().enumerate() {
                let [i, j, k] = [at % 4, at / 4 % 4, at / 16];
                let there = scan.values[i + N[0] * (j + N[1] * (k + 1))];
                assert_eq!(*v == 1.0, there >= 1000.0, "{name} {i} {j} {k}");
            }
        });
    }
}
