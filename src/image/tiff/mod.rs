//! Owns TIFF: single slices, multi-page stacks, BigTIFF, ImageJ's stacks and their voxel sizes.

pub mod directories;

use crate::error::{Error, Result};
use crate::image::imagej::{Grey, imagej, unit_mm};
use crate::image::raw;
use crate::image::raw::{Layout, Scalar};
use crate::image::stored;
use crate::image::stored::{Slice, Stored};
use crate::volume::Volume;
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::{Compression, DeflateLevel, Rational, TiffEncoder, colortype};
use tiff::tags::Tag;

const DAMAGED: &str =
    "the file is truncated, damaged or of a rare kind: export it again as plain grey-value TIFF";
/// Larger pages than this are refused (an 8-bit page of 46 000 × 46 000 pixels).
const PAGE_BYTES: u64 = 2 << 30;

struct Pages {
    decoder: Decoder<BufReader<File>>,
    file_bytes: u64,
}

fn open(path: &Path) -> Result<Pages> {
    let unreadable = |e: std::io::Error| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
    };
    let file = File::open(path).map_err(unreadable)?;
    let file_bytes = file.metadata().map_err(unreadable)?.len();
    if let Some(fault) = directories::fault(&file) {
        return Err(Error::file(
            path,
            format!("is no sound TIFF file: {fault}"),
            DAMAGED,
        ));
    }
    let mut file = file;
    file.rewind().map_err(unreadable)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = PAGE_BYTES as usize;
    limits.intermediate_buffer_size = PAGE_BYTES as usize;
    let decoder = Decoder::new(BufReader::new(file))
        .map_err(|e| damaged(path, &e))?
        .with_limits(limits);
    Ok(Pages {
        decoder,
        file_bytes,
    })
}

fn damaged(path: &Path, e: &tiff::TiffError) -> Error {
    Error::file(path, format!("cannot be decoded as TIFF ({e})"), DAMAGED)
}

/// Reads a file of one page.
pub fn read_slice(path: &Path) -> Result<Slice> {
    let mut pages = open(path)?;
    let mut slice = page(&mut pages, path)?;
    slice.grey = imagej(&description(&mut pages.decoder)).grey;
    slice.grey.apply(&mut slice.values, slice.stored_as);
    if pages.decoder.more_images() {
        return Err(Error::file(
            path,
            "holds several pages in a folder of slices",
            "a multi-page TIFF is a scan of its own: give the file, or keep only single slices in the folder",
        ));
    }
    Ok(slice)
}

/// Reads a stack in one file.
pub fn read(path: &Path) -> Result<Stored> {
    let mut pages = open(path)?;
    let mut facts = imagej(&description(&mut pages.decoder));
    let first = page(&mut pages, path)?;
    let (nx, ny) = (first.width, first.height);
    let mut notes = Vec::new();
    let spacing_mm = stored::spacing(&first, &mut notes);
    let stored_as = first.stored_as;
    let mut values = first.values;
    let mut nz = 1;
    if !pages.decoder.more_images() && facts.images > 1 {
        nz = facts.images;
        values = contiguous(&mut pages, path, [nx, ny, nz])?;
    }
    while pages.decoder.more_images() {
        pages.decoder.next_image().map_err(|e| damaged(path, &e))?;
        let next = page(&mut pages, path)?;
        nz += 1;
        if (next.width, next.height) != (nx, ny) {
            return Err(Error::file(
                path,
                format!(
                    "page {nz} has {} × {} pixels, the first has {nx} × {ny}",
                    next.width, next.height
                ),
                "one scan has pages of one size: export the stack again without thumbnails or other resolutions",
            ));
        }
        values.extend_from_slice(&next.values);
    }
    if facts.channels > 1 || facts.frames > 1 {
        return Err(Error::file(
            path,
            format!(
                "is an ImageJ hyperstack of {} channels and {} frames",
                facts.channels, facts.frames
            ),
            "save the one channel and frame that holds the scan",
        ));
    }
    facts.grey.apply(&mut values, stored_as);
    notes.extend(facts.grey.notes());
    Ok(Stored {
        format: format!("TIFF stack, {stored_as}"),
        n: [nx, ny, nz],
        values,
        spacing_mm,
        unit: facts.grey.unit(),
        notes,
        ..Stored::default()
    })
}

/// Decodes the current page.
fn page(pages: &mut Pages, path: &Path) -> Result<Slice> {
    let d = &mut pages.decoder;
    let (width, height) = d.dimensions().map_err(|e| damaged(path, &e))?;
    let bits = match d.colortype().map_err(|e| damaged(path, &e))? {
        ColorType::Gray(bits) => bits,
        other => {
            return Err(Error::file(
                path,
                format!("is a colour image ({other:?}), grey values are expected"),
                "convert it to 8- or 16-bit grey values (in Fiji: Image > Type)",
            ));
        }
    };
    let pixels = u64::from(width) * u64::from(height);
    let bytes = (pixels * u64::from(bits)).div_ceil(8);
    // No compression here shrinks more than about 2000 : 1.
    if pixels == 0 || bytes > pages.file_bytes.saturating_mul(2000) + 4096 || bytes > PAGE_BYTES {
        return Err(Error::file(
            path,
            format!(
                "the header promises {width} × {height} pixels, the file holds {} bytes",
                pages.file_bytes
            ),
            DAMAGED,
        ));
    }
    let (pixel_mm, slice_mm) = resolution(d);
    let decoded = d.read_image().map_err(|e| damaged(path, &e))?;
    let (width, height) = (width as usize, height as usize);
    let (values, stored_as) = grey(decoded, bits, width, height);
    if values.len() != width * height {
        return Err(Error::file(
            path,
            format!(
                "{} pixels decoded where {width} × {height} were expected",
                values.len()
            ),
            DAMAGED,
        ));
    }
    Ok(Slice {
        width,
        height,
        values,
        stored_as,
        pixel_mm,
        slice_mm,
        grey: Grey::default(),
    })
}

fn grey(
    decoded: DecodingResult,
    bits: u8,
    width: usize,
    height: usize,
) -> (Vec<f32>, &'static str) {
    fn cast<T: Copy>(v: &[T], f: impl Fn(T) -> f32) -> Vec<f32> {
        v.iter().map(|&x| f(x)).collect()
    }
    match decoded {
        DecodingResult::U8(v) if bits < 8 => (unpacked(&v, bits, width, height), "packed bits"),
        DecodingResult::U8(v) => (cast(&v, f32::from), "uint8"),
        DecodingResult::I8(v) => (cast(&v, f32::from), "int8"),
        DecodingResult::U16(v) => (cast(&v, f32::from), "uint16"),
        DecodingResult::I16(v) => (cast(&v, f32::from), "int16"),
        DecodingResult::U32(v) => (cast(&v, |x| x as f32), "uint32"),
        DecodingResult::I32(v) => (cast(&v, |x| x as f32), "int32"),
        DecodingResult::U64(v) => (cast(&v, |x| x as f32), "uint64"),
        DecodingResult::I64(v) => (cast(&v, |x| x as f32), "int64"),
        DecodingResult::F16(v) => (cast(&v, |x| x.to_f32()), "float16"),
        DecodingResult::F32(v) => (v, "float32"),
        DecodingResult::F64(v) => (cast(&v, |x| x as f32), "float64"),
    }
}

/// Pages of 1, 2 or 4 bits come packed, each row from a byte of its own, first pixel in the high bits.
fn unpacked(bytes: &[u8], bits: u8, width: usize, height: usize) -> Vec<f32> {
    let row_bytes = (width * bits as usize).div_ceil(8);
    let mask = (1u16 << bits) as u8 - 1;
    bytes
        .chunks_exact(row_bytes)
        .take(height)
        .flat_map(|row| {
            (0..width).map(move |x| {
                let at = x * bits as usize;
                f32::from(row[at / 8] >> (8 - bits as usize - at % 8) & mask)
            })
        })
        .collect()
}

/// ImageJ writes stacks over 4 GiB (and, on request, any) as one page followed by the planes of all the others.
fn contiguous(pages: &mut Pages, path: &Path, n: [usize; 3]) -> Result<Vec<f32>> {
    let d = &mut pages.decoder;
    let tag = |d: &mut Decoder<BufReader<File>>, t: Tag| {
        d.get_tag_u64_vec(t).map_err(|e| damaged(path, &e))
    };
    let plain = d.get_tag_u32(Tag::Compression).unwrap_or(1) == 1;
    let offset = tag(d, Tag::StripOffsets)?.first().copied().unwrap_or(0);
    let bits = tag(d, Tag::BitsPerSample)?.first().copied().unwrap_or(0);
    let format = d.get_tag_u32(Tag::SampleFormat).unwrap_or(1);
    let scalar = match (bits, format) {
        (8, 1) => Scalar::U8,
        (16, 1) => Scalar::U16,
        (16, 2) => Scalar::I16,
        (32, 1) => Scalar::U32,
        (32, 3) => Scalar::F32,
        _ => return Err(rare_stack(path, n[2])),
    };
    if !plain {
        return Err(rare_stack(path, n[2]));
    }
    let big_endian = d.byte_order() == tiff::tags::ByteOrder::BigEndian;
    let layout = Layout {
        scalar,
        big_endian,
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let left = pages.file_bytes.saturating_sub(offset);
    let source = d.inner();
    source
        .seek(SeekFrom::Start(offset))
        .map_err(|e| Error::file(path, format!("cannot be read: {e}"), DAMAGED))?;
    raw::read(source, &layout, path, left, false)
}

fn rare_stack(path: &Path, images: usize) -> Error {
    Error::file(
        path,
        format!(
            "says it is an ImageJ stack of {images} slices, but holds one page and no plain planes after it"
        ),
        "export it again as an uncompressed TIFF stack",
    )
}

/// Writes a folder of 16-bit signed slices that carry their pixel size; voxels must be as high as wide.
pub fn write_slices(folder: &Path, name: &str, volume: &Volume<i16>) -> Result<()> {
    let [nx, ny, nz] = volume.grid.n;
    // Pixels per centimetre, in units that hold µm exactly.
    let per_cm = volume.grid.spacing_mm.map(|s| Rational {
        n: 10_000_000,
        d: (s * 1e6).round() as u32,
    });
    let digits = nz.to_string().len().max(4);
    for (k, slice) in volume.as_slice().chunks_exact(nx * ny).enumerate() {
        let path = folder.join(format!("{name}_{k:0digits$}.tif"));
        let encode = |bytes: &mut std::io::Cursor<Vec<u8>>| -> tiff::TiffResult<()> {
            let mut encoder =
                TiffEncoder::new(bytes)?.with_compression(Compression::Deflate(DeflateLevel::Best));
            let mut image = encoder.new_image::<colortype::GrayI16>(nx as u32, ny as u32)?;
            image
                .encoder()
                .write_tag(Tag::XResolution, per_cm[0].clone())?;
            image
                .encoder()
                .write_tag(Tag::YResolution, per_cm[1].clone())?;
            image.encoder().write_tag(Tag::ResolutionUnit, 3u16)?;
            image.write_data(slice)
        };
        let mut bytes = std::io::Cursor::new(Vec::new());
        encode(&mut bytes).map_err(|e| {
            Error::file(
                &path,
                format!("cannot be encoded as TIFF ({e})"),
                "choose another format",
            )
        })?;
        crate::io::atomic::write(&path, bytes.into_inner())?;
    }
    Ok(())
}

fn description(d: &mut Decoder<BufReader<File>>) -> String {
    // µ may be Latin-1, which is not UTF-8: read bytes, not a string.
    match d.find_tag(Tag::ImageDescription) {
        Ok(Some(value)) => match value {
            tiff::decoder::ifd::Value::Ascii(text) => text,
            other => other
                .into_u8_vec()
                .map(|b| b.iter().map(|&c| char::from(c)).collect())
                .unwrap_or_default(),
        },
        _ => String::new(),
    }
}

/// Pixel size and slice distance in mm, from ImageJ's notes, OME's, or resolution tags that are no printer's.
fn resolution(d: &mut Decoder<BufReader<File>>) -> (Option<[f64; 2]>, Option<f64>) {
    let text = description(d);
    if text.contains("<OME") {
        return ome(&text);
    }
    let (Some(x), Some(y)) = (per_unit(d, Tag::XResolution), per_unit(d, Tag::YResolution)) else {
        return (None, None);
    };
    if text.starts_with("ImageJ=") {
        let facts = imagej(&text);
        let unit = facts.unit_mm;
        return (
            unit.map(|u| [u / x, u / y]),
            unit.zip(facts.spacing).map(|(u, s)| u * s),
        );
    }
    let unit = match d.get_tag_u32(Tag::ResolutionUnit).unwrap_or(2) {
        2 if !PRINTING_DPI.contains(&x) => 25.4,
        3 if x > 50.0 => 10.0,
        _ => return (None, None),
    };
    // Rational tags carry rounding: whole nanometres.
    let pixel = |per_unit: f64| (unit / per_unit * 1e6).round() / 1e6;
    (Some([pixel(x), pixel(y)]), None)
}

/// Dots per inch that image programs write when nobody told them a size.
const PRINTING_DPI: [f64; 9] = [1.0, 72.0, 96.0, 100.0, 150.0, 200.0, 300.0, 600.0, 1200.0];

fn per_unit(d: &mut Decoder<BufReader<File>>, tag: Tag) -> Option<f64> {
    use tiff::decoder::ifd::Value;
    let value = match d.find_tag(tag).ok()?? {
        Value::Rational(a, b) => f64::from(a) / f64::from(b),
        Value::List(list) => match list.first()? {
            Value::Rational(a, b) => f64::from(*a) / f64::from(*b),
            _ => return None,
        },
        Value::Float(v) => f64::from(v),
        Value::Double(v) => v,
        _ => return None,
    };
    (value.is_finite() && value > 0.0).then_some(value)
}

/// `PhysicalSizeX` and its kin of an OME-XML description; the unit is µm unless said.
fn ome(xml: &str) -> (Option<[f64; 2]>, Option<f64>) {
    let attribute = |name: &str| {
        let start = xml.find(&format!(" {name}=\""))? + name.len() + 3;
        let text = &xml[start..];
        Some(&text[..text.find('"')?])
    };
    let size = |axis: &str| {
        let value: f64 = attribute(&format!("PhysicalSize{axis}"))?.parse().ok()?;
        let unit = match attribute(&format!("PhysicalSize{axis}Unit")) {
            Some(unit) => unit_mm(unit)?,
            None => 1e-3,
        };
        (value.is_finite() && value > 0.0).then_some(value * unit)
    };
    (size("X").zip(size("Y")).map(|(x, y)| [x, y]), size("Z"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write_stack(path: &Path, text: &str, pages: usize, resolution: u32) {
        let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
        for k in 0..pages {
            let mut image = encoder.new_image::<colortype::Gray16>(3, 2).unwrap();
            if resolution > 0 {
                let r = Rational {
                    n: resolution,
                    d: 1,
                };
                image
                    .encoder()
                    .write_tag(Tag::XResolution, r.clone())
                    .unwrap();
                image.encoder().write_tag(Tag::YResolution, r).unwrap();
                image
                    .encoder()
                    .write_tag(Tag::ResolutionUnit, 1u16)
                    .unwrap();
            }
            if k == 0 && !text.is_empty() {
                image
                    .encoder()
                    .write_tag(Tag::ImageDescription, text)
                    .unwrap();
            }
            let values: Vec<u16> = (0..6).map(|v| (k * 1000 + v) as u16).collect();
            image.write_data(&values).unwrap();
        }
    }

    #[test]
    fn an_imagej_stack_brings_its_voxel_size() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("s.tif");
        write_stack(
            &path,
            "ImageJ=1.54f\nimages=4\nslices=4\nunit=um\nspacing=30.0\nloop=false\n",
            4,
            50,
        );
        let s = read(&path).unwrap();
        assert_eq!(s.n, [3, 2, 4]);
        let spacing = s.spacing_mm.unwrap();
        assert!(
            (spacing[0] - 2e-5).abs() < 1e-12 && (spacing[2] - 0.03).abs() < 1e-12,
            "{spacing:?}"
        );
        assert_eq!(s.values[6 * 3 + 5], 3005.0);
    }

    #[test]
    fn a_stack_without_a_size_has_none() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("s.tif");
        write_stack(&path, "", 2, 0);
        assert_eq!(read(&path).unwrap().spacing_mm, None);
        write_stack(&path, "ImageJ=1.54f\nimages=2\nunit=pixel\n", 2, 1);
        assert_eq!(read(&path).unwrap().spacing_mm, None);
    }

    #[test]
    fn planes_after_a_single_page_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("big.tif");
        write_stack(&path, "ImageJ=1.54f\nimages=3\nslices=3\n", 1, 0);
        // Move the pixels to the end of the file and append two more planes, as ImageJ lays them out.
        let mut bytes = std::fs::read(&path).unwrap();
        let mut d = open(&path).unwrap().decoder;
        let offset = d.get_tag_u64_vec(Tag::StripOffsets).unwrap()[0] as u32;
        let plane: Vec<u8> = bytes[offset as usize..offset as usize + 12].to_vec();
        let end = bytes.len() as u32;
        for k in 0..3u8 {
            bytes.extend(plane.iter().map(|b| b.wrapping_add(k)));
        }
        let at = bytes
            .windows(12)
            .position(|w| w[..2] == 273u16.to_le_bytes())
            .expect("StripOffsets entry");
        bytes[at + 8..at + 12].copy_from_slice(&end.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let s = read(&path).unwrap();
        assert_eq!(s.n, [3, 2, 3]);
        assert_eq!(s.values[5], 5.0);
        assert_eq!(s.values[6 + 5], f32::from(u16::from_le_bytes([6, 1])));
    }

    #[test]
    fn written_slices_come_back_as_a_scan_with_its_size() {
        let dir = tempfile::tempdir().unwrap();
        let grid = crate::grid::Grid::new([5, 4, 3], [0.0195; 3]);
        let volume = Volume::from_vec(grid, (0..60).map(|v| v * 100 - 3000).collect());
        write_slices(dir.path(), "s", &volume).unwrap();
        let back = crate::image::slices::read(dir.path()).unwrap();
        assert_eq!(back.n, grid.n);
        assert!(
            back.spacing_mm
                .unwrap()
                .iter()
                .all(|s| (s - 0.0195).abs() < 1e-9),
            "{:?}",
            back.spacing_mm
        );
        assert!(
            back.values
                .iter()
                .zip(volume.as_slice())
                .all(|(&a, &b)| a == f32::from(b))
        );
    }

    #[test]
    fn packed_bits_are_unpacked_row_by_row() {
        assert_eq!(
            unpacked(&[0b1010_0000, 0b0100_0000], 1, 3, 2),
            [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]
        );
        assert_eq!(unpacked(&[0x1F], 4, 2, 1), [1.0, 15.0]);
    }

    #[test]
    fn ome_sizes_are_read() {
        let (xy, z) = ome(
            r#"<OME><Pixels PhysicalSizeX="19.5" PhysicalSizeY="19.5" PhysicalSizeZ="0.02" PhysicalSizeZUnit="mm"/>"#,
        );
        let xy = xy.unwrap();
        assert!((xy[0] - 0.0195).abs() < 1e-12 && z == Some(0.02));
    }

    #[test]
    fn damage_is_told_with_the_file_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cut.tif");
        write_stack(&path, "", 2, 0);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("cut.tif"));
    }
}
