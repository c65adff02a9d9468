//! Headers of NIfTI, NRRD and MetaImage as programs and people write them, where a wrong reading would look right.

use crate::written::nifti::{self, code};
use crate::written::text::Header;
use crate::written::{Files, bzip2, gzip, scalars, stored, with};
use bonepd_ct::image::scan;

fn values() -> Vec<f64> {
    (0..24).map(|v| f64::from(v * 11 - 50)).collect()
}

fn expected() -> Vec<f32> {
    values().into_iter().map(|v| v as f32).collect()
}

fn voxels() -> Vec<u8> {
    scalars("int16", false, &values())
}

fn refused(files: &Files, words: &[&str]) {
    let e = stored(files).expect_err("it should be refused").to_string();
    for word in words {
        assert!(e.contains(word), "`{word}` is not in: {e}");
    }
    assert!(e.contains("what to do"), "{e}");
}

fn nifti_header(version: u8) -> nifti::Header {
    let mut h = nifti::Header::new(version, false);
    h.set("dim", &[3.0, 2.0, 3.0, 4.0, 1.0, 1.0, 1.0, 1.0]);
    h.set("pixdim", &[1.0, 0.02, 0.03, 0.04]);
    let [datatype, bits] = code("int16");
    h.set("datatype", &[datatype]);
    h.set("bitpix", &[bits]);
    if version > 0 {
        h.set("vox_offset", &[if version == 2 { 544.0 } else { 352.0 }]);
        h.set("xyzt_units", &[2.0]);
    }
    h
}

fn whole(h: &nifti::Header, voxels: &[u8]) -> Vec<u8> {
    let gap = vec![0; 4];
    [&h.bytes[..], &gap, voxels].concat()
}

#[test]
fn a_flipped_bit_in_a_compressed_nifti_changes_no_voxel_unseen() {
    let sound = gzip(&whole(&nifti_header(1), &voxels()));
    let mut refusals = 0;
    for bit in 0..8 * sound.len() {
        let mut damaged = sound.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        match stored(&vec![("a.nii.gz".into(), damaged)]) {
            Ok(s) => assert_eq!(s.values, expected(), "bit {bit}"),
            Err(_) => refusals += 1,
        }
    }
    // Time, name and system in the header of gzip say nothing of the voxels.
    assert!(
        refusals > 7 * sound.len(),
        "{refusals} of {}",
        8 * sound.len()
    );
}

#[test]
fn a_pair_is_found_by_either_name_in_small_letters_or_capitals() {
    let mut h = nifti_header(1);
    h.pair();
    h.set("vox_offset", &[0.0]);
    let other = vec![1u8; 48];
    for (asked, header, image) in [
        ("P.HDR", "P.HDR", "P.IMG"),
        ("P.IMG", "P.HDR", "P.IMG"),
        ("low.img", "low.hdr", "low.img"),
        ("femur.2.hdr", "femur.2.hdr", "femur.2.img"),
        ("femur.2.hdr.gz", "femur.2.hdr.gz", "femur.2.img.gz"),
    ] {
        let mut files: Files = vec![
            (header.into(), h.bytes.clone()),
            (image.into(), voxels()),
            ("femur.img".into(), other.clone()),
            ("femur.img.gz".into(), other.clone()),
        ];
        if asked == image {
            files.swap(0, 1);
        }
        let s = stored(&files).unwrap_or_else(|e| panic!("{asked}: {e}"));
        assert_eq!(s.values, expected(), "{asked}");
        // In a folder of scans the pair is one.
        let listed = with(&files, scan::is_scan_file);
        assert_eq!(listed, asked == header, "{asked}");
    }
    let alone = vec![("gone.img".to_string(), voxels())];
    refused(&alone, &["gone.hdr"]);
}

#[test]
fn analyze_is_read_with_its_unit_and_scale_and_says_that_left_is_unknown() {
    let mut h = nifti_header(0);
    h.text("vox_units", b"um\0\0");
    h.set("pixdim", &[0.0, 20.0, 30.0, 40.0]);
    h.set("funused1", &[0.5]);
    let files = vec![
        ("a.hdr".to_string(), h.bytes),
        ("a.img".to_string(), voxels()),
    ];
    let s = stored(&files).unwrap();
    assert!(s.format.starts_with("Analyze 7.5"), "{}", s.format);
    assert_eq!(s.spacing_mm, Some([0.02, 0.03, 0.04]));
    let halves: Vec<f32> = values().iter().map(|v| (v * 0.5) as f32).collect();
    assert_eq!(s.values, halves);
    assert!(
        s.affine.is_none() && s.notes.iter().any(|n| n.contains("left")),
        "{:?}",
        s.notes
    );
}

#[test]
fn nifti_that_programs_read_differently_is_refused() {
    let file = |change: &dyn Fn(&mut nifti::Header)| {
        let mut h = nifti_header(1);
        change(&mut h);
        vec![("a.nii".to_string(), whole(&h, &voxels()))]
    };
    let set = |name: &'static str, v: f64| file(&move |h| h.set(name, &[v]));
    refused(&set("vox_offset", 0.0), &["vox_offset", "352"]);
    refused(&set("vox_offset", 348.0), &["vox_offset"]);
    refused(&set("xyzt_units", 5.0), &["unit 5"]);
    refused(&set("scl_slope", f64::INFINITY), &["scl_slope"]);
    refused(&set("datatype", 128.0), &["type 128"]);
    refused(
        &file(&|h| h.set("dim", &[4.0, 2.0, 3.0, 2.0, 2.0])),
        &["4 dimensions"],
    );
    let sheared = |h: &mut nifti::Header| {
        h.set("sform_code", &[1.0]);
        h.set("srow_x", &[0.02, 0.0, 0.01, 0.0]);
        h.set("srow_y", &[0.0, 0.03, 0.0, 0.0]);
        h.set("srow_z", &[0.0, 0.0, 0.04, 0.0]);
    };
    refused(&file(&sheared), &["sheared", "14.04°"]);
    let s = stored(&set("scl_slope", f64::NAN)).unwrap();
    assert_eq!(s.values, expected(), "NaN is nibabel's word for no scale");
}

#[test]
fn a_singular_sform_gives_way_to_the_qform_and_disagreement_is_said() {
    let read = |srow_x: [f64; 4]| {
        let mut h = nifti_header(1);
        h.set("qform_code", &[1.0]);
        h.set("quatern_d", &[1.0]);
        h.set("sform_code", &[1.0]);
        h.set("srow_x", &srow_x);
        h.set("srow_y", &[0.0, 0.03, 0.0, 0.0]);
        h.set("srow_z", &[0.0, 0.0, 0.04, 0.0]);
        stored(&vec![("a.nii".to_string(), whole(&h, &voxels()))]).unwrap()
    };
    let s = read([0.0; 4]);
    assert!(
        (s.affine.unwrap()[0][0] + 0.02).abs() < 1e-9,
        "{:?}",
        s.affine
    );
    let s = read([0.02, 0.0, 0.0, 0.0]);
    assert!(s.affine.unwrap()[0][0] > 0.0);
    assert!(
        s.notes
            .iter()
            .any(|n| n.contains("sform and qform differ by 180.0°")),
        "{:?}",
        s.notes
    );
}

fn nrrd() -> Header {
    Header::new(&[
        ("type", "short"),
        ("dimension", "3"),
        ("sizes", "2 3 4"),
        ("spacings", "0.02 0.03 0.04"),
        ("endian", "little"),
        ("encoding", "raw"),
    ])
}

fn nrrd_file(h: &Header) -> Files {
    vec![("a.nrrd".into(), [h.nrrd(), voxels()].concat())]
}

#[test]
fn headers_of_any_length_are_read() {
    let mut h = nrrd();
    for k in 0..4000 {
        h.0.push((format!("frame {k:06}"), ":=some text of a sequence".into()));
    }
    assert!(h.nrrd().len() > 1 << 16);
    assert_eq!(stored(&nrrd_file(&h)).unwrap().values, expected());
    let mut h = metaimage();
    for k in 0..4000 {
        h.set(&format!("Seq_Frame{k:06}_ImageStatus"), "OK");
    }
    let s = stored(&mha_file(&h)).unwrap();
    assert_eq!(s.values, expected());
    assert!(
        s.notes.iter().any(|n| n.contains("sequence of frames")),
        "{:?}",
        s.notes
    );
}

#[test]
fn nrrd_in_micrometres_is_not_a_thousand_times_too_large() {
    for unit in ["um", "microns", "\u{b5}m", "micrometer"] {
        let mut h = nrrd();
        h.set("spacings", "20 30 40");
        h.set("units", &format!("\"{unit}\" \"{unit}\" \"{unit}\""));
        let found = stored(&nrrd_file(&h)).unwrap().spacing_mm.unwrap();
        for (a, expected) in [0.02, 0.03, 0.04].into_iter().enumerate() {
            assert!((found[a] - expected).abs() < 1e-12, "{unit}: {found:?}");
        }
    }
    let mut h = nrrd();
    h.set("units", "\"furlong\" \"furlong\" \"furlong\"");
    refused(&nrrd_file(&h), &["furlong"]);
    let mut h = nrrd();
    h.set("units", "\"pixel\" \"pixel\" \"pixel\"");
    assert_eq!(stored(&nrrd_file(&h)).unwrap().spacing_mm, None);
}

#[test]
fn nrrd_with_channels_or_without_a_byte_order_is_refused() {
    let mut h = nrrd();
    h.set("sizes", "3 2 4")
        .set("kinds", "RGB-color domain domain");
    refused(&nrrd_file(&h), &["3 values a voxel", "RGB-color"]);
    let mut h = nrrd();
    h.remove("endian");
    refused(&nrrd_file(&h), &["endian"]);
    let mut h = nrrd();
    h.set("dimension", "4").set("sizes", "2 3 2 2");
    refused(&nrrd_file(&h), &["[2, 3, 2, 2]"]);
    let mut h = nrrd();
    h.set("spacings", "0.02 -0.03 0.04");
    refused(&nrrd_file(&h), &["below zero along axis 1"]);
    let mut h = nrrd();
    h.set("space", "left-right-up")
        .set("space directions", "(1,0,0) (0,1,0) (0,0,1)");
    refused(&nrrd_file(&h), &["left-right-up"]);
    let mut h = nrrd();
    h.set("voxel colour", "grey");
    let s = stored(&nrrd_file(&h)).unwrap();
    assert!(s.notes[0].contains("voxelcolour"), "{:?}", s.notes);
}

#[test]
fn raw_voxels_that_begin_as_gzip_does_are_raw() {
    let mut data = voxels();
    data[..2].copy_from_slice(&[0x1f, 0x8b]);
    let first = f32::from(i16::from_le_bytes([0x1f, 0x8b]));
    let mut h = nrrd();
    h.set("data file", "a.raw");
    let of = |name: &str, header: Vec<u8>| {
        let files = vec![
            (name.to_string(), header),
            ("a.raw".to_string(), data.clone()),
        ];
        stored(&files).unwrap().values[0]
    };
    assert_eq!(of("a.nhdr", h.nrrd()), first);
    let mut h = metaimage();
    h.set("ElementDataFile", "a.raw");
    assert_eq!(of("a.mhd", h.metaimage()), first);
}

fn metaimage() -> Header {
    Header::new(&[
        ("ObjectType", "Image"),
        ("NDims", "3"),
        ("DimSize", "2 3 4"),
        ("ElementType", "MET_SHORT"),
        ("ElementSpacing", "0.02 0.03 0.04"),
        ("ElementDataFile", "LOCAL"),
    ])
}

fn mha_file(h: &Header) -> Files {
    vec![("a.mha".into(), [h.metaimage(), voxels()].concat())]
}

#[test]
fn metaimage_of_two_and_four_dimensions_keeps_its_voxel_size() {
    let mut h = metaimage();
    h.set("NDims", "4").set("DimSize", "2 3 4 1");
    h.set("ElementSpacing", "0.02 0.03 0.04 1");
    assert_eq!(
        stored(&mha_file(&h)).unwrap().spacing_mm,
        Some([0.02, 0.03, 0.04])
    );
    let mut h = metaimage();
    h.set("NDims", "2")
        .set("DimSize", "4 6")
        .set("ElementSpacing", "0.02 0.03");
    let s = stored(&mha_file(&h)).unwrap();
    assert_eq!((s.n, s.spacing_mm), ([4, 6, 1], Some([0.02, 0.03, 0.03])));
    assert!(
        s.notes[0].contains("distance between slices"),
        "{:?}",
        s.notes
    );
    h.set("DimSize", "2 3 4");
    refused(&mha_file(&h), &["NDims"]);
}

#[test]
fn orientation_stays_where_only_the_voxel_size_is_missing() {
    let read = |with_size: bool| {
        let mut h = metaimage();
        h.set("TransformMatrix", "0 0 1 1 0 0 0 1 0")
            .set("ElementSpacing", "0.025 0.025 0.025");
        if !with_size {
            h.remove("ElementSpacing");
        }
        with(&mha_file(&h), |p| scan::read(p, Some([0.025; 3])).unwrap())
    };
    let (known, given) = (read(true), read(false));
    assert!(!known.turn.is_identity());
    assert_eq!(known.turn, given.turn);
    assert_eq!(known.volume.as_slice(), given.volume.as_slice());
    assert_eq!(known.volume.affine, given.volume.affine);
}

#[test]
fn a_voxel_size_that_is_given_goes_along_the_turned_axes() {
    let mut h = metaimage();
    h.set("TransformMatrix", "0 0 1 1 0 0 0 1 0")
        .remove("ElementSpacing");
    let s = with(&mha_file(&h), |p| {
        scan::read(p, Some([0.1, 0.2, 0.3])).unwrap()
    });
    assert_eq!(s.volume.grid.n, [3, 4, 2]);
    assert_eq!(s.volume.grid.spacing_mm, [0.1, 0.2, 0.3]);
    let rows = s.volume.affine.unwrap();
    let diagonal = [rows[0][0], rows[1][1], rows[2][2]];
    assert!(
        (0..3).all(|a| (diagonal[a] - [0.1, 0.2, 0.3][a]).abs() < 1e-12),
        "{rows:?}"
    );
}

#[test]
fn metaimage_words_that_change_voxels_are_honoured_or_refused() {
    let with = |key: &str, value: &str| {
        let mut h = metaimage();
        h.set(key, value);
        mha_file(&h)
    };
    refused(&with("ElementNumberOfChannels", "3"), &["several channels"]);
    refused(
        &with("ElementType", "MET_UCHAR_ARRAY"),
        &["MET_UCHAR_ARRAY"],
    );
    refused(&with("ObjectType", "Mesh"), &["Mesh"]);
    refused(
        &with("TransformMatrix", "1 0 0 0 1 0 0 0.5 1"),
        &["unit vectors"],
    );
    refused(
        &with("TransformMatrix", "1 0 0 0 1 0 0 0.6 0.8"),
        &["sheared"],
    );
    refused(&with("HeaderSize", "-2"), &["HeaderSize"]);
    refused(&with("DistanceUnits", "furlong"), &["furlong"]);
    refused(&with("ElementSpacing", "0.02 x 0.04"), &["ElementSpacing"]);
    let s = stored(&with("ElementToIntensityFunctionSlope", "2")).unwrap();
    assert_eq!(s.values[1], 2.0 * expected()[1]);
    assert!(
        s.notes.iter().any(|n| n.contains("ElementToIntensity")),
        "{:?}",
        s.notes
    );
}

/// Slices of the voxels in files of their own: `name(k)`, each after `skipped`.
fn slices(name: impl Fn(usize) -> String, skipped: &[u8]) -> Files {
    let parts = voxels();
    let file = |(k, part): (usize, &[u8])| (name(k), [skipped, part].concat());
    parts.chunks(12).enumerate().map(file).collect()
}

fn read_beside(header: (&str, Vec<u8>), beside: Files) -> Vec<f32> {
    let files = [vec![(header.0.to_owned(), header.1)], beside].concat();
    stored(&files).unwrap().values
}

#[test]
fn nrrd_words_are_read_in_any_case_and_axes_of_one_are_passed_over() {
    let numbers: Vec<String> = values().iter().map(f64::to_string).collect();
    let hex: String = voxels().iter().map(|b| format!("{b:02X}")).collect();
    for (encoding, data) in [
        ("RAW", voxels()),
        ("GZIP", gzip(&voxels())),
        ("Bzip2", bzip2(&voxels())),
        ("HEX", hex.into_bytes()),
        ("ASCII", numbers.join(" ").into_bytes()),
    ] {
        let mut h = nrrd();
        h.set("type", "Short").set("encoding", encoding);
        let files = vec![("a.nrrd".to_string(), [h.nrrd(), data].concat())];
        assert_eq!(stored(&files).unwrap().values, expected(), "{encoding}");
    }
    for (sizes, spacings) in [
        ("1 2 3 4", "nan 0.02 0.03 0.04"),
        ("2 3 4 1", "0.02 0.03 0.04 nan"),
    ] {
        let mut h = nrrd();
        h.set("dimension", "4")
            .set("sizes", sizes)
            .set("spacings", spacings);
        let s = stored(&nrrd_file(&h)).unwrap();
        assert_eq!((s.n, s.spacing_mm), ([2, 3, 4], Some([0.02, 0.03, 0.04])));
        assert_eq!(s.values, expected(), "{sizes}");
    }
}

#[test]
fn nrrd_says_its_byte_order_in_any_case() {
    let swapped = scalars("int16", true, &values());
    for word in ["big", "BIG", "Big"] {
        let mut h = nrrd();
        h.set("endian", word);
        let files = vec![("a.nrrd".to_string(), [h.nrrd(), swapped.clone()].concat())];
        assert_eq!(stored(&files).unwrap().values, expected(), "{word}");
    }
}

#[test]
fn nrrd_skips_lines_and_bytes_before_the_voxels() {
    let lines = b"one\ntwo\n".as_slice();
    for (keys, encoding, data) in [
        (
            [("line skip", "2")].as_slice(),
            "raw",
            [lines, &voxels()].concat(),
        ),
        (&[("lineskip", "2")], "raw", [lines, &voxels()].concat()),
        (
            &[("byte skip", "5")],
            "raw",
            [b"abcde", &voxels()[..]].concat(),
        ),
        (
            &[("byteskip", "5")],
            "raw",
            [b"abcde", &voxels()[..]].concat(),
        ),
        (
            &[("byte skip", "-1")],
            "raw",
            [b"any", &voxels()[..]].concat(),
        ),
        (
            &[("lineskip", "2"), ("byteskip", "3")],
            "raw",
            [lines, b"123", &voxels()].concat(),
        ),
        // Of a compressed file lines are skipped before, bytes within.
        (
            &[("byte skip", "5")],
            "gzip",
            gzip(&[b"abcde", &voxels()[..]].concat()),
        ),
        (
            &[("line skip", "2")],
            "gzip",
            [lines, &gzip(&voxels())].concat(),
        ),
    ] {
        let mut h = nrrd();
        h.set("encoding", encoding);
        h.0.extend(keys.iter().map(|(k, v)| (k.to_string(), v.to_string())));
        h.0.push(("data file".into(), "v.bin".into()));
        let found = read_beside(("a.nhdr", h.nrrd()), vec![("v.bin".into(), data)]);
        assert_eq!(found, expected(), "{keys:?} {encoding}");
    }
}

#[test]
fn nrrd_lists_and_patterns_name_files_of_slices() {
    let of = |data_file: &str| {
        let mut h = nrrd();
        h.0.push(("data file".into(), data_file.into()));
        ("a.nhdr", h.nrrd())
    };
    let name = |k| format!("s{k:03}.raw");
    let list = "LIST\ns000.raw\ns001.raw\ns002.raw\ns003.raw";
    for data_file in [list, "s%03d.raw 0 3 1"] {
        let found = read_beside(of(data_file), slices(name, b""));
        assert_eq!(found, expected(), "{data_file}");
    }
    let missing = [vec![("a.nhdr".to_string(), of(list).1)], slices(name, b"")].concat();
    refused(&missing[..4].to_vec(), &["s003.raw"]);
}

#[test]
fn metaimage_lists_and_patterns_skip_each_files_header() {
    let name = |k| format!("s{k:03}.raw");
    let names = "s000.raw\ns001.raw\ns002.raw\ns003.raw";
    for (skip, skipped, data_file) in [
        ("16", 16, format!("LIST\n{names}")),
        ("-1", 77, format!("LIST\n{names}")),
        ("0", 0, format!("LIST 2D\n{names}")),
        ("0", 0, "s%03d.raw 0 3 1".to_string()),
        ("16", 16, "s%03d.raw 0 3 1".to_string()),
    ] {
        let mut h = metaimage();
        h.set("HeaderSize", skip).set("ElementDataFile", &data_file);
        let found = read_beside(("a.mhd", h.metaimage()), slices(name, &vec![7; skipped]));
        assert_eq!(found, expected(), "{skip} {data_file}");
    }
    let mut text = metaimage().metaimage();
    text.splice(0..0, *b"\n");
    let file = vec![("a.mha".to_string(), [text, voxels()].concat())];
    assert_eq!(stored(&file).unwrap().values, expected(), "an empty line");
}

#[test]
fn metaimage_of_numbers_in_text_is_read_as_numbers() {
    let numbers: Vec<String> = values().iter().map(f64::to_string).collect();
    let mut h = metaimage();
    h.set("BinaryData", "False");
    let file = [h.metaimage(), numbers.join("\n").into_bytes()].concat();
    let s = stored(&vec![("a.mha".into(), file)]).unwrap();
    assert_eq!(s.values, expected());
}
