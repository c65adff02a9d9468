//! Owns the bytes of the headers of Analyze 7.5, NIfTI-1 and NIfTI-2, in either byte order.

use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

const DAMAGED: &str = "the file is damaged or is no NIfTI: export it again";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    Analyze,
    One,
    Two,
}

impl Version {
    pub fn name(self) -> &'static str {
        match self {
            Version::Analyze => "Analyze 7.5",
            Version::One => "NIfTI-1",
            Version::Two => "NIfTI-2",
        }
    }

    pub fn header_bytes(self) -> u64 {
        match self {
            Version::Analyze | Version::One => 348,
            Version::Two => 540,
        }
    }
}

/// What of a header says where voxels are and what they mean.
#[derive(Debug, Clone)]
pub struct Header {
    pub version: Version,
    pub big_endian: bool,
    /// The voxels are in a file of their own.
    pub pair: bool,
    /// Number of dimensions, then their sizes.
    pub dim: [i64; 8],
    pub datatype: i32,
    pub pixdim: [f64; 8],
    pub vox_offset: f64,
    pub slope: f64,
    pub intercept: f64,
    pub xyzt_units: u8,
    pub qform_code: i32,
    pub sform_code: i32,
    pub quatern: [f64; 3],
    pub qoffset: [f64; 3],
    pub srow: [[f64; 4]; 3],
    /// Analyze's unit of length.
    pub vox_units: String,
    /// Analyze's plane of slices.
    pub orient: u8,
}

/// Numbers at places of a header.
struct Fields<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Fields<'_> {
    /// The `N` bytes at `at`, least significant first.
    fn word<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut word = [0; N];
        word.copy_from_slice(&self.bytes[at..at + N]);
        if self.big_endian {
            word.reverse();
        }
        word
    }

    fn i16(&self, at: usize) -> i32 {
        i32::from(i16::from_le_bytes(self.word(at)))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.word(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.word(at))
    }

    fn f32(&self, at: usize) -> f64 {
        decimal(f32::from_le_bytes(self.word(at)))
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.word(at))
    }

    fn text(&self, at: usize, length: usize) -> String {
        let text = self.bytes[at..at + length].split(|&b| b == 0).next();
        String::from_utf8_lossy(text.unwrap_or_default())
            .trim()
            .to_string()
    }
}

/// The shortest decimal that is this `f32`: 0.0195, not 0.01949999965727329.
pub fn decimal(v: f32) -> f64 {
    v.to_string().parse().unwrap_or(f64::from(v))
}

/// Reads a header from the start of `source`.
pub fn read(source: &mut dyn Read, path: &Path) -> Result<Header> {
    let mut bytes = vec![0u8; 348];
    fill(source, &mut bytes, path)?;
    let size = Fields {
        bytes: &bytes,
        big_endian: false,
    }
    .i32(0);
    let big_endian = match size {
        348 | 540 => false,
        _ if matches!(size.swap_bytes(), 348 | 540) => true,
        _ => {
            return Err(Error::file(
                path,
                format!("is no NIfTI: the header should say 348 or 540 bytes, it says {size}"),
                DAMAGED,
            ));
        }
    };
    let two = size == 540 || size.swap_bytes() == 540;
    if two {
        bytes.resize(540, 0);
        fill(source, &mut bytes[348..], path)?;
    }
    let fields = Fields {
        bytes: &bytes,
        big_endian,
    };
    if two {
        return second(&fields, path);
    }
    match fields.text(344, 4).as_str() {
        "n+1" => Ok(first(&fields, Version::One, false)),
        "ni1" => Ok(first(&fields, Version::One, true)),
        _ => Ok(analyze(&fields)),
    }
}

fn fill(source: &mut dyn Read, bytes: &mut [u8], path: &Path) -> Result<()> {
    let wanted = bytes.len();
    source.read_exact(bytes).map_err(|e| {
        Error::file(
            path,
            format!("its NIfTI header of 348 bytes or more is incomplete: {wanted} bytes were expected ({e})"),
            DAMAGED,
        )
        .caused_by(e)
    })
}

/// `nifti1.h`.
fn first(f: &Fields, version: Version, pair: bool) -> Header {
    Header {
        version,
        big_endian: f.big_endian,
        pair,
        dim: std::array::from_fn(|i| i64::from(f.i16(40 + 2 * i))),
        datatype: f.i16(70),
        pixdim: std::array::from_fn(|i| f.f32(76 + 4 * i)),
        vox_offset: f.f32(108),
        slope: f.f32(112),
        intercept: f.f32(116),
        xyzt_units: f.bytes[123],
        qform_code: f.i16(252),
        sform_code: f.i16(254),
        quatern: std::array::from_fn(|i| f.f32(256 + 4 * i)),
        qoffset: std::array::from_fn(|i| f.f32(268 + 4 * i)),
        srow: std::array::from_fn(|r| std::array::from_fn(|c| f.f32(280 + 16 * r + 4 * c))),
        vox_units: String::new(),
        orient: 0,
    }
}

/// `nifti2.h`. The last four characters of its magic show a file that was changed as text.
fn second(f: &Fields, path: &Path) -> Result<Header> {
    let pair = match f.text(4, 4).as_str() {
        "n+2" => false,
        "ni2" => true,
        other => {
            return Err(Error::file(
                path,
                format!("is no NIfTI-2: its magic should be n+2 or ni2, it is `{other}`"),
                DAMAGED,
            ));
        }
    };
    Ok(Header {
        version: Version::Two,
        big_endian: f.big_endian,
        pair,
        dim: std::array::from_fn(|i| f.i64(16 + 8 * i)),
        datatype: f.i16(12),
        pixdim: std::array::from_fn(|i| f.f64(104 + 8 * i)),
        vox_offset: f.i64(168) as f64,
        slope: f.f64(176),
        intercept: f.f64(184),
        // Only its lowest byte has a meaning.
        xyzt_units: (f.i32(500) & 0xFF) as u8,
        qform_code: f.i32(344),
        sform_code: f.i32(348),
        quatern: std::array::from_fn(|i| f.f64(352 + 8 * i)),
        qoffset: std::array::from_fn(|i| f.f64(376 + 8 * i)),
        srow: std::array::from_fn(|r| std::array::from_fn(|c| f.f64(400 + 32 * r + 8 * c))),
        vox_units: String::new(),
        orient: 0,
    })
}

/// `dbh.h`. It has no transforms and no intercept; its scale factor is SPM's `funused1`.
fn analyze(f: &Fields) -> Header {
    Header {
        xyzt_units: 0,
        qform_code: 0,
        sform_code: 0,
        intercept: 0.0,
        vox_units: f.text(56, 4),
        orient: f.bytes[252],
        ..first(f, Version::Analyze, true)
    }
}
