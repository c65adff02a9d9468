//! Owns what is measured of a mesh: dihedral angles, and the Euler number.

use super::mesh::{Mesh, cross, dot, minus};
use super::nodes::EDGES;
use super::pieces::Faces;
use rayon::prelude::*;

/// Least and largest dihedral angle that the method bounds, in degrees (Labelle & Shewchuk 2007, table 1).
pub const BOUNDS_DEGREES: [f64; 2] = [10.78, 164.74];

/// Dihedral angles of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    pub least_degrees: f64,
    pub largest_degrees: f64,
    /// Elements with an angle outside [`BOUNDS_DEGREES`].
    pub outside: usize,
    /// Of them, those away from the faces of the box.
    pub outside_inside_box: usize,
}

/// Least and largest dihedral angle of a tetrahedron, in degrees.
pub fn angles(corners: [[f64; 3]; 4]) -> [f64; 2] {
    // Inward normals of the faces across each corner.
    let normal = |c: usize| {
        let [p, q, r] = [1, 2, 3].map(|k| corners[(c + k) % 4]);
        let n = cross(minus(q, p), minus(r, p));
        let inward = dot(n, minus(corners[c], p)).signum() / dot(n, n).sqrt();
        n.map(|v| inward * v)
    };
    let normals = [0, 1, 2, 3].map(normal);
    let mut range = [180.0f64, 0.0f64];
    for a in 0..4 {
        for b in a + 1..4 {
            let angle = 180.0
                - dot(normals[a], normals[b])
                    .clamp(-1.0, 1.0)
                    .acos()
                    .to_degrees();
            range = [range[0].min(angle), range[1].max(angle)];
        }
    }
    range
}

/// Part of a cell's edge around the faces of the box in which angles have no bounds: a vertex on a face cannot always move onto
/// the surface, which then crosses its short edges nearer than elsewhere, up to 0.36 of their 0.87 cells away.
const NEAR_FACE: f64 = 0.32;

fn is_near_face(mesh: &Mesh, at: &[f64; 3]) -> bool {
    let near = NEAR_FACE * mesh.cell_mm;
    let mut inner = mesh.inner_mm.iter();
    (0..3).any(|a| at[a] < near || at[a] > mesh.size_mm[a] - near)
        || inner.any(|(a, plane)| (at[*a] - plane).abs() < near)
}

/// Whether an angle is outside [`BOUNDS_DEGREES`].
pub fn beyond([least, largest]: [f64; 2]) -> bool {
    least < BOUNDS_DEGREES[0] || largest > BOUNDS_DEGREES[1]
}

pub fn quality(mesh: &Mesh) -> Quality {
    let of = |e: &[u32; 4]| {
        let corners = mesh.corners(e);
        let [least, largest] = angles(corners);
        let outside = beyond([least, largest]);
        let at_face = corners.iter().any(|p| is_near_face(mesh, p));
        Quality {
            least_degrees: least,
            largest_degrees: largest,
            outside: usize::from(outside),
            outside_inside_box: usize::from(outside && !at_face),
        }
    };
    let none = || Quality {
        least_degrees: 180.0,
        largest_degrees: 0.0,
        outside: 0,
        outside_inside_box: 0,
    };
    mesh.elements
        .par_iter()
        .map(of)
        .reduce(none, |a, b| Quality {
            least_degrees: a.least_degrees.min(b.least_degrees),
            largest_degrees: a.largest_degrees.max(b.largest_degrees),
            outside: a.outside + b.outside,
            outside_inside_box: a.outside_inside_box + b.outside_inside_box,
        })
}

/// Euler's number: vertices less edges plus faces less elements.
pub fn euler(mesh: &Mesh) -> i64 {
    let faces = Faces::of(&mesh.elements);
    let ends = |e: &[u32; 4]| EDGES.map(|[a, b]| (e[a].min(e[b]), e[a].max(e[b])));
    let mut edges: Vec<(u32, u32)> = mesh.elements.par_iter().flat_map_iter(ends).collect();
    edges.par_sort_unstable();
    edges.dedup();
    let even = mesh.vertices_mm.len() + faces.shared.len() + faces.free.len();
    even as i64 - (edges.len() + mesh.elements.len()) as i64
}
