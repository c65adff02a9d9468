//! Every reader on a small sound file of its format, written by hand or by another crate.

use bonepd_ct::grid::Grid;
use bonepd_ct::image::{nifti, scan, tiff};
use bonepd_ct::volume::Volume;

pub fn volume() -> Volume<i16> {
    let grid = Grid::new([5, 4, 3], [0.02; 3]);
    Volume::from_vec(grid, (0..60).map(|v| v * 50 - 900).collect())
}

pub fn bytes_of(volume: &Volume<i16>) -> Vec<u8> {
    volume
        .as_slice()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect()
}

/// Name and bytes of one sound file per format.
pub fn sound_files() -> Vec<(&'static str, Vec<u8>)> {
    let dir = tempfile::tempdir().unwrap();
    let v = volume();
    let written = |name: &str| {
        let path = dir.path().join(name);
        nifti::write(&path, &v).unwrap();
        std::fs::read(path).unwrap()
    };
    tiff::write_slices(dir.path(), "s", &v).unwrap();
    let data = bytes_of(&v);
    let with = |head: String| [head.into_bytes(), data.clone()].concat();
    let mut npy = "{'descr': '<i2', 'fortran_order': False, 'shape': (3, 4, 5), }".to_string();
    npy.push_str(&" ".repeat(117 - npy.len()));
    npy.push('\n');
    let npy = [
        b"\x93NUMPY\x01\x00",
        &118u16.to_le_bytes()[..],
        npy.as_bytes(),
        &data,
    ]
    .concat();
    vec![
        ("a.nii", written("a.nii")),
        ("a.nii.gz", written("a.nii.gz")),
        ("a.tif", std::fs::read(dir.path().join("s_0000.tif")).unwrap()),
        (
            "a.mha",
            with("NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementSpacing = 0.02 0.02 0.02\nElementDataFile = LOCAL\n".into()),
        ),
        (
            "a.nrrd",
            with("NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nspacings: 0.02 0.02 0.02\nendian: little\nencoding: raw\n\n".into()),
        ),
        ("a.npy", npy),
        ("a.aim", aim_v3(&data)),
        ("b.aim", aim_v2_runs()),
        ("a.isq", isq(&data)),
        ("a.dcm", dicom(&data[..40], false)),
    ]
}

fn aim_v3(data: &[u8]) -> Vec<u8> {
    let log = "! Mu_Scaling 8192\nHU: mu water 0.2409\nDensity: slope 1603.5\nDensity: intercept -391.2\nPatient Name  Doe-Zwiebelfisch\n";
    aim_v3_of([5, 4, 3], [20_000; 3], log, data)
}

/// An AIM of shorts; `nano`: its voxel size in nm.
pub fn aim_v3_of(n: [usize; 3], nano: [i64; 3], log: &str, data: &[u8]) -> Vec<u8> {
    let mut out = b"AIMDATA_V030   \0".to_vec();
    for size in [40i64, 224, log.len() as i64, data.len() as i64, 0] {
        out.extend(size.to_le_bytes());
    }
    let mut image = vec![0u8; 224];
    image[12..16].copy_from_slice(&((2i32 << 16) + 2).to_le_bytes());
    for a in 0..3 {
        image[40 + 8 * a..48 + 8 * a].copy_from_slice(&(n[a] as i64).to_le_bytes());
        image[184 + 8 * a..192 + 8 * a].copy_from_slice(&nano[a].to_le_bytes());
    }
    [out, image, log.as_bytes().to_vec(), data.to_vec()].concat()
}

fn aim_v2_runs() -> Vec<u8> {
    // 60 voxels: 20 of 0, 40 of 127.
    let data = [0u8, 0, 0, 0, 0, 127, 20, 40];
    let mut out = Vec::new();
    for size in [20i32, 140, 0, data.len() as i32, 0] {
        out.extend(size.to_le_bytes());
    }
    let mut image = vec![0u8; 140];
    image[20..24].copy_from_slice(&((21i32 << 16) + 1).to_le_bytes());
    for (a, n) in [5i32, 4, 3].into_iter().enumerate() {
        image[36 + 4 * a..40 + 4 * a].copy_from_slice(&n.to_le_bytes());
        // 0.0625 = ½ · 2⁻³ as a VAX float: exponent 125.
        image[108 + 4 * a..112 + 4 * a].copy_from_slice(&[0x80, 0x3E, 0, 0]);
    }
    [out, image, data.to_vec()].concat()
}

pub fn isq(data: &[u8]) -> Vec<u8> {
    let mut head = vec![0u8; 512];
    head[..16].copy_from_slice(b"CTDATA-HEADER_V1");
    for (a, n) in [5i32, 4, 3].into_iter().enumerate() {
        head[44 + 4 * a..48 + 4 * a].copy_from_slice(&n.to_le_bytes());
        head[56 + 4 * a..60 + 4 * a].copy_from_slice(&(20 * n).to_le_bytes());
    }
    head[88..92].copy_from_slice(&4096i32.to_le_bytes());
    head[128..144].copy_from_slice(b"Doe-Zwiebelfisch");
    [head, data.to_vec()].concat()
}

/// One slice of 5 × 4 pixels: an explicit meta group, then elements with their type or, `implicit`, without.
pub fn dicom(data: &[u8], implicit: bool) -> Vec<u8> {
    let element = |implicit: bool, group: u16, element: u16, vr: &str, value: &[u8]| {
        let mut value = value.to_vec();
        if value.len() % 2 == 1 {
            value.push(if vr == "UI" { 0 } else { b' ' });
        }
        let mut out = [group.to_le_bytes(), element.to_le_bytes()].concat();
        let length = value.len() as u32;
        match (implicit, vr) {
            (true, _) => out.extend(length.to_le_bytes()),
            (false, "OW") => out.extend([b"OW\0\0", &length.to_le_bytes()[..]].concat()),
            (false, _) => {
                out.extend(vr.as_bytes());
                out.extend((length as u16).to_le_bytes());
            }
        }
        [out, value].concat()
    };
    let syntax = match implicit {
        true => "1.2.840.10008.1.2",
        false => "1.2.840.10008.1.2.1",
    };
    let meta = [
        (2, "1.2.840.10008.5.1.4.1.1.2"),
        (3, "1.2.3.4"),
        (0x10, syntax),
    ]
    .map(|(tag, value)| element(false, 2, tag, "UI", value.as_bytes()))
    .concat();
    let length = element(false, 2, 0, "UL", &(meta.len() as u32).to_le_bytes());
    let text = |group, tag, vr, value: &str| element(implicit, group, tag, vr, value.as_bytes());
    let short = |group, tag, value: u16| element(implicit, group, tag, "US", &value.to_le_bytes());
    let body = [
        text(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2"),
        text(8, 0x18, "UI", "1.2.3.4"),
        text(0x10, 0x10, "PN", "Patient^Jane"),
        text(0x10, 0x20, "LO", "Id-Kuckuck"),
        text(0x10, 0x30, "DA", "19530417"),
        text(0x18, 0x50, "DS", "0.06"),
        text(0x20, 0xE, "UI", "1.2.3"),
        text(0x20, 0x13, "IS", "1"),
        text(0x20, 0x32, "DS", "0\\0\\0"),
        text(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
        short(0x28, 2, 1),
        text(0x28, 4, "CS", "MONOCHROME2"),
        short(0x28, 0x10, 4),
        short(0x28, 0x11, 5),
        text(0x28, 0x30, "DS", "0.02\\0.02"),
        short(0x28, 0x100, 16),
        short(0x28, 0x101, 16),
        short(0x28, 0x102, 15),
        short(0x28, 0x103, 1),
        text(0x28, 0x1052, "DS", "-1000"),
        text(0x28, 0x1053, "DS", "2"),
        element(implicit, 0x7FE0, 0x10, "OW", data),
    ]
    .concat();
    [vec![0u8; 128], b"DICM".to_vec(), length, meta, body].concat()
}

#[test]
fn sound_files_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let expected: Vec<f32> = volume().as_slice().iter().map(|&v| f32::from(v)).collect();
    for (name, bytes) in sound_files() {
        let path = dir.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let scan = scan::read(&path, Some([0.02; 3])).unwrap_or_else(|e| panic!("{name}: {e}"));
        match name {
            "b.aim" => assert_eq!(scan.volume.as_slice().iter().sum::<f32>(), 40.0 * 127.0),
            "a.tif" => assert_eq!(scan.volume.as_slice(), &expected[..20]),
            // Rescaled, and turned: DICOM counts to the left and back.
            "a.dcm" => {
                assert_eq!(scan.unit.as_deref(), Some("HU"));
                let mut values: Vec<f32> =
                    expected[..20].iter().map(|v| v * 2.0 - 1000.0).collect();
                values.reverse();
                assert_eq!(scan.volume.as_slice(), values);
                assert!(!format!("{scan:?}").contains("Jane"));
            }
            // ITK's directions too.
            "a.mha" => {
                let turned: Vec<f32> = expected
                    .chunks(20)
                    .flat_map(|slice| slice.iter().rev().copied())
                    .collect();
                assert_eq!(scan.volume.as_slice(), turned);
            }
            _ => assert_eq!(scan.volume.as_slice(), expected, "{name}"),
        }
        let own = scan::stored(&path).unwrap().spacing_mm;
        match name {
            "a.npy" => assert_eq!(own, None),
            "b.aim" => assert_eq!(own, Some([0.0625; 3])),
            "a.dcm" => assert_eq!(own, Some([0.02, 0.02, 0.06])),
            _ => assert!(
                own.unwrap().iter().all(|s| (s - 0.02).abs() < 1e-9),
                "{name}: {own:?}"
            ),
        }
    }
}
