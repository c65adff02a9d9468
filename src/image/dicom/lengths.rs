//! Owns the check that a DICOM file's element lengths fit the file. The parser that reads it afterwards takes memory as
//! the lengths say, so a damaged one of a few hundred bytes could ask for gigabytes.

/// Nested sequences deeper than this are no image's.
const DEPTH: usize = 32;
const UNDEFINED: u32 = u32::MAX;
const ITEM: [u16; 2] = [0xFFFE, 0xE000];

/// None if all elements lie within `bytes`; else what is wrong.
pub fn fault(bytes: &[u8]) -> Option<String> {
    let mut walk = Walk {
        bytes,
        at: 132,
        implicit: false,
        big_endian: false,
        open: Vec::new(),
    };
    if bytes.get(128..132) != Some(b"DICM") {
        return Some("it does not hold the word DICM".into());
    }
    walk.meta().and_then(|()| walk.elements()).err()
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    implicit: bool,
    big_endian: bool,
    /// Ends of the sequences and items that are open; None where the length is undefined.
    open: Vec<Option<usize>>,
}

type Step<T> = std::result::Result<T, String>;

impl Walk<'_> {
    fn take<const N: usize>(&mut self) -> Step<[u8; N]> {
        let end = self.at + N;
        let found = self.bytes.get(self.at..end).and_then(|b| b.try_into().ok());
        self.at = end;
        found.ok_or_else(|| format!("it ends inside the element at byte {}", self.at - N))
    }

    fn short(&mut self) -> Step<u16> {
        let b = self.take()?;
        Ok(if self.big_endian {
            u16::from_be_bytes(b)
        } else {
            u16::from_le_bytes(b)
        })
    }

    fn long(&mut self) -> Step<u32> {
        let b = self.take()?;
        Ok(if self.big_endian {
            u32::from_be_bytes(b)
        } else {
            u32::from_le_bytes(b)
        })
    }

    fn tag(&mut self) -> Step<[u16; 2]> {
        Ok([self.short()?, self.short()?])
    }

    /// Length of the element whose tag was just taken, and whether it is said to be a sequence.
    fn length(&mut self, tag: [u16; 2]) -> Step<(u32, bool)> {
        if self.implicit || tag[0] == 0xFFFE {
            return Ok((self.long()?, false));
        }
        let vr: [u8; 2] = self.take()?;
        const SHORT: &[u8] = b"AEASATCSDADSDTFLFDISLOLTPNSHSLSSSTTMUIULUS";
        if SHORT.chunks_exact(2).any(|known| known == vr) {
            return Ok((u32::from(self.short()?), false));
        }
        self.take::<2>()?;
        Ok((self.long()?, &vr == b"SQ"))
    }

    fn skip(&mut self, length: u32) -> Step<()> {
        let start = self.at;
        self.at = self
            .at
            .checked_add(length as usize)
            .filter(|end| *end <= self.bytes.len())
            .ok_or_else(|| {
                format!(
                    "an element at byte {start} promises {length} bytes, more than the file holds"
                )
            })?;
        Ok(())
    }

    /// The meta group: explicit, little-endian, as long as its first element says.
    fn meta(&mut self) -> Step<()> {
        let mut promised = None;
        let mut syntax = String::new();
        while self.bytes.get(self.at..self.at + 2) == Some(&[2, 0]) {
            let tag = self.tag()?;
            let (length, _) = self.length(tag)?;
            let start = self.at;
            self.skip(length)?;
            let value = &self.bytes[start..self.at];
            match tag[1] {
                0 => {
                    promised = value
                        .try_into()
                        .ok()
                        .map(|b| self.at + u32::from_le_bytes(b) as usize)
                }
                0x10 => {
                    syntax = String::from_utf8_lossy(value)
                        .trim_end_matches(['\0', ' '])
                        .to_string()
                }
                _ => {}
            }
        }
        if promised != Some(self.at) {
            return Err("its meta information is not as long as it says".into());
        }
        self.implicit = syntax == "1.2.840.10008.1.2";
        self.big_endian = syntax == "1.2.840.10008.1.2.2";
        Ok(())
    }

    fn elements(&mut self) -> Step<()> {
        while self.at < self.bytes.len() {
            while self
                .open
                .last()
                .is_some_and(|end| end.is_some_and(|end| self.at >= end))
            {
                self.open.pop();
            }
            let tag = self.tag()?;
            let (length, sequence) = self.length(tag)?;
            match tag {
                [0xFFFE, 0xE00D | 0xE0DD] => {
                    self.open.pop();
                }
                [0x7FE0, 0x0010] if length == UNDEFINED => self.fragments()?,
                _ if tag == ITEM || sequence || length == UNDEFINED || self.item_follows() => {
                    self.enter(length)?
                }
                _ => self.skip(length)?,
            }
        }
        Ok(())
    }

    fn item_follows(&self) -> bool {
        let item: [u8; 4] = if self.big_endian {
            [0xFF, 0xFE, 0xE0, 0]
        } else {
            [0xFE, 0xFF, 0, 0xE0]
        };
        self.bytes.get(self.at..self.at + 4) == Some(&item)
    }

    fn enter(&mut self, length: u32) -> Step<()> {
        let end = if length == UNDEFINED {
            None
        } else {
            let start = self.at;
            self.skip(length)?;
            Some(std::mem::replace(&mut self.at, start))
        };
        self.open.push(end);
        match self.open.len() > DEPTH {
            true => Err("its sequences are nested too deeply".into()),
            false => Ok(()),
        }
    }

    /// Compressed pixels: items of raw bytes up to a delimiter.
    fn fragments(&mut self) -> Step<()> {
        while self.at < self.bytes.len() {
            let tag = self.tag()?;
            let length = self.long()?;
            if tag != ITEM {
                break;
            }
            self.skip(length)?;
        }
        Ok(())
    }
}
