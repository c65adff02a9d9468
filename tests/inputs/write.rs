//! A TIFF writer that shares nothing with the reader: every way to store a page, any tag.

use std::io::Write;

#[derive(Debug, Clone)]
pub enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Rational(u32, u32),
    Bytes(Vec<u8>),
    Ascii(Vec<u8>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Packing {
    None,
    Deflate,
    Lzw,
    PackBits,
    Zstandard,
}

#[derive(Debug, Clone)]
pub struct Page {
    pub width: usize,
    pub height: usize,
    pub bits: usize,
    /// 1 unsigned, 2 signed, 3 float.
    pub format: u16,
    /// In a pixel, interleaved.
    pub samples: usize,
    /// The bit pattern of each sample, row by row.
    pub values: Vec<u64>,
    pub packing: Packing,
    pub predictor: u16,
    pub reversed_bits: bool,
    pub rows_per_strip: usize,
    pub tile: Option<[usize; 2]>,
    pub photometric: u16,
    /// Tags beside those that the rest makes; they win.
    pub tags: Vec<(u16, Value)>,
}

impl Page {
    /// Grey values, 16 bits unless changed.
    pub fn grey(width: usize, height: usize, values: Vec<u64>) -> Page {
        Page {
            width,
            height,
            bits: 16,
            format: 1,
            samples: 1,
            values,
            packing: Packing::None,
            predictor: 1,
            reversed_bits: false,
            rows_per_strip: height,
            tile: None,
            photometric: 1,
            tags: Vec::new(),
        }
    }

    pub fn with(mut self, tag: u16, value: Value) -> Page {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, value));
        self
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Order {
    pub big_endian: bool,
    pub big_tiff: bool,
}

impl Order {
    fn number(self, value: u64, bytes: usize) -> Vec<u8> {
        match self.big_endian {
            true => value.to_be_bytes()[8 - bytes..].to_vec(),
            false => value.to_le_bytes()[..bytes].to_vec(),
        }
    }
}

/// A whole file.
pub fn tiff(pages: &[Page], order: Order) -> Vec<u8> {
    let word = if order.big_tiff { 8 } else { 4 };
    let mut out = if order.big_endian {
        b"MM".to_vec()
    } else {
        b"II".to_vec()
    };
    out.extend(order.number(if order.big_tiff { 43 } else { 42 }, 2));
    if order.big_tiff {
        out.extend(order.number(8, 2));
        out.extend(order.number(0, 2));
    }
    let mut link = out.len();
    out.extend(vec![0; word]);
    for page in pages {
        let (offsets, sizes): (Vec<u32>, Vec<u32>) = chunks(page, order)
            .into_iter()
            .map(|bytes| {
                let at = out.len() as u32;
                out.extend(&bytes);
                (at, bytes.len() as u32)
            })
            .unzip();
        let mut tags = own_tags(page, offsets, sizes);
        for (tag, value) in &page.tags {
            tags.retain(|(other, _)| other != tag);
            tags.push((*tag, value.clone()));
        }
        tags.sort_by_key(|(tag, _)| *tag);
        let entries: Vec<Vec<u8>> = tags
            .iter()
            .map(|(tag, value)| entry(*tag, value, order, &mut out))
            .collect();
        let here = order.number(out.len() as u64, word);
        out[link..link + word].copy_from_slice(&here);
        out.extend(order.number(entries.len() as u64, if order.big_tiff { 8 } else { 2 }));
        out.extend(entries.concat());
        link = out.len();
        out.extend(vec![0; word]);
    }
    out
}

fn own_tags(page: &Page, offsets: Vec<u32>, sizes: Vec<u32>) -> Vec<(u16, Value)> {
    let compression = match page.packing {
        Packing::None => 1,
        Packing::Deflate => 8,
        Packing::Lzw => 5,
        Packing::PackBits => 32773,
        Packing::Zstandard => 50000,
    };
    let each = |n: u16| Value::Short(vec![n; page.samples]);
    let mut tags = vec![
        (256, Value::Long(vec![page.width as u32])),
        (257, Value::Long(vec![page.height as u32])),
        (258, each(page.bits as u16)),
        (259, Value::Short(vec![compression])),
        (262, Value::Short(vec![page.photometric])),
        (266, Value::Short(vec![1 + u16::from(page.reversed_bits)])),
        (277, Value::Short(vec![page.samples as u16])),
        (317, Value::Short(vec![page.predictor])),
        (339, each(page.format)),
    ];
    tags.extend(match page.tile {
        None => vec![
            (273, Value::Long(offsets)),
            (278, Value::Long(vec![page.rows_per_strip as u32])),
            (279, Value::Long(sizes)),
        ],
        Some([width, height]) => vec![
            (322, Value::Long(vec![width as u32])),
            (323, Value::Long(vec![height as u32])),
            (324, Value::Long(offsets)),
            (325, Value::Long(sizes)),
        ],
    });
    tags
}

fn entry(tag: u16, value: &Value, order: Order, out: &mut Vec<u8>) -> Vec<u8> {
    let (kind, count, data) = match value {
        Value::Short(v) => (
            3,
            v.len(),
            v.iter()
                .flat_map(|n| order.number(u64::from(*n), 2))
                .collect(),
        ),
        Value::Long(v) => (
            4,
            v.len(),
            v.iter()
                .flat_map(|n| order.number(u64::from(*n), 4))
                .collect(),
        ),
        Value::Rational(a, b) => (
            5,
            1,
            [*a, *b]
                .iter()
                .flat_map(|n| order.number(u64::from(*n), 4))
                .collect(),
        ),
        Value::Bytes(v) => (1, v.len(), v.clone()),
        Value::Ascii(v) => (2, v.len() + 1, [&v[..], &[0]].concat()),
    };
    let word = if order.big_tiff { 8 } else { 4 };
    let mut field: Vec<u8> = data;
    if field.len() > word {
        let at = order.number(out.len() as u64, word);
        out.extend(&field);
        field = at;
    }
    field.resize(word, 0);
    [
        order.number(u64::from(tag), 2),
        order.number(kind, 2),
        order.number(count as u64, word),
        field,
    ]
    .concat()
}

/// Strips or tiles as they lie in the file.
fn chunks(page: &Page, order: Order) -> Vec<Vec<u8>> {
    let [width, height] = page.tile.unwrap_or([page.width, page.rows_per_strip]);
    let mut out = Vec::new();
    for y in (0..page.height).step_by(height) {
        for x in (0..page.width).step_by(width) {
            let rows = match page.tile {
                Some(_) => height,
                None => height.min(page.height - y),
            };
            let lines = (0..rows).map(|row| {
                let line = (0..width * page.samples).map(|i| {
                    let (column, row) = (x + i / page.samples, y + row);
                    match column < page.width && row < page.height {
                        true => {
                            page.values
                                [(row * page.width + column) * page.samples + i % page.samples]
                        }
                        false => 0,
                    }
                });
                self::row(&line.collect::<Vec<u64>>(), page, order)
            });
            let mut bytes = packed(page.packing, lines.collect::<Vec<_>>().concat());
            if page.reversed_bits {
                bytes.iter_mut().for_each(|b| *b = b.reverse_bits());
            }
            out.push(bytes);
        }
    }
    out
}

fn row(values: &[u64], page: &Page, order: Order) -> Vec<u8> {
    let bytes = page.bits / 8;
    if !page.bits.is_multiple_of(8) {
        let mut bits: Vec<bool> = values
            .iter()
            .flat_map(|v| (0..page.bits).rev().map(move |b| v >> b & 1 == 1))
            .collect();
        bits.resize(bits.len().div_ceil(8) * 8, false);
        let byte = |chunk: &[bool]| chunk.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
        return bits.chunks(8).map(byte).collect();
    }
    match page.predictor {
        3 => {
            let planes = (0..bytes)
                .rev()
                .flat_map(|b| values.iter().map(move |v| (v >> (8 * b)) as u8));
            let planes: Vec<u8> = planes.collect();
            let before = |i: usize| {
                if i < page.samples {
                    0
                } else {
                    planes[i - page.samples]
                }
            };
            (0..planes.len())
                .map(|i| planes[i].wrapping_sub(before(i)))
                .collect()
        }
        2 => {
            let before = |i: usize| {
                if i < page.samples {
                    0
                } else {
                    values[i - page.samples]
                }
            };
            let differences = (0..values.len()).map(|i| values[i].wrapping_sub(before(i)));
            differences
                .flat_map(|d| order.number(d & (u64::MAX >> (64 - page.bits)), bytes))
                .collect()
        }
        _ => values
            .iter()
            .flat_map(|v| order.number(*v, bytes))
            .collect(),
    }
}

fn packed(packing: Packing, bytes: Vec<u8>) -> Vec<u8> {
    match packing {
        Packing::None => bytes,
        Packing::Deflate => {
            let mut encoder =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(&bytes).unwrap();
            encoder.finish().unwrap()
        }
        Packing::Lzw => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8)
            .encode(&bytes)
            .unwrap(),
        Packing::PackBits => bytes
            .chunks(128)
            .flat_map(|part| {
                let run = part.len() > 1 && part.iter().all(|b| *b == part[0]);
                match run {
                    true => vec![(257 - part.len()) as u8, part[0]],
                    false => [&[part.len() as u8 - 1], part].concat(),
                }
            })
            .collect(),
        Packing::Zstandard => {
            // A frame of one segment with its size in four bytes, and one raw block.
            let size = bytes.len() as u32;
            let block = (1 | size << 3).to_le_bytes();
            [
                &[0x28, 0xB5, 0x2F, 0xFD, 0xA0][..],
                &size.to_le_bytes(),
                &block[..3],
                &bytes,
            ]
            .concat()
        }
    }
}
