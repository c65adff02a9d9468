//! Owns the pixels of a still: one ray each, two more where the body has an edge, in light, shadow and ambient light.

use super::body::Body;
use super::camera::Camera;
use super::paint::{GAMMA, Light, Paint};
use super::ray::{Hit, Ray};
use super::vec3::{Vec3, dot, unit};
use crate::draw::ink::PAPER;
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// What a still shows of each pixel.
pub(super) struct Panel {
    pub(super) size: [u32; 2],
    pub(super) light: Vec<Light>,
    /// Along the rays, mm; infinite where there is no bone.
    pub(super) depth: Vec<f32>,
}

impl Panel {
    /// Puts the pixels at their place in a picture.
    pub(super) fn put(&self, picture: &mut RgbImage, [left, top]: [u32; 2]) {
        for (i, light) in self.light.iter().enumerate() {
            let (x, y) = (i as u32 % self.size[0], i as u32 / self.size[0]);
            let colour = light.map(|l| (255.0 * l.clamp(0.0, 1.0).powf(1.0 / GAMMA)).round() as u8);
            if colour != PAPER.0 {
                picture.put_pixel(left + x, top + y, Rgb(colour));
            }
        }
    }

    /// Depth at a pixel; infinite outside.
    pub(super) fn depth_at(&self, [x, y]: [i64; 2]) -> f32 {
        let [width, height] = self.size.map(i64::from);
        let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
        let depth = is_inside
            .then(|| self.depth.get((x + width * y) as usize))
            .flatten();
        depth.copied().unwrap_or(f32::INFINITY)
    }
}

/// To the right, up, to the viewer.
const KEY: Vec3 = [-0.55, 0.62, 0.56];
/// Places in a pixel of the further rays at edges.
const PLACES: [[f32; 2]; 2] = [[0.17, 0.67], [0.83, 0.33]];

struct Scene<'a, P> {
    body: &'a Body,
    camera: &'a Camera,
    paint: &'a P,
    key: Vec3,
}

pub(super) fn panel(body: &Body, camera: &Camera, paint: &impl Paint) -> Panel {
    let scene = Scene {
        body,
        camera,
        paint,
        key: unit(camera.turned(KEY)),
    };
    let [width, height] = camera.size.map(|s| s as usize);
    let hits: Vec<Option<Hit>> = (0..width * height)
        .into_par_iter()
        .with_min_len(width)
        .map(|i| scene.hit([(i % width) as f32 + 0.5, (i / width) as f32 + 0.5]))
        .collect();
    let depth: Vec<f32> = hits
        .iter()
        .map(|hit| hit.map_or(f32::INFINITY, |h| h.depth))
        .collect();
    let step = 2.5 / camera.per_mm;
    let light = (0..width * height)
        .into_par_iter()
        .with_min_len(width)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let middle = scene.light(hits[i]);
            if !is_edge(&hits, [x, y], [width, height], step) {
                return middle;
            }
            let [a, b] =
                PLACES.map(|[dx, dy]| scene.light(scene.hit([x as f32 + dx, y as f32 + dy])));
            std::array::from_fn(|c| (middle[c] + a[c] + b[c]) / 3.0)
        })
        .collect();
    Panel {
        size: camera.size,
        light,
        depth,
    }
}

/// Whether the body jumps or bends between a pixel and those next to it.
fn is_edge(
    hits: &[Option<Hit>],
    [x, y]: [usize; 2],
    [width, height]: [usize; 2],
    step: f32,
) -> bool {
    let here = &hits[x + width * y];
    let next = [
        (x > 0).then(|| x - 1 + width * y),
        (x + 1 < width).then(|| x + 1 + width * y),
        (y > 0).then(|| x + width * (y - 1)),
        (y + 1 < height).then(|| x + width * (y + 1)),
    ];
    next.into_iter().flatten().any(|i| match (here, &hits[i]) {
        (Some(a), Some(b)) => (a.depth - b.depth).abs() > step || dot(a.normal, b.normal) < 0.8,
        (None, None) => false,
        _ => true,
    })
}

impl<P: Paint> Scene<'_, P> {
    fn hit(&self, at: [f32; 2]) -> Option<Hit> {
        let towards = self.camera.back.map(|c| -c);
        Ray::new(self.body, self.camera.start_mm(at), towards).hit(self.body)
    }

    fn light(&self, hit: Option<Hit>) -> Light {
        let Some(hit) = hit else { return [1.0; 3] };
        let colour = self.paint.colour(hit.q, hit.normal);
        let facing = dot(hit.normal, self.key).max(0.0);
        let sky = 0.5 + 0.5 * dot(hit.normal, self.camera.up);
        let front = dot(hit.normal, self.camera.back).max(0.0);
        let ambient = self.ambient(&hit) * (0.24 + 0.22 * sky + 0.20 * front);
        let key = facing * self.shadow(&hit, facing);
        let lit = ambient + 0.62 * key;
        // Far bone fades a little into the paper.
        let far = (hit.depth / self.camera.depth_mm()).clamp(0.0, 1.0);
        let fade = P::FADE * far * far;
        let lit = P::EVEN + (1.0 - P::EVEN) * lit;
        let sheen = P::SHEEN * (key + 0.4 * ambient);
        colour.map(|c| (c * lit + sheen) * (1.0 - fade) + 0.75 * fade)
    }

    /// Share of the ambient light that bone around does not take.
    fn ambient(&self, hit: &Hit) -> f32 {
        let taken = 0.85 * self.bone(hit, hit.normal, 3.0) + 0.85 * self.bone(hit, hit.normal, 8.0);
        (1.0 - taken).clamp(0.1, 1.0)
    }

    /// Share of the main light that comes through: less, the more bone lies on its way.
    fn shadow(&self, hit: &Hit, facing: f32) -> f32 {
        if facing <= 0.0 {
            return 0.0;
        }
        let start = Hit {
            q: self.body.moved(hit.q, hit.normal, 2.5),
            ..*hit
        };
        let bone = [3.0, 6.5, 11.0, 17.0, 25.0].map(|voxels| self.bone(&start, self.key, voxels));
        let through = bone.map(|bone| 1.0 - (1.5 * bone - 0.15).clamp(0.0, 1.0));
        through.iter().product()
    }

    /// Bone fraction `voxels` away from a place.
    fn bone(&self, hit: &Hit, towards: Vec3, voxels: f32) -> f32 {
        self.body.fraction(self.body.moved(hit.q, towards, voxels))
    }
}
