//! Owns the surface of smooth elements as binary STL: triangles seen from outside, in mm.

use crate::discretisation::tetrahedra::mesh::{cross, dot, minus};
use crate::discretisation::tetrahedra::pieces::{FACES, Faces};
use crate::error::Result;
use crate::io::atomic;
use crate::physics::tet10::Tet10;
use std::io::Write;
use std::path::Path;

pub fn write(path: &Path, model: &Tet10) -> Result<()> {
    let mesh = &model.mesh;
    let corners: Vec<[u32; 4]> = mesh
        .elements
        .iter()
        .map(|e| [e[0], e[1], e[2], e[3]])
        .collect();
    let free = Faces::of(&corners).free;
    atomic::write_with(path, |out| {
        let mut head = [0u8; 80];
        let words = b"bonepd-ct, mm";
        head[..words.len()].copy_from_slice(words);
        out.write_all(&head)?;
        out.write_all(&(free.len() as u32).to_le_bytes())?;
        for face in &free {
            let element = corners[*face as usize / 4];
            let at = FACES[*face as usize % 4].map(|c| mesh.nodes_mm[element[c] as usize]);
            let area = cross(minus(at[1], at[0]), minus(at[2], at[0]));
            let size = dot(area, area).sqrt();
            for v in [area.map(|a| a / size), at[0], at[1], at[2]].as_flattened() {
                out.write_all(&(*v as f32).to_le_bytes())?;
            }
            out.write_all(&[0; 2])?;
        }
        Ok(())
    })
}
