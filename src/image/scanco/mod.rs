//! Owns Scanco's number formats, shared by AIM and ISQ.

pub mod aim;
pub mod isq;

/// A little-endian integer at `at`, or None past the end.
pub fn i32_at(bytes: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(
        bytes.get(at..at.checked_add(4)?)?.try_into().ok()?,
    ))
}

pub fn i64_at(bytes: &[u8], at: usize) -> Option<i64> {
    Some(i64::from_le_bytes(
        bytes.get(at..at.checked_add(8)?)?.try_into().ok()?,
    ))
}

/// A VAX F float: 16-bit words swapped, exponent two above IEEE's (bias 128 and a fraction from ½).
pub fn vax_f32(b: [u8; 4]) -> f32 {
    let bits = u32::from_le_bytes([b[2], b[3], b[0], b[1]]);
    // An exponent of 0 is zero whatever the rest.
    if bits & 0x7F80_0000 == 0 {
        0.0
    } else {
        f32::from_bits(bits) / 4.0
    }
}

/// A VAX G float: the same with 11 bits of exponent.
pub fn vax_f64(b: [u8; 8]) -> f64 {
    let bits = u64::from_le_bytes([b[6], b[7], b[4], b[5], b[2], b[3], b[0], b[1]]);
    if bits & 0x7FF0_0000_0000_0000 == 0 {
        0.0
    } else {
        f64::from_bits(bits) / 4.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of 1, −12.5 and 0.082 in VAX order, worked out from the format: sign, exponent + 128, fraction from ½.
    #[test]
    fn vax_floats_are_decoded() {
        assert_eq!(vax_f32([0x80, 0x40, 0, 0]), 1.0);
        assert_eq!(vax_f32([0x48, 0xC2, 0, 0]), -12.5);
        assert_eq!(vax_f32([0, 0, 1, 1]), 0.0);
        assert_eq!(vax_f64([0x10, 0x40, 0, 0, 0, 0, 0, 0]), 1.0);
        assert_eq!(vax_f64([0x49, 0xC0, 0, 0, 0, 0, 0, 0]), -12.5);
    }
}
