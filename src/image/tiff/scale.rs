//! Owns the voxel size in the tags of a TIFF file.
//!
//! Tags XResolution, YResolution and ResolutionUnit were made for printers. Resolutions that image programs write when nobody
//! gave them a size are left out; any other is taken, with a note.

use super::Pages;
use super::storage::number;
use tiff::tags::Tag;

/// Dots per inch of printers, screens and cameras.
const PRINTING_DPI: [u32; 52] = [
    1, 50, 60, 70, 72, 75, 80, 90, 92, 96, 100, 110, 120, 130, 133, 140, 144, 150, 160, 170, 175,
    180, 192, 200, 220, 240, 250, 254, 266, 267, 288, 300, 320, 350, 360, 400, 450, 480, 500, 600,
    720, 750, 800, 900, 1000, 1200, 1440, 1600, 1800, 2000, 2400, 2880,
];
/// From here on, whole multiples of this many dots per inch are a printer's.
const STEP_DPI: f64 = 600.0;

/// Size of a pixel by the resolution tags.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// In the file's own unit, which its description names: pixels per unit along x and y.
    PerUnit([f64; 2]),
    Pixel([f64; 2]),
    None,
}

/// `described`: whether a program's notes in the description give the unit.
pub fn resolution(pages: &mut Pages, described: bool) -> Resolution {
    let (Some(x), Some(y)) = (
        per_unit(pages, Tag::XResolution),
        per_unit(pages, Tag::YResolution),
    ) else {
        return Resolution::None;
    };
    if described {
        return Resolution::PerUnit([x, y]);
    }
    let unit_mm = match number(pages, Tag::ResolutionUnit).unwrap_or(2) {
        2 if !is_printers(x, true) => 25.4,
        3 if !is_printers(x * 2.54, false) => 10.0,
        _ => return Resolution::None,
    };
    // Rational tags carry rounding: whole nanometres.
    let pixel = |per_unit: f64| (unit_mm / per_unit * 1e6).round() / 1e6;
    let pixel = [pixel(x), pixel(y)];
    match pixel.iter().all(|p| *p > 0.0) {
        true => Resolution::Pixel(pixel),
        false => Resolution::None,
    }
}

/// Whether it is a resolution of printing. One that was written per centimetre may be rounded to whole ones, and 254 dpi are
/// then 100 pixels a centimetre, which is a size.
fn is_printers(dpi: f64, in_inches: bool) -> bool {
    let slack = if in_inches { 0.01 } else { 0.004 * dpi };
    let near = |whole: f64| (dpi - whole).abs() <= slack;
    let listed = PRINTING_DPI
        .iter()
        .filter(|&&d| in_inches || d != 254)
        .any(|&d| near(f64::from(d)));
    let steps = (dpi / STEP_DPI).round();
    listed || steps >= 4.0 && (in_inches || steps <= 8.0) && near(steps * STEP_DPI)
}

fn per_unit(pages: &mut Pages, tag: Tag) -> Option<f64> {
    use tiff::decoder::ifd::Value;
    let value = match pages.decoder.find_tag(tag).ok()?? {
        Value::Rational(a, b) => f64::from(a) / f64::from(b),
        Value::List(list) => match list.first()? {
            Value::Rational(a, b) => f64::from(*a) / f64::from(*b),
            _ => return None,
        },
        Value::Float(v) => f64::from(v),
        Value::Double(v) => v,
        _ => return None,
    };
    (value.is_finite() && value > 0.0).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolutions_of_printing_are_no_voxel_sizes() {
        for dpi in [
            72.0, 96.0, 120.0, 144.0, 180.0, 240.0, 254.0, 300.0, 350.0, 400.0, 2400.0, 4800.0,
        ] {
            assert!(is_printers(dpi, true), "{dpi}");
        }
        for per_cm in [28.35, 59.0, 118.0, 118.11, 236.0, 472.44] {
            assert!(is_printers(per_cm * 2.54, false), "{per_cm} per cm");
        }
        // 10, 17.4, 19.5, 20, 36, 82 and 100 µm.
        for um in [10.0, 17.4, 19.5, 20.0, 36.0, 82.0] {
            assert!(!is_printers(25_400.0 / um, true), "{um} µm in inches");
        }
        for um in [5.0, 10.0, 17.4, 19.5, 20.0, 34.5, 36.0, 50.0, 82.0, 100.0] {
            assert!(!is_printers(25_400.0 / um, false), "{um} µm in cm");
        }
    }
}
