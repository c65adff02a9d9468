//! Owns ink on a picture: text in DejaVu Sans, lines, boxes, arrow heads, and scale bars of a round length.

use fontdue::{Font, FontSettings};
use image::{Rgb, RgbImage};
use std::sync::OnceLock;

pub(super) const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
pub(super) const INK: Rgb<u8> = Rgb([30, 30, 30]);
pub(super) const PALE: Rgb<u8> = Rgb([120, 126, 132]);

/// Letters, digits and signs of units; the whole font has 750 kB. `dejavu-sans-LICENSE` is its licence.
const SUBSET: &[u8] = include_bytes!("dejavu-sans-subset.ttf");

fn font() -> Option<&'static Font> {
    static FONT: OnceLock<Option<Font>> = OnceLock::new();
    FONT.get_or_init(|| Font::from_bytes(SUBSET, FontSettings::default()).ok())
        .as_ref()
}

/// Width of `text` in pixels, letters `px` high.
pub(super) fn width(text: &str, px: f32) -> f32 {
    let advance = |font: &Font, c| font.metrics(c, px).advance_width;
    font().map_or(0.0, |font| text.chars().map(|c| advance(font, c)).sum())
}

/// Writes `text` with its base line at `y`, from `x` on; what does not fit is cut.
pub(super) fn write(picture: &mut RgbImage, [x, y]: [f32; 2], px: f32, text: &str) {
    let Some(font) = font() else { return };
    let mut pen = x;
    for c in text.chars() {
        let (metrics, ink) = font.rasterize(c, px);
        let left = pen.round() as i64 + i64::from(metrics.xmin);
        let top = y.round() as i64 - metrics.height as i64 - i64::from(metrics.ymin);
        for (i, &share) in ink.iter().enumerate() {
            let at = [
                left + (i % metrics.width) as i64,
                top + (i / metrics.width) as i64,
            ];
            mix(picture, at, INK, f32::from(share) / 255.0);
        }
        pen += metrics.advance_width;
    }
}

/// A number with the sign of a paper.
pub(super) fn with_minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

/// As [`write()`], with the middle of the text at `x`.
pub(super) fn write_centred(picture: &mut RgbImage, [x, y]: [f32; 2], px: f32, text: &str) {
    write(picture, [x - width(text, px) / 2.0, y], px, text);
}

/// Puts `share` of a colour over a pixel; nothing outside the picture.
pub(super) fn mix(picture: &mut RgbImage, [x, y]: [i64; 2], colour: Rgb<u8>, share: f32) {
    let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else {
        return;
    };
    if let Some(pixel) = picture.get_pixel_mut_checked(x, y) {
        for (old, new) in pixel.0.iter_mut().zip(colour.0) {
            *old = (f32::from(*old) + share * (f32::from(new) - f32::from(*old))).round() as u8;
        }
    }
}

/// A line of `thick` pixels with soft edges. `seen` says of a pixel, and of the share of the line up to there, whether it is drawn.
pub(super) fn line(
    picture: &mut RgbImage,
    [from, to]: [[f32; 2]; 2],
    thick: f32,
    colour: Rgb<u8>,
    seen: impl Fn([i64; 2], f32) -> bool,
) {
    let run = [to[0] - from[0], to[1] - from[1]];
    let squared = (run[0] * run[0] + run[1] * run[1]).max(1e-6);
    let span = |a: usize| {
        let (low, high) = (from[a].min(to[a]) - thick, from[a].max(to[a]) + thick);
        low.floor() as i64..=high.ceil() as i64
    };
    for y in span(1) {
        for x in span(0) {
            let off = [x as f32 + 0.5 - from[0], y as f32 + 0.5 - from[1]];
            let share = ((off[0] * run[0] + off[1] * run[1]) / squared).clamp(0.0, 1.0);
            let away = (off[0] - share * run[0]).hypot(off[1] - share * run[1]);
            let ink = (0.5 * thick + 0.5 - away).clamp(0.0, 1.0);
            if ink > 0.0 && seen([x, y], share) {
                mix(picture, [x, y], colour, ink);
            }
        }
    }
}

/// A filled arrow head with its tip at `tip`, pointing along `towards` (of length 1).
pub(super) fn head(picture: &mut RgbImage, tip: [f32; 2], towards: [f32; 2], size: f32) {
    for step in 0..=(4.0 * size) as i32 {
        let back = step as f32 / 4.0;
        let middle = [tip[0] - back * towards[0], tip[1] - back * towards[1]];
        let half = 0.38 * back;
        let ends = [-half, half].map(|s| [middle[0] - s * towards[1], middle[1] + s * towards[0]]);
        line(picture, ends, 0.6, INK, |_, _| true);
    }
}

/// The longest of 1, 2 or 5 times a power of ten that is not above `most`.
pub(super) fn round_length(most: f64) -> f64 {
    let decade = 10f64.powf(most.log10().floor());
    let steps = [5.0, 2.0, 1.0].into_iter().map(|step| step * decade);
    steps
        .into_iter()
        .find(|l| *l <= most * (1.0 + 1e-9))
        .unwrap_or(decade)
}

/// A bar of a round length of about `wanted` pixels, its left end at `left`, its name over it. Returns its length in pixels.
pub(super) fn scale_bar(
    picture: &mut RgbImage,
    left: [f32; 2],
    per_mm: f64,
    wanted: f64,
    px: f32,
) -> f32 {
    let mm = round_length(wanted / per_mm);
    let length = (mm * per_mm).round() as f32;
    let (x, y) = (left[0].round() as i64, left[1].round() as i64);
    for dy in 0..5 {
        (0..length as i64).for_each(|dx| mix(picture, [x + dx, y + dy], INK, 1.0));
    }
    let text = match mm < 0.1 {
        true => format!("{} µm", (mm * 1000.0 * 1e6).round() / 1e6),
        false => format!("{mm} mm"),
    };
    write_centred(
        picture,
        [x as f32 + length / 2.0, y as f32 - 7.0],
        px,
        &text,
    );
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(picture: &RgbImage, y: u32) -> usize {
        (0..picture.width())
            .filter(|&x| picture.get_pixel(x, y).0 == INK.0)
            .count()
    }

    #[test]
    fn a_scale_bar_is_as_long_as_it_says() {
        let mut picture = RgbImage::from_pixel(300, 60, PAPER);
        // 73 pixels a mm; 2 mm is the longest round length in 190 pixels.
        let length = scale_bar(&mut picture, [10.0, 40.0], 73.0, 190.0, 16.0);
        assert_eq!((length, dark(&picture, 41)), (146.0, 146));
        assert_eq!(
            [0.3, 0.99, 2.0, 7.0].map(round_length),
            [0.2, 0.5, 2.0, 5.0]
        );
    }

    #[test]
    fn text_is_as_wide_as_it_says() {
        let mut picture = RgbImage::from_pixel(300, 40, PAPER);
        write(&mut picture, [10.0, 30.0], 20.0, "0.5 µm σ ≥ 1");
        let inked = |x: u32| (0..40).any(|y| picture.get_pixel(x, y).0 != PAPER.0);
        let end = 10 + width("0.5 µm σ ≥ 1", 20.0) as u32;
        assert!((end - 6..=end).any(inked) && !(end + 1..300).any(inked) && !(0..10).any(inked));
    }

    #[test]
    fn every_letter_of_the_pictures_is_in_the_font() {
        let all = (' '..='~').chain("°±²³µ·×–−…εμσ⁻≤≥".chars());
        let missing: Vec<char> = all
            .filter(|&c| font().unwrap().lookup_glyph_index(c) == 0)
            .collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
