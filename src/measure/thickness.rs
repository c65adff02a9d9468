//! Owns the quick estimate of strut thickness that warnings compare lattice parameters and voxels with.

use crate::volume::Volume;
use rayon::prelude::*;

/// Area in mm² of voxel faces between bone and pore inside the volume; the volume's own faces do not count.
pub fn voxel_face_area_mm2(bone: &Volume<u8>) -> f64 {
    let [nx, ny, nz] = bone.grid.n;
    let [sx, sy, sz] = bone.grid.spacing_mm;
    let voxels = bone.as_slice();
    let differing = |a: &[u8], b: &[u8]| {
        a.iter()
            .zip(b)
            .filter(|(a, b)| (**a != 0) != (**b != 0))
            .count() as u64
    };
    let row = |r: usize| &voxels[r * nx..(r + 1) * nx];
    let [x, y, z] = (0..ny * nz)
        .into_par_iter()
        .map(|r| {
            let along_x = differing(&row(r)[1..], &row(r)[..nx - 1]);
            let along_y = if r % ny + 1 < ny {
                differing(row(r), row(r + 1))
            } else {
                0
            };
            let along_z = if r + ny < ny * nz {
                differing(row(r), row(r + ny))
            } else {
                0
            };
            [along_x, along_y, along_z]
        })
        .reduce(|| [0; 3], |a, b| std::array::from_fn(|i| a[i] + b[i]));
    x as f64 * sy * sz + y as f64 * sx * sz + z as f64 * sx * sy
}

/// Mean strut thickness by the parallel-plate model, `2 BV / BS` (Parfitt 1983), in mm. The surface BS is 2/3 of the
/// area of voxel faces: averaged over directions a unit area shows 3/2 of itself on the three axes' planes.
/// None where there is no surface (all bone, or none).
///
/// Plates come out right, rods of diameter d as d/2: the estimate is low, so warnings based on it come early.
pub fn plate_thickness_mm(bone: &Volume<u8>) -> Option<f64> {
    let surface = 2.0 / 3.0 * voxel_face_area_mm2(bone);
    let voxels = bone.as_slice().par_iter().filter(|&&b| b != 0).count();
    (surface > 0.0).then(|| 2.0 * voxels as f64 * bone.grid.voxel_mm3() / surface)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn a_ball_has_the_volume_to_surface_ratio_of_a_ball() {
        let grid = Grid::new([80, 40, 80], [0.01, 0.02, 0.01]);
        let radius = 0.3;
        let voxels = (0..grid.len()).map(|at| {
            let p = [at % 80, at / 80 % 40, at / 3200];
            let d2: f64 = (0..3)
                .map(|a| ((p[a] as f64 + 0.5) * grid.spacing_mm[a] - 0.4).powi(2))
                .sum();
            u8::from(d2 < radius * radius)
        });
        let ball = Volume::from_vec(grid, voxels.collect());
        // 2 V / S = 2 r / 3; the voxelised ball gives 0.1997.
        let t = plate_thickness_mm(&ball).unwrap();
        assert!((t / (2.0 * radius / 3.0) - 1.0).abs() < 0.02, "{t}");
    }

    #[test]
    fn a_solid_block_has_no_thickness() {
        let grid = Grid::new([3, 4, 5], [1.0; 3]);
        assert_eq!(
            plate_thickness_mm(&Volume::from_vec(grid, vec![1; 60])),
            None
        );
    }
}
