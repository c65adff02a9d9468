//! Owns the voxels of an NRRD: in one file or several, skipped to, decompressed.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::header::Header;
use crate::format::raw::pattern;
use crate::format::raw::{self, Layout};
use crate::io::named;
use bzip2::bufread::MultiBzDecoder;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Raw,
    Text,
    Hex,
    Gzip,
    Bzip2,
}

pub fn read(header: &Header, layout: &Layout, path: &Path) -> Result<Vec<f32>> {
    let encoding = encoding(header, path)?;
    let files = files(header, path)?;
    if files.is_empty() {
        return part(header, encoding, layout, path, header.length);
    }
    let slab = raw::slab(layout, files.len()).ok_or_else(|| {
        Error::file(
            path,
            format!(
                "names {} files for {} × {} × {} voxels, which they cannot share evenly",
                files.len(),
                layout.n[0],
                layout.n[1],
                layout.n[2]
            ),
            ADVICE,
        )
    })?;
    let parts = files.iter().map(|f| part(header, encoding, &slab, f, 0));
    Ok(parts.collect::<Result<Vec<_>>>()?.concat())
}

/// The files that a header names, in its folder; none where the data follow it.
pub fn files(header: &Header, path: &Path) -> Result<Vec<PathBuf>> {
    let Some(named) = header.get("datafile") else {
        return Ok(Vec::new());
    };
    let names = match named.split_whitespace().next() {
        Some("LIST") => header.listed.clone(),
        _ => match pattern::names(named) {
            Some(names) => names,
            None => vec![named.to_string()],
        },
    };
    if names.is_empty() {
        return Err(Error::file(
            path,
            format!("names no data file in `{named}`"),
            ADVICE,
        ));
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    Ok(names
        .iter()
        .map(|name| named::in_folder(folder, name))
        .collect())
}

fn encoding(header: &Header, path: &Path) -> Result<Encoding> {
    let name = header.get("encoding").unwrap_or("missing");
    Ok(match name.to_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "txt" | "text" | "ascii" => Encoding::Text,
        "hex" => Encoding::Hex,
        "gzip" | "gz" => Encoding::Gzip,
        "bzip2" | "bz2" => Encoding::Bzip2,
        _ => {
            return Err(Error::file(
                path,
                format!("encoding `{name}` is not read"),
                "save it as raw or gzip",
            ));
        }
    })
}

/// The voxels in one file, `start` bytes after its beginning.
fn part(
    header: &Header,
    encoding: Encoding,
    layout: &Layout,
    path: &Path,
    start: u64,
) -> Result<Vec<f32>> {
    let (_, file_bytes) = raw::open_plain(path)?;
    let mut source = at_data(header, encoding, layout, path, start)?;
    match encoding {
        Encoding::Text => raw::read_text(&mut *source, layout, path, file_bytes),
        Encoding::Hex => {
            let bytes = from_hex(&mut *source, path)?;
            let held = bytes.len() as u64;
            raw::read(&mut Cursor::new(bytes), layout, path, held, false)
        }
        Encoding::Raw => raw::read(&mut *source, layout, path, file_bytes, false),
        Encoding::Gzip => raw::read(&mut *source, layout, path, file_bytes, true),
        Encoding::Bzip2 => raw::read_expanding(&mut *source, layout, path),
    }
}

/// The file's stream after what its header skips: lines as they are in the file, then decompressed bytes. A byte skip of -1
/// goes to the voxels at the end.
fn at_data(
    header: &Header,
    encoding: Encoding,
    layout: &Layout,
    path: &Path,
    start: u64,
) -> Result<Box<dyn Read>> {
    let (lines, bytes) = (
        skip(header, "lineskip", path)?,
        skip(header, "byteskip", path)?,
    );
    let binary = !matches!(encoding, Encoding::Text | Encoding::Hex);
    let wanted = layout.sizes().map_or(0, |(_, bytes)| bytes as u64);
    let mut source = stream(path, encoding, start, lines)?;
    let leading = match bytes {
        0.. if lines >= 0 => bytes as u64,
        -1 if lines >= 0 && binary => {
            let whole = length(&mut *stream(path, encoding, start, lines)?, path)?;
            whole.saturating_sub(wanted)
        }
        _ => {
            return Err(Error::file(
                path,
                format!(
                    "line skip {lines} and byte skip {bytes} are not read: the least are 0 and, for binary data, -1"
                ),
                "give the number of lines and bytes before the data",
            ));
        }
    };
    raw::skip(&mut *source, leading);
    Ok(source)
}

fn skip(header: &Header, key: &str, path: &Path) -> Result<i64> {
    let Some(word) = header.get(key) else {
        return Ok(0);
    };
    word.parse().map_err(|_| {
        Error::file(
            path,
            format!("has a {key} of `{word}`, which is no whole number"),
            ADVICE,
        )
    })
}

/// The data after `start` bytes and `lines` lines, decompressed.
fn stream(path: &Path, encoding: Encoding, start: u64, lines: i64) -> Result<Box<dyn Read>> {
    let (mut source, _): (BufReader<File>, u64) = raw::open_plain(path)?;
    raw::skip(&mut source, start);
    for _ in 0..lines {
        let mut line = Vec::new();
        let got = source
            .read_until(b'\n', &mut line)
            .map_err(|e| Error::file(path, format!("its lines cannot be skipped: {e}"), ADVICE))?;
        if got == 0 {
            return Err(Error::file(
                path,
                format!("has fewer than the {lines} lines to be skipped"),
                ADVICE,
            ));
        }
    }
    Ok(match encoding {
        Encoding::Gzip => Box::new(raw::gunzip(source)),
        Encoding::Bzip2 => Box::new(MultiBzDecoder::new(source)),
        _ => Box::new(source),
    })
}

fn length(source: &mut dyn Read, path: &Path) -> Result<u64> {
    std::io::copy(source, &mut std::io::sink())
        .map_err(|e| Error::file(path, format!("its data are damaged: {e}"), ADVICE))
}

fn from_hex(source: &mut dyn Read, path: &Path) -> Result<Vec<u8>> {
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let mut digits = Vec::new();
    let mut text = Vec::new();
    source
        .read_to_end(&mut text)
        .map_err(|e| wrong(format!("its data cannot be read: {e}")))?;
    for c in text.into_iter().filter(|c| !c.is_ascii_whitespace()) {
        let digit = char::from(c).to_digit(16);
        digits.push(digit.ok_or_else(|| wrong("its hex data hold other characters".into()))? as u8);
    }
    Ok(digits.chunks_exact(2).map(|d| 16 * d[0] + d[1]).collect())
}
