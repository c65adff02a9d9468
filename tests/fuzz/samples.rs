//! Sound files to damage: every format in every way of storing it that has code of its own.

use crate::formats::{dicom, sound_files, volume};
use crate::inputs::write::{self, Order, Packing, Page, Value};
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use std::io::{Cursor, Write};
use tiff::encoder::{Compression as TiffCompression, TiffEncoder, colortype};

/// A file, and what lies beside it undamaged.
#[derive(Clone)]
pub struct Sample {
    /// Relative to a folder of its own.
    pub name: &'static str,
    pub bytes: Vec<u8>,
    pub beside: Vec<(&'static str, Vec<u8>)>,
}

impl Sample {
    /// Settings and results, not voxels.
    pub fn is_table(&self) -> bool {
        self.name.ends_with(".csv") || self.name.ends_with(".tsv") || self.name.ends_with(".toml")
    }
}

fn alone(name: &'static str, bytes: Vec<u8>) -> Sample {
    Sample {
        name,
        bytes,
        beside: Vec::new(),
    }
}

pub fn samples() -> Vec<Sample> {
    let mut all: Vec<Sample> = sound_files()
        .into_iter()
        .map(|(name, bytes)| alone(name, bytes))
        .collect();
    all.extend(nifti_kin());
    all.extend(text_headers());
    all.extend(tiffs());
    all.extend(pictures());
    all.extend(scanco());
    all.push(alone("implicit.dcm", dicom(&le_bytes()[..40], true)));
    all.extend(super::headers::samples());
    all.extend(tables());
    all.extend(arrays());
    all
}

/// Halves with axes of one, and an archive of them.
fn arrays() -> [Sample; 2] {
    let mut text = "{'descr': '<f2', 'fortran_order': True, 'shape': (1, 3, 4, 5, 1), }".to_owned();
    text += &" ".repeat(117 - text.len());
    text.push('\n');
    let halves: Vec<u8> = (0..60u16)
        .flat_map(|v| (0x3C00 + 40 * v).to_le_bytes())
        .collect();
    let npy = [
        b"\x93NUMPY\x02\x00",
        &118u32.to_le_bytes()[..],
        text.as_bytes(),
        &halves,
    ]
    .concat();
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    archive
        .start_file("scan.npy", zip::write::SimpleFileOptions::default())
        .unwrap();
    archive.write_all(&npy).unwrap();
    let archive = archive.finish().unwrap().into_inner();
    [alone("half.npy", npy), alone("a.npz", archive)]
}

fn le_bytes() -> Vec<u8> {
    crate::formats::bytes_of(&volume())
}

fn be_bytes() -> Vec<u8> {
    let v = volume();
    v.as_slice().iter().flat_map(|v| v.to_be_bytes()).collect()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut out = ZlibEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::default());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

/// A big-endian file and a pair of header and image, after `nifti1.h`.
fn nifti_kin() -> [Sample; 2] {
    let header = |magic: &[u8; 4], data_at: f32| {
        let mut h = vec![0u8; 348];
        h[..4].copy_from_slice(&348i32.to_be_bytes());
        for (i, n) in [3i16, 5, 4, 3, 1, 1, 1, 1].into_iter().enumerate() {
            h[40 + 2 * i..42 + 2 * i].copy_from_slice(&n.to_be_bytes());
        }
        h[70..72].copy_from_slice(&4i16.to_be_bytes());
        h[72..74].copy_from_slice(&16i16.to_be_bytes());
        for i in 0..4 {
            h[76 + 4 * i..80 + 4 * i].copy_from_slice(&0.02f32.to_be_bytes());
        }
        h[108..112].copy_from_slice(&data_at.to_be_bytes());
        h[123] = 2;
        h[344..].copy_from_slice(magic);
        h
    };
    let whole = [header(b"n+1\0", 352.0), vec![0; 4], be_bytes()].concat();
    let pair = Sample {
        name: "pair.hdr",
        bytes: header(b"ni1\0", 0.0),
        beside: vec![("pair.img", be_bytes())],
    };
    [alone("big-endian.nii", whole), pair]
}

fn text_headers() -> Vec<Sample> {
    let meta =
        "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementSpacing = 0.02 0.02 0.02\n";
    let nrrd = "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 4 3\n\
                space directions: (0.02,0,0) (0,0.02,0) (0,0,0.02)\nendian: little\n";
    let data = le_bytes();
    let with = |head: String, data: Vec<u8>| [head.into_bytes(), data].concat();
    let numbers: Vec<String> = volume().as_slice().iter().map(i16::to_string).collect();
    let slices = data.chunks(40).map(<[u8]>::to_vec);
    vec![
        alone(
            "zlib.mha",
            with(
                format!("{meta}CompressedData = True\nElementDataFile = LOCAL\n"),
                zlib(&data),
            ),
        ),
        Sample {
            name: "raw.mhd",
            bytes: format!("{meta}HeaderSize = -1\nElementDataFile = raw.raw\n").into_bytes(),
            beside: vec![("raw.raw", data.clone())],
        },
        Sample {
            name: "list.mhd",
            bytes: format!("{meta}ElementDataFile = LIST\ns0\ns1\ns2\n").into_bytes(),
            beside: ["s0", "s1", "s2"].into_iter().zip(slices).collect(),
        },
        alone(
            "gzip.nrrd",
            with(format!("{nrrd}encoding: gzip\n\n"), gzip(&data)),
        ),
        alone(
            "text.nrrd",
            with(
                format!("{nrrd}encoding: ascii\n\n"),
                numbers.join(" ").into_bytes(),
            ),
        ),
        Sample {
            name: "apart.nhdr",
            bytes: format!("{nrrd}encoding: raw\nbyte skip: -1\ndata file: raw.raw\n").into_bytes(),
            beside: vec![("raw.raw", data)],
        },
    ]
}

fn tiffs() -> Vec<Sample> {
    fn pages<K: tiff::encoder::TiffKind>(mut encoder: TiffEncoder<&mut Cursor<Vec<u8>>, K>) {
        for page in volume().as_slice().chunks(20) {
            encoder
                .write_image::<colortype::GrayI16>(5, 4, page)
                .unwrap();
        }
    }
    let small = |compression| {
        let mut out = Cursor::new(Vec::new());
        pages(
            TiffEncoder::new(&mut out)
                .unwrap()
                .with_compression(compression),
        );
        out.into_inner()
    };
    let mut big = Cursor::new(Vec::new());
    pages(TiffEncoder::new_big(&mut big).unwrap());
    vec![
        alone("lzw.tif", small(TiffCompression::Lzw)),
        alone("packbits.tif", small(TiffCompression::Packbits)),
        alone("big.tif", big.into_inner()),
        alone("imagej.tif", imagej()),
        alone("bits.tif", crate::stored::bits(1)),
        alone("ome.tif", ome()),
        alone("zstd.tif", stored(Packing::Zstandard, 16)),
        alone("12-bit.tif", stored(Packing::Deflate, 12)),
        alone("tiles.tif", tiles()),
        alone("palette.tif", palette()),
        Sample {
            name: "tiffs/s2.tif",
            bytes: small_page(),
            beside: vec![("tiffs/s10.tif", small_page())],
        },
    ]
}

/// Three pages of values that begin at 0.
fn pages(packing: Packing, bits: usize) -> Vec<Page> {
    let values = volume();
    let values = values.as_slice().chunks(20);
    values
        .map(|page| Page {
            packing,
            bits,
            reversed_bits: bits == 12,
            rows_per_strip: 2,
            ..Page::grey(5, 4, page.iter().map(|v| (v + 900) as u64).collect())
        })
        .collect()
}

fn stored(packing: Packing, bits: usize) -> Vec<u8> {
    write::tiff(&pages(packing, bits), Order::default())
}

/// Big-endian BigTIFF of tiles with differences, each slice named by OME-XML.
fn tiles() -> Vec<u8> {
    let text = "<OME><Image><Pixels SizeX=\"5\" SizeY=\"4\" SizeZ=\"3\" SizeC=\"1\" SizeT=\"1\" PhysicalSizeX=\"20\" PhysicalSizeY=\"20\"><TiffData IFD=\"0\" FirstZ=\"2\"/><TiffData IFD=\"1\" FirstZ=\"1\"/><TiffData IFD=\"2\"/></Pixels></Image></OME>";
    let mut pages = pages(Packing::Lzw, 16);
    for page in &mut pages {
        (page.tile, page.predictor) = (Some([16, 16]), 2);
    }
    pages[0] = pages[0].clone().with(270, Value::Ascii(text.into()));
    let order = Order {
        big_endian: true,
        big_tiff: true,
    };
    write::tiff(&pages, order)
}

/// Labels of 8 bits with a table of colours from ImageJ.
fn palette() -> Vec<u8> {
    let table = (0..768u16).map(|i| i % 7 * 9000).collect();
    let page = Page {
        bits: 8,
        photometric: 3,
        packing: Packing::PackBits,
        ..Page::grey(5, 4, (0..20).collect())
    };
    let text = Value::Ascii(b"ImageJ=1.54f\nunit=um\nspacing=20\n".to_vec());
    write::tiff(
        &[page.with(320, Value::Short(table)).with(270, text)],
        Order::default(),
    )
}

fn ome() -> Vec<u8> {
    let text = r#"<OME><Pixels PhysicalSizeX="20" PhysicalSizeY="20" PhysicalSizeZ="0.02" PhysicalSizeZUnit="mm"/></OME>"#;
    crate::stored::noted::<colortype::GrayI16>(text, &volume().as_slice()[..20])
}

fn small_page() -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    TiffEncoder::new(&mut out)
        .unwrap()
        .write_image::<colortype::GrayI16>(5, 4, &volume().as_slice()[..20])
        .unwrap();
    out.into_inner()
}

/// One directory, three planes behind it: how ImageJ writes large stacks.
fn imagej() -> Vec<u8> {
    let text = b"ImageJ=1.53t\nimages=3\nslices=3\nunit=mm\nspacing=0.02\ncf=0\nc0=-900.0\nc1=1.0\nvunit=HU\n\0";
    let entries = 11u16;
    let text_at = 8 + 2 + 12 * u32::from(entries) + 4;
    let rational_at = text_at + text.len() as u32;
    let data_at = rational_at + 8;
    let mut out = b"II*\0\x08\0\0\0".to_vec();
    out.extend(entries.to_le_bytes());
    let mut entry = |tag: u16, kind: u16, count: u32, value: u32| {
        out.extend(tag.to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend(count.to_le_bytes());
        out.extend(value.to_le_bytes());
    };
    for (tag, value) in [(256, 5), (257, 4), (258, 16), (259, 1), (262, 1)] {
        entry(tag, 3, 1, value);
    }
    entry(270, 2, text.len() as u32, text_at);
    entry(273, 4, 1, data_at);
    entry(277, 3, 1, 1);
    entry(279, 4, 1, 40);
    entry(282, 5, 1, rational_at);
    entry(283, 5, 1, rational_at);
    out.extend(0u32.to_le_bytes());
    out.extend(text);
    out.extend(50u32.to_le_bytes());
    out.extend(1u32.to_le_bytes());
    let v = volume();
    out.extend(v.as_slice().iter().flat_map(|v| (v + 900).to_le_bytes()));
    out
}

fn pictures() -> Vec<Sample> {
    let encoded = |format| {
        let grey: Vec<u8> = (0..20u8).map(|v| v * 12).collect();
        let mut out = Cursor::new(Vec::new());
        image::GrayImage::from_raw(5, 4, grey)
            .unwrap()
            .write_to(&mut out, format)
            .unwrap();
        out.into_inner()
    };
    let (png, bmp) = (
        encoded(image::ImageFormat::Png),
        encoded(image::ImageFormat::Bmp),
    );
    vec![
        Sample {
            name: "pngs/s1.png",
            beside: vec![("pngs/s2.png", png.clone())],
            bytes: png,
        },
        Sample {
            name: "bmps/s1.bmp",
            beside: vec![
                ("bmps/s2.bmp", bmp.clone()),
                (
                    "bmps/s.log",
                    b"Pixel Size (um)=17.4\nSection to Section Step=2\n".to_vec(),
                ),
            ],
            bytes: bmp,
        },
    ]
}

/// AIM's packed kinds with a frame, and an ISQ with its calibration.
fn scanco() -> Vec<Sample> {
    let aim = |kind: i32, frame: i64, data: Vec<u8>| {
        let mut out = b"AIMDATA_V030   \0".to_vec();
        for size in [40i64, 224, 0, data.len() as i64, 0] {
            out.extend(size.to_le_bytes());
        }
        let mut image = vec![0u8; 224];
        image[12..16].copy_from_slice(&kind.to_le_bytes());
        for (a, n) in [5i64, 4, 3].into_iter().enumerate() {
            image[40 + 8 * a..48 + 8 * a].copy_from_slice(&n.to_le_bytes());
            image[64 + 8 * a..72 + 8 * a].copy_from_slice(&frame.to_le_bytes());
            image[184 + 8 * a..192 + 8 * a].copy_from_slice(&20_000i64.to_le_bytes());
        }
        [out, image, data].concat()
    };
    let bits = [vec![0b0101_1010u8; 3 * 2 * 2], vec![127]].concat();
    // The frame leaves 3 × 2 × 1 voxels.
    let runs = [vec![0u8; 8], vec![0, 2, 127, 4]].concat();
    let mut isq = crate::formats::isq(&[]);
    isq[508..512].copy_from_slice(&3i32.to_le_bytes());
    let mut extended = vec![0u8; 512 * 3];
    extended[16..27].copy_from_slice(b"Calibration");
    extended[8 + 1176..8 + 1184].copy_from_slice(&[0x9A, 0x46, 0, 0, 0, 0, 0, 0]);
    vec![
        alone("bits.aim", aim((6 << 16) + 1, 0, bits)),
        alone("runs.aim", aim((8 << 16) + 2, 1, runs)),
        alone(
            "v1.aim",
            crate::stored::aim_v1(92, (2 << 16) + 2, 1, &le_bytes()),
        ),
        alone("extended.isq", [isq, extended, le_bytes()].concat()),
    ]
}

fn tables() -> Vec<Sample> {
    let manifest = "path,name,group,subject,spacing_mm,lower,upper,otsu,gaussian_voxels\n\
                    a.nii,left,OA,p1,0.02,200,NA,,0.5\nb.nii,right,,p2,,,,true,\n";
    let row = bonepd_ct::result::row::Row {
        key: bonepd_ct::result::settings::Settings {
            scan: "s".into(),
            ..Default::default()
        },
        solved: Some(bonepd_ct::result::row::Solution {
            e_app_mpa: Some(12.5),
            sites: Some(7),
            ..Default::default()
        }),
        ..Default::default()
    };
    let results = bonepd_ct::io::table::to_csv(&[row]);
    let recipe = include_str!("../../pipelines/paper.toml");
    vec![
        alone("manifest.csv", manifest.into()),
        alone(
            "manifest.tsv",
            "path\tspacing_mm\tlower\na.nii\t0,02 x 0,02 x 0,04\t12,5\n".into(),
        ),
        alone("results.csv", results.into_bytes()),
        alone("recipe.toml", recipe.into()),
    ]
}
