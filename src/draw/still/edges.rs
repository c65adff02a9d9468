//! Owns the edges of a specimen's box.

use super::camera::Camera;
use super::panel::Panel;
use crate::draw::ink::{self, PALE};
use image::RgbImage;

/// Draws them where no bone is before them. The panel lies at `corner`.
pub(super) fn draw(
    picture: &mut RgbImage,
    panel: &Panel,
    camera: &Camera,
    size_mm: [f64; 3],
    corner: [u32; 2],
) {
    for (along, other) in (0..12).map(|edge| (edge / 4, edge % 4)) {
        let ends = ends(size_mm, along, other);
        let [(from, near), (to, far)] = ends.map(|end| camera.seen(end));
        let is_seen = |[x, y]: [i64; 2], share: f32| {
            let [x, y] = [x - i64::from(corner[0]), y - i64::from(corner[1])];
            let depth = panel.depth_at([x, y]);
            near + share * (far - near) <= depth + 0.5 / camera.per_mm
        };
        let line = [from, to].map(|p| [p[0] + corner[0] as f32, p[1] + corner[1] as f32]);
        ink::line(picture, line, 1.0, PALE, is_seen);
    }
}

/// Both ends of one of the four edges along an axis, mm.
pub(super) fn ends(size_mm: [f64; 3], along: usize, other: usize) -> [[f32; 3]; 2] {
    let size = size_mm.map(|s| s as f32);
    let across = [(along + 1) % 3, (along + 2) % 3];
    [0.0, size[along]].map(|at| {
        let mut end = [0.0; 3];
        end[along] = at;
        end[across[0]] = if other & 1 == 1 { size[across[0]] } else { 0.0 };
        end[across[1]] = if other & 2 == 2 { size[across[1]] } else { 0.0 };
        end
    })
}
