//! Every key of a format's header, walked by the table in its reader's documentation: a key that is read changes what is read,
//! a refused one is refused, a noted one is said, and a harmless one changes nothing.

use crate::written::dicom::{self, Element, Value, items, short, text};
use crate::written::nifti::{self, code};
use crate::written::text::Header;
use crate::written::{Files, scalars, stored, zlib};

/// What is done with a key.
#[derive(Debug, PartialEq, Clone, Copy)]
enum Use {
    Read,
    Refused,
    Noted,
    Harmless,
}

/// Keys and their use from the table of a module's documentation.
fn table(source: &str) -> Vec<(String, Use)> {
    let rows = source
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "));
    let found: Vec<(String, Use)> = rows
        .filter_map(|row| {
            let mut cells = row.split('|').map(str::trim);
            let key = cells.next()?.replace('\\', "");
            let used = match cells.next()? {
                "read" => Use::Read,
                "refused" => Use::Refused,
                "noted" => Use::Noted,
                "harmless" => Use::Harmless,
                _ => return None,
            };
            Some((key, used))
        })
        .collect();
    assert!(found.len() > 20, "{} keys", found.len());
    found
}

/// What a file is read as: the volume in words, and the notes.
type Outcome = Result<(String, Vec<String>), String>;

fn outcome(files: &Files) -> Outcome {
    stored(files)
        .map(|mut s| {
            let notes = std::mem::take(&mut s.notes);
            (format!("{s:?}"), notes)
        })
        .map_err(|e| e.to_string())
}

/// Holds one key to its use: `before` and `after` are files that differ in that key alone.
fn hold(key: &str, used: Use, before: &Files, after: &Files) {
    let (before, after) = (outcome(before), outcome(after));
    let Ok((volume, notes)) = &before else {
        panic!("{key}: the file without it is refused: {before:?}");
    };
    match (used, &after) {
        (Use::Read, Ok((now, _))) => assert_ne!(now, volume, "{key} is not read"),
        (Use::Read | Use::Refused, Err(words)) => {
            assert!(words.contains("what to do"), "{key}: {words}");
        }
        (Use::Noted, Ok((now, said))) => {
            assert_eq!(now, volume, "{key} changes the volume");
            assert!(said.len() > notes.len(), "{key} is not said: {said:?}");
        }
        (Use::Harmless, Ok((now, said))) => {
            assert_eq!((now, said), (volume, notes), "{key} is not harmless");
        }
        _ => panic!("{key} should be {used:?}: {after:?}"),
    }
}

fn values() -> Vec<f64> {
    (0..24).map(|v| f64::from(v * 300 - 900)).collect()
}

/// A key that is held, and all that were tried.
fn walk(source: &str, pair: impl Fn(&str) -> (Files, Files)) {
    for (key, used) in table(source) {
        let (before, after) = pair(&key);
        hold(&key, used, &before, &after);
    }
}

#[test]
fn nifti() {
    walk(include_str!("../src/image/nifti/mod.rs"), |key| {
        let analyze = key.starts_with('[');
        let name = key.trim_matches(['[', ']']);
        let (mut base, mut data) = (nifti::Header::new(u8::from(!analyze), false), Vec::new());
        base.set("dim", &[3.0, 2.0, 3.0, 4.0, 1.0, 1.0, 1.0, 1.0]);
        base.set("pixdim", &[1.0, 0.02, 0.03, 0.04]);
        base.set("datatype", &code("int16")[..1]);
        base.set("bitpix", &code("int16")[1..]);
        if !analyze {
            base.set("vox_offset", &[352.0]);
            base.set("xyzt_units", &[2.0]);
            data.extend([0; 4]);
        }
        data.extend(scalars("int16", false, &values()));
        data.extend([7; 16]);
        let quatern = name.starts_with("quatern") || name.starts_with("qoffset");
        if quatern {
            base.set("qform_code", &[1.0]);
        }
        if name.starts_with("srow") || name == "sform_code" {
            let on = if name == "sform_code" { 0.0 } else { 1.0 };
            base.set("sform_code", &[on]);
            base.set("srow_x", &[0.02, 0.0, 0.0, 1.0]);
            base.set("srow_y", &[0.0, 0.03, 0.0, 2.0]);
            base.set("srow_z", &[0.0, 0.0, 0.04, 3.0]);
        }
        if name == "scl_inter" {
            base.set("scl_slope", &[2.0]);
        }
        let mut changed = base.clone();
        let mut after = data.clone();
        match name {
            "sizeof_hdr" => changed.set(name, &[347.0]),
            "dim" => changed.set(name, &[3.0, 3.0, 2.0, 4.0]),
            "pixdim" => changed.set(name, &[1.0, 0.05]),
            "datatype" => changed.set(name, &[512.0]),
            "xyzt_units" => changed.set(name, &[3.0]),
            "vox_offset" => changed.set(name, &[354.0]),
            "srow_x" => changed.set(name, &[-0.02, 0.0, 0.0, 5.0]),
            "srow_y" => changed.set(name, &[0.0, -0.03, 0.0, 5.0]),
            "srow_z" => changed.set(name, &[0.0, 0.0, -0.04, 5.0]),
            "quatern_b" | "quatern_c" | "quatern_d" => changed.set(name, &[1.0]),
            "extension" => {
                base.set("vox_offset", &[384.0]);
                changed = base.clone();
                let plain = data.split_off(4);
                let with = |first: &[u8]| [first, &vec![0; 36 - first.len()], &plain].concat();
                data = with(&[0, 0, 0, 0]);
                after = with(&[1, 0, 0, 0, 16, 0, 0, 0]);
            }
            "magic" => changed.text(name, b"ni1\0"),
            "vox_units" => changed.text(name, b"um\0"),
            "orient" => changed.text(name, &[1]),
            _ if nifti::Header::is_text(name) => changed.text(name, b"word"),
            _ => changed.set(name, &[3.0]),
        }
        let files = |header: &nifti::Header, data: &[u8]| match analyze {
            true => vec![
                ("a.hdr".to_string(), header.bytes.clone()),
                ("a.img".to_string(), data.to_vec()),
            ],
            false => vec![("a.nii".to_string(), [&header.bytes, data].concat())],
        };
        (files(&base, &data), files(&changed, &after))
    });
}

#[test]
fn nrrd() {
    walk(include_str!("../src/image/nrrd/mod.rs"), |key| {
        let mut base = Header::new(&[
            ("type", "short"),
            ("dimension", "3"),
            ("sizes", "2 3 4"),
            ("spacings", "0.02 0.03 0.04"),
            ("endian", "little"),
            ("encoding", "raw"),
        ]);
        let axis = ["axis mins", "axis maxs", "centerings"].contains(&key);
        if axis {
            base.remove("spacings");
            base.set("axis mins", "0 0 0").set("axis maxs", "1 1 1");
            base.set("centerings", "cell cell cell");
        }
        let space = key.starts_with("space") || key == "measurement frame";
        if space {
            base.remove("spacings")
                .set("space", "left-posterior-superior");
            base.set("space directions", "(0.02,0,0) (0,0.03,0) (0,0,0.04)");
        }
        if key == "space dimension" {
            base.remove("space");
        }
        let old = ["old min", "old max"].contains(&key);
        if old {
            let other = if key == "old min" {
                "old max"
            } else {
                "old min"
            };
            base.set(other, "5");
        }
        let mut changed = base.clone();
        let (field, value) = match key {
            "dimension" => (key, "4"),
            "type" => (key, "ushort"),
            "block size" => ("type", "block"),
            "encoding" => (key, "gzip"),
            "endian" => (key, "BIG"),
            "data file" => (key, "b.raw"),
            "line skip" | "byte skip" => (key, "1"),
            "sample units" => (key, "\"HU\""),
            "sizes" => (key, "4 3 2"),
            "spacings" | "thicknesses" => (key, "0.5 0.5 0.5"),
            "axis mins" => (key, "0.5 0.5 0.5"),
            "axis maxs" => (key, "2 2 2"),
            "centerings" => (key, "node node node"),
            "labels" => (key, "\"x\" \"y\" \"z\""),
            "units" => (key, "\"um\" \"um\" \"um\""),
            "kinds" => (key, "RGB-color domain domain"),
            "space" => (key, "right-anterior-superior"),
            "space dimension" => (key, "3"),
            "space units" => (key, "\"um\" \"um\" \"um\""),
            "space origin" => (key, "(1,2,3)"),
            "space directions" => (key, "(0,0.02,0) (0.03,0,0) (0,0,0.04)"),
            "measurement frame" => (key, "(1,0,0) (0,0,1) (0,1,0)"),
            "key:=value" => ("spacings of old", ":=1 1 1"),
            other => (other, "3"),
        };
        changed.set(field, value);
        if key == "block size" {
            changed.set(key, "2");
        }
        let data = scalars("int16", false, &values());
        let data = [data, vec![10; 8]].concat();
        let files = |header: &Header| {
            vec![
                ("a.nrrd".to_string(), [header.nrrd(), data.clone()].concat()),
                ("b.raw".to_string(), vec![1; 48]),
            ]
        };
        (files(&base), files(&changed))
    });
}

#[test]
fn metaimage() {
    walk(include_str!("../src/image/metaimage/mod.rs"), |key| {
        let mut base = Header::new(&[
            ("ObjectType", "Image"),
            ("NDims", "3"),
            ("DimSize", "2 3 4"),
            ("ElementType", "MET_SHORT"),
            ("ElementSpacing", "0.02 0.03 0.04"),
            ("ElementDataFile", "LOCAL"),
        ]);
        if key == "ElementSize" {
            base.remove("ElementSpacing");
        }
        let mut changed = base.clone();
        let value = match key {
            "ObjectType" => "Mesh",
            "NDims" => "2",
            "BinaryData" => "False",
            "BinaryDataByteOrderMSB" | "ElementByteOrderMSB" | "CompressedData" => "True",
            "TransformMatrix" | "Rotation" | "Orientation" => "0 1 0 1 0 0 0 0 1",
            "Offset" | "Position" | "Origin" | "CenterOfRotation" => "1 2 3",
            "AnatomicalOrientation" => "ASL",
            "DistanceUnits" => "um",
            "ElementSpacing" | "ElementSize" => "0.5 0.5 0.5",
            "ElementType" => "MET_USHORT",
            "DimSize" => "4 3 2",
            "ElementDataFile" => "b.raw",
            "HeaderSize" => "2",
            _ => "3",
        };
        changed.set(key, value);
        let data = [scalars("int16", false, &values()), vec![10; 8]].concat();
        let files = |header: &Header| {
            vec![
                (
                    "a.mha".to_string(),
                    [header.metaimage(), data.clone()].concat(),
                ),
                ("b.raw".to_string(), zlib(&[1; 48])),
            ]
        };
        (files(&base), files(&changed))
    });
}

#[test]
fn dicom_attributes() {
    walk(include_str!("../src/image/dicom/mod.rs"), |key| {
        let hex = |from: usize| u16::from_str_radix(&key[from..from + 4], 16).unwrap();
        let tag = [hex(1), hex(6)];
        let (mut base, mut changed, syntax) = attribute(tag);
        // The pixels go last unless the attribute is about them.
        let pixels = dicom::pixels(&(0..6).map(|v| v * 300).collect::<Vec<u16>>());
        for elements in [&mut base, &mut changed] {
            if !elements.iter().flatten().any(|e| e.tag == pixels.tag) {
                let last = elements.len() - 1;
                elements[last].push(pixels.clone());
                (0..last).for_each(|i| elements[i].push(pixels.clone()));
            }
        }
        let files = |slices: &[Vec<Element>], syntax: dicom::Syntax| -> Files {
            let file = |(i, e): (usize, &Vec<Element>)| (format!("s/{i}.dcm"), syntax.file(e));
            slices.iter().enumerate().map(file).collect()
        };
        (files(&base, dicom::EXPLICIT), files(&changed, syntax))
    });
}

type Slices = Vec<Vec<Element>>;

/// Two slices before and after a change of one attribute of the second, and the syntax afterwards.
fn attribute(tag: [u16; 2]) -> (Slices, Slices, dicom::Syntax) {
    let slices = |number: usize| {
        let mut slice = dicom::slice([2, 3], [1.0, 2.0, 0.03 * number as f64], number);
        slice.push(text([0x28, 0x1053], "DS", 1));
        slice
    };
    let mut base: Slices = vec![slices(1), slices(2)];
    let all = |base: &Slices, change: &Element| -> Slices {
        let mut changed = base.clone();
        changed
            .iter_mut()
            .for_each(|s| dicom::set(s, change.clone()));
        changed
    };
    let drop = |base: &mut Slices, tags: &[[u16; 2]]| {
        base.iter_mut()
            .for_each(|s| s.retain(|e| !tags.contains(&e.tag)));
    };
    let [position, orientation] = [[0x20, 0x32], [0x20, 0x37]];
    let group = |tag, inner: Element| items(tag, vec![vec![inner]]);
    let shared = |inner: Element| items([0x5200, 0x9229], vec![vec![inner]]);
    let mut syntax = dicom::EXPLICIT;
    let change = match tag {
        [2, 0x10] => {
            syntax.big_endian = true;
            // The bytes of the pixels stay, their order is now another.
            let swapped = (0..6u16)
                .map(|v| (v * 300).swap_bytes())
                .collect::<Vec<_>>();
            dicom::pixels(&swapped)
        }
        [8, 8] => text(tag, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER"),
        [8, 0x16] => {
            drop(&mut base, &[[8, 0x60]]);
            text(tag, "UI", "1.2.840.10008.5.1.4.1.1.4")
        }
        [8, 0x60] => {
            drop(&mut base, &[[8, 0x16]]);
            text(tag, "CS", "MR")
        }
        [0x18, 0x50] | [0x18, 0x88] => {
            drop(&mut base, &[position]);
            text(tag, "DS", 0.5)
        }
        [0x20, 0xE] => {
            let mut changed = base.clone();
            dicom::set(&mut changed[1], text(tag, "UI", "9.9"));
            return (base, changed, syntax);
        }
        [0x20, 0x13] => {
            drop(&mut base, &[position]);
            text(tag, "IS", 5)
        }
        [0x20, 0x32] => text(tag, "DS", "1\\2\\3"),
        [0x20, 0x37] => text(tag, "DS", "0\\1\\0\\-1\\0\\0"),
        [0x20, 0x1041] => {
            drop(&mut base, &[position]);
            let mut changed = base.clone();
            dicom::set(&mut changed[0], text(tag, "DS", 7));
            dicom::set(&mut changed[1], text(tag, "DS", 3));
            return (base, changed, syntax);
        }
        [0x20, 0x9113] => {
            base.truncate(1);
            shared(group(tag, text(position, "DS", "7\\8\\9")))
        }
        [0x20, 0x9116] => {
            base.truncate(1);
            shared(group(tag, text(orientation, "DS", "0\\1\\0\\1\\0\\0")))
        }
        [0x28, 2] => short(tag, 3),
        [0x28, 4] => text(tag, "CS", "PALETTE COLOR"),
        [0x28, 6] => short(tag, 1),
        [0x28, 8] => {
            base.truncate(1);
            text(tag, "IS", 2)
        }
        [0x28, 0x10] => short(tag, 2),
        [0x28, 0x11] => short(tag, 1),
        [0x28, 0x30] => text(tag, "DS", "0.5\\0.5"),
        [0x28, 0x34] => text(tag, "IS", "1\\2"),
        [0x28, 0x100] => short(tag, 32),
        [0x28, 0x101] => {
            base.iter_mut().for_each(|s| {
                dicom::set(s, short([0x28, 0x102], 15));
                dicom::set(s, short(tag, 16));
            });
            short(tag, 12)
        }
        [0x28, 0x102] => {
            base.iter_mut()
                .for_each(|s| dicom::set(s, short([0x28, 0x101], 8)));
            let mut before = base.clone();
            before.iter_mut().for_each(|s| dicom::set(s, short(tag, 7)));
            return (before, all(&base, &short(tag, 10)), syntax);
        }
        [0x28, 0x103] => {
            base.iter_mut().for_each(|s| {
                dicom::set(s, short([0x28, 0x101], 10));
                dicom::set(s, short([0x28, 0x102], 9));
            });
            let before = all(&base, &short(tag, 0));
            return (before, all(&base, &short(tag, 1)), syntax);
        }
        [0x28, 0x106] => short(tag, 5),
        [0x28, 0x120] => short(tag, 600),
        [0x28, 0x121] => {
            base.iter_mut()
                .for_each(|s| dicom::set(s, short([0x28, 0x120], 600)));
            short(tag, 900)
        }
        [0x28, 0x1052] => text(tag, "DS", -1000),
        [0x28, 0x1053] => text(tag, "DS", 2),
        [0x28, 0x1054] => text(tag, "LO", "mgHA/ccm"),
        [0x28, 0x2110] => text(tag, "CS", "01"),
        [0x28, 0x3000] => items(
            tag,
            vec![vec![
                Element {
                    tag: [0x28, 0x3002],
                    vr: "US",
                    value: Value::Short(vec![3, 0, 16]),
                },
                text([0x28, 0x3004], "LO", "HU"),
                Element {
                    tag: [0x28, 0x3006],
                    vr: "OW",
                    value: Value::Short(vec![7, 8, 9]),
                },
            ]],
        ),
        [0x28, 0x3010] => items(tag, vec![vec![text([0x28, 0x3003], "LO", "window")]]),
        [0x28, 0x9110] => shared(group(tag, text([0x28, 0x30], "DS", "0.5\\0.5"))),
        [0x28, 0x9145] => shared(group(tag, text([0x28, 0x1053], "DS", 3))),
        [0x5200, 0x9229] => shared(group([0x28, 0x9145], text([0x28, 0x1053], "DS", 3))),
        [0x5200, 0x9230] => items(
            tag,
            vec![vec![group([0x28, 0x9145], text([0x28, 0x1053], "DS", 3))]],
        ),
        [0x40, 0x9096] => items(tag, vec![vec![text([0x40, 0x9210], "SH", "HA")]]),
        [0x3004, 0xC] => {
            base.truncate(1);
            dicom::set(&mut base[0], text([0x28, 8], "IS", 2));
            let twelve: Vec<u16> = (0..12).map(|v| v * 300).collect();
            dicom::set(&mut base[0], dicom::pixels(&twelve));
            text(tag, "DS", "0\\-0.03")
        }
        [0x6000, 0x3000] => Element {
            tag,
            vr: "OW",
            value: Value::Short(vec![0xFFFF]),
        },
        [0x7FE0, 8] => Element {
            tag,
            vr: "OF",
            value: Value::Bytes(vec![0; 24]),
        },
        [0x7FE0, 9] => Element {
            tag,
            vr: "OD",
            value: Value::Bytes(vec![0; 48]),
        },
        [0x7FE0, 0x10] => dicom::pixels(&[9, 8, 7, 6, 5, 4]),
        _ => text(tag, "DS", 3),
    };
    let changed = all(&base, &change);
    (base, changed, syntax)
}
