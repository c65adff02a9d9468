//! Owns how one page of a TIFF file is stored, by its tags ([`super::tags`]), and what is refused of it.

use super::{Pages, damaged, unread};
use crate::error::Result;
use crate::format::strips::{self, Samples};
use std::path::Path;
use tiff::tags::Tag;

/// What the samples of a pixel are.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixel {
    Grey,
    /// Grey and its opacity; `multiplied` where the grey value already has been by it.
    GreyAlpha {
        multiplied: bool,
    },
    /// Red, green, blue, perhaps opacity: grey where they are equal.
    Colour,
    /// An index into a table of colours.
    Index(Table),
}

/// A table of colours, by what it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// Black for 0 to white for the largest value.
    Grey,
    /// White for 0.
    Inverted,
    Other,
}

/// A page's storage.
#[derive(Debug, Clone, PartialEq)]
pub struct Storage {
    pub width: usize,
    pub height: usize,
    pub samples: Samples,
    pub pixel: Pixel,
    /// White for 0: how it is shown, not what is stored.
    pub white_is_zero: bool,
    pub compression: u64,
    pub predictor: u64,
    /// The first pixel of a byte is in its lowest bit.
    pub reversed_bits: bool,
    /// Width and height of a strip or tile.
    pub chunk: [usize; 2],
    /// Tag 274; 1 is the first row at the top, the first column at the left.
    pub orientation: u64,
    /// GDAL's notes of the values: tags 42112 and 42113.
    pub gdal: [bool; 2],
}

impl Storage {
    /// The type of a sample as NumPy calls it.
    pub fn stored_as(&self) -> String {
        self.samples.name().unwrap_or_default()
    }

    /// Whether two pages can be slices of one scan.
    pub fn is_like(&self, other: &Storage) -> bool {
        (
            self.samples.bits,
            self.samples.format,
            &self.pixel,
            self.white_is_zero,
            self.orientation,
        ) == (
            other.samples.bits,
            other.samples.format,
            &other.pixel,
            other.white_is_zero,
            other.orientation,
        )
    }

    /// In words, for a message about pages that differ.
    pub fn words(&self) -> String {
        let shown = match (&self.pixel, self.white_is_zero) {
            (Pixel::Index(_), _) => ", a palette",
            (Pixel::Colour, _) => ", red, green and blue",
            (Pixel::GreyAlpha { .. }, _) => ", with opacity",
            (Pixel::Grey, true) => ", white for 0",
            (Pixel::Grey, false) => "",
        };
        format!("{}{shown}", self.stored_as())
    }

    /// What a user should know of how the values were taken.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let stored = "taken as stored, as ImageJ and tifffile do";
        if self.white_is_zero {
            notes.push(format!(
                "the file shows 0 as white (an inverting table in ImageJ); its values are {stored}"
            ));
        }
        match self.pixel {
            Pixel::Grey | Pixel::Index(Table::Grey) => {}
            Pixel::GreyAlpha { .. } => {
                notes.push(
                    "the opacity (alpha) of pixels is left out: grey values are as stored".into(),
                );
            }
            Pixel::Colour => {
                notes.push("red, green and blue are equal everywhere: read as grey values".into());
            }
            Pixel::Index(Table::Inverted) => notes.push(format!(
                "a palette shows 0 as white; the values are {stored}"
            )),
            Pixel::Index(Table::Other) => notes.push(format!(
                "a palette gives each value a colour; the values are {stored}"
            )),
        }
        if self.orientation != 1 {
            notes.push(format!(
                "tag Orientation is {}: viewers may show the slices flipped or turned; rows and columns are {stored}",
                self.orientation
            ));
        }
        let [metadata, no_data] = self.gdal;
        if metadata {
            notes.push(format!(
                "GDAL's notes (tag 42112) may scale values; they are {stored}"
            ));
        }
        if no_data {
            notes.push(
                "GDAL's tag 42113 names a value for pixels without data: it is taken as any other"
                    .into(),
            );
        }
        notes
    }

    /// Whether the decoder of the crate is used, which inverts what shows 0 as white.
    pub fn by_crate(&self) -> bool {
        matches!(self.compression, strips::CCITT_GROUP_4 | strips::JPEG)
    }
}

/// Whether the current page is another resolution, or a mask, of another one (tags 254 and 255).
pub fn is_reduced(pages: &mut Pages) -> bool {
    let kind = number(pages, Tag::NewSubfileType).unwrap_or(0);
    let old_kind = number(pages, Tag::SubfileType).unwrap_or(1);
    kind & 0b101 != 0 || old_kind == 2
}

/// Reads the tags of the current page. `from_imagej`: its values are labels whatever a palette shows.
///
/// # Errors
/// What would be read as something else than it is, or cannot be read.
pub fn storage(pages: &mut Pages, path: &Path, from_imagej: bool) -> Result<Storage> {
    refuse_other_kinds(pages, path)?;
    let (width, height) = pages.decoder.dimensions().map_err(|e| damaged(path, &e))?;
    let (width, height) = (width as usize, height as usize);
    let samples = samples(pages, path)?;
    let photometric = number(pages, Tag::PhotometricInterpretation).unwrap_or(1);
    let pixel = pixel(pages, path, photometric, &samples, from_imagej)?;
    let compression = number(pages, Tag::Compression).unwrap_or(strips::NONE);
    let chunk = match number(pages, Tag::TileWidth) {
        Some(tile) => [tile, number(pages, Tag::TileLength).unwrap_or(1)].map(|n| n as usize),
        None => {
            let rows = number(pages, Tag::RowsPerStrip).unwrap_or(height as u64);
            [width, (rows as usize).clamp(1, height)]
        }
    };
    let storage = Storage {
        width,
        height,
        samples,
        pixel,
        white_is_zero: photometric == 0,
        compression,
        predictor: number(pages, Tag::Predictor).unwrap_or(1),
        reversed_bits: number(pages, Tag::FillOrder) == Some(2),
        chunk,
        orientation: number(pages, Tag::Orientation)
            .filter(|o| (1..=8).contains(o))
            .unwrap_or(1),
        gdal: [42112, 42113].map(|tag| has(pages, tag)),
    };
    refuse_compression(&storage, path)?;
    Ok(storage)
}

/// The first value of a tag that holds whole numbers.
pub fn number(pages: &mut Pages, tag: Tag) -> Option<u64> {
    numbers(pages, tag)?.first().copied()
}

pub fn numbers(pages: &mut Pages, tag: Tag) -> Option<Vec<u64>> {
    pages.decoder.find_tag(tag).ok()??.into_u64_vec().ok()
}

/// Kinds of files that share TIFF's directories and mean something else by them.
fn refuse_other_kinds(pages: &mut Pages, path: &Path) -> Result<()> {
    const DEPTH: u16 = 32997;
    const METAMORPH: u16 = 33629;
    const ZEISS_LSM: u16 = 34412;
    let as_stack = "save it as an uncompressed TIFF stack (in Fiji: File > Import > Bio-Formats, then File > Save As > Tiff)";
    if number(pages, Tag::from_u16_exhaustive(DEPTH)).is_some_and(|depth| depth > 1) {
        return Err(unread(
            path,
            "holds several slices in one page (tag ImageDepth)",
            as_stack,
        ));
    }
    for (tag, name) in [(METAMORPH, "MetaMorph STK"), (ZEISS_LSM, "Zeiss LSM")] {
        if has(pages, tag) {
            let found = format!("is a {name} file, whose planes do not follow TIFF");
            return Err(unread(path, &found, as_stack));
        }
    }
    Ok(())
}

fn has(pages: &mut Pages, tag: u16) -> bool {
    let tag = Tag::from_u16_exhaustive(tag);
    pages.decoder.image_ifd().find_entry(tag).is_some()
}

fn samples(pages: &mut Pages, path: &Path) -> Result<Samples> {
    let bits = number(pages, Tag::BitsPerSample).unwrap_or(1);
    let format = match number(pages, Tag::SampleFormat).unwrap_or(1) {
        // Undefined: libtiff also takes it as unsigned.
        4 => 1,
        format => format,
    };
    let samples = Samples {
        bits: bits as usize,
        format,
        big_endian: pages.decoder.byte_order() == tiff::tags::ByteOrder::BigEndian,
        count: number(pages, Tag::SamplesPerPixel).unwrap_or(1) as usize,
    };
    if samples.name().is_none() {
        let kind = match format {
            1 => "unsigned integers",
            2 => "signed integers",
            3 => "floats",
            5 | 6 => "complex numbers",
            _ => "numbers of an unknown format",
        };
        return Err(unread(
            path,
            &format!("holds {kind} of {bits} bits, which are not read"),
            "save it with 8, 16 or 32 bits a pixel (in Fiji: Image > Type)",
        ));
    }
    let planar = number(pages, Tag::PlanarConfiguration).unwrap_or(1);
    if samples.count > 1 && planar == 2 {
        return Err(colour(
            path,
            "holds several samples a pixel in planes of their own",
        ));
    }
    Ok(samples)
}

fn colour(path: &Path, found: &str) -> crate::error::Error {
    unread(
        path,
        found,
        "save the one channel that holds the scan as grey values (in Fiji: Image > Color > Split Channels, or Image > Type > 8-bit or 16-bit)",
    )
}

fn pixel(
    pages: &mut Pages,
    path: &Path,
    photometric: u64,
    samples: &Samples,
    from_imagej: bool,
) -> Result<Pixel> {
    let extra = numbers(pages, Tag::ExtraSamples).unwrap_or_default();
    let opacity = |kind: &u64| [1, 2].contains(kind);
    match (photometric, samples.count) {
        (0 | 1, 1) => Ok(Pixel::Grey),
        (0 | 1, 2) if extra.len() == 1 && opacity(&extra[0]) => Ok(Pixel::GreyAlpha {
            multiplied: extra[0] == 1,
        }),
        (2, 3) => Ok(Pixel::Colour),
        (2, 4) if extra.is_empty() || opacity(&extra[0]) => Ok(Pixel::Colour),
        (3, 1) => {
            let table = table(
                &numbers(pages, Tag::ColorMap).unwrap_or_default(),
                samples.bits,
            );
            if table == Table::Other && !from_imagej {
                return Err(colour(
                    path,
                    "is a palette image: its table gives values colours or shades that follow no straight line, so what a value means is not clear; the file",
                ));
            }
            Ok(Pixel::Index(table))
        }
        (0 | 1, n) => Err(colour(
            path,
            &format!("holds {n} samples (channels) a pixel"),
        )),
        (other, _) => {
            let kind = match other {
                2 => "an RGB image with further channels",
                3 => "a palette image with several samples a pixel",
                4 => "a transparency mask, not an image",
                5 => "a CMYK image",
                6 => "a YCbCr image",
                8..=10 => "a CIE L*a*b* image",
                32803 | 34892 => "a camera's raw image",
                _ => "an image of an unknown kind of pixels",
            };
            Err(colour(
                path,
                &format!("is {kind}, grey values are expected"),
            ))
        }
    }
}

/// A colour table: all reds, then all greens, then all blues, from 0 to 65535 (or, in old files, to 255).
fn table(colours: &[u64], bits: usize) -> Table {
    let n = 1usize << bits.min(16);
    if colours.len() != 3 * n || n < 2 {
        return Table::Other;
    }
    let scale = if colours.iter().all(|&v| v < 256) {
        1.0
    } else {
        257.0
    };
    let is = |shade: &dyn Fn(usize) -> f64| {
        (0..3 * n).all(|i| (colours[i] as f64 / scale - shade(i % n)).abs() <= 1.0)
    };
    let step = 255.0 / (n - 1) as f64;
    match () {
        _ if is(&|i| i as f64 * step) => Table::Grey,
        _ if is(&|i| (n - 1 - i) as f64 * step) => Table::Inverted,
        _ => Table::Other,
    }
}

fn refuse_compression(storage: &Storage, path: &Path) -> Result<()> {
    let compression = storage.compression;
    let single = storage.samples.count == 1 && !storage.reversed_bits;
    let by_crate = storage.by_crate() && single && matches!(storage.pixel, Pixel::Grey);
    if strips::is_read(compression) || by_crate {
        return Ok(());
    }
    Err(unread(
        path,
        &format!(
            "is compressed by {}, which is not read",
            strips::name(compression)
        ),
        "save it uncompressed, or with deflate (ZIP) or LZW",
    ))
}
