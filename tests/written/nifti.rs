//! NIfTI-1, NIfTI-2 and Analyze 7.5 by the names of their fields (`nifti1.h`, `nifti2.h`, `dbh.h`).

use super::scalars;

/// Name, NumPy type, count, byte in NIfTI-1, byte in NIfTI-2.
const FIELDS: [(&str, &str, &str, usize, usize); 40] = [
    ("sizeof_hdr", "int32", "int32", 0, 0),
    ("data_type", "text", "", 4, usize::MAX),
    ("db_name", "text", "", 14, usize::MAX),
    ("extents", "int32", "", 32, usize::MAX),
    ("session_error", "int16", "", 36, usize::MAX),
    ("regular", "uint8", "", 38, usize::MAX),
    ("dim_info", "uint8", "uint8", 39, 524),
    ("dim", "int16", "int64", 40, 16),
    ("intent_p1", "float32", "float64", 56, 80),
    ("intent_p2", "float32", "float64", 60, 88),
    ("intent_p3", "float32", "float64", 64, 96),
    ("intent_code", "int16", "int32", 68, 504),
    ("datatype", "int16", "int16", 70, 12),
    ("bitpix", "int16", "int16", 72, 14),
    ("slice_start", "int16", "int64", 74, 224),
    ("pixdim", "float32", "float64", 76, 104),
    ("vox_offset", "float32", "int64", 108, 168),
    ("scl_slope", "float32", "float64", 112, 176),
    ("scl_inter", "float32", "float64", 116, 184),
    ("slice_end", "int16", "int64", 120, 232),
    ("slice_code", "uint8", "int32", 122, 496),
    ("xyzt_units", "uint8", "int32", 123, 500),
    ("cal_max", "float32", "float64", 124, 192),
    ("cal_min", "float32", "float64", 128, 200),
    ("slice_duration", "float32", "float64", 132, 208),
    ("toffset", "float32", "float64", 136, 216),
    ("glmax", "int32", "", 140, usize::MAX),
    ("glmin", "int32", "", 144, usize::MAX),
    ("qform_code", "int16", "int32", 252, 344),
    ("sform_code", "int16", "int32", 254, 348),
    ("quatern_b", "float32", "float64", 256, 352),
    ("quatern_c", "float32", "float64", 260, 360),
    ("quatern_d", "float32", "float64", 264, 368),
    ("qoffset_x", "float32", "float64", 268, 376),
    ("qoffset_y", "float32", "float64", 272, 384),
    ("qoffset_z", "float32", "float64", 276, 392),
    ("srow_x", "float32", "float64", 280, 400),
    ("srow_y", "float32", "float64", 296, 432),
    ("srow_z", "float32", "float64", 312, 464),
    ("funused1", "float32", "", 112, usize::MAX),
];

/// Text fields: name, byte, in NIfTI-1 and Analyze.
const TEXTS: [(&str, usize); 9] = [
    ("data_type", 4),
    ("db_name", 14),
    ("vox_units", 56),
    ("descrip", 148),
    ("aux_file", 228),
    ("orient", 252),
    ("originator", 253),
    ("intent_name", 328),
    ("magic", 344),
];

/// A header whose fields are set by name.
#[derive(Clone)]
pub struct Header {
    pub bytes: Vec<u8>,
    pub big_endian: bool,
}

impl Header {
    /// `version` 0 is Analyze.
    pub fn new(version: u8, big_endian: bool) -> Header {
        let length = if version == 2 { 540 } else { 348 };
        let mut header = Header {
            bytes: vec![0; length],
            big_endian,
        };
        header.set("sizeof_hdr", &[length as f64]);
        match version {
            0 => {}
            1 => header.text("magic", b"n+1\0"),
            _ => header.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n"),
        }
        header
    }

    fn is_two(&self) -> bool {
        self.bytes.len() == 540
    }

    pub fn set(&mut self, name: &str, values: &[f64]) {
        let (_, first, second, at1, at2) = *FIELDS.iter().find(|f| f.0 == name).unwrap();
        let (kind, at) = if self.is_two() {
            (second, at2)
        } else {
            (first, at1)
        };
        let bytes = scalars(kind, self.big_endian, values);
        self.bytes[at..at + bytes.len()].copy_from_slice(&bytes);
    }

    pub fn text(&mut self, name: &str, value: &[u8]) {
        let (_, at) = *TEXTS.iter().find(|t| t.0 == name).unwrap();
        self.bytes[at..at + value.len()].copy_from_slice(value);
    }

    /// Whether a field is text.
    pub fn is_text(name: &str) -> bool {
        TEXTS.iter().any(|t| t.0 == name)
    }

    pub fn pair(&mut self) {
        match self.is_two() {
            true => self.bytes[4..7].copy_from_slice(b"ni2"),
            false => self.text("magic", b"ni1\0"),
        }
    }
}

/// NIfTI's code and bits of a NumPy type.
pub fn code(kind: &str) -> [f64; 2] {
    match kind {
        "uint8" => [2.0, 8.0],
        "int16" => [4.0, 16.0],
        "int32" => [8.0, 32.0],
        "float32" => [16.0, 32.0],
        "float64" => [64.0, 64.0],
        "int8" => [256.0, 8.0],
        "uint16" => [512.0, 16.0],
        "uint32" => [768.0, 32.0],
        "int64" => [1024.0, 64.0],
        "uint64" => [1280.0, 64.0],
        other => panic!("{other}"),
    }
}
