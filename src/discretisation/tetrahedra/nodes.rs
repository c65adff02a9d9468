//! Owns the nodes of ten-node elements: corners and middles of edges, numbered along the box so that neighbours are near.

use super::mesh::{self, Mesh};
use rayon::prelude::*;

/// Corners, then the middles of the edges [`EDGES`].
pub type Ten = [u32; 10];

/// The corners of each edge, in the order of the middles: that of C3D10 and of VTK.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Ten-node elements with straight edges.
#[derive(Debug, Clone, Default)]
pub struct TetMesh {
    pub nodes_mm: Vec<[f64; 3]>,
    /// In the order of their least node.
    pub elements: Vec<Ten>,
    /// Of each node, whether it is a corner of elements.
    pub is_corner: Vec<bool>,
    pub size_mm: [f64; 3],
    pub cell_mm: f64,
    pub edges: usize,
}

/// Nodes are numbered by slabs along z, in them by strips along y, in those along x: this many cells thick and wide.
const SLAB: f64 = 1.0;
const STRIP: f64 = 4.0;

impl TetMesh {
    /// See [`mesh::faces_at`].
    pub fn faces_at(&self, at: [f64; 3]) -> [u8; 3] {
        mesh::faces_at(self.size_mm, at)
    }

    pub fn of(mesh: &Mesh) -> TetMesh {
        let corners = mesh.vertices_mm.len();
        let key = |slot: usize| {
            let e = mesh.elements[slot / 6];
            let [a, b] = EDGES[slot % 6].map(|c| e[c]);
            (u64::from(a.min(b)) << 32 | u64::from(a.max(b)), slot as u32)
        };
        let mut slots: Vec<(u64, u32)> = (0..6 * mesh.elements.len())
            .into_par_iter()
            .map(key)
            .collect();
        slots.par_sort_unstable();
        let mut elements: Vec<Ten> = mesh
            .elements
            .iter()
            .map(|e| std::array::from_fn(|i| if i < 4 { e[i] } else { 0 }))
            .collect();
        let mut at_mm = mesh.vertices_mm.clone();
        for group in slots.chunk_by(|a, b| a.0 == b.0) {
            let [a, b] =
                [group[0].0 >> 32, group[0].0 & 0xffff_ffff].map(|v| mesh.vertices_mm[v as usize]);
            let node = at_mm.len() as u32;
            at_mm.push([0, 1, 2].map(|c| 0.5 * (a[c] + b[c])));
            for (_, slot) in group {
                elements[*slot as usize / 6][4 + *slot as usize % 6] = node;
            }
        }
        drop(slots);
        let edges = at_mm.len() - corners;
        let order = order(&at_mm, mesh.cell_mm);
        let mut name = vec![0u32; at_mm.len()];
        order
            .iter()
            .enumerate()
            .for_each(|(i, v)| name[*v as usize] = i as u32);
        elements
            .par_iter_mut()
            .for_each(|e| *e = e.map(|v| name[v as usize]));
        elements.par_sort_unstable_by_key(|e| (e.iter().min().copied(), *e));
        TetMesh {
            nodes_mm: order.par_iter().map(|v| at_mm[*v as usize]).collect(),
            is_corner: order.par_iter().map(|v| (*v as usize) < corners).collect(),
            elements,
            size_mm: mesh.size_mm,
            cell_mm: mesh.cell_mm,
            edges,
        }
    }
}

fn order(at_mm: &[[f64; 3]], cell_mm: f64) -> Vec<u32> {
    let key = |v: u32| {
        let [x, y, z] = at_mm[v as usize];
        let part = |x: f64, size: f64| (x / size + 1e-6).floor() as i64;
        let row = [part(z, SLAB * cell_mm), part(y, STRIP * cell_mm)];
        (row, (x / cell_mm * 1024.0) as i64, v)
    };
    let mut keyed: Vec<_> = (0..at_mm.len() as u32).into_par_iter().map(key).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(.., v)| v).collect()
}
