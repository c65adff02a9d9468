//! Owns the voxels of a MetaImage: after the header, in one file or in several.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::header::Header;
use crate::format::raw::pattern;
use crate::format::raw::{self, Layout};
use crate::io::named;
use flate2::bufread::ZlibDecoder;
use std::io::BufRead;
use std::path::{Path, PathBuf};

pub fn read(header: &Header, layout: &Layout, path: &Path) -> Result<Vec<f32>> {
    let files = files(header, path)?;
    if files.is_empty() {
        return part(header, layout, path, Some(header.length));
    }
    let slab = raw::slab(layout, files.len()).ok_or_else(|| {
        Error::file(
            path,
            format!(
                "names {} files for {} slices, which they cannot share evenly",
                files.len(),
                layout.n[2]
            ),
            ADVICE,
        )
    })?;
    let parts = files.iter().map(|file| part(header, &slab, file, None));
    Ok(parts.collect::<Result<Vec<_>>>()?.concat())
}

/// The files that a header names, in its folder; none where the data follow it.
pub fn files(header: &Header, path: &Path) -> Result<Vec<PathBuf>> {
    let named = header.get("ElementDataFile").unwrap_or_default();
    let names = match named.split_whitespace().next() {
        Some(local) if local.eq_ignore_ascii_case("LOCAL") => return Ok(Vec::new()),
        Some("LIST") => header.listed.clone(),
        Some(_) => pattern::names(named).unwrap_or_else(|| vec![named.to_string()]),
        None => Vec::new(),
    };
    if names.is_empty() {
        return Err(Error::file(
            path,
            format!("ElementDataFile = {named} names no file"),
            ADVICE,
        ));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    Ok(names
        .iter()
        .map(|name| named::in_folder(folder, name))
        .collect())
}

/// The voxels in one file; `after`: the header's length, where they follow it. HeaderSize counts from the file's beginning.
fn part(header: &Header, layout: &Layout, path: &Path, after: Option<u64>) -> Result<Vec<f32>> {
    let (mut source, file_bytes) = raw::open_plain(path)?;
    let compressed = header.is_true("CompressedData");
    let text = header.is_false("BinaryData");
    let skip = match header.get("HeaderSize").map(str::parse::<i64>) {
        None | Some(Ok(0)) => after.unwrap_or(0),
        Some(Ok(-1)) if !compressed && !text => {
            let wanted = layout.sizes().map_or(0, |(_, bytes)| bytes as u64);
            file_bytes.saturating_sub(wanted)
        }
        Some(Ok(bytes)) if bytes > 0 => bytes as u64,
        Some(_) => {
            return Err(Error::file(
                path,
                format!(
                    "HeaderSize = {} is not read here: it should be the number of bytes before the data, or -1 for raw data",
                    header.get("HeaderSize").unwrap_or_default()
                ),
                ADVICE,
            ));
        }
    };
    raw::skip(&mut source, skip);
    match (text, compressed) {
        (true, true) => Err(Error::file(
            path,
            "says that its data are text and compressed, which no program writes",
            ADVICE,
        )),
        (true, false) => raw::read_text(&mut source, layout, path, file_bytes),
        // MetaIO's own decompression also takes gzip for zlib.
        (false, true) if source.fill_buf().is_ok_and(|b| b.starts_with(&raw::GZIP)) => {
            raw::read(&mut raw::gunzip(source), layout, path, file_bytes, true)
        }
        (false, true) => {
            let mut inflated = ZlibDecoder::new(source);
            raw::read(&mut inflated, layout, path, file_bytes, true)
        }
        (false, false) => raw::read(&mut source, layout, path, file_bytes, false),
    }
}
