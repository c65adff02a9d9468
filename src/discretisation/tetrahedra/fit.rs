//! Owns the last fit of a mesh to its surface: flat faces between points of a curved surface lose volume, so the points move
//! out by the mean gap.
//!
//! A face's gap is that of its edges' middles, which is exact for surfaces of even curvature. A vertex moves by the mean of its
//! faces' gaps, weighted by area, so that the mesh gains the volume of the gaps to first order.

use super::mesh::{Mesh, cross, dot, minus, volume};
use super::pieces::Faces;
use super::quality::{angles, beyond};
use super::surface::Surface;
use rayon::prelude::*;

/// Part of a cell's edge that a vertex moves at most.
const MOST: f64 = 0.1;

/// Part of an element's volume that must be left; its angles must stay within their bounds where they were.
const LEAST_LEFT: f64 = 0.4;

/// Fits free faces to the surface; those on planes that elements end at stay in them.
pub fn fit(mesh: &mut Mesh, surface: &Surface) {
    let faces = Faces::of(&mesh.elements).free;
    let most = MOST * mesh.cell_mm;
    // Twice the area with its direction, and the gap.
    let of_face = |face: &u32| {
        let corners = Faces::corners(mesh, *face);
        if !corners.iter().all(|v| mesh.on_surface[*v as usize]) {
            return None;
        }
        let [a, b, c] = corners.map(|v| mesh.vertices_mm[v as usize]);
        let on = [a, b, c].map(|p| mesh.planes_at(p));
        if (0..3).any(|x| on[0][x] & on[1][x] & on[2][x] != 0) {
            return None;
        }
        let area = cross(minus(b, a), minus(c, a));
        let middle = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|x| 0.5 * (p[x] + q[x]));
        let gap = [middle(a, b), middle(b, c), middle(c, a)]
            .map(|p| surface.depth_mm(p).clamp(-most, most));
        Some((corners, area, gap.iter().sum::<f64>() / 3.0))
    };
    let fitted: Vec<_> = faces.par_iter().filter_map(of_face).collect();
    let mut sums = vec![[0.0; 5]; mesh.vertices_mm.len()];
    for (corners, area, gap) in fitted {
        let size = dot(area, area).sqrt();
        for v in corners {
            let sum = &mut sums[v as usize];
            (0..3).for_each(|a| sum[a] += area[a]);
            sum[3] += size;
            sum[4] += size * gap;
        }
    }
    let before = mesh.vertices_mm.clone();
    let move_of = |(v, sum): (usize, &[f64; 5])| {
        let [x, y, z, size, gaps] = *sum;
        let on = mesh.planes_at(before[v]);
        let normal: [f64; 3] = [x, y, z];
        let whole = dot(normal, normal).sqrt();
        let free: [f64; 3] = std::array::from_fn(|a| if on[a] == 0 { normal[a] } else { 0.0 });
        let squared = dot(free, free);
        // Surfaces nearly parallel to a face of the box would slide far along it.
        if size == 0.0 || squared < 0.1 * whole * whole {
            return [0.0; 3];
        }
        let by = (gaps / size).clamp(-most, most);
        let moved = free.map(|f| by * whole * f / squared);
        match mesh.is_across_plane(before[v], [0, 1, 2].map(|a| before[v][a] + moved[a])) {
            true => [0.0; 3],
            false => moved,
        }
    };
    let mut moves: Vec<[f64; 3]> = sums.par_iter().enumerate().map(move_of).collect();
    for _ in 0..4 {
        mesh.vertices_mm
            .par_iter_mut()
            .zip(before.par_iter().zip(&moves))
            .for_each(|(at, (from, by))| *at = [0, 1, 2].map(|a| from[a] + by[a]));
        let spoilt = |e: &&[u32; 4]| {
            if e.iter().all(|v| moves[*v as usize] == [0.0; 3]) {
                return false;
            }
            let was = e.map(|v| before[v as usize]);
            let now = mesh.corners(e);
            volume(now) < LEAST_LEFT * volume(was) || beyond(angles(now)) && !beyond(angles(was))
        };
        let spoilt: Vec<u32> = mesh
            .elements
            .par_iter()
            .filter(spoilt)
            .flat_map_iter(|e| *e)
            .collect();
        if spoilt.is_empty() {
            return;
        }
        spoilt.iter().for_each(|v| moves[*v as usize] = [0.0; 3]);
    }
    mesh.vertices_mm = before;
}
