//! Owns the view of a still: parallel, from above one edge of the specimen, so that lengths are the same in all of the picture.

use super::vec3::{Vec3, cross, dot};

/// Degrees from x towards y of the direction to the viewer, and above the plane of x and y.
const AZIMUTH: f32 = -58.0;
const ELEVATION: f32 = 24.0;

/// Directions are of length 1.
pub(super) struct Camera {
    right: Vec3,
    pub(super) up: Vec3,
    /// To the viewer.
    pub(super) back: Vec3,
    middle_mm: Vec3,
    half_diagonal_mm: f32,
    /// Pixels of the longer side of the specimen.
    pub(super) side: f32,
    /// Pixels of one mm.
    pub(super) per_mm: f32,
    /// Pixels of the panel.
    pub(super) size: [u32; 2],
}

impl Camera {
    /// Of a box of `size_mm`, its longer side in the picture `side` pixels.
    pub(super) fn new(size_mm: [f64; 3], side: f32) -> Camera {
        let (az, el) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
        let back = [el.cos() * az.cos(), el.cos() * az.sin(), el.sin()];
        let right = [-az.sin(), az.cos(), 0.0];
        let up = cross(back, right);
        let size = size_mm.map(|s| s as f32);
        let extent = |d: Vec3| (0..3).map(|a| d[a].abs() * size[a]).sum::<f32>();
        let shown = [extent(right), extent(up)];
        let per_mm = side / shown[0].max(shown[1]);
        Camera {
            right,
            up,
            back,
            middle_mm: size.map(|s| s / 2.0),
            half_diagonal_mm: extent(back) / 2.0,
            side,
            per_mm,
            size: shown.map(|s| (s * per_mm).ceil() as u32 + 2),
        }
    }

    /// Where the ray of a place in the panel (pixels from its upper left) starts, before the body.
    pub(super) fn start_mm(&self, [x, y]: [f32; 2]) -> Vec3 {
        let off =
            [x - self.size[0] as f32 / 2.0, self.size[1] as f32 / 2.0 - y].map(|p| p / self.per_mm);
        std::array::from_fn(|a| {
            self.middle_mm[a]
                + off[0] * self.right[a]
                + off[1] * self.up[a]
                + self.half_diagonal_mm * self.back[a]
        })
    }

    /// Place in the panel, pixels, and depth along its ray, mm.
    pub(super) fn seen(&self, at_mm: Vec3) -> ([f32; 2], f32) {
        let off: Vec3 = std::array::from_fn(|a| at_mm[a] - self.middle_mm[a]);
        let x = self.size[0] as f32 / 2.0 + self.per_mm * dot(off, self.right);
        let y = self.size[1] as f32 / 2.0 - self.per_mm * dot(off, self.up);
        ([x, y], self.half_diagonal_mm - dot(off, self.back))
    }

    /// From the nearest to the furthest corner of the box, mm.
    pub(super) fn depth_mm(&self) -> f32 {
        2.0 * self.half_diagonal_mm
    }

    /// A direction that turns with the view: to the right, up and to the viewer.
    pub(super) fn turned(&self, [x, y, z]: [f32; 3]) -> Vec3 {
        std::array::from_fn(|a| x * self.right[a] + y * self.up[a] + z * self.back[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_start_where_points_are_seen() {
        let camera = Camera::new([2.0, 3.0, 4.0], 300.0);
        let place = camera.seen([0.5, 2.0, 3.0]);
        let start = camera.start_mm(place.0);
        let end: Vec3 = std::array::from_fn(|a| start[a] - place.1 * camera.back[a]);
        for (a, wanted) in [0.5, 2.0, 3.0].into_iter().enumerate() {
            assert!((end[a] - wanted).abs() < 1e-4, "{end:?}");
        }
        assert_eq!(camera.size.iter().max(), Some(&302));
    }
}
