//! JPEG lossless (ITU-T T.81, process 14, first-order prediction) of one component.

/// Bits, most significant first; a byte of ones is followed by a zero one.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    open: u32,
    count: u32,
}

impl Bits {
    fn push(&mut self, value: u32, count: u32) {
        for k in (0..count).rev() {
            self.open = self.open << 1 | (value >> k & 1);
            self.count += 1;
            if self.count == 8 {
                self.bytes.push(self.open as u8);
                if self.open == 0xFF {
                    self.bytes.push(0);
                }
                (self.open, self.count) = (0, 0);
            }
        }
    }
}

/// Samples of `precision` bits, row by row.
pub fn lossless(samples: &[u16], [columns, rows]: [u16; 2], precision: u8) -> Vec<u8> {
    let mut out = vec![0xFF, 0xD8];
    // 17 categories of differences, codes of five bits each.
    out.extend([0xFF, 0xC4, 0, 36, 0]);
    out.extend((1..=16).map(|length| if length == 5 { 17 } else { 0 }));
    out.extend(0..17);
    out.extend([0xFF, 0xC3, 0, 11, precision]);
    out.extend([rows.to_be_bytes(), columns.to_be_bytes()].concat());
    out.extend([1, 1, 0x11, 0]);
    out.extend([0xFF, 0xDA, 0, 8, 1, 1, 0, 1, 0, 0]);
    let width = usize::from(columns);
    let mut bits = Bits::default();
    for (i, &sample) in samples.iter().enumerate() {
        let predicted = match (i % width, i / width) {
            (0, 0) => 1 << (precision - 1),
            (0, _) => samples[i - width],
            _ => samples[i - 1],
        };
        let difference = i32::from(sample.wrapping_sub(predicted) as i16);
        let category = 32 - difference.unsigned_abs().leading_zeros();
        bits.push(category, 5);
        let extra = if difference < 0 {
            difference - 1
        } else {
            difference
        };
        if category < 16 {
            bits.push(extra as u32, category);
        }
    }
    bits.push(0x7F, (8 - bits.count) % 8);
    out.extend(bits.bytes);
    out.extend([0xFF, 0xD9]);
    if out.len() % 2 == 1 {
        out.push(0);
    }
    out
}
