//! Owns the making of a mesh: lattice, surface, stencils, fit.

use super::fit;
use super::lattice::Lattice;
use super::mesh::{Corners, Mesh};
use super::snap::{Side, Snapped};
use super::stencils::{self, Vertex};
use super::surface::Surface;
use crate::error::{Error, Result};
use rayon::prelude::*;

/// Vertices that 32 bits number.
const MOST: usize = u32::MAX as usize;

/// The bone that `surface` encloses in its box, in cells of the lattice.
///
/// # Errors
/// More vertices than can be numbered.
pub fn fill(surface: &Surface, lattice: &Lattice) -> Result<Mesh> {
    if lattice.vertices() > MOST {
        return Err(Error::setting(
            "element_mm",
            format!(
                "{} lattice vertices are too many to number",
                lattice.vertices()
            ),
            "take a larger element or crop the scan",
        ));
    }
    let snapped = Snapped::new(lattice, surface);
    let lattices = lattice.vertices();
    if lattices + snapped.cuts.len() > MOST {
        return Err(Error::setting(
            "element_mm",
            "more vertices than can be numbered",
            "take a larger element or crop the scan",
        ));
    }
    let layers: Vec<Vec<Corners>> = (0..lattice.n[2])
        .into_par_iter()
        .map(|layer| {
            let mut elements = Vec::new();
            lattice.each_tetrahedron(layer, |t| {
                stencils::fill(&snapped, t, &mut |v| {
                    elements.push(v.map(|v| match v {
                        Vertex::Lattice(v) => v,
                        Vertex::Cut(c) => (lattices + c as usize) as u32,
                    }));
                });
            });
            elements
        })
        .collect();
    let mut mesh = numbered(layers.concat(), &snapped);
    mesh.orient();
    fit::fit(&mut mesh, surface);
    Ok(mesh)
}

/// Gives the vertices that are used numbers of their own, in the order of the lattice.
fn numbered(mut elements: Vec<Corners>, snapped: &Snapped) -> Mesh {
    let lattices = snapped.lattice.vertices();
    let mut name = vec![u32::MAX; lattices + snapped.cuts.len()];
    elements
        .iter()
        .flatten()
        .for_each(|v| name[*v as usize] = 0);
    let used: Vec<u32> = (0..name.len() as u32)
        .filter(|v| name[*v as usize] == 0)
        .collect();
    used.iter()
        .enumerate()
        .for_each(|(i, v)| name[*v as usize] = i as u32);
    elements
        .par_iter_mut()
        .for_each(|e| *e = e.map(|v| name[v as usize]));
    let place = |v: &u32| match (*v as usize).checked_sub(lattices) {
        None => snapped.position_mm(*v as usize),
        Some(cut) => snapped.cuts[cut].at_mm,
    };
    let on = |v: &u32| *v as usize >= lattices || snapped.sides[*v as usize] == Side::On;
    Mesh {
        vertices_mm: used.par_iter().map(place).collect(),
        on_surface: used.par_iter().map(on).collect(),
        elements,
        size_mm: snapped.lattice.ends_mm(),
        cell_mm: snapped.lattice.size_mm(),
        inner_mm: snapped.lattice.inner_mm(),
    }
}
