//! Writers of scan files that share nothing with the readers: headers are given key by key, so that a test can write what no
//! sound program writes.

pub mod dicom;
pub mod jpeg;
pub mod nifti;
pub mod text;

use bonepd_ct::error::Result;
use bonepd_ct::image::scan;
use bonepd_ct::image::stored::Stored;
use std::path::Path;

/// A file and what lies beside it.
pub type Files = Vec<(String, Vec<u8>)>;

/// Writes `files` into a folder of their own and reads the first, or, where it is in a folder, that folder.
pub fn stored(files: &Files) -> Result<Stored> {
    with(files, scan::stored)
}

/// The same for any reader of a path.
pub fn with<T>(files: &Files, read: impl Fn(&Path) -> T) -> T {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    match files[0].0.split_once('/') {
        Some((folder, _)) => read(&dir.path().join(folder)),
        None => read(&dir.path().join(&files[0].0)),
    }
}

/// Numbers as bytes of a scalar type, by NumPy's name of it.
pub fn scalars(kind: &str, big_endian: bool, values: &[f64]) -> Vec<u8> {
    macro_rules! of {
        ($t:ty) => {
            values
                .iter()
                .flat_map(|&v| {
                    let v = v as $t;
                    if big_endian {
                        v.to_be_bytes().to_vec()
                    } else {
                        v.to_le_bytes().to_vec()
                    }
                })
                .collect()
        };
    }
    match kind {
        "uint8" => of!(u8),
        "int8" => of!(i8),
        "uint16" => of!(u16),
        "int16" => of!(i16),
        "uint32" => of!(u32),
        "int32" => of!(i32),
        "uint64" => of!(u64),
        "int64" => of!(i64),
        "float32" => of!(f32),
        "float64" => of!(f64),
        other => panic!("{other}"),
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

pub fn bzip2(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut out = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}
