//! Owns the bytes of a DICOM file: its elements and sequences, as slices of what was read. Nothing is copied, so lengths that
//! lie take no memory; all of them are held to the file's end.
//!
//! Read are: implicit and explicit VR, both byte orders, deflated files, files without preamble or without meta information,
//! VR UN whose items are implicit (PS3.5, 6.2.2), sequences and items of defined and undefined length. Reading ends with the
//! pixels: what comes after is padding or a signature.

use super::elements::{PIXEL_DATA, Set, Tag, Value};
use flate2::read::DeflateDecoder;
use std::io::Read;

/// Nested sequences deeper than this are no image's.
const DEPTH: usize = 32;
const UNDEFINED: u32 = u32::MAX;
const ITEM: Tag = [0xFFFE, 0xE000];
const ITEM_END: Tag = [0xFFFE, 0xE00D];
const SEQUENCE_END: Tag = [0xFFFE, 0xE0DD];

const IMPLICIT: &str = "1.2.840.10008.1.2";
const BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";
const EXPLICIT: &str = "1.2.840.10008.1.2.1";

/// VRs whose length has two bytes.
const SHORT: &[u8] = b"AEASATCSDADSDTFLFDISLOLTPNSHSLSSSTTMUIULUS";
const LONG: &[u8] = b"OBODOFOLOVOWSQSVUCUNURUTUV";

type Step<T> = Result<T, String>;

/// The elements of a file, and how they and the pixels are coded.
#[derive(Debug)]
pub struct Data {
    bytes: Vec<u8>,
    from: usize,
    pub syntax: String,
}

impl Data {
    /// # Errors
    /// In words: what is wrong with the file as DICOM.
    pub fn new(bytes: Vec<u8>) -> Step<Data> {
        let start = match bytes.get(128..132) {
            Some(b"DICM") => 132,
            _ if without_preamble(&bytes) => 0,
            _ => {
                return Err(
                    "it does not hold the word DICM, nor does it begin with elements".into(),
                );
            }
        };
        let (from, syntax) = meta(&bytes, start)?;
        let data = Data {
            syntax: syntax.unwrap_or_else(|| guessed(&bytes[from.min(bytes.len())..]).into()),
            bytes,
            from,
        };
        if data.syntax != DEFLATED {
            return Ok(data);
        }
        let mut inflated = Vec::new();
        DeflateDecoder::new(&data.bytes[data.from..])
            .read_to_end(&mut inflated)
            .map_err(|e| format!("its deflated elements are damaged ({e})"))?;
        Ok(Data {
            bytes: inflated,
            from: 0,
            ..data
        })
    }

    pub fn elements(&self) -> Step<Set<'_>> {
        let mut walk = Walk {
            bytes: &self.bytes,
            at: self.from,
            end: self.bytes.len(),
            implicit: self.syntax == IMPLICIT,
            big_endian: self.syntax == BIG_ENDIAN,
            depth: 0,
        };
        walk.set(false)
    }

    pub fn is_compressed(&self) -> bool {
        ![IMPLICIT, EXPLICIT, BIG_ENDIAN, DEFLATED].contains(&self.syntax.as_str())
    }
}

/// Whether a file without DICM begins as a data set does: with meta information or the group of identification.
pub fn without_preamble(bytes: &[u8]) -> bool {
    let Some(head) = bytes.get(..8) else {
        return false;
    };
    let group = u16::from_le_bytes([head[0], head[1]]);
    let element = u16::from_le_bytes([head[2], head[3]]);
    let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    let explicit = is_vr(&[head[4], head[5]]);
    matches!((group, element), (2, 0..=0x16) | (8, 0..=0x18)) && (explicit || length < 256)
}

fn is_vr(vr: &[u8; 2]) -> bool {
    let known = |list: &[u8]| list.chunks_exact(2).any(|known| known == vr);
    known(SHORT) || known(LONG)
}

/// Without meta information the first element shows its VR, or has none.
fn guessed(bytes: &[u8]) -> &'static str {
    match bytes.get(4..6) {
        Some(&[a, b]) if is_vr(&[a, b]) => EXPLICIT,
        _ => IMPLICIT,
    }
}

/// End of the meta information, which is explicit and little-endian, and the transfer syntax that it names.
fn meta(bytes: &[u8], start: usize) -> Step<(usize, Option<String>)> {
    let mut walk = Walk {
        bytes,
        at: start,
        end: bytes.len(),
        implicit: false,
        big_endian: false,
        depth: 0,
    };
    let mut syntax = None;
    while bytes.get(walk.at..walk.at + 2) == Some(&[2, 0]) {
        let tag = walk.tag()?;
        let (_, length) = walk.length(tag)?;
        let value = walk.take(length)?;
        if tag == [2, 0x10] {
            let text = String::from_utf8_lossy(value);
            syntax = Some(text.trim_matches(['\0', ' ']).to_string());
        }
    }
    Ok((walk.at, syntax))
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    end: usize,
    implicit: bool,
    big_endian: bool,
    depth: usize,
}

impl<'a> Walk<'a> {
    fn word<const N: usize>(&mut self) -> Step<[u8; N]> {
        let start = self.at;
        let found = self.bytes[..self.end].get(start..start + N);
        let word = found.and_then(|b| b.try_into().ok());
        self.at = start + N;
        word.ok_or_else(|| format!("it ends inside the element at byte {start}"))
    }

    fn short(&mut self) -> Step<u16> {
        let b = self.word()?;
        Ok(match self.big_endian {
            true => u16::from_be_bytes(b),
            false => u16::from_le_bytes(b),
        })
    }

    fn long(&mut self) -> Step<u32> {
        let b = self.word()?;
        Ok(match self.big_endian {
            true => u32::from_be_bytes(b),
            false => u32::from_le_bytes(b),
        })
    }

    fn tag(&mut self) -> Step<Tag> {
        Ok([self.short()?, self.short()?])
    }

    /// VR (zeros where it is not written) and length of the element whose tag was just read.
    fn length(&mut self, tag: Tag) -> Step<([u8; 2], u32)> {
        if self.implicit || tag[0] == 0xFFFE {
            return Ok(([0; 2], self.long()?));
        }
        let vr: [u8; 2] = self.word()?;
        if SHORT.chunks_exact(2).any(|known| known == vr) {
            return Ok((vr, u32::from(self.short()?)));
        }
        self.word::<2>()?;
        Ok((vr, self.long()?))
    }

    fn take(&mut self, length: u32) -> Step<&'a [u8]> {
        let start = self.at;
        let end = start.checked_add(length as usize);
        let Some(end) = end.filter(|end| *end <= self.end) else {
            return Err(format!(
                "an element at byte {start} promises {length} bytes, more than the file holds"
            ));
        };
        self.at = end;
        Ok(&self.bytes[start..end])
    }

    /// Elements up to the end, or up to the end of an item of undefined length.
    fn set(&mut self, open: bool) -> Step<Set<'a>> {
        let mut set = Set {
            elements: Vec::new(),
            big_endian: self.big_endian,
        };
        while self.at < self.end {
            let tag = self.tag()?;
            let (vr, length) = self.length(tag)?;
            if tag == ITEM_END && open {
                return Ok(set);
            }
            if tag[0] == 0xFFFE {
                return Err(format!(
                    "an item begins or ends out of place at byte {}",
                    self.at
                ));
            }
            let value = self.value(tag, vr, length)?;
            set.elements.push((tag, value));
            if self.depth == 0 && (tag == PIXEL_DATA || tag[0] == 0x7FE0 && tag[1] < 0x10) {
                return Ok(set);
            }
        }
        match open {
            true => Err("it ends inside an item".into()),
            false => Ok(set),
        }
    }

    fn value(&mut self, tag: Tag, vr: [u8; 2], length: u32) -> Step<Value<'a>> {
        if tag == PIXEL_DATA && length == UNDEFINED {
            return self.fragments().map(Value::Fragments);
        }
        if length == UNDEFINED || &vr == b"SQ" {
            return self.sequence(&vr == b"UN", length).map(Value::Items);
        }
        let start = self.at;
        let bytes = self.take(length)?;
        let untyped = vr == [0; 2] || &vr == b"UN";
        if untyped && bytes.starts_with(&[0xFE, 0xFF, 0x00, 0xE0]) {
            let end = std::mem::replace(&mut self.at, start);
            let items = self.sequence(&vr == b"UN", length);
            // Bytes that only begin as an item does are no sequence.
            self.at = end;
            return Ok(items.map_or(Value::Bytes(bytes), Value::Items));
        }
        Ok(Value::Bytes(bytes))
    }

    /// Items; those of VR UN have implicit VRs, whatever the file has.
    fn sequence(&mut self, unknown: bool, length: u32) -> Step<Vec<Set<'a>>> {
        if self.depth == DEPTH {
            return Err("its sequences are nested too deeply".into());
        }
        let start = self.at;
        let end = match length {
            UNDEFINED => self.end,
            length => {
                self.take(length)?;
                self.at
            }
        };
        let mut inner = Walk {
            at: start,
            end,
            implicit: self.implicit || unknown,
            big_endian: self.big_endian && !unknown,
            depth: self.depth + 1,
            ..*self
        };
        let mut items = Vec::new();
        while inner.at < end {
            let tag = inner.tag()?;
            let length = inner.long()?;
            match (tag, length) {
                (SEQUENCE_END, _) => break,
                (ITEM, UNDEFINED) => items.push(inner.set(true)?),
                (ITEM, length) => {
                    let from = inner.at;
                    inner.take(length)?;
                    let to = inner.at;
                    let mut item = Walk {
                        at: from,
                        end: to,
                        ..inner
                    };
                    items.push(item.set(false)?);
                }
                _ => return Err(format!("an item was expected at byte {}", inner.at - 8)),
            }
        }
        self.at = inner.at;
        Ok(items)
    }

    /// Items of raw bytes up to a delimiter.
    fn fragments(&mut self) -> Step<Vec<&'a [u8]>> {
        let mut fragments = Vec::new();
        while self.at < self.end {
            let tag = self.tag()?;
            let length = self.long()?;
            if tag != ITEM {
                break;
            }
            fragments.push(self.take(length)?);
        }
        Ok(fragments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element with an explicit VR of short length.
    fn element(tag: Tag, vr: &[u8; 2], value: &[u8]) -> Vec<u8> {
        let head = [tag[0].to_le_bytes(), tag[1].to_le_bytes(), *vr].concat();
        [&head, &(value.len() as u16).to_le_bytes()[..], value].concat()
    }

    fn implicit(tag: Tag, value: &[u8]) -> Vec<u8> {
        let head = [tag[0].to_le_bytes(), tag[1].to_le_bytes()].concat();
        [&head, &(value.len() as u32).to_le_bytes()[..], value].concat()
    }

    #[test]
    fn un_holds_implicit_items_of_defined_and_undefined_length() {
        let item = [implicit(ITEM, &implicit([0x28, 0x1053], b"2 ")), Vec::new()].concat();
        let open = [
            &[0xFE, 0xFF, 0x00, 0xE0, 0xFF, 0xFF, 0xFF, 0xFF][..],
            &implicit([0x28, 0x1053], b"3 "),
            &implicit(ITEM_END, b""),
            &implicit(SEQUENCE_END, b""),
        ]
        .concat();
        let un = |length: u32, value: &[u8]| {
            let head = [&[9, 0, 1, 0][..], b"UN\0\0", &length.to_le_bytes()].concat();
            [&head, value].concat()
        };
        let name = element([8, 5], b"CS", b"ISO_IR 100");
        for (value, expected) in [
            (un(item.len() as u32, &item), 2.0),
            (un(UNDEFINED, &open), 3.0),
        ] {
            let file = [name.clone(), value, element([0x28, 0x10], b"US", &[7, 0])].concat();
            let data = Data::new(file).unwrap();
            let set = data.elements().unwrap();
            let inner = set.item([9, 1]).unwrap();
            assert_eq!(inner.decimal([0x28, 0x1053]), Some(expected));
            assert_eq!(set.short([0x28, 0x10]), Some(7));
        }
    }

    #[test]
    fn lengths_beyond_the_file_are_refused() {
        let mut file = element([8, 5], b"CS", b"ISO_IR 100");
        file.extend([8, 0, 0x70, 0, b'U', b'T', 0, 0, 0, 0, 0, 0x70]);
        let data = Data::new(file).unwrap();
        let e = data.elements().unwrap_err();
        assert!(e.contains("promises 1879048192 bytes"), "{e}");
    }
}
