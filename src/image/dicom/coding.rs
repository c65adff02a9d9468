//! Owns how pixels of a frame are stored and what the stored numbers mean: bits, sign, a line or a table.

/// How one sample is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coding {
    /// 1 or 2.
    pub bytes: usize,
    /// Bits that count, and the highest of them; others may hold overlays.
    pub stored: u32,
    pub high: u32,
    pub signed: bool,
}

impl Coding {
    /// The stored number in the low bits of `word`.
    fn number(&self, word: u16) -> i32 {
        let up = word << (15 - self.high);
        match self.signed {
            true => i32::from((up as i16) >> (16 - self.stored)),
            false => i32::from(up >> (16 - self.stored)),
        }
    }
}

/// From stored numbers to values.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub slope: f64,
    pub intercept: f64,
    pub table: Option<Table>,
    pub unit: Option<String>,
}

/// Values by stored number from `first` on; numbers outside take the table's ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub first: i32,
    pub values: Vec<f32>,
}

impl Scale {
    pub fn value(&self, number: f64) -> f32 {
        match &self.table {
            Some(table) => table.value(number as i32),
            None => (self.slope * number + self.intercept) as f32,
        }
    }
}

impl Table {
    fn value(&self, number: i32) -> f32 {
        let last = self.values.len() - 1;
        let at = number.saturating_sub(self.first).max(0) as usize;
        self.values[at.min(last)]
    }
}

/// Values of a frame from its stored bytes.
pub fn convert(stored: &[u8], coding: &Coding, big_endian: bool, scale: &Scale, out: &mut [f32]) {
    let word = |b: &[u8]| match (b, big_endian) {
        ([low], _) => u16::from(*low),
        ([low, high], false) | ([high, low], true) => u16::from_le_bytes([*low, *high]),
        _ => 0,
    };
    let numbers = stored
        .chunks_exact(coding.bytes)
        .map(|b| coding.number(word(b)));
    let each = out.iter_mut().zip(numbers);
    match (&scale.table, scale.slope, scale.intercept) {
        (Some(table), ..) => each.for_each(|(out, v)| *out = table.value(v)),
        (None, 1.0, 0.0) => each.for_each(|(out, v)| *out = v as f32),
        (None, slope, intercept) => {
            each.for_each(|(out, v)| *out = (slope * f64::from(v) + intercept) as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_stored_bits_count_and_the_highest_is_the_sign() {
        let coding = |stored, high, signed| Coding {
            bytes: 2,
            stored,
            high,
            signed,
        };
        assert_eq!(coding(12, 11, false).number(0xF123), 0x123);
        assert_eq!(coding(12, 11, true).number(0x0FFF), -1);
        assert_eq!(coding(12, 15, true).number(0xFFF7), -1);
        assert_eq!(coding(16, 15, true).number(0x8000), -32768);
        assert_eq!(coding(8, 7, true).number(0x80), -128);
    }
}
