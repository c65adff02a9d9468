//! Every way of storing a voxel that the table of formats in docs/formats.md names, value by value.

use crate::formats::{bytes_of, volume};
use bonepd_ct::image::scan;
use std::io::Cursor;
use std::path::Path;
use tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32, Gray32Float, Gray64, Gray64Float, GrayI8, GrayI16, GrayI32,
    GrayI64,
};
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffKind, TiffValue};

/// Reads `bytes` as a scan of this name.
fn values(name: &str, bytes: &[u8]) -> Vec<f32> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read(&path)
}

fn read(path: &Path) -> Vec<f32> {
    let scan = scan::read(path, Some([0.02; 3])).unwrap_or_else(|e| panic!("{e}"));
    scan.volume.as_slice().to_vec()
}

fn expected() -> Vec<f32> {
    volume().as_slice().iter().map(|&v| f32::from(v)).collect()
}

/// A stack of three pages of the test volume, each value by `cast`.
fn stack<C: ColorType, K: TiffKind>(
    mut encoder: TiffEncoder<&mut Cursor<Vec<u8>>, K>,
    cast: impl Fn(i16) -> C::Inner,
) where
    [C::Inner]: TiffValue,
{
    for page in volume().as_slice().chunks(20) {
        let page: Vec<C::Inner> = page.iter().map(|&v| cast(v)).collect();
        encoder.write_image::<C>(5, 4, &page).unwrap();
    }
}

fn plain<C: ColorType>(cast: impl Fn(i16) -> C::Inner) -> Vec<f32>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    stack::<C, _>(TiffEncoder::new(&mut out).unwrap(), cast);
    values("a.tif", &out.into_inner())
}

#[test]
fn tiff_of_every_number() {
    let shifted = |by: f32, factor: f32| -> Vec<f32> {
        expected().iter().map(|v| (v + by) * factor).collect()
    };
    let small = |v: i16| v / 50 + 18;
    assert_eq!(plain::<Gray8>(|v| small(v) as u8), shifted(900.0, 0.02));
    let signed: Vec<f32> = (0..60).map(|v| v as f32 - 30.0).collect();
    assert_eq!(plain::<GrayI8>(|v| (small(v) - 30) as i8), signed);
    assert_eq!(plain::<Gray16>(|v| (v + 900) as u16), shifted(900.0, 1.0));
    assert_eq!(plain::<GrayI16>(|v| v), expected());
    assert_eq!(
        plain::<Gray32>(|v| (i32::from(v) + 900) as u32 * 4096),
        shifted(900.0, 4096.0)
    );
    assert_eq!(
        plain::<GrayI32>(|v| i32::from(v) * 4096),
        shifted(0.0, 4096.0)
    );
    assert_eq!(
        plain::<Gray64>(|v| (i64::from(v) + 900) as u64 * (1 << 40)),
        shifted(900.0, 2f32.powi(40))
    );
    assert_eq!(
        plain::<GrayI64>(|v| i64::from(v) * (1 << 40)),
        shifted(0.0, 2f32.powi(40))
    );
    assert_eq!(
        plain::<Gray32Float>(|v| f32::from(v) / 8.0),
        shifted(0.0, 0.125)
    );
    assert_eq!(
        plain::<Gray64Float>(|v| f64::from(v) / 8.0),
        shifted(0.0, 0.125)
    );
}

#[test]
fn tiff_of_every_packing() {
    for (name, compression) in [
        ("lzw", Compression::Lzw),
        ("packbits", Compression::Packbits),
        ("deflate", Compression::Deflate(DeflateLevel::Best)),
    ] {
        let mut out = Cursor::new(Vec::new());
        let encoder = TiffEncoder::new(&mut out).unwrap();
        stack::<GrayI16, _>(encoder.with_compression(compression), |v| v);
        assert_eq!(values("a.tif", &out.into_inner()), expected(), "{name}");
    }
    let mut out = Cursor::new(Vec::new());
    stack::<GrayI16, _>(TiffEncoder::new_big(&mut out).unwrap(), |v| v);
    let big = out.into_inner();
    assert_eq!(big[2], 43, "no BigTIFF");
    assert_eq!(values("big.tif", &big), expected());
}

/// A page of one bit a pixel, 11 wide: rows start on bytes of their own. Shown with white for 0 where `photometric` says so.
pub fn bits(photometric: u16) -> Vec<u8> {
    let rows = [[0b1010_0000, 0b0110_0000], [0b0000_0001, 0b1000_0000]];
    let entries: [(u16, u32); 9] = [
        (256, 11),
        (257, 2),
        (258, 1),
        (259, 1),
        (262, photometric.into()),
        (273, 8 + 2 + 9 * 12 + 4),
        (277, 1),
        (278, 2),
        (279, 4),
    ];
    let mut out = b"II*\0\x08\0\0\0\x09\0".to_vec();
    for (tag, value) in entries {
        out.extend([&tag.to_le_bytes()[..], &[4, 0, 1, 0, 0, 0]].concat());
        out.extend(value.to_le_bytes());
    }
    out.extend([0; 4]);
    out.extend(rows.as_flattened());
    out
}

#[test]
fn tiff_of_single_bits() {
    let set = [0, 2, 9, 10, 11 + 7, 11 + 8];
    let black_is_0: Vec<f32> = (0..22)
        .map(|i| f32::from(u8::from(set.contains(&i))))
        .collect();
    assert_eq!(values("bits.tif", &bits(1)), black_is_0);
    // How they are shown is not what they are.
    assert_eq!(values("bits.tif", &bits(0)), black_is_0);
}

#[test]
fn png_of_16_bits() {
    let dir = tempfile::tempdir().unwrap();
    for (k, page) in volume().as_slice().chunks(20).enumerate() {
        let page: Vec<u16> = page.iter().map(|v| (v + 900) as u16 * 20 + 1).collect();
        let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(5, 4, page).unwrap();
        image.save(dir.path().join(format!("s{k}.png"))).unwrap();
    }
    let wide: Vec<f32> = expected()
        .iter()
        .map(|v| (v + 900.0) * 20.0 + 1.0)
        .collect();
    assert_eq!(read(dir.path()), wide);
}

/// A number as a VAX stores it: IEEE's with an exponent two higher, 16-bit words swapped.
fn vax(value: f32) -> [u8; 4] {
    let [a, b, c, d] = if value == 0.0 {
        [0; 4]
    } else {
        (value * 4.0).to_le_bytes()
    };
    [c, d, a, b]
}

/// An AIM of version 1.0 or 1.1 (its header is four bytes longer): type at 16, sizes at 20, frame at 32, edge at 68.
pub fn aim_v1(header: usize, kind: i32, frame: i32, data: &[u8]) -> Vec<u8> {
    let mut image = vec![0u8; header];
    let mut put = |at: usize, value: i32| image[at..at + 4].copy_from_slice(&value.to_le_bytes());
    put(16, kind);
    for (a, n) in [5, 4, 3].into_iter().enumerate() {
        put(20 + 4 * a, n);
        put(32 + 4 * a, frame);
    }
    image[68..72].copy_from_slice(&vax(0.02));
    let sizes = [16, header as i32, 0, data.len() as i32].map(i32::to_le_bytes);
    [sizes.as_flattened(), &image, data].concat()
}

#[test]
fn aim_of_version_1_and_of_floats() {
    let floats: Vec<[u8; 4]> = expected().iter().map(|v| vax(v / 16.0)).collect();
    let sixteenths: Vec<f32> = expected().iter().map(|v| v / 16.0).collect();
    for header in [92, 96] {
        let float = aim_v1(header, (4 << 16) + 4, 0, floats.as_flattened());
        assert_eq!(values("f.aim", &float), sixteenths, "{header}");
        let short = aim_v1(header, (2 << 16) + 2, 0, &bytes_of(&volume()));
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("s.aim");
        std::fs::write(&path, &short).unwrap();
        let stored = scan::stored(&path).unwrap();
        assert_eq!(stored.values, expected());
        assert_eq!(stored.spacing_mm, Some([0.02; 3]));
    }
    // A frame of one voxel is cut off.
    let framed = aim_v1(92, (2 << 16) + 2, 1, &bytes_of(&volume()));
    let inner = expected();
    let inner: Vec<f32> = (0..6)
        .map(|i| inner[20 + 5 * (1 + i / 3) + 1 + i % 3])
        .collect();
    assert_eq!(values("frame.aim", &framed), inner);
}

/// Names that mix cases and paddings: the number decides.
#[test]
fn slices_of_mixed_names_are_read_in_their_order() {
    let dir = tempfile::tempdir().unwrap();
    let names = ["scan_9.tif", "SCAN_10.TIF", "Scan_011.tiff"];
    for (name, page) in names.iter().zip(volume().as_slice().chunks(20)) {
        let file = std::fs::File::create(dir.path().join(name)).unwrap();
        TiffEncoder::new(file)
            .unwrap()
            .write_image::<GrayI16>(5, 4, page)
            .unwrap();
    }
    assert_eq!(read(dir.path()), expected());
    // One series and no gap: or it is no scan.
    for (from, to, said) in [
        ("scan_9.tif", "scan_3.tif", "between the numbers 3 and 10"),
        ("scan_3.tif", "other_9.tif", "slices of 2 series"),
        ("other_9.tif", "scan_10.tiff", "the same number"),
    ] {
        std::fs::rename(dir.path().join(from), dir.path().join(to)).unwrap();
        let words = scan::read(dir.path(), None).unwrap_err().to_string();
        assert!(words.contains(said), "{to}: {words}");
    }
}

/// One page with a description.
pub fn noted<C: ColorType>(text: &str, values: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out).unwrap();
    let mut image = encoder.new_image::<C>(5, 4).unwrap();
    image
        .encoder()
        .write_tag(tiff::tags::Tag::ImageDescription, text)
        .unwrap();
    image.write_data(values).unwrap();
    out.into_inner()
}

/// ImageJ keeps negative values as unsigned ones with a line in its notes; slices have notes of their own.
#[test]
fn imagejs_line_is_applied() {
    let dir = tempfile::tempdir().unwrap();
    let hu = "ImageJ=1.54f\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=HU\n";
    for (k, page) in volume().as_slice().chunks(20).enumerate() {
        let shifted: Vec<u16> = page
            .iter()
            .map(|&v| (i32::from(v) + 32768) as u16)
            .collect();
        let bytes = noted::<Gray16>(hu, &shifted);
        assert_eq!(values("one.tif", &bytes), expected()[20 * k..20 * (k + 1)]);
        std::fs::write(dir.path().join(format!("s{k}.tif")), bytes).unwrap();
    }
    let scan = scan::read(dir.path(), Some([0.02; 3])).unwrap();
    assert_eq!(scan.volume.as_slice(), expected());
    assert_eq!(scan.unit.as_deref(), Some("HU"));
    assert!(
        scan.notes[0].contains("-32768 + 1 · stored value"),
        "{:?}",
        scan.notes
    );
    // A curve is not applied, and that is said.
    let path = dir.path().join("curve.tif");
    let bytes = noted::<Gray8>("ImageJ=1.54f\ncf=3\nc0=1.0\nc1=2.0\nvunit=HU\n", &[7; 20]);
    std::fs::write(&path, bytes).unwrap();
    let scan = scan::read(&path, Some([0.02; 3])).unwrap();
    assert_eq!((scan.volume.as_slice()[0], scan.unit), (7.0, None));
    assert!(scan.notes[0].contains("not applied"), "{:?}", scan.notes);
}
