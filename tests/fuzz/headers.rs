//! Sound files of the kinds that DICOM, NIfTI, NRRD and MetaImage have beside their plain ones.

use super::samples::Sample;
use crate::formats::{bytes_of, volume};
use crate::written::dicom::{self, EXPLICIT, Element, Syntax, Value, items, text};
use crate::written::nifti::{self, code};
use crate::written::text::Header;
use crate::written::{bzip2, jpeg};

pub fn samples() -> Vec<Sample> {
    [dicoms(), niftis(), texts()].concat()
}

fn of(name: &'static str, bytes: Vec<u8>) -> Sample {
    Sample {
        name,
        bytes,
        beside: Vec::new(),
    }
}

fn words() -> Vec<u16> {
    volume().as_slice()[..20]
        .iter()
        .map(|v| *v as u16)
        .collect()
}

fn slice(position: [f64; 3], pixels: Element) -> Vec<Element> {
    let mut elements = dicom::slice([5, 4], position, 1);
    elements.push(text([0x18, 0x50], "DS", 0.02));
    elements.push(pixels);
    elements
}

fn fragments(part: Vec<u8>) -> Element {
    Element {
        tag: [0x7FE0, 0x10],
        vr: "OB",
        value: Value::Fragments(vec![Vec::new(), part]),
    }
}

fn dicoms() -> Vec<Sample> {
    let plain = slice([0.0; 3], dicom::pixels(&words()));
    let mut request = plain.clone();
    let inner = vec![
        vec![text([0x40, 7], "LO", "request")],
        vec![text([8, 0x60], "CS", "CT")],
    ];
    request.push(items([0x40, 0x275], inner));
    let rle = Syntax {
        rle: true,
        ..EXPLICIT
    };
    let lossless = rle.file(&slice(
        [0.0; 3],
        fragments(jpeg::lossless(&words(), [5, 4], 16)),
    ));
    let at = lossless
        .windows(19)
        .position(|w| w == b"1.2.840.10008.1.2.5")
        .unwrap();
    // The name of JPEG lossless is two characters longer, in the place of the zero that evens the other.
    let named = [&[22u8, 0][..], b"1.2.840.10008.1.2.4.70"].concat();
    let lossless = [&lossless[..at - 2], &named, &lossless[at + 20..]].concat();
    vec![
        of(
            "rle.dcm",
            rle.file(&slice([0.0; 3], fragments(dicom::rle(&words())))),
        ),
        of("jpeg.dcm", lossless),
        of(
            "deflated.dcm",
            Syntax {
                deflated: true,
                ..EXPLICIT
            }
            .file(&plain),
        ),
        of(
            "big-endian.dcm",
            Syntax {
                big_endian: true,
                ..EXPLICIT
            }
            .file(&plain),
        ),
        of(
            "unknown.dcm",
            Syntax {
                unknown: true,
                ..EXPLICIT
            }
            .file(&request),
        ),
        of(
            "open.dcm",
            Syntax {
                unknown: true,
                open: true,
                ..EXPLICIT
            }
            .file(&request),
        ),
        of(
            "bare.dcm",
            Syntax {
                preamble: false,
                meta: false,
                ..EXPLICIT
            }
            .file(&plain),
        ),
        of("enhanced.dcm", enhanced()),
        Sample {
            name: "series/0.dcm",
            bytes: EXPLICIT.file(&plain),
            beside: vec![
                (
                    "series/1.dcm",
                    EXPLICIT.file(&slice([0.0, 0.0, 0.02], dicom::pixels(&words()))),
                ),
                (
                    "series/DICOMDIR",
                    EXPLICIT.file(&[text([8, 0x60], "CS", "SR")]),
                ),
            ],
        },
    ]
}

fn enhanced() -> Vec<u8> {
    let mut e = slice([0.0; 3], dicom::pixels(&[words(), words()].concat()));
    e.push(text([0x28, 8], "IS", 2));
    let group = |tag, inner| items(tag, vec![vec![inner]]);
    let place = |z: f64| {
        let position = dicom::decimals([0.0, 0.0, z]);
        vec![group([0x20, 0x9113], text([0x20, 0x32], "DS", position))]
    };
    e.push(items([0x5200, 0x9230], vec![place(0.02), place(0.0)]));
    let shared = vec![group([0x28, 0x9145], text([0x28, 0x1053], "DS", 2))];
    e.push(items([0x5200, 0x9229], vec![shared]));
    EXPLICIT.file(&e)
}

fn niftis() -> Vec<Sample> {
    let header = |version: u8| {
        let mut h = nifti::Header::new(version, false);
        h.set("dim", &[3.0, 5.0, 4.0, 3.0, 1.0, 1.0, 1.0, 1.0]);
        h.set("pixdim", &[1.0, 0.02, 0.02, 0.02]);
        h.set("datatype", &code("int16")[..1]);
        h
    };
    let mut two = header(2);
    two.set("vox_offset", &[544.0]);
    two.set("xyzt_units", &[2.0]);
    vec![
        of(
            "two.nii",
            [two.bytes, vec![0; 4], bytes_of(&volume())].concat(),
        ),
        Sample {
            name: "analyze.hdr",
            bytes: header(0).bytes,
            beside: vec![("analyze.img", bytes_of(&volume()))],
        },
    ]
}

fn texts() -> Vec<Sample> {
    let data = bytes_of(&volume());
    let numbers: Vec<String> = volume().as_slice().iter().map(i16::to_string).collect();
    let slices: Vec<Vec<u8>> = data.chunks(40).map(<[u8]>::to_vec).collect();
    let beside = || {
        ["v0.raw", "v1.raw", "v2.raw"]
            .into_iter()
            .zip(slices.clone())
            .collect()
    };
    let nrrd = |encoding: &str| {
        Header::new(&[
            ("type", "short"),
            ("dimension", "4"),
            ("sizes", "5 4 3 1"),
            ("spacings", "20 20 20 1"),
            ("units", "\"um\" \"um\" \"um\" \"\""),
            ("endian", "little"),
            ("encoding", encoding),
        ])
    };
    let meta = Header::new(&[
        ("NDims", "3"),
        ("DimSize", "5 4 3"),
        ("ElementSpacing", "0.02 0.02 0.02"),
        ("ElementType", "MET_SHORT"),
        ("ElementDataFile", "LOCAL"),
    ]);
    let mut list = nrrd("raw");
    let names = "LIST\nv0.raw\nv1.raw\nv2.raw";
    list.0.push(("data file".into(), names.into()));
    let hex: String = data.iter().map(|b| format!("{b:02x}")).collect();
    let with = |h: &Header, more: &[u8]| [h.nrrd(), more.to_vec()].concat();
    vec![
        of("bzip2.nrrd", with(&nrrd("bzip2"), &bzip2(&data))),
        of("hex.nrrd", with(&nrrd("hex"), hex.as_bytes())),
        Sample {
            name: "list.nhdr",
            bytes: list.nrrd(),
            beside: beside(),
        },
        Sample {
            name: "pattern.nhdr",
            bytes: nrrd("raw").set("data file", "v%d.raw 0 2 1").nrrd(),
            beside: beside(),
        },
        Sample {
            name: "pattern.mhd",
            bytes: meta
                .clone()
                .set("ElementDataFile", "v%d.raw 0 2 1")
                .metaimage(),
            beside: beside(),
        },
        of(
            "text.mha",
            [
                meta.clone().set("BinaryData", "False").metaimage(),
                numbers.join(" ").into_bytes(),
            ]
            .concat(),
        ),
    ]
}
