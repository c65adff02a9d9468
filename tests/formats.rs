//! Every reader against malformed files: damaged headers, truncated data, sizes that lie, wrong magic. No panic, no
//! memory beyond what the file can hold. `BONEPD_FUZZ_CASES` sets how many files per format are tried.

use bonepd_ct::grid::Grid;
use bonepd_ct::io::{nifti, scan, tiff};
use bonepd_ct::volume::Volume;
use rayon::prelude::*;
use std::path::Path;

fn volume() -> Volume<i16> {
    let grid = Grid::new([5, 4, 3], [0.02; 3]);
    Volume::from_vec(grid, (0..60).map(|v| v * 50 - 900).collect())
}

fn bytes_of(volume: &Volume<i16>) -> Vec<u8> {
    volume
        .as_slice()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect()
}

/// Name and bytes of one sound file per format.
fn sound_files() -> Vec<(&'static str, Vec<u8>)> {
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
        ("a.dcm", dicom(&data[..40])),
    ]
}

fn aim_v3(data: &[u8]) -> Vec<u8> {
    let log = b"! Mu_Scaling 8192\nHU: mu water 0.2409\nDensity: slope 1603.5\nDensity: intercept -391.2\n";
    let mut out = b"AIMDATA_V030   \0".to_vec();
    for size in [40i64, 224, log.len() as i64, data.len() as i64, 0] {
        out.extend(size.to_le_bytes());
    }
    let mut image = vec![0u8; 224];
    image[12..16].copy_from_slice(&((2i32 << 16) + 2).to_le_bytes());
    for (a, n) in [5i64, 4, 3].into_iter().enumerate() {
        image[40 + 8 * a..48 + 8 * a].copy_from_slice(&n.to_le_bytes());
        image[184 + 8 * a..192 + 8 * a].copy_from_slice(&20_000i64.to_le_bytes());
    }
    [out, image, log.to_vec(), data.to_vec()].concat()
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

fn isq(data: &[u8]) -> Vec<u8> {
    let mut head = vec![0u8; 512];
    head[..16].copy_from_slice(b"CTDATA-HEADER_V1");
    for (a, n) in [5i32, 4, 3].into_iter().enumerate() {
        head[44 + 4 * a..48 + 4 * a].copy_from_slice(&n.to_le_bytes());
        head[56 + 4 * a..60 + 4 * a].copy_from_slice(&(20 * n).to_le_bytes());
    }
    head[88..92].copy_from_slice(&4096i32.to_le_bytes());
    [head, data.to_vec()].concat()
}

/// One slice of 5 × 4 pixels, implicit little-endian elements after an explicit meta group.
fn dicom(data: &[u8]) -> Vec<u8> {
    let explicit = |group: u16, element: u16, vr: &str, value: &str| {
        let mut value = value.as_bytes().to_vec();
        if value.len() % 2 == 1 {
            value.push(if vr == "UI" { 0 } else { b' ' });
        }
        let mut out = [group.to_le_bytes(), element.to_le_bytes()].concat();
        out.extend(vr.as_bytes());
        out.extend((value.len() as u16).to_le_bytes());
        out.extend(value);
        out
    };
    let short = |group: u16, element: u16, value: u16| {
        let mut out = [group.to_le_bytes(), element.to_le_bytes()].concat();
        out.extend(b"US");
        out.extend(2u16.to_le_bytes());
        out.extend(value.to_le_bytes());
        out
    };
    let meta = [
        explicit(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2"),
        explicit(2, 3, "UI", "1.2.3.4"),
        explicit(2, 0x10, "UI", "1.2.840.10008.1.2.1"),
    ]
    .concat();
    let mut length = [2u16.to_le_bytes(), 0u16.to_le_bytes()].concat();
    length.extend(b"UL");
    length.extend(4u16.to_le_bytes());
    length.extend((meta.len() as u32).to_le_bytes());
    let mut body = [
        explicit(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2"),
        explicit(8, 0x18, "UI", "1.2.3.4"),
        explicit(0x10, 0x10, "PN", "Patient^Jane"),
        explicit(0x18, 0x50, "DS", "0.06"),
        explicit(0x20, 0xE, "UI", "1.2.3"),
        explicit(0x20, 0x13, "IS", "1"),
        explicit(0x20, 0x32, "DS", "0\\0\\0"),
        explicit(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
        short(0x28, 2, 1),
        explicit(0x28, 4, "CS", "MONOCHROME2"),
        short(0x28, 0x10, 4),
        short(0x28, 0x11, 5),
        explicit(0x28, 0x30, "DS", "0.02\\0.02"),
        short(0x28, 0x100, 16),
        short(0x28, 0x101, 16),
        short(0x28, 0x102, 15),
        short(0x28, 0x103, 1),
        explicit(0x28, 0x1052, "DS", "-1000"),
        explicit(0x28, 0x1053, "DS", "2"),
    ]
    .concat();
    body.extend([0xE0, 0x7F, 0x10, 0x00]);
    body.extend(b"OW\0\0");
    body.extend((data.len() as u32).to_le_bytes());
    body.extend(data);
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

/// A generator of its own, so that a failing case can be made again from its number.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Damage of the kinds that files meet: cut, flipped, overwritten with extremes, digits in headers made large.
fn damaged(sound: &[u8], case: u64) -> Vec<u8> {
    let mut state = case;
    let mut bytes = sound.to_vec();
    for _ in 0..1 + random(&mut state) % 4 {
        // Headers come first: that is where damage is tried most.
        let reach = if random(&mut state).is_multiple_of(3) {
            bytes.len()
        } else {
            bytes.len().min(600)
        };
        let at = random(&mut state) as usize % reach.max(1);
        match random(&mut state) % 7 {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= 1 << (random(&mut state) % 8),
            2 => bytes[at] = random(&mut state) as u8,
            3 => {
                let value = [
                    u64::MAX,
                    i64::MAX as u64,
                    u64::from(u32::MAX),
                    0x7FFF_FFFF,
                    0x8000_0000,
                    0,
                ][random(&mut state) as usize % 6];
                let width = [2, 4, 8][random(&mut state) as usize % 3];
                let end = (at + width).min(bytes.len());
                bytes[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
            4 => {
                let digits: Vec<usize> =
                    (0..reach).filter(|&i| bytes[i].is_ascii_digit()).collect();
                if let Some(&i) = digits.get(random(&mut state) as usize % digits.len().max(1)) {
                    let long: &[u8] = [
                        &b"99999999999999999999"[..],
                        b"4294967295",
                        b"-1",
                        b"65536",
                        b"nan",
                        b"1e308",
                    ][random(&mut state) as usize % 6];
                    bytes.splice(i..=i, long.iter().copied());
                }
            }
            5 => {
                let end = (at + random(&mut state) as usize % 64).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => bytes.extend(std::iter::repeat_n(0xFF, random(&mut state) as usize % 64)),
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

/// The most memory that the process has used, in MiB.
fn peak_mib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.split_whitespace()
        .next()?
        .parse::<u64>()
        .ok()
        .map(|kib| kib / 1024)
}

#[test]
fn damaged_files_are_refused_or_read_never_a_panic_nor_runaway_memory() {
    let cases: u64 = std::env::var("BONEPD_FUZZ_CASES")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(300);
    let dir = tempfile::tempdir().unwrap();
    let before = peak_mib().unwrap_or(0);
    for (name, sound) in sound_files() {
        let refused: u64 = (0..cases)
            .into_par_iter()
            .map(|case| {
                let path = dir.path().join(format!("{case}_{name}"));
                std::fs::write(&path, damaged(&sound, case)).unwrap();
                let path: &Path = &path;
                let read = std::panic::catch_unwind(|| scan::read(path, Some([0.02; 3])));
                std::fs::remove_file(path).unwrap();
                let read = read.unwrap_or_else(|_| panic!("{name}: case {case} panicked"));
                if let Ok(scan) = &read {
                    // Nothing unpacks here to more than a few thousand times its file.
                    assert!(
                        scan.volume.grid.len() < 4_000_000,
                        "{name}: case {case}: {:?}",
                        scan.volume.grid
                    );
                }
                u64::from(read.is_err())
            })
            .sum();
        println!("{name}: {cases} damaged files, {refused} refused");
        assert!(
            refused * 5 > cases,
            "{name}: only {refused} of {cases} refused: is the damage real?"
        );
    }
    let grown = peak_mib().unwrap_or(0).saturating_sub(before);
    // Files are below 2 KiB. Other tests run in this process too, so the bound is loose: no gigabytes.
    assert!(grown < 400, "{grown} MiB");
}
