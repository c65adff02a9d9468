//! Owns what is read off solved bricks: each element's energy, stress, strain and displacement, and its nodal forces.

use super::element::{self, ElementMatrix, Integration};
use crate::discretisation::voxels::{Segment, VoxelMesh};
use rayon::prelude::*;

/// One kind of element: Young's modulus in MPa, Poisson's ratio, and how it is integrated.
pub type Kind = (f64, f64, Integration);

/// What a brick stores and bears. Tensors are those at its centre, which are its means, in the order 11, 22, 33, 23, 13, 12.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brick {
    /// Index in the mesh's grid.
    pub element: usize,
    /// Young's modulus in MPa.
    pub young_mpa: f32,
    /// Strain energy over the element's volume, in MPa (N mm/mm³).
    pub mean_energy_density_mpa: f32,
    /// Strain energy density of the strain at the centre, ½ σ:ε, in MPa.
    pub centre_energy_density_mpa: f32,
    /// Shears are engineering shears, twice the tensor's components.
    pub strain: [f32; 6],
    pub stress_mpa: [f32; 6],
    /// Equivalent stress, in MPa.
    pub von_mises_mpa: f32,
    /// At the centre, in mm.
    pub displacement_mm: [f32; 3],
}

/// Displacements (mm) of a mesh's nodes, with the kinds of its elements. `stiffness` yields factor and kind of the element whose
/// corner of smallest x, y, z is a node.
pub struct Deformed<'a, F> {
    pub mesh: &'a VoxelMesh,
    pub kinds: &'a [Kind],
    pub stiffness: F,
    pub u: &'a [[f64; 3]],
}

/// One element of a deformed mesh.
struct Placed {
    at: [usize; 3],
    factor: f64,
    kind: usize,
    corners: [[f64; 3]; 8],
}

impl<F: Fn(usize) -> (f32, u8) + Sync> Deformed<'_, F> {
    /// What `read` makes of every element, in the order of the elements.
    pub fn bricks<T: Send>(&self, read: impl Fn(&Brick) -> T + Sync) -> Vec<T> {
        self.sample(1, read)
    }

    /// The same of the elements of every `step`-th row of the mesh: enough for means over many.
    pub fn sample<T: Send>(&self, step: usize, read: impl Fn(&Brick) -> T + Sync) -> Vec<T> {
        let matrices = self.matrices();
        let h = self.mesh.grid.spacing_mm;
        let rows = self.mesh.segments.par_iter().step_by(step.max(1));
        let of_row = |s: &Segment| -> Vec<T> {
            let brick = |p: Placed| {
                let element = self.mesh.grid.index(p.at);
                read(&brick(
                    element,
                    h,
                    &matrices[p.kind],
                    self.kinds[p.kind],
                    &p,
                ))
            };
            self.placed(s).map(brick).collect()
        };
        let all: Vec<Vec<T>> = rows.map(of_row).collect();
        all.into_iter().flatten().collect()
    }

    /// The forces (N) at the corners of every element of one layer across an axis: element, its indices, forces by corner
    /// `cx + 2 cy + 4 cz`.
    pub fn layer_forces(
        &self,
        axis: usize,
        layer: usize,
    ) -> Vec<(usize, [usize; 3], [[f64; 3]; 8])> {
        let matrices = self.matrices();
        let of_row = |s: &Segment| -> Vec<_> {
            let inside = self.placed(s).filter(|p| p.at[axis] == layer);
            let forces = |p: Placed| {
                let f = forces(&matrices[p.kind], p.factor, &p.corners);
                (self.mesh.grid.index(p.at), p.at, f)
            };
            inside.map(forces).collect()
        };
        let all: Vec<Vec<_>> = self.mesh.segments.par_iter().map(of_row).collect();
        all.into_iter().flatten().collect()
    }

    fn matrices(&self) -> Vec<ElementMatrix> {
        let h = self.mesh.grid.spacing_mm;
        let of = |&(young, nu, rule): &Kind| element::stiffness(h, young, nu, rule);
        self.kinds.iter().map(of).collect()
    }

    /// The elements whose corners of smallest x, y, z lie in a segment.
    fn placed<'s>(&'s self, s: &'s Segment) -> impl Iterator<Item = Placed> + 's {
        let own = s.nodes().enumerate();
        let exist = own.filter(|(_, node)| self.mesh.has_element(*node));
        exist.map(move |(i, node)| {
            let (factor, kind) = (self.stiffness)(node);
            let corner = |c: usize| {
                let row = 4 + (c >> 1 & 1) + 3 * (c >> 2);
                self.u[s.rows[row] as usize + i + (c & 1)]
            };
            Placed {
                at: [s.at[0] as usize + i, s.at[1] as usize, s.at[2] as usize],
                factor: f64::from(factor),
                kind: usize::from(kind),
                corners: std::array::from_fn(corner),
            }
        })
    }
}

/// Nodal forces of one element.
fn forces(k: &ElementMatrix, factor: f64, corners: &[[f64; 3]; 8]) -> [[f64; 3]; 8] {
    let force = |i: usize| -> f64 { (0..24).map(|j| k[i][j] * corners[j / 3][j % 3]).sum() };
    std::array::from_fn(|c| std::array::from_fn(|a| factor * force(3 * c + a)))
}

fn brick(
    element: usize,
    h: [f64; 3],
    k: &ElementMatrix,
    (young, nu, _): Kind,
    placed: &Placed,
) -> Brick {
    let Placed {
        factor, corners, ..
    } = placed;
    let forces = forces(k, *factor, corners);
    let pairs = forces.as_flattened().iter().zip(corners.as_flattened());
    let twice_energy: f64 = pairs.map(|(f, u)| f * u).sum();
    let strain = centre_strain(h, corners);
    let young = factor * young;
    let (lambda, shear) = (
        young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        young / (2.0 * (1.0 + nu)),
    );
    let trace: f64 = strain[..3].iter().sum();
    let stress: [f64; 6] = std::array::from_fn(|i| match i {
        0..3 => lambda * trace + 2.0 * shear * strain[i],
        _ => shear * strain[i],
    });
    let twice_density: f64 = strain.iter().zip(&stress).map(|(e, s)| e * s).sum();
    let mean = |a: usize| 0.125 * corners.iter().map(|u| u[a]).sum::<f64>();
    Brick {
        element,
        young_mpa: young as f32,
        mean_energy_density_mpa: (0.5 * twice_energy / (h[0] * h[1] * h[2])) as f32,
        centre_energy_density_mpa: (0.5 * twice_density) as f32,
        strain: strain.map(|v| v as f32),
        stress_mpa: stress.map(|v| v as f32),
        von_mises_mpa: von_mises(stress) as f32,
        displacement_mm: [0, 1, 2].map(|a| mean(a) as f32),
    }
}

/// Strain at the centre, engineering shears.
fn centre_strain(h: [f64; 3], corners: &[[f64; 3]; 8]) -> [f64; 6] {
    let mut gradient = [[0.0; 3]; 3];
    for (c, u) in corners.iter().enumerate() {
        for (a, row) in gradient.iter_mut().enumerate() {
            for (b, g) in row.iter_mut().enumerate() {
                let sign = if c >> b & 1 == 1 { 1.0 } else { -1.0 };
                *g += 0.25 * sign * u[a] / h[b];
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = gradient;
    [xx, yy, zz, yz + zy, xz + zx, xy + yx]
}

/// Equivalent stress of a stress tensor.
pub fn von_mises([xx, yy, zz, yz, xz, xy]: [f64; 6]) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (yz * yz + xz * xz + xy * xy)).sqrt()
}
