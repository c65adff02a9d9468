//! Damage of the kinds that files meet: cut off, bits flipped, sizes made extreme, text put where numbers were, another
//! format's bytes inside.

use proptest::prelude::*;
use proptest::sample::{Index, select};

/// One fault. An `Index` is a place relative to the length that is there when the fault is made.
#[derive(Debug, Clone)]
pub enum Damage {
    Cut(Place),
    Flip(Place, u8),
    Byte(Place, u8),
    Word(Place, usize, u64),
    Number(Place, &'static str),
    Remove(Place, usize),
    Repeat(Place, usize),
    Splice(Place, Index, usize),
    Append(u8, usize),
}

/// In the first bytes, where headers are, or anywhere.
#[derive(Debug, Clone)]
pub struct Place {
    header: bool,
    index: Index,
}

impl Place {
    fn reach(&self, bytes: &[u8]) -> usize {
        if self.header {
            bytes.len().min(600)
        } else {
            bytes.len()
        }
    }

    fn at(&self, bytes: &[u8]) -> usize {
        self.index.index(self.reach(bytes).max(1))
    }
}

fn place() -> impl Strategy<Value = Place> {
    (prop::bool::weighted(0.67), any::<Index>()).prop_map(|(header, index)| Place { header, index })
}

/// Numbers at the ends of the integer types, as files may claim them.
const EXTREMES: [u64; 9] = [
    0,
    1,
    0x7FFF,
    0xFFFF,
    0x7FFF_FFFF,
    0x8000_0000,
    u32::MAX as u64,
    i64::MAX as u64,
    u64::MAX,
];

const TEXTS: [&str; 11] = [
    "99999999999999999999",
    "18446744073709551615",
    "4294967295",
    "65536",
    "0",
    "-1",
    "nan",
    "inf",
    "1e308",
    "1e-320",
    "",
];

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        1 => place().prop_map(Damage::Cut),
        1 => (place(), 0..8u8).prop_map(|(p, bit)| Damage::Flip(p, bit)),
        1 => (place(), any::<u8>()).prop_map(|(p, v)| Damage::Byte(p, v)),
        3 => (place(), select(&[2usize, 4, 8][..]), select(&EXTREMES[..]))
            .prop_map(|(p, width, v)| Damage::Word(p, width, v)),
        3 => (place(), select(&TEXTS[..])).prop_map(|(p, text)| Damage::Number(p, text)),
        1 => (place(), 1..64usize).prop_map(|(p, n)| Damage::Remove(p, n)),
        1 => (place(), 1..64usize).prop_map(|(p, n)| Damage::Repeat(p, n)),
        1 => (place(), any::<Index>(), 1..96usize).prop_map(|(p, from, n)| Damage::Splice(p, from, n)),
        1 => (any::<u8>(), 1..64usize).prop_map(|(v, n)| Damage::Append(v, n)),
    ]
}

/// One to four faults in turn.
pub fn faults() -> impl Strategy<Value = Vec<Damage>> {
    prop::collection::vec(damage(), 1..=4)
}

/// `sound` with its faults; `other` is a file of another format to splice from.
pub fn damaged(sound: &[u8], faults: &[Damage], other: &[u8]) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    for fault in faults {
        if bytes.is_empty() {
            break;
        }
        apply(&mut bytes, fault, other);
    }
    bytes
}

fn apply(bytes: &mut Vec<u8>, fault: &Damage, other: &[u8]) {
    let stretch = |at: usize, n: usize| at..(at + n).min(bytes.len());
    match fault {
        Damage::Cut(place) => bytes.truncate(place.at(bytes)),
        Damage::Flip(place, bit) => {
            let at = place.at(bytes);
            bytes[at] ^= 1 << bit;
        }
        Damage::Byte(place, value) => {
            let at = place.at(bytes);
            bytes[at] = *value;
        }
        Damage::Word(place, width, value) => {
            // Fields of headers are aligned to their width more often than not.
            let range = stretch(place.at(bytes) / width * width, *width);
            let little = value.to_le_bytes();
            let n = range.len();
            bytes[range].copy_from_slice(&little[..n]);
        }
        Damage::Number(place, text) => {
            let reach = place.reach(bytes);
            let digit = |i: &usize| bytes[*i].is_ascii_digit();
            let starts: Vec<usize> = (0..reach)
                .filter(|i| digit(i) && (*i == 0 || !digit(&(i - 1))))
                .collect();
            if starts.is_empty() {
                return;
            }
            let from = starts[place.index.index(starts.len())];
            let length = (from..bytes.len()).take_while(digit).count();
            bytes.splice(from..from + length, text.bytes());
        }
        Damage::Remove(place, n) => {
            let range = stretch(place.at(bytes), *n);
            bytes.drain(range);
        }
        Damage::Repeat(place, n) => {
            let range = stretch(place.at(bytes), *n);
            let copy = bytes[range.clone()].to_vec();
            bytes.splice(range.start..range.start, copy);
        }
        Damage::Splice(place, from, n) => {
            let from = from.index(other.len().max(1));
            let piece = &other[from..(from + n).min(other.len())];
            let range = stretch(place.at(bytes), *n);
            bytes.splice(range, piece.iter().copied());
        }
        Damage::Append(value, n) => bytes.extend(std::iter::repeat_n(*value, *n)),
    }
}
