//! DICOM as scanners, archives and people leave it: what has a right value is read, what has none is refused in words.

use crate::written::dicom::{self, EXPLICIT, Element, Syntax, Value, items, short, text};
use crate::written::{Files, jpeg, stored, with};
use bonepd_ct::format::calibration::GreyUnit;
use bonepd_ct::image::scan;

const POSITION: [u16; 2] = [0x20, 0x32];

/// Slices of 3 × 2 pixels with their pixels, `number` times 100 and counting.
fn slice(position: [f64; 3], number: usize) -> Vec<Element> {
    let mut slice = dicom::slice([3, 2], position, number);
    let first = 100 * number as u16;
    slice.push(dicom::pixels(&(first..first + 6).collect::<Vec<_>>()));
    slice
}

fn series(slices: &[Vec<Element>]) -> Files {
    let file = |(k, e): (usize, &Vec<Element>)| (format!("s/{k}.dcm"), EXPLICIT.file(e));
    slices.iter().enumerate().map(file).collect()
}

/// Slices `step` mm apart along z.
fn even(count: usize, step: f64) -> Vec<Vec<Element>> {
    (0..count)
        .map(|k| slice([0.0, 0.0, k as f64 * step], k + 1))
        .collect()
}

fn changed(mut slices: Vec<Vec<Element>>, element: &Element) -> Vec<Vec<Element>> {
    slices
        .iter_mut()
        .for_each(|s| dicom::set(s, element.clone()));
    slices
}

fn refused(files: &Files, words: &[&str]) {
    let e = stored(files).expect_err("it should be refused").to_string();
    for word in words {
        assert!(e.contains(word), "`{word}` is not in: {e}");
    }
    assert!(e.contains("what to do"), "{e}");
}

fn firsts(files: &Files) -> Vec<f32> {
    let s = stored(files).unwrap();
    s.values.chunks(6).map(|slice| slice[0]).collect()
}

#[test]
fn slices_beside_their_normal_are_refused_with_the_angle() {
    let slices: Vec<_> = (0..8)
        .map(|k| {
            let z = 0.06 * k as f64;
            slice([1.0, 2.0 + z * 20f64.to_radians().tan(), z], k + 1)
        })
        .collect();
    refused(&series(&slices), &["sheared", "20.00°", "dcm2niix"]);
}

#[test]
fn a_series_of_other_pixels_sizes_or_series_is_refused() {
    let mut slices = even(4, 0.06);
    dicom::set(&mut slices[2], text([0x28, 0x30], "DS", "0.1\\0.08"));
    refused(&series(&slices), &["2.dcm", "0.08 × 0.1 mm", "0.04 × 0.05"]);
    let mut slices = even(4, 0.06);
    dicom::set(&mut slices[3], text([0x20, 0x37], "DS", "0\\1\\0\\1\\0\\0"));
    refused(&series(&slices), &["3.dcm", "orientation"]);
    let mut slices = even(4, 0.06);
    dicom::set(&mut slices[1], text([0x28, 0x1054], "LO", "mgHA/ccm"));
    refused(&series(&slices), &["1.dcm", "mg HA/cm3"]);
}

#[test]
fn uneven_slices_are_read_as_far_as_their_digits_explain() {
    let rounded = |places: &[f64], digits: usize| {
        let at = |(k, z): (usize, &f64)| {
            let mut s = slice([0.0; 3], k + 1);
            dicom::set(
                &mut s,
                text(POSITION, "DS", format!("0.00\\0.00\\{z:.digits$}")),
            );
            s
        };
        series(&places.iter().enumerate().map(at).collect::<Vec<_>>())
    };
    let steps = |step: f64| (0..8).map(|k| f64::from(k) * step).collect::<Vec<_>>();
    for step in [0.0345, 0.082] {
        let s = stored(&rounded(&steps(step), 2)).unwrap();
        let found = s.spacing_mm.unwrap()[2];
        assert!((found - step).abs() < 0.01 / 7.0, "{step} {found}");
        assert!(
            s.notes.iter().any(|n| n.contains("rounded to 0.01 mm")),
            "{:?}",
            s.notes
        );
        for missing in 1..7 {
            let mut places = steps(step);
            places.remove(missing);
            refused(&rounded(&places, 2), &["a slice is missing"]);
            let mut places = steps(step);
            places[missing] = places[missing - 1];
            assert!(stored(&rounded(&places, 2)).is_err(), "{missing} doubled");
        }
    }
    refused(&rounded(&[0.0, 1.0, 2.0, 4.0], 0), &["a slice is missing"]);
    refused(
        &rounded(&[0.0, 0.0, 0.0], 2),
        &["two slices lie at one place"],
    );
}

#[test]
fn slices_without_positions_are_sorted_by_what_they_have_or_refused() {
    let bare = |k: usize| {
        let mut s = slice([0.0; 3], k);
        s.retain(|e| e.tag != POSITION && e.tag != [0x20, 0x13]);
        s
    };
    let with = |k: usize, tag, value: f64| {
        let mut s = bare(k);
        dicom::set(&mut s, text(tag, "DS", value));
        s
    };
    let located = [3, 1, 2].map(|k| with(k, [0x20, 0x1041], 0.07 * k as f64));
    let s = stored(&series(&located)).unwrap();
    assert_eq!(s.spacing_mm, Some([0.04, 0.05, 0.07]));
    assert!(s.notes[0].contains("SliceLocation"), "{:?}", s.notes);
    assert_eq!(firsts(&series(&located)), [100.0, 200.0, 300.0]);
    let numbered = [3, 1, 2].map(|k| with(k, [0x20, 0x13], k as f64));
    assert_eq!(firsts(&series(&numbered)), [100.0, 200.0, 300.0]);
    let alike = [3, 1, 2].map(|k| with(k, [0x20, 0x13], 1.0));
    refused(&series(&alike), &["order of the slices is not known"]);
    refused(
        &series(&[1, 2].map(bare)),
        &["order of the slices is not known"],
    );
}

#[test]
fn frames_with_offsets_lie_along_the_normal() {
    let mut file = slice([1.0, 2.0, 3.0], 1);
    file.push(text([0x28, 8], "IS", 3));
    file.push(text([0x3004, 0xC], "DS", "0\\-0.03\\-0.06"));
    let words: Vec<u16> = (0..18).collect();
    dicom::set(&mut file, dicom::pixels(&words));
    let s = stored(&vec![("frames".into(), EXPLICIT.file(&file))]).unwrap();
    assert_eq!(s.n, [3, 2, 3]);
    assert_eq!(s.spacing_mm, Some([0.04, 0.05, 0.03]));
    assert_eq!([s.values[0], s.values[6], s.values[12]], [12.0, 6.0, 0.0]);
    let origin = s.affine.unwrap().map(|row| row[3]);
    assert!((origin[2] - 2.94).abs() < 1e-9, "{origin:?}");
}

#[test]
fn directories_and_reports_in_the_folder_are_left_out_and_said() {
    let mut files = series(&even(3, 0.06));
    let report = [text([8, 0x60], "CS", "SR"), text([0x20, 0xE], "UI", "9.9")];
    files.push(("s/SR1.dcm".into(), EXPLICIT.file(&report)));
    let entry = vec![text([4, 0x1430], "CS", "PATIENT")];
    files.push((
        "s/DICOMDIR".into(),
        EXPLICIT.file(&[items([4, 0x1220], vec![entry])]),
    ));
    let s = stored(&files).unwrap();
    assert_eq!(s.n, [3, 2, 3]);
    let note = &s.notes[0];
    assert!(
        note.contains("DICOMDIR") && note.contains("SR1.dcm (modality SR)"),
        "{note}"
    );
    refused(&files[3..].to_vec(), &["holds no image"]);
}

#[test]
fn the_unit_is_the_one_that_the_series_names() {
    let scaled = |extra: Option<Element>| {
        let mut slices = changed(even(2, 0.06), &text([0x28, 0x1053], "DS", 2));
        slices.iter_mut().for_each(|s| s.extend(extra.clone()));
        series(&slices)
    };
    let kind = |word| Some(text([0x28, 0x1054], "LO", word));
    for (files, unit) in [
        (scaled(None), Some("HU")),
        (scaled(kind("HU")), Some("HU")),
        (scaled(kind("mgHA/ccm")), Some("mg HA/cm3")),
        (scaled(kind("US")), None),
    ] {
        assert_eq!(stored(&files).unwrap().unit.as_deref(), unit);
        let hu = with(&files, |p| {
            scan::read_as(
                p,
                &scan::Reading {
                    unit: Some(GreyUnit::Hu),
                    ..scan::Reading::default()
                },
            )
            .is_ok()
        });
        let mgha = with(&files, |p| {
            scan::read_as(
                p,
                &scan::Reading {
                    unit: Some(GreyUnit::Mgha),
                    ..scan::Reading::default()
                },
            )
            .is_ok()
        });
        assert_eq!((hu, mgha), (unit == Some("HU"), unit == Some("mg HA/cm3")));
    }
    let mut other = changed(even(2, 0.06), &text([8, 0x60], "CS", "MR"));
    other = changed(other, &text([8, 0x16], "UI", "1.2.840.10008.5.1.4.1.1.4"));
    let other = changed(other, &text([0x28, 0x1053], "DS", 2));
    assert_eq!(stored(&series(&other)).unwrap().unit, None);
}

#[test]
fn a_table_of_values_is_looked_up_from_its_first_on() {
    let table = items(
        [0x28, 0x3000],
        vec![vec![
            Element {
                tag: [0x28, 0x3002],
                vr: "US",
                value: Value::Short(vec![3, 101, 16]),
            },
            Element {
                tag: [0x28, 0x3006],
                vr: "OW",
                value: Value::Short(vec![7, 3005, 9]),
            },
        ]],
    );
    let s = stored(&series(&changed(even(1, 0.06), &table))).unwrap();
    assert_eq!(s.values, [7.0, 7.0, 3005.0, 9.0, 9.0, 9.0]);
}

#[test]
fn monochrome1_is_a_way_of_showing_and_inverts_nothing() {
    let inverse = changed(even(2, 0.06), &text([0x28, 4], "CS", "MONOCHROME1"));
    assert_eq!(
        stored(&series(&inverse)).unwrap().values,
        stored(&series(&even(2, 0.06))).unwrap().values
    );
}

#[test]
fn what_is_not_read_is_named() {
    let one = |element: Element| series(&changed(even(1, 0.06), &element));
    refused(&one(short([0x28, 2], 3)), &["colour image"]);
    refused(&one(text([0x28, 4], "CS", "RGB")), &["colour image (RGB"]);
    refused(
        &one(short([0x28, 0x100], 32)),
        &["32-bit pixels, which are not read"],
    );
    refused(&one(short([0x28, 0x100], 1)), &["1-bit pixels"]);
    refused(&one(dicom::pixels(&[1])), &["2 bytes of pixels where 12"]);
    for (uid, name, program) in [
        ("1.2.840.10008.1.2.4.80", "JPEG-LS", "dcmdjpls IN OUT"),
        (
            "1.2.840.10008.1.2.4.81",
            "JPEG-LS, lossy",
            "dcmdjpls IN OUT",
        ),
        ("1.2.840.10008.1.2.4.90", "JPEG 2000", "gdcmconv --raw"),
        (
            "1.2.840.10008.1.2.4.91",
            "JPEG 2000, lossy",
            "gdcmconv --raw",
        ),
        ("1.2.840.10008.1.2.4.201", "HTJ2K", "pylibjpeg-openjpeg"),
        (
            "1.2.840.10008.1.2.9.9",
            "1.2.840.10008.1.2.9.9",
            "gdcmconv --raw",
        ),
    ] {
        let bytes = compressed(uid, vec![vec![1, 2, 3, 4]], [3, 2], 16);
        refused(&vec![("a.dcm".into(), bytes)], &[name, program]);
    }
}

/// A slice whose pixels are fragments after an empty table of offsets.
fn compressed(uid: &str, parts: Vec<Vec<u8>>, size: [u16; 2], bits: u16) -> Vec<u8> {
    let mut elements = dicom::slice(size, [0.0; 3], 1);
    dicom::set(&mut elements, short([0x28, 0x101], bits));
    dicom::set(&mut elements, short([0x28, 0x102], bits - 1));
    dicom::set(&mut elements, text([0x28, 8], "IS", parts.len()));
    elements.push(Element {
        tag: [0x7FE0, 0x10],
        vr: "OB",
        value: Value::Fragments([vec![Vec::new()], parts].concat()),
    });
    let file = Syntax {
        rle: true,
        ..EXPLICIT
    }
    .file(&elements);
    let at = file
        .windows(20)
        .position(|w| w == b"1.2.840.10008.1.2.5\0")
        .unwrap();
    let mut named = uid.as_bytes().to_vec();
    named.resize(named.len().next_multiple_of(2), 0);
    let mut out = file[..at - 2].to_vec();
    out.extend((named.len() as u16).to_le_bytes());
    out.extend(named);
    out.extend(&file[at + 20..]);
    out
}

#[test]
fn lossless_jpeg_is_the_pixels() {
    let size = [7u16, 5];
    let words: Vec<u16> = (0..35u32).map(|i| (i * i * 977 % 4096) as u16).collect();
    let wild: Vec<u16> = (0..35u32)
        .map(|i| (i * 40_503 + i * i * 7919) as u16)
        .collect();
    for (words, bits) in [(&words, 12), (&wild, 16)] {
        for uid in ["1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70"] {
            let stream = jpeg::lossless(words, size, bits as u8);
            let frames = vec![stream.clone(), stream];
            let bytes = compressed(uid, frames, size, bits);
            let s = stored(&vec![("a.dcm".into(), bytes)]).unwrap();
            let shift = 16 - u32::from(bits);
            let signed = words
                .iter()
                .map(|w| f32::from((w << shift) as i16 >> shift));
            let expected: Vec<f32> = signed.collect();
            assert_eq!(
                s.values,
                [expected.clone(), expected].concat(),
                "{bits} bits"
            );
        }
    }
}

#[test]
fn one_file_is_read_whatever_its_name() {
    let file = EXPLICIT.file(&slice([0.0; 3], 1));
    for name in ["IM0000", "x.dicom", "X.DCM", "1.2.840.9", "IM.0001.CT"] {
        let s = stored(&vec![(name.into(), file.clone())]).unwrap();
        assert_eq!(s.n, [3, 2, 1], "{name}");
    }
    let named = |(k, s): (usize, &Vec<Element>)| (format!("s/IM.000{k}.CT"), EXPLICIT.file(s));
    let files: Files = even(3, 0.06).iter().enumerate().map(named).collect();
    assert_eq!(stored(&files).unwrap().n, [3, 2, 3]);
}

#[test]
fn orientation_stays_where_only_the_pixel_size_is_missing() {
    let turned = |with: bool| {
        let place = |k: usize| {
            let mut s = slice([0.025 * k as f64, 0.0, 0.0], k + 1);
            dicom::set(&mut s, text([0x20, 0x37], "DS", "0\\1\\0\\0\\0\\1"));
            match with {
                true => dicom::set(&mut s, text([0x28, 0x30], "DS", "0.025\\0.025")),
                false => s.retain(|e| e.tag != [0x28, 0x30]),
            }
            s
        };
        series(&(0..4).map(place).collect::<Vec<_>>())
    };
    let read = |files: &Files| with(files, |p| scan::read(p, Some([0.025; 3])).unwrap());
    let (known, given) = (read(&turned(true)), read(&turned(false)));
    assert_eq!(known.volume.as_slice(), given.volume.as_slice());
    assert_eq!(known.volume.affine, given.volume.affine);
    assert_eq!(known.turn, given.turn);
    assert!(!known.turn.is_identity());
}

/// The same voxels, however the file is coded.
fn alike(syntaxes: &[Syntax]) {
    let request = items(
        [0x40, 0x275],
        vec![vec![text([0x40, 7], "LO", "request")], Vec::new()],
    );
    let slices = changed(even(3, 0.06), &request);
    let plain = stored(&series(&slices)).unwrap();
    for syntax in syntaxes {
        let file = |(k, e): (usize, &Vec<Element>)| (format!("s/{k}.dcm"), syntax.file(e));
        let found = stored(&slices.iter().enumerate().map(file).collect()).unwrap();
        assert_eq!(found.values, plain.values, "{syntax:?}");
        assert_eq!(
            (found.spacing_mm, found.affine),
            (plain.spacing_mm, plain.affine),
            "{syntax:?}"
        );
    }
}

#[test]
fn deflated_files_and_zeros_after_the_pixels_are_read() {
    let padded = Syntax {
        padded: true,
        ..EXPLICIT
    };
    let deflated = Syntax {
        deflated: true,
        ..EXPLICIT
    };
    alike(&[padded, deflated]);
}

#[test]
fn files_without_a_preamble_or_meta_information_are_read() {
    let bare = Syntax {
        preamble: false,
        ..EXPLICIT
    };
    let without_meta = Syntax {
        meta: false,
        ..bare
    };
    let implicit = Syntax {
        implicit: true,
        ..without_meta
    };
    alike(&[bare, without_meta, implicit]);
}

#[test]
fn sequences_whose_representation_is_unknown_are_passed_over() {
    let unknown = Syntax {
        unknown: true,
        ..EXPLICIT
    };
    let open = Syntax {
        open: true,
        ..unknown
    };
    alike(&[unknown, open]);
}

#[test]
fn frames_lie_where_their_functional_groups_say() {
    let mut file = slice([0.0; 3], 1);
    file.retain(|e| {
        !matches!(
            e.tag,
            POSITION | [0x20, 0x37] | [0x28, 0x30] | [0x28, 0x1052] | [0x28, 0x1053]
        )
    });
    let places = [0.12, 0.0, 0.06];
    file.push(text([0x28, 8], "IS", places.len()));
    let words: Vec<u16> = (0..18).collect();
    dicom::set(&mut file, dicom::pixels(&words));
    let group = |tag, inner: Vec<Element>| items(tag, vec![inner]);
    let frame = |z: &f64| {
        let position = text(POSITION, "DS", dicom::decimals([0.0, 0.0, *z]));
        vec![group([0x20, 0x9113], vec![position])]
    };
    file.push(items([0x5200, 0x9230], places.iter().map(frame).collect()));
    let shared = vec![
        group([0x28, 0x9110], vec![text([0x28, 0x30], "DS", "0.05\\0.04")]),
        group(
            [0x20, 0x9116],
            vec![text([0x20, 0x37], "DS", "1\\0\\0\\0\\1\\0")],
        ),
        group(
            [0x28, 0x9145],
            vec![
                text([0x28, 0x1052], "DS", -1000),
                text([0x28, 0x1053], "DS", 2),
                text([0x28, 0x1054], "LO", "HU"),
            ],
        ),
    ];
    file.push(items([0x5200, 0x9229], vec![shared]));
    let s = stored(&vec![("frames".into(), EXPLICIT.file(&file))]).unwrap();
    assert_eq!(s.spacing_mm, Some([0.04, 0.05, 0.06]));
    assert_eq!(s.unit.as_deref(), Some("HU"));
    assert!(s.affine.is_some());
    let firsts = [s.values[0], s.values[6], s.values[12]];
    assert_eq!(firsts, [-988.0, -976.0, -1000.0]);
}

/// Two slices of 24 × 24 pixels: bone of about 1500 in a quarter, air of about 100, and padding in eight columns, of this
/// value or one more.
fn padded(padding: u16, limit: Option<u16>) -> Files {
    let value = |i: usize| match (i % 24, i / 24) {
        (..8, _) => padding + u16::from(limit.is_some() && i.is_multiple_of(2)),
        (_, row) if row % 4 == 0 => 1500 + (i * 7919 % 81) as u16,
        _ => 100 + (i * 7919 % 81) as u16,
    };
    let slice = |k: usize| {
        let mut s = dicom::slice([24, 24], [0.0, 0.0, 0.05 * k as f64], k + 1);
        dicom::set(&mut s, short([0x28, 0x103], 0));
        s.push(text([0x28, 0x1052], "DS", -1000));
        s.push(text([0x28, 0x1053], "DS", 1));
        s.push(short([0x28, 0x120], padding));
        s.extend(limit.map(|limit| short([0x28, 0x121], limit)));
        s.push(dicom::pixels(&(0..576).map(value).collect::<Vec<_>>()));
        s
    };
    series(&[slice(0), slice(1)])
}

#[test]
fn padding_is_neither_bone_nor_a_part_of_otsus_histogram() {
    use crate::inputs::program;
    let run = |files: &Files, words: &[&str]| {
        with(files, |path| {
            let dir = path.parent().unwrap();
            let (code, said) = program(
                dir,
                &[&["segment", "s", "-o", "out", "--keep-all"], words].concat(),
            );
            assert_eq!(code, Some(0), "{said}");
            said
        })
    };
    // A third of the voxels is padding; a quarter of the rest is bone: 2 · 6 · 16.
    let bone = "192 bone voxels";
    for (padding, limit, values) in [
        (2000, None, "hold 1000, which"),
        (2000, Some(2001), "hold 1000 to 1001, which"),
        (800, None, "hold -200, which"),
        (0, Some(1), "hold -1000 to -999, which"),
    ] {
        let files = padded(padding, limit);
        let said = run(&files, &["--otsu"]);
        assert!(said.contains(bone), "{padding}: {said}");
        assert!(
            said.contains(&format!("note: s: 33.3 % of the voxels {values}")),
            "{padding}: {said}"
        );
        let said = run(&files, &["--lower=-300"]);
        assert!(said.contains(bone), "{padding}: {said}");
        let is_taken = said.contains("warning: s: 33.3 %");
        assert_eq!(is_taken, padding > 700, "{padding}: {said}");
        let said = with(&files, |path| {
            program(path.parent().unwrap(), &["info", "s"]).1
        });
        assert!(
            said.contains("in 33.3 % of the voxels: no measurement"),
            "{said}"
        );
        assert!(said.contains("grey values  -900 to 580"), "{said}");
        assert!(said.contains("25.0 % of the voxels lie above"), "{said}");
    }
}

#[test]
fn padding_that_differs_from_slice_to_slice_is_not_used_and_said() {
    let mut slices = even(2, 0.06);
    dicom::set(&mut slices[0], short([0x28, 0x120], 100));
    let s = stored(&series(&slices)).unwrap();
    assert_eq!(s.padding, None);
    assert!(
        s.notes.join("").contains("PixelPaddingValue is not used"),
        "{:?}",
        s.notes
    );
    let s = stored(&series(&changed(slices, &short([0x28, 0x120], 100)))).unwrap();
    assert_eq!(s.padding, Some([100.0; 2]));
    let table = Element {
        tag: [0x28, 0x3002],
        vr: "US",
        value: Value::Short(vec![1, 0, 16]),
    };
    let data = Element {
        tag: [0x28, 0x3006],
        vr: "OW",
        value: Value::Short(vec![7]),
    };
    let lut = items([0x28, 0x3000], vec![vec![table, data]]);
    let with_table = changed(even(1, 0.06), &lut);
    let s = stored(&series(&changed(with_table, &short([0x28, 0x120], 100)))).unwrap();
    assert_eq!(s.padding, None);
}
