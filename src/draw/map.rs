//! Owns maps: values on the cells of a plane grid as coloured pixels with a colour bar, as PNG, and several of them as an
//! animated GIF.

use crate::discretisation::plane::Points;
use crate::draw::ink::{self, INK, PAPER};
use crate::error::{Error, Result};
use crate::io::atomic;
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, Rgb, RgbImage};
use std::io::Cursor;
use std::path::Path;

/// Pixels of the longer side of a body.
const SIDE: f64 = 420.0;
const MARGIN: u32 = 14;
const BAR: u32 = 16;
const LABELS: u32 = 110;
/// Height of letters, pixels.
const TEXT: f32 = 17.0;

/// Colours at equal distances along a scale.
pub(super) type Scale = &'static [[u8; 3]];

/// Dark blue over green to yellow, even in lightness: after matplotlib's viridis (van der Walt and Smith, CC0).
const SEQUENTIAL: Scale = &[
    [68, 1, 84],
    [72, 40, 120],
    [62, 74, 137],
    [49, 104, 142],
    [38, 130, 142],
    [31, 158, 137],
    [53, 183, 121],
    [109, 205, 89],
    [180, 222, 44],
    [253, 231, 37],
];

/// Blue, white at the middle, red: ColorBrewer's RdBu.
const DIVERGING: Scale = &[
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [209, 229, 240],
    [247, 247, 247],
    [253, 219, 199],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
];

/// What the ends of a map's colours stand for. Ranges symmetric about zero are drawn blue, white and red.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    /// The range of all values, widened where they are equal.
    pub fn of<'a>(values: impl IntoIterator<Item = &'a f64>) -> Range {
        let (low, high) = values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
                (l.min(v), h.max(v))
            });
        if low < high {
            return Range { low, high };
        }
        let middle = if low.is_finite() { low } else { 0.0 };
        Range {
            low: middle - 0.5,
            high: middle + 0.5,
        }
    }

    /// Colours at equal distances from the low to the high end.
    pub(super) fn scale(&self) -> Scale {
        match self.low == -self.high {
            true => DIVERGING,
            false => SEQUENTIAL,
        }
    }

    pub(super) fn colour(&self, value: f64) -> Rgb<u8> {
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        let scale = self.scale();
        let at = share * (scale.len() - 1) as f64;
        let k = (at as usize).min(scale.len() - 2);
        let mix = |a: u8, b: u8| (a as f64 + (at - k as f64) * (b as f64 - a as f64)).round() as u8;
        Rgb([0, 1, 2].map(|c| mix(scale[k][c], scale[k + 1][c])))
    }
}

/// A value per point as a picture, y upwards, with a colour bar and the time.
pub fn draw(points: &Points, values: &[f64], range: Range, time: f64) -> RgbImage {
    let (low, n) = points.bounds();
    let cell = (SIDE / n[0].max(n[1]) as f64).max(1.0);
    let size = n.map(|n| (n as f64 * cell).ceil() as u32);
    let height = size[1].max(160) + 2 * MARGIN + 24;
    let mut picture = RgbImage::from_pixel(size[0] + 3 * MARGIN + BAR + LABELS, height, PAPER);
    for y in 0..size[1] {
        for x in 0..size[0] {
            let i = low[0] + (x as f64 / cell) as i32;
            let j = low[1] + ((size[1] - 1 - y) as f64 / cell) as i32;
            if let Some(&value) = points.at([i, j]).and_then(|p| values.get(p)) {
                picture.put_pixel(x + MARGIN, y + MARGIN, range.colour(value));
            }
        }
    }
    bar(&mut picture, size, range);
    let foot = [MARGIN as f32, (height - MARGIN + 4) as f32];
    ink::write(&mut picture, foot, TEXT, &format!("t = {}", short(time)));
    picture
}

fn bar(picture: &mut RgbImage, size: [u32; 2], range: Range) {
    let (left, length) = (size[0] + 2 * MARGIN, size[1].max(160));
    for y in 0..length {
        let share = 1.0 - y as f64 / (length - 1) as f64;
        let colour = range.colour(range.low + share * (range.high - range.low));
        (0..BAR).for_each(|x| picture.put_pixel(left + x, MARGIN + y, colour));
    }
    for k in 0..=4 {
        let share = k as f64 / 4.0;
        let y = MARGIN + ((1.0 - share) * (length - 1) as f64) as u32;
        (0..4).for_each(|x| picture.put_pixel(left + BAR + x, y, INK));
        let text = short(range.low + share * (range.high - range.low));
        let place = [(left + BAR + 8) as f32, y as f32 + 6.0];
        ink::write(picture, place, TEXT, &ink::with_minus(&text));
    }
}

/// At most four significant digits, no trailing zeros.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || value.abs() < 1e-12 {
        return "0".into();
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

pub fn write_png(path: &Path, picture: &RgbImage) -> Result<()> {
    let mut png = Cursor::new(Vec::new());
    picture
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(|e| encoding(path, &e))?;
    atomic::write(path, png.into_inner())
}

/// [`write_png`] of a shaded picture. Its colours are rounded to steps of 1/85, which the eye does not see: the file is smaller by a quarter.
///
/// # Errors
/// An unwritable file.
pub fn write_shaded_png(path: &Path, mut picture: RgbImage) -> Result<()> {
    for channel in picture.iter_mut() {
        *channel = channel.saturating_add(1) / 3 * 3;
    }
    write_png(path, &picture)
}

/// An endless animation, a third of a second a picture.
pub fn write_gif(path: &Path, pictures: Vec<RgbImage>) -> Result<()> {
    let mut bytes = Vec::new();
    {
        let mut encoder = GifEncoder::new_with_speed(&mut bytes, 10);
        encoder
            .set_repeat(Repeat::Infinite)
            .map_err(|e| encoding(path, &e))?;
        for picture in pictures {
            let rgba = image::DynamicImage::ImageRgb8(picture).into_rgba8();
            let frame = Frame::from_parts(rgba, 0, 0, Delay::from_numer_denom_ms(333, 1));
            encoder
                .encode_frame(frame)
                .map_err(|e| encoding(path, &e))?;
        }
    }
    atomic::write(path, bytes)
}

fn encoding(path: &Path, e: &image::ImageError) -> Error {
    Error::file(
        path,
        format!("cannot be encoded: {e}"),
        "report this as a bug",
    )
}

/// Reads an image as brightness from 0 to 1, rows from the bottom up.
pub fn read_brightness(path: &Path) -> Result<([usize; 2], Vec<f64>)> {
    let picture = image::open(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read as an image: {e}"),
            "give a PNG or BMP file",
        )
        .caused_by(e)
    })?;
    let grey = picture.into_luma16();
    let (width, height) = grey.dimensions();
    let row = |y: u32| (0..width).map(move |x| (x, y));
    let values = (0..height)
        .rev()
        .flat_map(row)
        .map(|(x, y)| grey.get_pixel(x, y).0[0] as f64 / 65535.0);
    Ok(([width as usize, height as usize], values.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_shows_values_upright() {
        let points = Points::from_box([0.0; 2], 1.0, [2, 2], |_| true);
        let range = Range {
            low: 0.0,
            high: 3.0,
        };
        let picture = draw(&points, &[0.0, 1.0, 2.0, 3.0], range, 0.5);
        // The first point is at the lower left, the last at the upper right.
        assert_eq!(picture.get_pixel(MARGIN, MARGIN + 419).0, SEQUENTIAL[0]);
        assert_eq!(picture.get_pixel(MARGIN + 419, MARGIN).0, SEQUENTIAL[9]);
        assert_eq!(
            Range {
                low: -1.0,
                high: 1.0
            }
            .colour(0.0)
            .0,
            DIVERGING[5]
        );
        assert_eq!(
            [0.25, -0.1, 280.0, 0.0].map(short),
            ["0.25", "-0.1", "280", "0"]
        );
    }
}
