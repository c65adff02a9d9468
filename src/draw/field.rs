//! Owns the picture of a field: mid-slices of the three planes in colours, with a scale bar and a colour bar.

use crate::draw::colour_bar::{self, Coloured};
use crate::draw::ink::{self, PAPER};
use crate::draw::map::Range;
use crate::volume::Volume;
use image::{Rgb, RgbImage};

/// Pixels of the longest side of a specimen.
const SIDE: f64 = 400.0;
const MARGIN: u32 = 20;
/// Under the slices.
const CAPTION: u32 = 50;
/// Next to the slices, for the colour bar.
const BAR: u32 = 190;
/// Height of letters, pixels.
const TEXT: f32 = 18.0;
/// Where no element is.
const PORE: Rgb<u8> = Rgb([225, 225, 225]);

/// Which axes run right and down, and through the paper; z runs up.
const PLANES: [[usize; 3]; 3] = [[0, 1, 2], [0, 2, 1], [1, 2, 0]];

/// Slices through the middle of a field that is 0 where no element is.
pub fn draw(field: &Coloured) -> RgbImage {
    let grid = field.values.grid;
    let size = grid.size_mm();
    let per_mm = SIDE / size.iter().copied().fold(0.0, f64::max);
    let pixels = |axis: usize| ((size[axis] * per_mm).round() as u32).max(1);
    let height = PLANES
        .map(|[_, down, _]| pixels(down))
        .into_iter()
        .fold(240, u32::max);
    let width: u32 = PLANES
        .map(|[right, ..]| pixels(right) + MARGIN)
        .iter()
        .sum();
    let mut picture = RgbImage::from_pixel(width + MARGIN + BAR, height + CAPTION + MARGIN, PAPER);
    let foot = (MARGIN + height) as f32 + 26.0;
    let mut left = MARGIN;
    for plane @ [right, down, through] in PLANES {
        let panel = [pixels(right), pixels(down)];
        slice(&mut picture, left, panel, field.values, plane, field.range);
        let names = ["x", "y", "z"];
        let middle_mm = (grid.n[through] / 2) as f64 * grid.spacing_mm[through];
        let text = format!(
            "{}{}, {} = {middle_mm:.2} mm",
            names[right], names[down], names[through]
        );
        ink::write(&mut picture, [left as f32, foot], TEXT, &text);
        left += panel[0] + MARGIN;
    }
    let bar = [left + 8, MARGIN + 56];
    colour_bar::draw(&mut picture, field, bar, height - 62, TEXT);
    let scale = [(left - MARGIN) as f32 - SIDE as f32 / 4.0, foot];
    ink::scale_bar(&mut picture, scale, per_mm, SIDE / 4.0, TEXT);
    picture
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn slices_show_values_upright_and_pores_grey() {
        let grid = Grid::new([2, 2, 2], [1.0; 3]);
        // Only the upper layer holds elements.
        let values: Vec<f32> = (0..8).map(|i| if i < 4 { 0.0 } else { 2.0 }).collect();
        let values = Volume::from_vec(grid, values);
        let range = colour_bar::range(&values).unwrap();
        let picture = draw(&Coloured {
            values: &values,
            name: "value",
            range,
        });
        let xz = MARGIN + SIDE as u32 + MARGIN;
        assert_eq!(*picture.get_pixel(xz + 5, MARGIN + 390), PORE);
        assert_eq!(*picture.get_pixel(xz + 5, MARGIN + 5), range.colour(2.0));
    }
}
