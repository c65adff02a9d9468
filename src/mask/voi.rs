//! Owns the volume of interest: what is outside is pore, and TV is its volume.

use crate::grid::Grid;
use crate::volume::Volume;
use rayon::prelude::*;

/// Which part of a grid is specimen.
#[derive(Debug, Clone, Copy)]
pub enum Inside<'a> {
    Box,
    /// Around an axis along z; millimetres from the grid's corner.
    Cylinder {
        center_mm: [f64; 2],
        diameter_mm: f64,
    },
    /// Non-zero is inside.
    Mask(&'a Volume<u8>),
}

impl Inside<'_> {
    /// The widest centred cylinder along z.
    pub fn fitted_cylinder(grid: &Grid) -> Self {
        let [x, y, _] = grid.size_mm();
        Inside::Cylinder {
            center_mm: [x / 2.0, y / 2.0],
            diameter_mm: x.min(y),
        }
    }

    /// Volume in mm³, pores included, counted in voxels as bone is: a solid cylinder has BV/TV 1.
    pub fn tv_mm3(&self, grid: &Grid) -> f64 {
        let voxels = match self {
            Inside::Box => return grid.size_mm().iter().product(),
            Inside::Cylinder { .. } => {
                let slice = Grid::new([grid.n[0], grid.n[1], 1], grid.spacing_mm);
                let mut disc = Volume::from_vec(slice, vec![1; slice.len()]);
                let outside = self.clear_outside(&mut disc);
                (slice.len() - outside as usize) * grid.n[2]
            }
            Inside::Mask(mask) => mask.as_slice().par_iter().filter(|&&m| m != 0).count(),
        };
        voxels as f64 * grid.voxel_mm3()
    }

    /// 1 inside; None for the whole box.
    pub fn mask(&self, grid: Grid) -> Option<Volume<u8>> {
        if matches!(self, Inside::Box) {
            return None;
        }
        let mut mask = Volume::from_vec(grid, vec![1; grid.len()]);
        self.clear_outside(&mut mask);
        Some(mask)
    }

    /// Sets what is outside to 0 and returns how many bone voxels were lost.
    pub fn clear_outside(&self, bone: &mut Volume<u8>) -> u64 {
        let grid = bone.grid;
        let row = grid.n[0];
        let rows = bone
            .values
            .as_slice_mut()
            .expect("volumes are kept in standard layout")
            .par_chunks_mut(row)
            .enumerate();
        match self {
            Inside::Box => 0,
            Inside::Cylinder {
                center_mm,
                diameter_mm,
            } => rows
                .map(|(r, voxels)| {
                    let y = ((r % grid.n[1]) as f64 + 0.5) * grid.spacing_mm[1] - center_mm[1];
                    // A hair more, so that rounding does not decide about centres that lie on the circle.
                    let reach = diameter_mm * diameter_mm / 4.0 * (1.0 + 1e-9) - y * y;
                    clear(voxels, |i| {
                        let x = (i as f64 + 0.5) * grid.spacing_mm[0] - center_mm[0];
                        x * x <= reach
                    })
                })
                .sum(),
            Inside::Mask(mask) => rows
                .map(|(r, voxels)| {
                    let inside = &mask.as_slice()[r * row..(r + 1) * row];
                    clear(voxels, |i| inside[i] != 0)
                })
                .sum(),
        }
    }
}

fn clear(voxels: &mut [u8], inside: impl Fn(usize) -> bool) -> u64 {
    let mut lost = 0;
    for (i, v) in voxels.iter_mut().enumerate() {
        if *v != 0 && !inside(i) {
            *v = 0;
            lost += 1;
        }
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cylinder_keeps_its_share_of_voxels() {
        let grid = Grid::new([100, 120, 3], [0.02, 0.02, 0.05]);
        let mut bone = Volume::from_vec(grid, vec![1u8; grid.len()]);
        let inside = Inside::fitted_cylinder(&grid);
        let lost = inside.clear_outside(&mut bone);
        let kept: u64 = bone.as_slice().iter().map(|&v| u64::from(v)).sum();
        assert_eq!(kept + lost, grid.len() as u64);
        let tv = inside.tv_mm3(&grid);
        assert!((kept as f64 * grid.voxel_mm3() / tv - 1.0).abs() < 1e-12);
        // Voxel centres in a circle of 100 voxels across: off by 0.04 % here.
        let exact = std::f64::consts::PI / 4.0 * 2.0f64.powi(2) * 0.15;
        assert!((tv / exact - 1.0).abs() < 2e-3);
        assert_eq!(bone.values[[1, 60, 50]], 1);
        assert_eq!(bone.values[[1, 0, 0]], 0);
    }
}
