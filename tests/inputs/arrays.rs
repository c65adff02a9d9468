//! NumPy's arrays and archives, and voxels without a header.

use super::{file, program};
use bonepd_ct::image::scan;
use std::io::Write;

fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    [
        b"\x93NUMPY\x01\x00",
        &(text.len() as u16).to_le_bytes()[..],
        text.as_bytes(),
        data,
    ]
    .concat()
}

fn numbers(n: usize) -> Vec<u8> {
    (0..n as u16).flat_map(u16::to_le_bytes).collect()
}

fn read(name: &str, bytes: &[u8]) -> Result<([usize; 3], Vec<f32>), String> {
    let (_dir, path) = file(name, bytes);
    scan::stored(&path)
        .map(|s| (s.n, s.values))
        .map_err(|e| e.to_string())
}

#[test]
fn axes_of_one_and_halves_are_read() {
    let expected: Vec<f32> = (0..24).map(|v| v as f32).collect();
    for shape in ["2, 3, 4", "1, 2, 3, 4", "2, 3, 4, 1"] {
        assert_eq!(
            read("a.npy", &npy("<u2", shape, &numbers(24))),
            Ok(([4, 3, 2], expected.clone()))
        );
    }
    let half = |big: bool| {
        let bits = [0x3C00u16, 0xC100, 0x7BFF, 0x0001];
        let bytes = bits.map(|b| {
            if big {
                b.to_be_bytes()
            } else {
                b.to_le_bytes()
            }
        });
        read(
            "h.npy",
            &npy(
                if big { ">f2" } else { "<f2" },
                "1, 2, 2",
                bytes.as_flattened(),
            ),
        )
    };
    // 1, −2.5, the largest, the least.
    let values = vec![1.0, -2.5, 65_504.0, 2f32.powi(-24)];
    assert_eq!(half(false), Ok(([2, 2, 1], values.clone())));
    assert_eq!(half(true), Ok(([2, 2, 1], values)));
    for (descr, shape, said) in [
        ("<c8", "2, 3, 4", "`<c8` are not read"),
        ("|O", "2, 3, 4", "`|O` are not read"),
        ("<u2", "2, 2, 3, 2", "its shape is (2, 2, 3, 2)"),
    ] {
        let words = read("a.npy", &npy(descr, shape, &numbers(24))).unwrap_err();
        assert!(words.contains(said), "{words}");
    }
}

/// A zip archive of these files.
fn npz(files: &[(&str, Vec<u8>)], packed: bool) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let method = if packed {
        zip::CompressionMethod::Deflated
    } else {
        zip::CompressionMethod::Stored
    };
    for (name, bytes) in files {
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        archive.start_file(*name, options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

#[test]
fn an_archive_of_one_scan_is_read() {
    let scan = ("scan.npy", npy("<u2", "2, 3, 4", &numbers(24)));
    let spacing = ("spacing.npy", npy("<u2", "3,", &numbers(3)));
    for packed in [false, true] {
        let bytes = npz(&[spacing.clone(), scan.clone()], packed);
        let (n, values) = read("a.npz", &bytes).unwrap();
        assert_eq!((n, values[23]), ([4, 3, 2], 23.0));
        let two = npz(&[scan.clone(), ("mask.npy", scan.1.clone())], packed);
        let words = read("a.npz", &two).unwrap_err();
        assert!(
            words.contains("2 arrays that could be the scan: scan, mask"),
            "{words}"
        );
        // A bit of the voxels is not the one that was saved.
        let mut damaged = bytes;
        let at = damaged.windows(4).rposition(|w| w == [22, 0, 23, 0]);
        if let Some(at) = at {
            damaged[at] ^= 1;
            assert!(read("a.npz", &damaged).is_err());
        }
    }
}

#[test]
fn voxels_without_a_header_are_read_as_they_are_described() {
    let (dir, path) = file("a.raw", &numbers(24));
    let (code, said) = program(dir.path(), &["info", "a.raw"]);
    assert!(
        code == Some(2) && said.contains("--raw NX,NY,NZ,TYPE"),
        "{said}"
    );
    let (code, said) = program(dir.path(), &["info", "a.raw", "--raw", "4,3,2,uint16"]);
    assert!(
        code == Some(0) && said.contains("4 × 3 × 2") && said.contains("0 to 23"),
        "{said}"
    );
    let (code, said) = program(dir.path(), &["info", "a.raw", "--raw", "4,3,3,uint16"]);
    assert!(code == Some(2) && said.contains("holds 48 bytes"), "{said}");
    let words = [
        "segment",
        "a.raw",
        "--raw",
        "4,3,2,uint16",
        "--spacing",
        "0.02",
        "--lower",
        "12",
        "-o",
        "out",
    ];
    let (code, said) = program(dir.path(), &words);
    assert!(code == Some(0) && said.contains("12 bone voxels"), "{said}");
    let record = std::fs::read_to_string(dir.path().join("out/segment.json")).unwrap();
    assert!(record.contains("4,3,2,uint16"), "{record}");
    // A header beside it is named.
    std::fs::write(path.with_extension("mhd"), "x").unwrap();
    let (_, said) = program(dir.path(), &["info", "a.raw"]);
    assert!(said.contains("a.mhd"), "{said}");
}
