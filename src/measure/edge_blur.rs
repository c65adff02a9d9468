//! Owns the blur of a grey image, read off its edges.
//!
//! Where a threshold lies between two neighbouring voxels, their difference over the contrast of bone and pore says how wide
//! the edge is. For half spaces of any direction and place, box-sampled by voxels and blurred by a Gaussian of σ voxels, its
//! mean is the table below (numerical integration). Struts narrower than the blur show less contrast than there is, so their
//! blur is underestimated.

use crate::volume::Volume;
use rayon::prelude::*;

/// σ in voxels, and the mean jump across an edge over the contrast.
const JUMPS: [(f64, f64); 9] = [
    (0.0, 0.607),
    (0.3, 0.505),
    (0.5, 0.400),
    (0.7, 0.322),
    (0.86, 0.277),
    (1.0, 0.247),
    (1.3, 0.195),
    (1.6, 0.161),
    (2.0, 0.130),
];

/// Share of bone voxels that is brighter, and of pore voxels that is darker, than the level taken for theirs.
const TAIL: f64 = 0.1;

/// Voxels that levels are taken from, about.
const SAMPLED: usize = 2_000_000;

/// σ in voxels of all blur beyond the voxels' own boxes, at most 2. None where `bone` has no edge or no contrast.
pub fn edge_blur_voxels(grey: &Volume<f32>, bone: &Volume<u8>) -> Option<f64> {
    let (values, mask) = (grey.as_slice(), bone.as_slice());
    // A sample will do for levels; its step shares no factor with usual edges.
    let step = values.len().div_ceil(SAMPLED) | 1;
    let of = |wanted: u8| {
        let both = values.iter().zip(mask).step_by(step);
        both.filter(|(_, b)| **b == wanted)
            .map(|(v, _)| *v)
            .collect::<Vec<f32>>()
    };
    let high = level(of(1), 1.0 - TAIL)?;
    let low = level(of(0), TAIL)?;
    let contrast = high - low;
    let (jumps, edges) = jumps(grey, bone);
    (contrast > 0.0 && edges > 0).then(|| sigma(jumps / edges as f64 / contrast))
}

/// The value below which a share of the finite values lies.
fn level(mut values: Vec<f32>, share: f64) -> Option<f64> {
    values.retain(|v| v.is_finite());
    let last = values.len().checked_sub(1)?;
    let at = (share * last as f64).round() as usize;
    Some(f64::from(
        *values.select_nth_unstable_by(at, f32::total_cmp).1,
    ))
}

/// Sum of differences from pore to bone over all faces between them, and the number of those faces.
fn jumps(grey: &Volume<f32>, bone: &Volume<u8>) -> (f64, u64) {
    let [nx, ny, nz] = grey.grid.n;
    let (values, mask) = (grey.as_slice(), bone.as_slice());
    let plane = |z: usize| {
        let (mut sum, mut count) = (0.0, 0);
        let mut add = |a: usize, b: usize| {
            if mask[a] != mask[b] {
                let step = f64::from(values[a]) - f64::from(values[b]);
                sum += if mask[a] != 0 { step } else { -step };
                count += 1;
            }
        };
        for at in z * nx * ny..(z + 1) * nx * ny {
            let (x, y) = (at % nx, at / nx % ny);
            if x + 1 < nx {
                add(at, at + 1);
            }
            if y + 1 < ny {
                add(at, at + nx);
            }
            if z + 1 < nz {
                add(at, at + nx * ny);
            }
        }
        (sum, count)
    };
    // Planes are added up in order, so that the sum is the same on any number of threads.
    let planes: Vec<(f64, u64)> = (0..nz).into_par_iter().map(plane).collect();
    planes
        .into_iter()
        .fold((0.0, 0), |(s, n), (ds, dn)| (s + ds, n + dn))
}

/// From the table, in straight lines between its entries.
fn sigma(jump: f64) -> f64 {
    let between = JUMPS.windows(2).find(|pair| jump >= pair[1].1);
    match between {
        Some(&[(s0, j0), (s1, j1)]) => (s0 + (s1 - s0) * (j0 - jump) / (j0 - j1)).max(0.0),
        _ => JUMPS[JUMPS.len() - 1].0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::mask::gaussian;

    /// A ball of radius 12 voxels, sampled by means of 4³ points a voxel.
    fn ball() -> Volume<f32> {
        let n = 40;
        let grid = Grid::new([n; 3], [0.02; 3]);
        let inside = |p: [f64; 3]| p.iter().map(|x| (x - 20.3).powi(2)).sum::<f64>() < 144.0;
        let value = |i: usize| {
            let at = [i % n, i / n % n, i / (n * n)];
            let points = (0..64).filter(|k| {
                let sub = [k % 4, k / 4 % 4, k / 16];
                inside([0, 1, 2].map(|a| at[a] as f64 + (sub[a] as f64 + 0.5) / 4.0))
            });
            points.count() as f32 / 64.0 * 2400.0 - 1000.0
        };
        Volume::from_vec(grid, (0..grid.len()).map(value).collect())
    }

    #[test]
    fn the_blur_of_a_ball_is_read_off_its_edge() {
        let sharp = ball();
        for blur in [0.0, 0.5, 0.86, 1.3] {
            let slabs = gaussian::map_slabs(&sharp, blur, |v| v, |_, v| v.to_vec());
            let grey = Volume::from_vec(sharp.grid, slabs.concat());
            let bone = grey.as_slice().iter().map(|v| u8::from(*v >= 200.0));
            let bone = Volume::from_vec(grey.grid, bone.collect());
            let found = edge_blur_voxels(&grey, &bone).unwrap();
            assert!((found - blur).abs() < 0.12, "{blur}: {found}");
        }
    }

    #[test]
    fn an_image_without_an_edge_has_no_blur() {
        let grid = Grid::new([4; 3], [1.0; 3]);
        let grey = Volume::from_vec(grid, vec![1.0; 64]);
        assert_eq!(
            edge_blur_voxels(&grey, &Volume::from_vec(grid, vec![1; 64])),
            None
        );
    }
}
