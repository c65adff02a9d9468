//! Owns a mesh of four-cornered elements: vertices, elements, and which vertices lie on the surface.

use rayon::prelude::*;

/// Corners of an element by vertex; the volume `(b − a) × (c − a) · (d − a) / 6` is positive.
pub type Corners = [u32; 4];

/// Four-cornered elements.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub vertices_mm: Vec<[f64; 3]>,
    /// Whether a vertex was put on the surface.
    pub on_surface: Vec<bool>,
    pub elements: Vec<Corners>,
    /// Edge lengths of the box.
    pub size_mm: [f64; 3],
    /// Mean edge of the lattice's cells.
    pub cell_mm: f64,
    /// Planes inside the box that no element reaches through: axis and place.
    pub inner_mm: Vec<(usize, f64)>,
}

impl Mesh {
    pub fn corners(&self, e: &Corners) -> [[f64; 3]; 4] {
        e.map(|v| self.vertices_mm[v as usize])
    }

    /// Swaps corners of elements whose volume is negative.
    pub fn orient(&mut self) {
        let vertices = &self.vertices_mm;
        self.elements.par_iter_mut().for_each(|e| {
            if volume(e.map(|v| vertices[v as usize])) < 0.0 {
                e.swap(2, 3);
            }
        });
    }

    /// Volume of all elements.
    pub fn volume_mm3(&self) -> f64 {
        crate::par::sum_chunks(self.elements.len(), |range| {
            self.elements[range]
                .iter()
                .map(|e| volume(self.corners(e)))
                .sum()
        })
    }

    /// See [`faces_at`].
    pub fn faces_at(&self, at: [f64; 3]) -> [u8; 3] {
        faces_at(self.size_mm, at)
    }

    /// The same; 4 on a plane inside the box that no element reaches through.
    pub fn planes_at(&self, at: [f64; 3]) -> [u8; 3] {
        let mut on = self.faces_at(at);
        for (a, plane) in &self.inner_mm {
            on[*a] |= u8::from((at[*a] - plane).abs() < 1e-9 * self.size_mm[*a]) << 2;
        }
        on
    }

    /// Whether a face of the box or a plane of `inner_mm` lies between two places, or at the second one only.
    pub fn is_across_plane(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        let faces = (0..3).flat_map(|a| [(a, 0.0), (a, self.size_mm[a])]);
        let mut planes = faces.chain(self.inner_mm.iter().copied());
        planes.any(|(a, plane)| from[a] != to[a] && (from[a] - plane) * (to[a] - plane) <= 0.0)
    }

    /// The same mesh of the elements that `keep` names, without vertices that none uses.
    pub fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let mut at = 0;
        self.elements.retain(|_| {
            at += 1;
            keep(at - 1)
        });
        let mut name = vec![u32::MAX; self.vertices_mm.len()];
        self.elements
            .iter()
            .flatten()
            .for_each(|v| name[*v as usize] = 0);
        let used = name.iter_mut().filter(|v| **v == 0);
        used.enumerate().for_each(|(i, v)| *v = i as u32);
        let used = |v: usize| name[v] != u32::MAX;
        let mut v = 0;
        self.vertices_mm.retain(|_| {
            v += 1;
            used(v - 1)
        });
        v = 0;
        self.on_surface.retain(|_| {
            v += 1;
            used(v - 1)
        });
        self.elements
            .iter_mut()
            .for_each(|e| *e = e.map(|v| name[v as usize]));
    }
}

/// By axis, whether a place lies on the lower (1) or the upper (2) face of a box; 0: neither.
pub fn faces_at(size_mm: [f64; 3], at: [f64; 3]) -> [u8; 3] {
    std::array::from_fn(|a| {
        let near = 1e-9 * size_mm[a];
        u8::from(at[a] < near) | u8::from(at[a] > size_mm[a] - near) << 1
    })
}

pub fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Signed volume of a tetrahedron.
pub fn volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
    dot(cross(minus(b, a), minus(c, a)), minus(d, a)) / 6.0
}
