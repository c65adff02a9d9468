//! Owns `segment.png`: mid-slices of the three planes, grey values with the mask's outline over them.

use crate::draw::ink::{self, PAPER};
use crate::draw::map;
use crate::error::Result;
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
/// Height of letters, pixels.
const TEXT: f32 = 18.0;

/// Three panels: xy (as in the slices), xz and yz (z upwards), each through the middle, with a scale bar.
/// Both volumes are on the same grid.
pub fn write(path: &Path, grey: &Volume<f32>, bone: &Volume<u8>) -> Result<()> {
    map::write_png(path, &draw(grey, bone))
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
    let foot = (MARGIN + height + 24) as f32;
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
            "{}{}, {} = {}",
            names[plane.right],
            names[plane.down],
            names[plane.through],
            grey.grid.n[plane.through] / 2
        );
        ink::write(&mut picture, [left as f32, foot], TEXT, &text);
        left += width + MARGIN;
    }
    let right = (picture.width() - MARGIN) as f32;
    let place = [right - (SIDE / 4.0) as f32, foot];
    ink::scale_bar(&mut picture, place, per_mm, SIDE / 4.0, TEXT);
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
