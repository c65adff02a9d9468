//! Owns the check that a TIFF file's directories ask for no more than the file holds. The decoder takes memory as an
//! entry's count says, before it reads: a damaged file of a few hundred bytes could ask for gigabytes.

use std::io::{BufReader, Read, Seek, SeekFrom};

/// More directories than this are no scan's (and a chain that bites its tail ends here).
const DIRECTORIES: usize = 100_000;

/// None if all entries of all directories lie within the file; else what is wrong. What is no TIFF at all is left to the
/// decoder to say.
pub fn fault(source: &mut (impl Read + Seek), bytes: u64) -> Option<String> {
    let mut walk = Walk {
        source: BufReader::new(source),
        bytes,
        big_endian: false,
        wide: false,
    };
    walk.directories().err()
}

struct Walk<R> {
    source: BufReader<R>,
    bytes: u64,
    big_endian: bool,
    /// BigTIFF: counts and offsets of 8 bytes.
    wide: bool,
}

type Step<T> = std::result::Result<T, String>;

impl<R: Read + Seek> Walk<R> {
    fn directories(&mut self) -> Step<()> {
        let mut order = [0u8; 2];
        if self.source.read_exact(&mut order).is_err() {
            return Ok(());
        }
        self.big_endian = &order == b"MM";
        self.wide = self.number(2)? == 43;
        if self.wide {
            self.number(4)?;
        }
        let word = if self.wide { 8 } else { 4 };
        let mut next = self.number(word)?;
        for _ in 0..DIRECTORIES {
            if next == 0 {
                return Ok(());
            }
            self.to(next)?;
            let entries = self.number(if self.wide { 8 } else { 2 })?;
            if entries > self.bytes / 12 {
                return Err(format!("a directory promises {entries} entries"));
            }
            for _ in 0..entries {
                self.entry(word)?;
            }
            next = self.number(word)?;
        }
        Err(format!("it has more than {DIRECTORIES} directories"))
    }

    /// Tag, type, count, and the values or where they are.
    fn entry(&mut self, word: usize) -> Step<()> {
        let (tag, kind, count) = (self.number(2)?, self.number(2)?, self.number(word)?);
        self.number(word)?;
        let size = match kind {
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16 | 17 | 18 => 8,
            _ => 1,
        };
        match count.checked_mul(size) {
            Some(needed) if needed <= self.bytes => Ok(()),
            _ => Err(format!(
                "tag {tag} promises {count} values, more than the file's {} bytes hold",
                self.bytes
            )),
        }
    }

    fn to(&mut self, offset: u64) -> Step<()> {
        let moved = self.source.seek(SeekFrom::Start(offset));
        moved.map(|_| ()).map_err(|e| e.to_string())
    }

    fn number(&mut self, width: usize) -> Step<u64> {
        let mut raw = [0u8; 8];
        self.source
            .read_exact(&mut raw[..width])
            .map_err(|_| "it ends inside a directory".to_owned())?;
        if self.big_endian {
            raw[..width].reverse();
        }
        Ok(u64::from_le_bytes(raw))
    }
}
