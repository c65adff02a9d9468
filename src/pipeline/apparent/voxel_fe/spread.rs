//! Owns how values of elements come to voxels of the scan: means of a voxel's finer elements, or the coarser element around its
//! centre.

use crate::grid::Grid;
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::{Specimen, Volume};

/// Elements' values by voxel of the scan: the mean of a voxel's elements, or that of the element around its centre. `values` are
/// by element of `grid`.
pub fn spread(
    grid: Grid,
    specimen: &Specimen,
    params: &SolveParams,
    values: impl Iterator<Item = (usize, f32)>,
) -> Volume<f32> {
    let scan = specimen.bone.grid;
    let mut out = vec![0f32; scan.len()];
    let [nx, ny, _] = grid.n;
    if params.coarsen > 1 {
        let mut coarse = vec![0f32; grid.len()];
        values.for_each(|(element, value)| coarse[element] = value);
        let around = |i: usize, a: usize| ((2 * i + 1) * grid.n[a]) / (2 * scan.n[a]);
        let [sx, sy, _] = scan.n;
        for (v, out) in out.iter_mut().enumerate() {
            if specimen.bone.as_slice()[v] != 0 {
                let at = [v % sx, v / sx % sy, v / (sx * sy)];
                *out = coarse[grid.index([0, 1, 2].map(|a| around(at[a], a)))];
            }
        }
    } else {
        let n = params.refine;
        let share = 1.0 / (n * n * n) as f32;
        for (e, value) in values {
            let voxel = scan.index([e % nx / n, e / nx % ny / n, e / (nx * ny) / n]);
            out[voxel] += share * value;
        }
    }
    let mut volume = Volume::from_vec(scan, out);
    volume.affine = specimen.bone.affine;
    volume
}

/// The same on the scan's grid, from elements of another size: the mean of a voxel's elements where they are finer, that
/// of the element around the voxel's centre where they are coarser.
pub fn onto(values: &Volume<f32>, scan: &Volume<u8>) -> Volume<f32> {
    let (from, to) = (values.grid, scan.grid);
    let mut out = vec![0f32; to.len()];
    if from.n[0] >= to.n[0] {
        let [fx, fy, _] = from.n;
        let factor: [usize; 3] = std::array::from_fn(|a| from.n[a] / to.n[a]);
        let share = 1.0 / factor.iter().product::<usize>() as f32;
        for (e, value) in values.as_slice().iter().enumerate() {
            let at = [
                e % fx / factor[0],
                e / fx % fy / factor[1],
                e / (fx * fy) / factor[2],
            ];
            out[to.index(at)] += share * value;
        }
    } else {
        let around = |i: usize, a: usize| ((2 * i + 1) * from.n[a]) / (2 * to.n[a]);
        let [sx, sy, _] = to.n;
        for (v, out) in out
            .iter_mut()
            .enumerate()
            .filter(|(v, _)| scan.as_slice()[*v] != 0)
        {
            let at = [v % sx, v / sx % sy, v / (sx * sy)];
            *out = values.as_slice()[from.index([0, 1, 2].map(|a| around(at[a], a)))];
        }
    }
    let mut volume = Volume::from_vec(to, out);
    volume.affine = scan.affine;
    volume
}
