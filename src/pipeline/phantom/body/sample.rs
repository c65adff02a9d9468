//! Owns how a scanner sees a body: partial volumes, blur, noise, the position of its voxels.

use super::super::PhantomParams;
use super::super::waves::{Numbers, turn};
use super::Body;
use super::frame::Vec3;
use crate::grid::Grid;
use crate::mask::gaussian;
use crate::volume::Volume;
use rayon::prelude::*;

/// Parts along each edge of a voxel. The share of bone in a part follows from the distance between its middle and the surface: exact
/// for a surface along the parts' faces.
const PARTS: usize = 5;

/// From positions in the scan (mm from its first corner) to those in the body (mm from its middle).
struct Place {
    middle: Vec3,
    turn: [f64; 2],
    shift_mm: Vec3,
}

impl Place {
    fn new(params: &PhantomParams) -> Self {
        let grid = params.grid();
        let (shift, degrees) = params
            .body
            .map_or(([0.0; 3], 0.0), |b| (b.shift_mm, b.turn_degrees));
        Place {
            middle: grid.size_mm().map(|l| 0.5 * l),
            turn: turn(degrees / 360.0),
            shift_mm: shift,
        }
    }

    fn of(&self, p: Vec3) -> Vec3 {
        let [c, s] = self.turn;
        let [x, y, z] = std::array::from_fn(|a| p[a] - self.middle[a]);
        let [dx, dy, dz] = self.shift_mm;
        [c * x - s * y + dx, s * x + c * y + dy, z + dz]
    }
}

/// 1 where the middle of a voxel lies in the body.
pub fn mask(body: &Body, params: &PhantomParams) -> Volume<u8> {
    let grid = params.grid();
    let place = Place::new(params);
    let values = per_voxel(&grid, 0, |middle| {
        u8::from(body.value(place.of(middle)) < 0.0)
    });
    Volume::from_vec(grid, values)
}

/// Grey values before blur and noise, as shares of bone, with a margin of so many voxels all around.
pub fn partial_volumes(body: &Body, params: &PhantomParams, margin: usize) -> Volume<f32> {
    let grid = params.grid();
    let place = Place::new(params);
    let h = grid.spacing_mm[0];
    let part = h / PARTS as f64;
    let half_diagonal = 0.5 * 3f64.sqrt() * (h + part);
    let offset = |n: usize| ((n as f64 + 0.5) / PARTS as f64 - 0.5) * h;
    let share = |middle: Vec3| {
        let value = body.value(place.of(middle));
        if value.abs() > half_diagonal {
            return if value < 0.0 { 1.0 } else { 0.0 };
        }
        let mut inside = 0.0;
        for k in 0..PARTS {
            for j in 0..PARTS {
                for i in 0..PARTS {
                    let p = [
                        middle[0] + offset(i),
                        middle[1] + offset(j),
                        middle[2] + offset(k),
                    ];
                    inside += (0.5 - body.value(place.of(p)) / part).clamp(0.0, 1.0);
                }
            }
        }
        (inside / (PARTS * PARTS * PARTS) as f64) as f32
    };
    let values = per_voxel(&grid, margin, share);
    Volume::from_vec(
        Grid::new(grid.n.map(|n| n + 2 * margin), grid.spacing_mm),
        values,
    )
}

/// Blur and noise over partial volumes, rounded to whole HU. The body goes on beyond the box, and so does its blur.
pub fn scan(body: &Body, params: &PhantomParams) -> Volume<i16> {
    let margin = gaussian::kernel(params.blur_voxels).len() / 2;
    let bone = partial_volumes(body, params, margin);
    let [dark, contrast] = [params.background_hu, params.bone_hu - params.background_hu];
    let noise = Numbers::new(params.seed, 3);
    let grid = params.grid();
    let wide = bone.grid;
    let plane = wide.n[0] * wide.n[1];
    let inner = margin..margin + grid.n[2];
    let slabs = gaussian::map_slabs(
        &bone,
        params.blur_voxels,
        |v| v,
        |slices, values| {
            let kept = slices
                .zip(values.chunks_exact(plane))
                .filter(|(k, _)| inner.contains(k));
            let mut greys = Vec::new();
            for (k, slice) in kept {
                for j in 0..grid.n[1] {
                    for i in 0..grid.n[0] {
                        let share = slice[(j + margin) * wide.n[0] + i + margin];
                        let at = grid.index([i, j, k - margin]) as u64;
                        let hu =
                            dark + contrast * f64::from(share) + params.noise_hu * noise.normal(at);
                        greys.push(hu.round() as i16);
                    }
                }
            }
            greys
        },
    );
    Volume::from_vec(grid, slabs.concat())
}

/// A value for the middle of every voxel, x fastest.
fn per_voxel<T: Send>(grid: &Grid, margin: usize, of: impl Fn(Vec3) -> T + Sync) -> Vec<T> {
    let n = grid.n.map(|n| n + 2 * margin);
    let middle = |i: usize, a: usize| (i as f64 + 0.5 - margin as f64) * grid.spacing_mm[a];
    (0..n[1] * n[2])
        .into_par_iter()
        .flat_map_iter(|row| {
            let (j, k) = (row % n[1], row / n[1]);
            let of = &of;
            (0..n[0]).map(move |i| of([middle(i, 0), middle(j, 1), middle(k, 2)]))
        })
        .collect()
}
