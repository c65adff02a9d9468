//! Owns Scanco ISQ: 512-byte header, optional extended header with calibration, 16-bit voxels. The patient's name in
//! the header is not taken over.

use crate::error::{Error, Result};
use crate::format::calibration::Calibration;
use crate::format::raw;
use crate::format::raw::{Layout, Scalar};
use crate::image::scanco::{i32_at, vax_f64};
use crate::image::stored::Stored;
use std::path::Path;

const ADVICE: &str = "the file is truncated or no ISQ: copy it again in binary mode";

pub fn read(path: &Path) -> Result<Stored> {
    let bytes = raw::head(path, 1 << 20)?;
    let broken = |found: &str| Error::file(path, found, ADVICE);
    if !bytes.starts_with(b"CTDATA-HEADER_V1") {
        return Err(broken("is no ISQ: it does not begin with CTDATA-HEADER_V1"));
    }
    let int = |at: usize| {
        i32_at(&bytes, at).ok_or_else(|| broken("its header of 512 bytes is incomplete"))
    };
    let n = [int(44)?, int(48)?, int(52)?];
    let um = [int(56)?, int(60)?, int(64)?];
    let blocks = int(508)?;
    if n.iter().chain(&um).any(|v| *v <= 0) || blocks < 0 {
        return Err(broken(&format!(
            "has unusable dimensions: {n:?} voxels, {um:?} µm"
        )));
    }
    let n = n.map(|v| v as usize);
    let layout = Layout {
        scalar: Scalar::I16,
        big_endian: false,
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let (mut source, file_bytes, _) = raw::open(path)?;
    let data_at = 512 * (blocks as u64 + 1);
    raw::skip(&mut *source, data_at);
    let values = raw::read(
        &mut *source,
        &layout,
        path,
        file_bytes.saturating_sub(data_at),
        false,
    )?;
    let extended = bytes
        .get(512..(data_at as usize).min(bytes.len()))
        .unwrap_or_default();
    let calibration = calibration(f64::from(int(88)?), extended);
    Ok(Stored {
        format: "Scanco ISQ, int16".into(),
        n,
        values,
        // The slice thickness in the header is rounded to µm: extent over count is not.
        spacing_mm: Some(std::array::from_fn(|a| {
            (f64::from(um[a]) / n[a] as f64 * 1e3).round() / 1e6
        })),
        calibration: Some(calibration),
        details: calibration.details(),
        ..Stored::default()
    })
}

/// Constants stand at fixed distances behind the word `Calibration` of the extended header.
fn calibration(mu_scaling: f64, extended: &[u8]) -> Calibration {
    let start = extended
        .windows(11)
        .position(|w| w == b"Calibration")
        .and_then(|at| at.checked_sub(8));
    let number = |offset: usize| {
        let at = start? + offset;
        let value = vax_f64(extended.get(at..at + 8)?.try_into().ok()?);
        (value.is_finite() && value != 0.0).then_some(value)
    };
    // Slopes are mg HA/cm³ per 1/cm, of order 1000. Some writers divide by mu_scaling beforehand (order 0.1).
    let slope = number(1176).map(|s| if s.abs() < 10.0 { s * mu_scaling } else { s });
    Calibration {
        mu_scaling: Some(mu_scaling),
        mu_water: number(1200),
        density: slope.zip(number(1184)).map(|(a, b)| [a, b]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::calibration::GreyUnit;

    /// A file as the format is described, with calibration in VAX G floats of exact binary values.
    fn isq() -> Vec<u8> {
        let mut bytes = vec![0u8; 512 * 4];
        bytes[..16].copy_from_slice(b"CTDATA-HEADER_V1");
        let mut put = |at: usize, v: i32| bytes[at..at + 4].copy_from_slice(&v.to_le_bytes());
        for (a, (n, um)) in [(2, 122), (3, 183), (2, 121)].into_iter().enumerate() {
            put(44 + 4 * a, n);
            put(56 + 4 * a, um);
        }
        put(88, 4096);
        put(508, 3);
        bytes[128..140].copy_from_slice(b"Jane Patient");
        let at = 600;
        bytes[at + 8..at + 19].copy_from_slice(b"Calibration");
        // 1600 = 0.78125 · 2^11, −256 = −0.5 · 2^9, 0.25 = 0.5 · 2^−1, with exponents from 1024.
        bytes[at + 1176..at + 1178].copy_from_slice(&[0xB9, 0x40]);
        bytes[at + 1184..at + 1186].copy_from_slice(&[0x90, 0xC0]);
        bytes[at + 1200..at + 1202].copy_from_slice(&[0xF0, 0x3F]);
        for v in 0..12i16 {
            bytes.extend((v * 1000 - 2000).to_le_bytes());
        }
        bytes
    }

    #[test]
    fn geometry_and_calibration_are_read_and_no_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.isq");
        std::fs::write(&path, isq()).unwrap();
        let s = read(&path).unwrap();
        assert_eq!(
            (s.n, s.spacing_mm),
            ([2, 3, 2], Some([0.061, 0.061, 0.0605]))
        );
        assert_eq!(s.values[11], 9000.0);
        let c = s.calibration.unwrap();
        assert_eq!(
            (c.mu_water, c.density),
            (Some(0.25), Some([1600.0, -256.0]))
        );
        let ([a, b], _) = c.line(GreyUnit::Mgha, &path).unwrap();
        assert_eq!(a * 4096.0 + b, 1344.0);
        assert!(!format!("{s:?}").contains("Jane"));
        std::fs::write(&path, &isq()[..2050]).unwrap();
        assert!(read(&path).is_err());
    }
}
