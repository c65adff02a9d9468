//! Owns `segment.png`: mid-slices of the three planes, grey values with the mask's outline over them.

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::volume::Volume;
use image::{Rgb, RgbImage};
use std::path::Path;

/// Pixels of the longest side of a specimen.
const SIDE: f64 = 480.0;
const MARGIN: u32 = 12;
const CAPTION: u32 = 30;
/// Vermilion of the Okabe–Ito palette: seen on grey and on white by all eyes.
const OUTLINE: Rgb<u8> = Rgb([213, 94, 0]);

/// Steps to the pixels that make a bone pixel one of the outline: two wide, so that a page that shows the picture smaller
/// still shows it.
const NEAR: [(i32, i32); 8] = [
    (1, 0),
    (-1, 0),
    (0, 1),
    (0, -1),
    (2, 0),
    (-2, 0),
    (0, 2),
    (0, -2),
];
const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
const INK: Rgb<u8> = Rgb([30, 30, 30]);

/// Three panels: xy (as in the slices), xz and yz (z upwards), each through the middle, with a scale bar.
/// Both volumes are on the same grid.
pub fn write(path: &Path, grey: &Volume<f32>, bone: &Volume<u8>) -> Result<()> {
    let picture = draw(grey, bone);
    let mut png = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(|e| {
            Error::file(
                path,
                format!("cannot be encoded: {e}"),
                "report this as a bug",
            )
            .caused_by(e)
        })?;
    atomic::write(path, png.into_inner())
}

/// A plane through the middle: which axes run right and down, and whether down is reversed.
struct Plane {
    right: usize,
    down: usize,
    through: usize,
    upwards: bool,
}

const PLANES: [Plane; 3] = [
    Plane {
        right: 0,
        down: 1,
        through: 2,
        upwards: false,
    },
    Plane {
        right: 0,
        down: 2,
        through: 1,
        upwards: true,
    },
    Plane {
        right: 1,
        down: 2,
        through: 0,
        upwards: true,
    },
];

fn draw(grey: &Volume<f32>, bone: &Volume<u8>) -> RgbImage {
    let size = grey.grid.size_mm();
    let per_mm = SIDE / size.iter().copied().fold(0.0, f64::max);
    let pixels = |axis: usize| ((size[axis] * per_mm).round() as u32).max(1);
    let widths = PLANES.each_ref().map(|p| pixels(p.right));
    let height = PLANES.iter().map(|p| pixels(p.down)).max().unwrap_or(1);
    let total = widths.iter().sum::<u32>() + 4 * MARGIN;
    let mut picture =
        RgbImage::from_pixel(total.max(3 * 150), height + CAPTION + 2 * MARGIN, PAPER);
    let range = contrast(grey);
    let mut left = MARGIN;
    for (plane, width) in PLANES.iter().zip(widths) {
        let panel = [width, pixels(plane.down)];
        draw_plane(
            &mut picture,
            [left, MARGIN],
            panel,
            plane,
            grey,
            bone,
            range,
        );
        let names = ["x", "y", "z"];
        let text = format!(
            "{}{} {}={}",
            names[plane.right],
            names[plane.down],
            names[plane.through],
            grey.grid.n[plane.through] / 2
        );
        write_text(&mut picture, [left, MARGIN + height + 10], &text);
        left += width + MARGIN;
    }
    scale_bar(&mut picture, per_mm, height);
    picture
}

fn draw_plane(
    picture: &mut RgbImage,
    [left, top]: [u32; 2],
    [width, height]: [u32; 2],
    plane: &Plane,
    grey: &Volume<f32>,
    bone: &Volume<u8>,
    (dark, light): (f32, f32),
) {
    let n = grey.grid.n;
    let voxel = |x: u32, y: u32| {
        let mut at = [0; 3];
        at[plane.through] = n[plane.through] / 2;
        at[plane.right] = (x as usize * n[plane.right]) / width as usize;
        let y = if plane.upwards { height - 1 - y } else { y };
        at[plane.down] = (y as usize * n[plane.down]) / height as usize;
        grey.grid.index(at)
    };
    let is_bone = |x: u32, y: u32| bone.as_slice()[voxel(x, y)] != 0;
    for y in 0..height {
        for x in 0..width {
            let edge = is_bone(x, y) && NEAR.iter().any(|&(dx, dy)| {
                let (x, y) = (x.checked_add_signed(dx), y.checked_add_signed(dy));
                matches!((x, y), (Some(x), Some(y)) if x < width && y < height && !is_bone(x, y))
            });
            let shade = ((grey.as_slice()[voxel(x, y)] - dark) / (light - dark) * 255.0) as u8;
            let colour = if edge { OUTLINE } else { Rgb([shade; 3]) };
            picture.put_pixel(left + x, top + y, colour);
        }
    }
}

/// Grey values shown black and white: the 0.5 and 99.5 percentiles of a sample.
fn contrast(grey: &Volume<f32>) -> (f32, f32) {
    let step = (grey.grid.len() / 200_000).max(1);
    let mut sample: Vec<f32> = grey
        .as_slice()
        .iter()
        .step_by(step)
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    if sample.is_empty() {
        return (0.0, 1.0);
    }
    sample.sort_by(f32::total_cmp);
    let at = |share: f64| sample[((sample.len() - 1) as f64 * share) as usize];
    let (dark, light) = (at(0.005), at(0.995));
    if light > dark {
        (dark, light)
    } else {
        (dark, dark + 1.0)
    }
}

/// A bar of 1, 2 or 5 times a power of ten mm, about a quarter of the panels' side.
fn scale_bar(picture: &mut RgbImage, per_mm: f64, height: u32) {
    let wanted = SIDE / 4.0 / per_mm;
    let decade = 10f64.powf(wanted.log10().floor());
    let mm = [5.0, 2.0, 1.0]
        .into_iter()
        .map(|f| f * decade)
        .find(|l| *l <= wanted)
        .unwrap_or(decade);
    let length = (mm * per_mm) as u32;
    let text = format!("{mm} mm");
    let text_width = 12 * text.chars().count() as u32;
    let right = picture.width() - MARGIN;
    let left = right.saturating_sub(length);
    let y = MARGIN + height + 15;
    for x in left..right {
        for dy in 0..4 {
            picture.put_pixel(x, y + dy, INK);
        }
    }
    write_text(
        picture,
        [left.saturating_sub(text_width + 6), MARGIN + height + 10],
        &text,
    );
}

/// Rows of 5-pixel glyphs, top first, high bit left.
fn glyph(c: char) -> [u8; 7] {
    match c {
        '0' => [14, 17, 19, 21, 25, 17, 14],
        '1' => [4, 12, 4, 4, 4, 4, 14],
        '2' => [14, 17, 1, 2, 4, 8, 31],
        '3' => [31, 2, 4, 2, 1, 17, 14],
        '4' => [2, 6, 10, 18, 31, 2, 2],
        '5' => [31, 16, 30, 1, 1, 17, 14],
        '6' => [6, 8, 16, 30, 17, 17, 14],
        '7' => [31, 1, 2, 4, 8, 8, 8],
        '8' => [14, 17, 17, 14, 17, 17, 14],
        '9' => [14, 17, 17, 15, 1, 2, 12],
        'x' => [0, 0, 17, 10, 4, 10, 17],
        'y' => [0, 0, 17, 17, 15, 1, 14],
        'z' => [0, 0, 31, 2, 4, 8, 31],
        'm' => [0, 0, 26, 21, 21, 21, 21],
        '=' => [0, 0, 31, 0, 31, 0, 0],
        '-' => [0, 0, 0, 31, 0, 0, 0],
        't' => [8, 8, 28, 8, 8, 9, 6],
        '.' => [0, 0, 0, 0, 0, 12, 12],
        _ => [0; 7],
    }
}

/// Text at twice the glyphs' size, 12 pixels a character; what does not fit is cut.
pub(crate) fn write_text(picture: &mut RgbImage, [left, top]: [u32; 2], text: &str) {
    for (i, c) in text.chars().enumerate() {
        for (row, bits) in glyph(c).into_iter().enumerate() {
            for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let x = left + 12 * i as u32 + 2 * column + dx;
                    let y = top + 2 * row as u32 + dy;
                    if x < picture.width() && y < picture.height() {
                        picture.put_pixel(x, y, INK);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn the_outline_runs_inside_the_bone_and_only_there() {
        let grid = Grid::new([12, 12, 12], [0.02; 3]);
        let inside = |at: usize| {
            [at % 12, at / 12 % 12, at / 144]
                .iter()
                .all(|p| (4..8).contains(p))
        };
        let bone = Volume::from_vec(
            grid,
            (0..grid.len()).map(|at| u8::from(inside(at))).collect(),
        );
        let grey = Volume::from_vec(
            grid,
            (0..grid.len())
                .map(|at| if inside(at) { 9.0 } else { 1.0 })
                .collect(),
        );
        let picture = draw(&grey, &bone);
        // 480 pixels for 12 voxels: the bone's 4 voxels are 160 pixels, its rim 4 · 159 pixels in each panel.
        let outline = picture.pixels().filter(|p| **p == OUTLINE).count();
        assert_eq!(outline, 3 * 4 * (159 + 157));
        assert_eq!(
            *picture.get_pixel(MARGIN + 240, MARGIN + 240),
            Rgb([255; 3])
        );
        assert_eq!(*picture.get_pixel(MARGIN + 20, MARGIN + 20), Rgb([0; 3]));
    }
}
