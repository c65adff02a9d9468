//! Owns which elements share faces, which faces are free, and which connected pieces reach what they must.

use super::mesh::{Corners, Mesh};
use crate::parts;
use rayon::prelude::*;

/// The three corners across from corner `c`, seen from outside in the order of a positive area.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A face of an element: four times the element, plus the corner across.
pub type FaceId = u32;

/// Pairs of elements that share a face, and faces of one element only.
pub struct Faces {
    pub shared: Vec<[u32; 2]>,
    pub free: Vec<FaceId>,
}

impl Faces {
    /// # Panics
    /// At 2³⁰ elements or more.
    pub fn of(elements: &[Corners]) -> Faces {
        assert!(elements.len() < 1 << 30, "too many elements");
        let face = |f: usize| {
            let e = elements[f / 4];
            let mut corners = FACES[f % 4].map(|c| e[c]);
            corners.sort_unstable();
            (corners, f as u32)
        };
        let mut faces: Vec<([u32; 3], u32)> =
            (0..4 * elements.len()).into_par_iter().map(face).collect();
        faces.par_sort_unstable();
        let (mut shared, mut free) = (Vec::new(), Vec::new());
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            match group {
                [(_, one)] => free.push(*one),
                [(_, a), (_, b)] => shared.push([a / 4, b / 4]),
                _ => unreachable!("a face has two sides"),
            }
        }
        free.sort_unstable();
        Faces { shared, free }
    }

    /// Corners of a free face, outwards.
    pub fn corners(mesh: &Mesh, face: FaceId) -> [u32; 3] {
        let e = mesh.elements[face as usize / 4];
        FACES[face as usize % 4].map(|c| e[c])
    }
}

/// The piece of every element (pieces are joined by faces), numbered in the order of their first elements, and how many there are.
pub fn pieces(elements: usize, shared: &[[u32; 2]]) -> (Vec<u32>, usize) {
    let mut up = parts::apart(elements);
    for &[a, b] in shared {
        parts::join(&mut up, a, b);
    }
    parts::numbered(up)
}

/// Which elements a load reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Keep {
    /// Pieces that two grips hold, which end at these places along an axis.
    Between { axis: usize, ends_mm: [f64; 2] },
    /// Pieces that touch a face of the box.
    AtFaces,
}

/// What was left out of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loaded {
    /// Pieces before and after.
    pub pieces: usize,
    pub kept: usize,
    pub dropped_elements: usize,
}

/// Keeps the pieces that carry load.
pub fn keep(mesh: &mut Mesh, keep: Keep) -> Loaded {
    let faces = Faces::of(&mesh.elements);
    let (piece, count) = pieces(mesh.elements.len(), &faces.shared);
    let mut touched = vec![0u8; count];
    for (e, corners) in mesh.elements.iter().enumerate() {
        touched[piece[e] as usize] |= held(mesh, corners, keep);
    }
    let before = mesh.elements.len();
    mesh.retain(|e| touched[piece[e] as usize] == 3);
    Loaded {
        pieces: count,
        kept: touched.iter().filter(|t| **t == 3).count(),
        dropped_elements: before - mesh.elements.len(),
    }
}

/// Which supports hold an element by a face of it: bits of the lower and the upper one. Bone that meets them in an edge is not held.
fn held(mesh: &Mesh, corners: &Corners, keep: Keep) -> u8 {
    let at = corners.map(|v| mesh.vertices_mm[v as usize]);
    let face = |is_on: &dyn Fn(&[f64; 3]) -> bool| at.iter().filter(|p| is_on(p)).count() > 2;
    match keep {
        Keep::Between { axis, ends_mm } => {
            let near = 1e-9 * mesh.size_mm[axis];
            let lower = face(&|p| p[axis] <= ends_mm[0] + near);
            let upper = face(&|p| p[axis] >= ends_mm[1] - near);
            u8::from(lower) | u8::from(upper) << 1
        }
        Keep::AtFaces => {
            let on = |a: usize, bit: u8| face(&|p| mesh.faces_at(*p)[a] & bit != 0);
            3 * u8::from((0..3).any(|a| on(a, 1) || on(a, 2)))
        }
    }
}
