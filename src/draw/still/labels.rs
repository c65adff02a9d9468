//! Owns what stands around a specimen: its box, the load axis, the scale bar and the colour bar.

use super::camera::Camera;
use super::edges;
use super::panel::Panel;
use crate::draw::colour_bar::{self, Coloured};
use crate::draw::ink::{self, INK, PAPER};
use crate::grid::Axis;
use image::RgbImage;

const MARGIN: u32 = 30;
/// Left of the specimen, for the load axis.
const LEFT: u32 = 96;
/// Under the specimen, for the scale bar.
const BOTTOM: u32 = 84;
/// Right of the specimen, for the colour bar.
const BAR: u32 = 190;
/// Height of letters, pixels.
const TEXT: f32 = 22.0;

/// The whole picture.
pub(super) fn page(
    panel: &Panel,
    camera: &Camera,
    size_mm: [f64; 3],
    load: Axis,
    field: Option<&Coloured>,
) -> RgbImage {
    let bar = if field.is_some() { BAR } else { 0 };
    let [width, height] = panel.size;
    let corner = [LEFT, MARGIN];
    let mut picture =
        RgbImage::from_pixel(width + LEFT + MARGIN + bar, height + MARGIN + BOTTOM, PAPER);
    panel.put(&mut picture, corner);
    edges::draw(&mut picture, panel, camera, size_mm, corner);
    load_axis(&mut picture, camera, size_mm, load, corner);
    let bottom = picture.height() as f32 - 24.0;
    ink::scale_bar(
        &mut picture,
        [LEFT as f32, bottom],
        f64::from(camera.per_mm),
        f64::from(camera.side) / 4.0,
        TEXT,
    );
    if let Some(field) = field {
        let bar = [LEFT + width + 34, MARGIN + height / 6];
        colour_bar::draw(&mut picture, field, bar, (height * 2 / 3).max(60), TEXT);
    }
    picture
}

/// An arrow along the axis, on that edge of the box that lies to the left or below, with its name.
fn load_axis(
    picture: &mut RgbImage,
    camera: &Camera,
    size_mm: [f64; 3],
    load: Axis,
    corner: [u32; 2],
) {
    let axis = load.index();
    let edge = |other: usize| {
        edges::ends(size_mm, axis, other).map(|end| {
            let (p, _) = camera.seen(end);
            [p[0] + corner[0] as f32, p[1] + corner[1] as f32]
        })
    };
    let outward: [f32; 2] = if load == Axis::Z {
        [-1.0, 0.0]
    } else {
        [0.0, 1.0]
    };
    let reach = |ends: &[[f32; 2]; 2]| ends[0][0] * outward[0] + ends[0][1] * outward[1];
    let outer = (0..4)
        .map(edge)
        .max_by(|a, b| reach(a).total_cmp(&reach(b)));
    let Some(ends) = outer else { return };
    let [from, to] = ends.map(|p| [p[0] + 30.0 * outward[0], p[1] + 22.0 * outward[1]]);
    let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(1e-3);
    let towards = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    ink::line(picture, [from, to], 2.4, INK, |_, _| true);
    ink::head(picture, to, towards, 17.0);
    ink::head(picture, from, towards.map(|c| -c), 17.0);
    let middle = [0, 1].map(|a| (from[a] + to[a]) / 2.0);
    let lines = ["load", load.name()];
    let at = if load == Axis::Z {
        [middle[0] - 36.0, middle[1] - 8.0]
    } else {
        [middle[0], middle[1] + 34.0]
    };
    if load == Axis::Z {
        ink::write_centred(picture, at, TEXT, lines[0]);
        ink::write_centred(picture, [at[0], at[1] + 26.0], TEXT, lines[1]);
    } else {
        ink::write_centred(picture, at, TEXT, &lines.join(" "));
    }
}
