//! Owns what is read off solved bricks: each element's energy, stress, strain and displacement.

use super::element::{self, ElementMatrix, Integration};
use crate::discretisation::voxels::{Segment, VoxelMesh};
use rayon::prelude::*;

/// One kind of element: Young's modulus in MPa, Poisson's ratio, and how it is integrated.
pub type Kind = (f64, f64, Integration);

/// What a brick stores and bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brick {
    /// Index in the mesh's grid.
    pub element: usize,
    /// Strain energy over the element's volume, in MPa (N mm/mm³).
    pub energy_density_mpa: f32,
    /// Equivalent stress at the centre, in MPa.
    pub von_mises_mpa: f32,
    /// `√(2 SED / E)` (Pistoia et al. 2002).
    pub effective_strain: f32,
    /// At the centre, in mm.
    pub displacement_mm: [f32; 3],
}

/// All elements of a mesh under the displacements `u`. `stiffness` yields factor and kind of the element whose corner of
/// smallest x, y, z is a node.
pub fn bricks(
    mesh: &VoxelMesh,
    kinds: &[Kind],
    stiffness: impl Fn(usize) -> (f32, u8) + Sync,
    u: &[[f64; 3]],
) -> Vec<Brick> {
    sample(mesh, kinds, stiffness, u, 1)
}

/// The elements of every `step`-th row of a mesh: enough for means over many.
pub fn sample(
    mesh: &VoxelMesh,
    kinds: &[Kind],
    stiffness: impl Fn(usize) -> (f32, u8) + Sync,
    u: &[[f64; 3]],
    step: usize,
) -> Vec<Brick> {
    let h = mesh.grid.spacing_mm;
    let matrices: Vec<ElementMatrix> = kinds
        .iter()
        .map(|&(young, nu, rule)| element::stiffness(h, young, nu, rule))
        .collect();
    let segment = |s: &Segment| -> Vec<Brick> {
        let mut found = Vec::new();
        for (i, node) in s.nodes().enumerate() {
            if !mesh.has_element(node) {
                continue;
            }
            let (factor, kind) = stiffness(node);
            let corners: [[f64; 3]; 8] = std::array::from_fn(|c| {
                let row = 4 + (c >> 1 & 1) + 3 * (c >> 2);
                u[s.rows[row] as usize + i + (c & 1)]
            });
            let at = [s.at[0] as usize + i, s.at[1] as usize, s.at[2] as usize];
            let kind = usize::from(kind);
            found.push(brick(
                mesh.grid.index(at),
                h,
                &matrices[kind],
                kinds[kind],
                f64::from(factor),
                &corners,
            ));
        }
        found
    };
    let rows = mesh.segments.par_iter().step_by(step.max(1));
    let all: Vec<Vec<Brick>> = rows.map(segment).collect();
    all.into_iter().flatten().collect()
}

fn brick(
    element: usize,
    h: [f64; 3],
    k: &ElementMatrix,
    (young, nu, _): Kind,
    factor: f64,
    corners: &[[f64; 3]; 8],
) -> Brick {
    let mut twice_energy = 0.0;
    for i in 0..24 {
        let force: f64 = (0..24).map(|j| k[i][j] * corners[j / 3][j % 3]).sum();
        twice_energy += force * corners[i / 3][i % 3];
    }
    let density = 0.5 * twice_energy / (h[0] * h[1] * h[2]);
    let mut gradient = [[0.0; 3]; 3];
    for (c, u) in corners.iter().enumerate() {
        for (a, row) in gradient.iter_mut().enumerate() {
            for (b, g) in row.iter_mut().enumerate() {
                let sign = if c >> b & 1 == 1 { 1.0 } else { -1.0 };
                *g += 0.25 * sign * u[a] / h[b];
            }
        }
    }
    let third = (gradient[0][0] + gradient[1][1] + gradient[2][2]) / 3.0;
    let mut deviator = 0.0;
    for a in 0..3 {
        for b in 0..3 {
            let strain = 0.5 * (gradient[a][b] + gradient[b][a]);
            deviator += (strain - if a == b { third } else { 0.0 }).powi(2);
        }
    }
    let shear = young / (2.0 * (1.0 + nu));
    let mean = |a: usize| 0.125 * corners.iter().map(|u| u[a]).sum::<f64>();
    Brick {
        element,
        energy_density_mpa: (factor * density) as f32,
        von_mises_mpa: (factor * 2.0 * shear * (1.5 * deviator).sqrt()) as f32,
        effective_strain: (2.0 * density.max(0.0) / young).sqrt() as f32,
        displacement_mm: [0, 1, 2].map(|a| mean(a) as f32),
    }
}
