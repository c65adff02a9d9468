//! DICOM files, element by element, in any of the uncompressed transfer syntaxes and RLE.

/// The value of an element.
#[derive(Clone, Debug)]
pub enum Value {
    Text(String),
    Short(Vec<u16>),
    Bytes(Vec<u8>),
    Items(Vec<Vec<Element>>),
    /// The table of offsets and fragments of compressed pixels.
    Fragments(Vec<Vec<u8>>),
}

#[derive(Clone, Debug)]
pub struct Element {
    pub tag: [u16; 2],
    pub vr: &'static str,
    pub value: Value,
}

pub fn text(tag: [u16; 2], vr: &'static str, value: impl ToString) -> Element {
    let value = Value::Text(value.to_string());
    Element { tag, vr, value }
}

pub fn short(tag: [u16; 2], value: u16) -> Element {
    Element {
        tag,
        vr: "US",
        value: Value::Short(vec![value]),
    }
}

pub fn items(tag: [u16; 2], items: Vec<Vec<Element>>) -> Element {
    Element {
        tag,
        vr: "SQ",
        value: Value::Items(items),
    }
}

pub fn pixels(words: &[u16]) -> Element {
    Element {
        tag: [0x7FE0, 0x10],
        vr: "OW",
        value: Value::Short(words.to_vec()),
    }
}

pub fn decimals<const N: usize>(values: [f64; N]) -> String {
    values.map(|v| v.to_string()).join("\\")
}

/// How elements become bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Syntax {
    pub implicit: bool,
    pub big_endian: bool,
    pub deflated: bool,
    pub rle: bool,
    /// Sequences and items of undefined length.
    pub open: bool,
    /// Sequences with VR UN, their items implicit.
    pub unknown: bool,
    pub preamble: bool,
    pub meta: bool,
    /// Zeros after the pixels.
    pub padded: bool,
}

pub const EXPLICIT: Syntax = Syntax {
    implicit: false,
    big_endian: false,
    deflated: false,
    rle: false,
    open: false,
    unknown: false,
    preamble: true,
    meta: true,
    padded: false,
};

impl Syntax {
    fn uid(&self) -> &'static str {
        match (self.implicit, self.big_endian, self.deflated, self.rle) {
            (_, _, _, true) => "1.2.840.10008.1.2.5",
            (true, ..) => "1.2.840.10008.1.2",
            (_, true, ..) => "1.2.840.10008.1.2.2",
            (_, _, true, _) => "1.2.840.10008.1.2.1.99",
            _ => "1.2.840.10008.1.2.1",
        }
    }

    fn u16(&self, v: u16) -> [u8; 2] {
        if self.big_endian {
            v.to_be_bytes()
        } else {
            v.to_le_bytes()
        }
    }

    fn u32(&self, v: u32) -> [u8; 4] {
        if self.big_endian {
            v.to_be_bytes()
        } else {
            v.to_le_bytes()
        }
    }

    fn tag(&self, tag: [u16; 2]) -> Vec<u8> {
        [self.u16(tag[0]), self.u16(tag[1])].concat()
    }

    fn head(&self, tag: [u16; 2], vr: &str, length: u32) -> Vec<u8> {
        let mut out = self.tag(tag);
        let long = ["OB", "OW", "SQ", "UN", "OF", "OD"].contains(&vr);
        match (self.implicit, long) {
            (true, _) => out.extend(self.u32(length)),
            (false, true) => {
                out.extend(vr.as_bytes());
                out.extend([0, 0]);
                out.extend(self.u32(length));
            }
            (false, false) => {
                out.extend(vr.as_bytes());
                out.extend(self.u16(length as u16));
            }
        }
        out
    }

    fn element(&self, element: &Element) -> Vec<u8> {
        let Element { tag, vr, value } = element;
        let bytes = match value {
            Value::Text(text) => {
                let mut bytes = text.clone().into_bytes();
                if bytes.len() % 2 == 1 {
                    bytes.push(if *vr == "UI" { 0 } else { b' ' });
                }
                bytes
            }
            Value::Short(words) => words.iter().flat_map(|w| self.u16(*w)).collect(),
            Value::Bytes(bytes) => bytes.clone(),
            Value::Items(items) => return self.sequence(*tag, items),
            Value::Fragments(parts) => {
                let mut out = self.head(*tag, "OB", u32::MAX);
                for part in parts {
                    out.extend(self.tag([0xFFFE, 0xE000]));
                    out.extend(self.u32(part.len() as u32));
                    out.extend(part);
                }
                out.extend(self.tag([0xFFFE, 0xE0DD]));
                out.extend(self.u32(0));
                return out;
            }
        };
        [self.head(*tag, vr, bytes.len() as u32), bytes].concat()
    }

    fn sequence(&self, tag: [u16; 2], items: &[Vec<Element>]) -> Vec<u8> {
        let unknown = self.unknown && !self.implicit;
        let inner = Syntax {
            implicit: self.implicit || unknown,
            ..*self
        };
        let mut body = Vec::new();
        for item in items {
            let content: Vec<u8> = item.iter().flat_map(|e| inner.element(e)).collect();
            body.extend(self.tag([0xFFFE, 0xE000]));
            let length = if self.open {
                u32::MAX
            } else {
                content.len() as u32
            };
            body.extend(self.u32(length));
            body.extend(content);
            if self.open {
                body.extend(self.tag([0xFFFE, 0xE00D]));
                body.extend(self.u32(0));
            }
        }
        if self.open {
            body.extend(self.tag([0xFFFE, 0xE0DD]));
            body.extend(self.u32(0));
        }
        let length = if self.open {
            u32::MAX
        } else {
            body.len() as u32
        };
        let vr = if unknown { "UN" } else { "SQ" };
        [self.head(tag, vr, length), body].concat()
    }

    pub fn file(&self, elements: &[Element]) -> Vec<u8> {
        let mut sorted = elements.to_vec();
        sorted.sort_by_key(|e| e.tag);
        let mut body: Vec<u8> = sorted.iter().flat_map(|e| self.element(e)).collect();
        if self.padded {
            body.extend([0; 46]);
        }
        if self.deflated {
            use std::io::Write;
            let mut out =
                flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::fast());
            out.write_all(&body).unwrap();
            body = out.finish().unwrap();
        }
        let plain = Syntax {
            meta: false,
            ..EXPLICIT
        };
        let syntax = text([2, 0x10], "UI", self.uid());
        let meta = match self.meta {
            true => plain.element(&syntax),
            false => Vec::new(),
        };
        let length = Element {
            tag: [2, 0],
            vr: "UL",
            value: Value::Bytes((meta.len() as u32).to_le_bytes().to_vec()),
        };
        let group = match self.meta {
            true => [plain.element(&length), meta].concat(),
            false => Vec::new(),
        };
        let preamble = match self.preamble {
            true => [vec![0; 128], b"DICM".to_vec()].concat(),
            false => Vec::new(),
        };
        [preamble, group, body].concat()
    }
}

/// One frame of 16-bit samples in RLE (PS3.5, annex G), all of it literals and runs.
pub fn rle(words: &[u16]) -> Vec<u8> {
    let pack = |bytes: Vec<u8>| {
        let mut out = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let run = bytes[at..]
                .iter()
                .take_while(|b| **b == bytes[at])
                .count()
                .min(128);
            if run > 1 {
                out.extend([(257 - run) as u8, bytes[at]]);
            } else {
                out.extend([0, bytes[at]]);
            }
            at += run;
        }
        if out.len() % 2 == 1 {
            out.push(128);
        }
        out
    };
    let high = pack(words.iter().map(|w| (w >> 8) as u8).collect());
    let low = pack(words.iter().map(|w| *w as u8).collect());
    let mut head = vec![0u8; 64];
    head[0] = 2;
    head[4..8].copy_from_slice(&64u32.to_le_bytes());
    head[8..12].copy_from_slice(&(64 + high.len() as u32).to_le_bytes());
    [head, high, low].concat()
}

/// A CT slice of `columns × rows` at `position`, without its pixels.
pub fn slice([columns, rows]: [u16; 2], position: [f64; 3], number: usize) -> Vec<Element> {
    vec![
        text([8, 0x16], "UI", "1.2.840.10008.5.1.4.1.1.2"),
        text([8, 0x60], "CS", "CT"),
        text([0x10, 0x10], "PN", "Doe-Zwiebelfisch"),
        text([0x20, 0xE], "UI", "1.2.3"),
        text([0x20, 0x13], "IS", number),
        text([0x20, 0x32], "DS", decimals(position)),
        text([0x20, 0x37], "DS", "1\\0\\0\\0\\1\\0"),
        short([0x28, 2], 1),
        text([0x28, 4], "CS", "MONOCHROME2"),
        short([0x28, 0x10], rows),
        short([0x28, 0x11], columns),
        text([0x28, 0x30], "DS", "0.05\\0.04"),
        short([0x28, 0x100], 16),
        short([0x28, 0x101], 16),
        short([0x28, 0x102], 15),
        short([0x28, 0x103], 1),
    ]
}

/// Puts an element in place of another of its tag, or adds it.
pub fn set(elements: &mut Vec<Element>, element: Element) {
    elements.retain(|e| e.tag != element.tag);
    elements.push(element);
}
