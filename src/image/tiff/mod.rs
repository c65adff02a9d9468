//! Owns TIFF: single slices, multi-page stacks, BigTIFF, and their voxel sizes. Which tags are read is listed in [`tags`]; what
//! ImageJ and OME write into the description in [`crate::image::description`].

mod chunks;
mod described;
mod scale;
mod storage;
pub mod tags;

pub mod directories;

use crate::error::{Error, Result};
use crate::format::raw::{self, Layout};
use crate::format::strips::{self, Samples};
use crate::image::description::imagej::Grey;
use crate::image::stored::{self, Slice, Stored};
use crate::volume::Volume;
use chunks::{Fault, Places};
use described::{Described, described};
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use storage::{Storage, numbers, storage};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::{Compression, DeflateLevel, Rational, TiffEncoder, colortype};
use tiff::tags::Tag;

const DAMAGED: &str =
    "the file is truncated or damaged: copy it again, or export it again as plain grey-value TIFF";
/// Larger pages than this are refused (an 8-bit page of 46 000 × 46 000 pixels).
const PAGE_BYTES: u64 = 2 << 30;
/// Files up to this size are read at once.
const AT_ONCE: u64 = 32 << 20;

trait Source: Read + Seek {}
impl<T: Read + Seek> Source for T {}

struct Pages {
    decoder: Decoder<Box<dyn Source>>,
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
    let mut file = File::open(path).map_err(unreadable)?;
    let file_bytes = file.metadata().map_err(unreadable)?.len();
    let mut source: Box<dyn Source> = if file_bytes <= AT_ONCE {
        let mut bytes = Vec::with_capacity(file_bytes as usize);
        file.read_to_end(&mut bytes).map_err(unreadable)?;
        Box::new(Cursor::new(bytes))
    } else {
        Box::new(BufReader::new(file))
    };
    if let Some(fault) = directories::fault(&mut source, file_bytes) {
        return Err(Error::file(
            path,
            format!("is no sound TIFF file: {fault}"),
            DAMAGED,
        ));
    }
    source.rewind().map_err(unreadable)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = PAGE_BYTES as usize;
    limits.intermediate_buffer_size = PAGE_BYTES as usize;
    let decoder = Decoder::new(source)
        .map_err(|e| damaged(path, &e))?
        .with_limits(limits);
    Ok(Pages {
        decoder,
        file_bytes,
    })
}

fn damaged(path: &Path, e: &tiff::TiffError) -> Error {
    match e {
        tiff::TiffError::UnsupportedError(e) => unread(
            path,
            &format!("is stored in a way that is not read ({e})"),
            "export it again as plain grey-value TIFF",
        ),
        e => Error::file(path, format!("cannot be decoded as TIFF ({e})"), DAMAGED),
    }
}

/// A sound file of a kind that is not read.
fn unread(path: &Path, found: &str, advice: &str) -> Error {
    Error::file(path, found, format!("the file is sound: {advice}"))
}

/// Reads a file of one page.
pub fn read_slice(path: &Path) -> Result<Slice> {
    let mut pages = open(path)?;
    let described = described(&mut pages, path)?;
    refuse_described(&described, path)?;
    let mut page = page(&mut pages, path, described.is_imagej())?;
    if more(&mut pages, path)? {
        return Err(Error::file(
            path,
            "holds several pages in a folder of slices",
            "a multi-page TIFF is a scan of its own: give the file, or keep only single slices in the folder",
        ));
    }
    let stored_as = page.storage.stored_as();
    let mut grey = grey_of(&described);
    grey.apply(&mut page.values, &stored_as);
    let size = described.size(page.resolution, 1);
    let mut notes = page.storage.notes();
    notes.extend(size.notes);
    Ok(Slice {
        width: page.storage.width,
        height: page.storage.height,
        values: page.values,
        stored_as,
        pixel_mm: size.pixel_mm,
        slice_mm: size.slice_mm,
        grey,
        notes,
    })
}

/// Reads a stack in one file.
pub fn read(path: &Path) -> Result<Stored> {
    let mut pages = open(path)?;
    let described = described(&mut pages, path)?;
    refuse_described(&described, path)?;
    let mut left_out = skip_reduced(&mut pages, path)?;
    let first = page(&mut pages, path, described.is_imagej())?;
    let (nx, ny) = (first.storage.width, first.storage.height);
    let mut notes = first.storage.notes();
    let mut values = first.values;
    let mut nz = 1;
    let behind = described.slices_of_one_page([nx, ny]);
    if behind > 1 && !pages.decoder.more_images() {
        nz = behind;
        values = contiguous(&mut pages, path, &first.storage, nz)?;
    }
    loop {
        let [next, reduced] = next(&mut pages, path)?;
        left_out += reduced;
        if next == 0 {
            break;
        }
        let other = page(&mut pages, path, described.is_imagej())?;
        nz += 1;
        same_kind(&first.storage, &other.storage, nz, path)?;
        values.extend_from_slice(&other.values);
    }
    if left_out > 0 {
        notes.push(format!(
            "{left_out} pages are of another resolution, or masks (tag NewSubfileType): they were left out"
        ));
    }
    let mut values = in_order(&described, values, [nx, ny, nz], path)?;
    let mut grey = grey_of(&described);
    grey.apply(&mut values, &first.storage.stored_as());
    let size = described.size(first.resolution, nz);
    notes.extend(size.notes);
    let spacing_mm = stored::spacing(size.pixel_mm, size.slice_mm, nz, &mut notes);
    notes.extend(grey.notes());
    Ok(Stored {
        format: format!("TIFF stack, {}", first.storage.stored_as()),
        n: [nx, ny, nz],
        values,
        spacing_mm,
        unit: grey.unit(),
        notes,
        ..Stored::default()
    })
}

fn grey_of(described: &Described) -> Grey {
    match described {
        Described::ImageJ(facts) => facts.grey,
        _ => Grey::default(),
    }
}

fn refuse_described(described: &Described, path: &Path) -> Result<()> {
    match described.fault() {
        Some(fault) => Err(Error::file(
            path,
            fault,
            "save the one channel and time that holds the scan as a stack (in Fiji: Image > Duplicate, or Image > Color > Split Channels)",
        )),
        None => Ok(()),
    }
}

/// Passes over pages of other resolutions: how many.
fn skip_reduced(pages: &mut Pages, path: &Path) -> Result<usize> {
    let mut skipped = 0;
    while storage::is_reduced(pages) && pages.decoder.more_images() {
        pages.decoder.next_image().map_err(|e| damaged(path, &e))?;
        skipped += 1;
    }
    Ok(skipped)
}

/// Goes to the next page of full resolution: 1 if there is one, and how many others were passed over.
fn next(pages: &mut Pages, path: &Path) -> Result<[usize; 2]> {
    let mut skipped = 0;
    while pages.decoder.more_images() {
        pages.decoder.next_image().map_err(|e| damaged(path, &e))?;
        if !storage::is_reduced(pages) {
            return Ok([1, skipped]);
        }
        skipped += 1;
    }
    Ok([0, skipped])
}

fn more(pages: &mut Pages, path: &Path) -> Result<bool> {
    Ok(next(pages, path)?[0] > 0)
}

fn same_kind(first: &Storage, other: &Storage, number: usize, path: &Path) -> Result<()> {
    let wrong = |found: String| {
        Err(Error::file(
            path,
            found,
            "one scan has pages of one size and kind: export the stack again without thumbnails or other images",
        ))
    };
    let [(nx, ny), (mx, my)] = [first, other].map(|s| (s.width, s.height));
    if (nx, ny) != (mx, my) {
        return wrong(format!(
            "page {number} has {mx} × {my} pixels, the first has {nx} × {ny}"
        ));
    }
    if !first.is_like(other) {
        return wrong(format!(
            "page {number} holds {}, the first {}",
            other.words(),
            first.words()
        ));
    }
    Ok(())
}

/// Slices in the order that the description gives them.
fn in_order(
    described: &Described,
    values: Vec<f32>,
    [nx, ny, nz]: [usize; 3],
    path: &Path,
) -> Result<Vec<f32>> {
    let export = "the file is truncated, or pages were added to it: export it again";
    if let Some(said) = described.slices()
        && said != nz
    {
        return Err(Error::file(
            path,
            format!("says that it holds {said} slices, and holds {nz} pages"),
            export,
        ));
    }
    let Described::Ome(ome) = described else {
        return Ok(values);
    };
    if ome.contradicts([nx, ny]) {
        let [x, y, ..] = ome.sizes;
        let found = format!("its OME-XML says {x} × {y} pixels, its pages have {nx} × {ny}");
        return Err(Error::file(path, found, export));
    }
    let plane = nx * ny;
    let order = ome
        .pages_of(nz)
        .map_err(|found| Error::file(path, found, export))?;
    if order.iter().copied().eq(0..nz) {
        return Ok(values);
    }
    let pages = order
        .into_iter()
        .flat_map(|k| &values[k * plane..(k + 1) * plane]);
    Ok(pages.copied().collect())
}

struct Page {
    storage: Storage,
    values: Vec<f32>,
    resolution: scale::Resolution,
}

/// Decodes the current page.
fn page(pages: &mut Pages, path: &Path, from_imagej: bool) -> Result<Page> {
    let storage = storage(pages, path, from_imagej)?;
    let (width, height) = (storage.width, storage.height);
    let bits = (storage.samples.bits * storage.samples.count) as u64;
    let bytes = (width as u64 * height as u64)
        .saturating_mul(bits)
        .div_ceil(8);
    // No compression here shrinks more than about 2000 : 1.
    if bytes > pages.file_bytes.saturating_mul(2000) + 4096 || bytes > PAGE_BYTES {
        return Err(Error::file(
            path,
            format!(
                "the header promises {width} × {height} pixels, the file holds {} bytes",
                pages.file_bytes
            ),
            DAMAGED,
        ));
    }
    let resolution = scale::resolution(pages, from_imagej);
    let values = match storage.by_crate() {
        true => by_crate(pages, path, &storage)?,
        false => by_chunks(pages, path, &storage)?,
    };
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
    Ok(Page {
        storage,
        values,
        resolution,
    })
}

fn by_chunks(pages: &mut Pages, path: &Path, storage: &Storage) -> Result<Vec<f32>> {
    let [offsets, bytes] = match pages.decoder.get_chunk_type() {
        tiff::decoder::ChunkType::Strip => [Tag::StripOffsets, Tag::StripByteCounts],
        tiff::decoder::ChunkType::Tile => [Tag::TileOffsets, Tag::TileByteCounts],
    };
    let [offsets, bytes] = [offsets, bytes].map(|tag| numbers(pages, tag).unwrap_or_default());
    let places = Places { offsets, bytes };
    chunks::values(storage, &places, pages.decoder.inner()).map_err(|fault| match fault {
        Fault::Damaged(found) => Error::file(
            path,
            format!("cannot be decoded as TIFF ({found})"),
            DAMAGED,
        ),
        Fault::NotGrey(found) => unread(
            path,
            found,
            "convert it to 8- or 16-bit grey values (in Fiji: Image > Type)",
        ),
    })
}

/// Compressions that the crate decodes: fax of 1 bit, JPEG of 8 bits.
fn by_crate(pages: &mut Pages, path: &Path, storage: &Storage) -> Result<Vec<f32>> {
    let decoded = pages.decoder.read_image().map_err(|e| damaged(path, &e))?;
    let DecodingResult::U8(mut bytes) = decoded else {
        return Err(unread(
            path,
            "is JPEG of more than 8 bits, which is not read",
            "save it uncompressed",
        ));
    };
    if storage.white_is_zero {
        // The crate inverts such pages.
        bytes.iter_mut().for_each(|b| *b = !*b);
    }
    let mut values = Vec::new();
    storage.samples.decode(&bytes, storage.width, &mut values);
    Ok(values)
}

/// ImageJ writes stacks over 4 GiB (and tifffile, on request, any) as one page followed by the planes of all the others.
fn contiguous(pages: &mut Pages, path: &Path, storage: &Storage, nz: usize) -> Result<Vec<f32>> {
    let Samples {
        big_endian, count, ..
    } = storage.samples;
    let plain = storage.compression == strips::NONE
        && count == 1
        && !storage.reversed_bits
        && storage.chunk[0] == storage.width;
    let offsets = numbers(pages, Tag::StripOffsets).unwrap_or_default();
    let (Some(scalar), true, Some(&offset)) = (storage.samples.scalar(), plain, offsets.first())
    else {
        return Err(rare_stack(path, nz));
    };
    let layout = Layout {
        scalar,
        big_endian,
        n: [storage.width, storage.height, nz],
        slope: 1.0,
        intercept: 0.0,
    };
    let left = pages.file_bytes.saturating_sub(offset);
    let source = pages.decoder.inner();
    source
        .seek(SeekFrom::Start(offset))
        .map_err(|e| Error::file(path, format!("cannot be read: {e}"), DAMAGED))?;
    raw::read(source, &layout, path, left, false)
}

fn rare_stack(path: &Path, images: usize) -> Error {
    Error::file(
        path,
        format!(
            "says that it is a stack of {images} slices, but holds one page and no plain planes after it"
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
    fn damage_is_told_with_the_file_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cut.tif");
        write_stack(&path, "", 2, 0);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("cut.tif"));
    }
}
