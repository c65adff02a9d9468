//! Owns the colour of bone: ivory, or that of a field just below the surface.

use super::vec3::Vec3;
use crate::draw::colour_bar::Coloured;
use image::Rgb;

/// From light to the numbers of a picture.
pub(super) const GAMMA: f32 = 2.2;

/// Ivory.
const BONE: [u8; 3] = [238, 226, 202];

/// How far below the surface a field is taken, and from how far around, in voxels.
const BELOW: f32 = 0.75;
const AROUND: f32 = 1.5;

/// Light of one pixel, red, green and blue; 1 is white paper.
pub(super) type Light = [f32; 3];

/// The colour of the bone at a place of its grid, with the normal there.
pub(super) trait Paint: Sync {
    /// Share of a colour that light and shadow leave as it is.
    const EVEN: f32;
    /// White that the main light adds: it shows the shape of dark bone.
    const SHEEN: f32;
    /// How much the furthest bone fades.
    const FADE: f32;

    fn colour(&self, q: Vec3, normal: Vec3) -> Light;
}

/// Ivory bone.
pub(super) struct Plain;

impl Paint for Plain {
    const EVEN: f32 = 0.04;
    const FADE: f32 = 0.3;
    const SHEEN: f32 = 0.0;

    fn colour(&self, _: Vec3, _: Vec3) -> Light {
        linear(Rgb(BONE))
    }
}

/// Bone in the colours of a field.
pub(super) struct Painted<'a> {
    pub(super) field: &'a Coloured<'a>,
    /// Voxels of the field a side of a voxel of the body.
    pub(super) factor: f32,
}

impl Paint for Painted<'_> {
    const EVEN: f32 = 0.3;
    const FADE: f32 = 0.1;
    const SHEEN: f32 = 0.055;

    /// The mean of the elements around a place just below the surface: values of single voxels at the surface are rough.
    fn colour(&self, q: Vec3, normal: Vec3) -> Light {
        let n = self.field.values.grid.n;
        let all = self.field.values.as_slice();
        // The middle of the body's first voxel is at 1; that of the mask's at 0.
        let at: Vec3 =
            std::array::from_fn(|a| (q[a] - 0.5) * self.factor - 0.5 - BELOW * normal[a]);
        let [xs, ys, zs] = std::array::from_fn(|a| {
            let [from, to] =
                [at[a] - AROUND, at[a] + AROUND].map(|end| end.clamp(0.0, n[a] as f32 - 1.0));
            from.ceil() as usize..=to.floor() as usize
        });
        let near = |i: usize, a: usize| (AROUND - (i as f32 - at[a]).abs()).max(1e-3);
        let (mut sum, mut weights) = (0.0, 0.0);
        for z in zs {
            for y in ys.clone() {
                let across = near(z, 2) * near(y, 1);
                for x in xs.clone() {
                    let value = all[x + n[0] * (y + n[1] * z)];
                    if value != 0.0 && value.is_finite() {
                        let weight = across * near(x, 0);
                        sum += weight * value;
                        weights += weight;
                    }
                }
            }
        }
        match weights > 0.0 {
            true => linear(self.field.range.colour(f64::from(sum / weights))),
            false => linear(Rgb([150; 3])),
        }
    }
}

/// From the numbers of a picture to light.
pub(super) fn linear(colour: Rgb<u8>) -> Light {
    colour.0.map(|c| (f32::from(c) / 255.0).powf(GAMMA))
}
