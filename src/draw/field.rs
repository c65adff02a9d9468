//! Owns the picture of a field: mid-slices of the three planes in colours, with a colour bar.

use crate::draw::map::{self, Range};
use crate::draw::picture::write_text;
use crate::volume::Volume;
use image::{Rgb, RgbImage};

/// Pixels of the longest side of a specimen.
const SIDE: f64 = 360.0;
const MARGIN: u32 = 14;
const CAPTION: u32 = 24;
/// Width next to the slices, for the colour bar.
const BAR: u32 = 150;
const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
/// Where no element is.
const PORE: Rgb<u8> = Rgb([225, 225, 225]);

/// Colours end here: a few elements at the grips or at thin struts have many times what all others have.
const SHOWN: f64 = 0.99;

/// Which axes run right and down, and through the paper; z runs up.
const PLANES: [[usize; 3]; 3] = [[0, 1, 2], [0, 2, 1], [1, 2, 0]];

/// Slices through the middle of a field that is 0 where no element is. None where it is 0 everywhere.
pub fn draw(values: &Volume<f32>) -> Option<RgbImage> {
    let range = range(values)?;
    let size = values.grid.size_mm();
    let per_mm = SIDE / size.iter().copied().fold(0.0, f64::max);
    let pixels = |axis: usize| ((size[axis] * per_mm).round() as u32).max(1);
    let height = PLANES.map(|[_, down, _]| pixels(down)).into_iter().max()?;
    let width: u32 = PLANES
        .map(|[right, ..]| pixels(right) + MARGIN)
        .iter()
        .sum();
    let mut picture = RgbImage::from_pixel(
        width + MARGIN + BAR,
        height.max(160) + CAPTION + 2 * MARGIN,
        PAPER,
    );
    let mut left = MARGIN;
    for plane @ [right, down, through] in PLANES {
        let panel = [pixels(right), pixels(down)];
        slice(&mut picture, left, panel, values, plane, range);
        let names = ["x", "y", "z"];
        let text = format!(
            "{}{} {}={}",
            names[right],
            names[down],
            names[through],
            values.grid.n[through] / 2
        );
        write_text(&mut picture, [left, MARGIN + height.max(160) + 8], &text);
        left += panel[0] + MARGIN;
    }
    map::bar(&mut picture, [left - 2 * map::MARGIN, height], range);
    Some(picture)
}

fn slice(
    picture: &mut RgbImage,
    left: u32,
    [width, height]: [u32; 2],
    values: &Volume<f32>,
    [right, down, through]: [usize; 3],
    range: Range,
) {
    let n = values.grid.n;
    let all = values.as_slice();
    for y in 0..height {
        for x in 0..width {
            let mut at = [0; 3];
            at[through] = n[through] / 2;
            at[right] = (x as usize * n[right]) / width as usize;
            let below = (y as usize * n[down]) / height as usize;
            at[down] = if down == 2 { n[2] - 1 - below } else { below };
            let value = f64::from(all[at[0] + n[0] * (at[1] + n[1] * at[2])]);
            let colour = if value == 0.0 {
                PORE
            } else {
                range.colour(value)
            };
            picture.put_pixel(left + x, MARGIN + y, colour);
        }
    }
}

/// From 0 to what [`SHOWN`] of the elements do not exceed; to both sides of 0 where values are of either sign.
fn range(values: &Volume<f32>) -> Option<Range> {
    let step = (values.grid.len() / 400_000).max(1);
    let sample = values.as_slice().iter().step_by(step);
    let mut found: Vec<f32> = sample
        .copied()
        .filter(|v| *v != 0.0 && v.is_finite())
        .collect();
    let signed = found.iter().any(|v| *v < 0.0);
    found.iter_mut().for_each(|v| *v = v.abs());
    found.sort_unstable_by(f32::total_cmp);
    let last = found.len().checked_sub(1)?;
    let high = rounded_up(f64::from(found[(SHOWN * last as f64) as usize]));
    Some(Range {
        low: if signed { -high } else { 0.0 },
        high,
    })
}

/// The next number whose thirds have few digits.
fn rounded_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let steps = [1.2, 1.5, 1.8, 2.4, 3.0, 3.6, 4.5, 6.0, 7.5, 9.0, 12.0];
    let least = steps.into_iter().find(|step| step * power >= value);
    least.map_or(value, |step| step * power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn slices_show_values_upright_and_pores_grey() {
        let grid = Grid::new([2, 2, 2], [1.0; 3]);
        // Only the upper layer holds elements.
        let values: Vec<f32> = (0..8).map(|i| if i < 4 { 0.0 } else { 2.0 }).collect();
        let picture = draw(&Volume::from_vec(grid, values)).unwrap();
        let xz = MARGIN + 360 + MARGIN;
        assert_eq!(*picture.get_pixel(xz + 5, MARGIN + 350), PORE);
        assert_ne!(*picture.get_pixel(xz + 5, MARGIN + 5), PORE);
        assert!(draw(&Volume::from_vec(grid, vec![0.0; 8])).is_none());
    }
}
