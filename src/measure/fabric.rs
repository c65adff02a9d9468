//! Owns the fabric of a mask: mean intercept lengths and the degree of anisotropy.
//!
//! A line along `n` crosses a surface of normal `ν` and area `dS` with density `|n · ν| dS`, so the number of times that
//! all lines of that direction enter bone is half the sum over the surface. The surface is the slope of the mask smoothed by
//! one voxel: `MIL(n) = BV / (½ ∫ |n · ∇χ| dV)`, what counting along infinitely many lines comes to, without the
//! steps of the voxels. `1 / MIL²` is fitted by an ellipsoid (Harrigan and Mann 1984).

use crate::mask::gaussian;
use crate::volume::Volume;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Directions over half a sphere.
const DIRECTIONS: usize = 301;

/// Smoothing in voxels.
const SIGMA: f64 = 1.0;

/// The ellipsoid of mean intercept lengths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fabric {
    /// Half-axes, the longest first, in mm of bone.
    pub mil_mm: [f64; 3],
    /// Their directions: unit vectors x, y, z, with z not below 0.
    pub directions: [[f64; 3]; 3],
    /// Degree of anisotropy: longest over shortest, 1 is isotropic.
    pub da: f64,
}

/// The fabric of bone within its box or, where given, the part of it that is `within` (non-zero). None without surface,
/// or where lines of some direction never leave the bone (perfect plates and rods).
pub fn fabric(bone: &Volume<u8>, within: Option<&Volume<u8>>) -> Option<Fabric> {
    let fit = fitted(bone, within)?;
    // Ascending: the longest first. An axis fifty times the mean is a line that never leaves the bone.
    if fit.squares[0] < 4e-4 {
        return None;
    }
    let mil_mm = fit.squares.map(|square| fit.scale_mm / square.sqrt());
    Some(Fabric {
        mil_mm,
        directions: fit.directions,
        da: mil_mm[0] / mil_mm[2],
    })
}

/// The direction of the longest mean intercept, and by how much it is longer than the next (infinite for perfect rods).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// Unit vector x, y, z, with z not below 0.
    pub direction: [f64; 3],
    /// Longest over second longest half-axis, at least 1.
    pub ratio: f64,
}

/// The main direction of bone, also where it has no ellipsoid; `within` as for [`fabric`]. None without surface.
pub fn principal(bone: &Volume<u8>, within: Option<&Volume<u8>>) -> Option<Principal> {
    let fit = fitted(bone, within)?;
    let [first, second, _] = fit.squares.map(|square| square.max(1e-12));
    Some(Principal {
        direction: fit.directions[0],
        ratio: (second / first).sqrt(),
    })
}

/// `1 / MIL²` along its own axes.
struct Fit {
    /// Over `1 / scale²`, ascending.
    squares: [f64; 3],
    directions: [[f64; 3]; 3],
    scale_mm: f64,
}

fn fitted(bone: &Volume<u8>, within: Option<&Volume<u8>>) -> Option<Fit> {
    let smooth = smoothed(bone);
    let room = within.map(smoothed);
    let [nx, ny, nz] = bone.grid.n;
    let s = bone.grid.spacing_mm;
    let voxels = |at: usize| room.as_ref().is_none_or(|r| r[at] > 0.999);
    // Slopes across the box's faces are mirrored away: the faces are no surface of the bone.
    let slope = |at: usize| -> [f64; 3] {
        let p = [at % nx, at / nx % ny, at / (nx * ny)];
        let step = [1, nx, nx * ny];
        let n = [nx, ny, nz];
        std::array::from_fn(|a| {
            let ahead = if p[a] + 1 < n[a] { at + step[a] } else { at };
            let behind = if p[a] > 0 { at - step[a] } else { at };
            0.5 * f64::from(smooth[ahead] - smooth[behind]) / s[a]
        })
    };
    let surface: Vec<[f32; 3]> = (0..smooth.len())
        .into_par_iter()
        .filter(|&at| voxels(at))
        .map(|at| slope(at).map(|v| v as f32))
        .filter(|g| g.iter().any(|&v| v != 0.0))
        .collect();
    let bv = (0..smooth.len())
        .into_par_iter()
        .filter(|&at| voxels(at) && bone.as_slice()[at] != 0)
        .count() as f64;
    if surface.is_empty() || bv == 0.0 {
        return None;
    }
    let directions: Vec<[f64; 3]> = (0..DIRECTIONS).map(direction).collect();
    let lengths: Vec<f64> = directions
        .par_iter()
        .map(|n| {
            let [x, y, z] = n.map(|v| v as f32);
            let crossings: f64 = surface
                .chunks(4096)
                .map(|part| {
                    let sum: f32 = part
                        .iter()
                        .map(|g| (x * g[0] + y * g[1] + z * g[2]).abs())
                        .sum();
                    f64::from(sum)
                })
                .sum();
            2.0 * bv / crossings
        })
        .collect();
    ellipsoid(&directions, &lengths)
}

fn smoothed(mask: &Volume<u8>) -> Vec<f32> {
    let values = mask.as_slice().iter().map(|&v| f32::from(u8::from(v != 0)));
    let volume = Volume::from_vec(mask.grid, values.collect());
    gaussian::map_slabs(&volume, SIGMA, |v| v, |_, slab| slab.to_vec()).concat()
}

/// Evenly spread over the half sphere z > 0, along a golden spiral.
fn direction(i: usize) -> [f64; 3] {
    let z = (i as f64 + 0.5) / DIRECTIONS as f64;
    let angle = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    [r * angle.cos(), r * angle.sin(), z]
}

/// Least squares of `nᵀ M n = 1 / MIL²`, scaled to the (harmonic) mean: lengths may be infinite.
fn ellipsoid(directions: &[[f64; 3]], lengths: &[f64]) -> Option<Fit> {
    let scale = lengths.len() as f64 / lengths.iter().map(|l| 1.0 / l).sum::<f64>();
    let terms = |[x, y, z]: [f64; 3]| [x * x, y * y, z * z, 2.0 * x * y, 2.0 * y * z, 2.0 * z * x];
    let a = Mat::from_fn(lengths.len(), 6, |i, j| terms(directions[i])[j]);
    let b = Mat::from_fn(lengths.len(), 1, |i, _| (scale / lengths[i]).powi(2));
    let m = (a.transpose() * &a)
        .llt(Side::Lower)
        .ok()?
        .solve(a.transpose() * &b);
    let [xx, yy, zz, xy, yz, zx] = std::array::from_fn(|j| m[(j, 0)]);
    let tensor = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
    let eigen = Mat::from_fn(3, 3, |i, j| tensor[i][j])
        .self_adjoint_eigen(Side::Lower)
        .ok()?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let directions = std::array::from_fn(|i| {
        let v: [f64; 3] = std::array::from_fn(|a| vectors[(a, i)]);
        let sign = if v[2] < 0.0 { -1.0 } else { 1.0 };
        v.map(|c| sign * c)
    });
    Some(Fit {
        squares: std::array::from_fn(|i| values[i]),
        directions,
        scale_mm: scale,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn mask(n: usize, spacing: [f64; 3], bone: impl Fn([f64; 3]) -> bool) -> Volume<u8> {
        let grid = Grid::new([n; 3], spacing);
        let voxels = (0..grid.len()).map(|at| {
            let p = [at % n, at / n % n, at / (n * n)];
            u8::from(bone(std::array::from_fn(|a| {
                (p[a] as f64 + 0.5) * spacing[a]
            })))
        });
        Volume::from_vec(grid, voxels.collect())
    }

    /// An ellipsoid of half-axes a, b, c has mean chords 4/3 of them, and 1 / MIL² is a quadratic form: any turn of it has
    /// the same fabric, turned.
    #[test]
    fn the_fabric_of_an_ellipsoid_is_itself() {
        let (axes, angle) = ([0.32, 0.24, 0.16], 0.5f64);
        let long = [angle.cos(), 0.0, angle.sin()];
        let short = [-angle.sin(), 0.0, angle.cos()];
        let body = mask(50, [0.02; 3], |p| {
            let p = p.map(|v| v - 0.5);
            let dot = |d: [f64; 3]| p.iter().zip(d).map(|(a, b)| a * b).sum::<f64>();
            let q = [dot(long) / axes[0], p[1] / axes[1], dot(short) / axes[2]];
            q.iter().map(|v| v * v).sum::<f64>() < 1.0
        });
        let f = fabric(&body, None).unwrap();
        for (found, axis) in f.mil_mm.iter().zip(axes) {
            // Measured: -0.9, +0.9 and +2.1 %: smoothing by a voxel rounds the short axis, of eight voxels.
            assert!((found / (4.0 / 3.0 * axis) - 1.0).abs() < 0.025, "{f:?}");
        }
        // Measured: -2.9 %, the same cause.
        assert!((f.da / 2.0 - 1.0).abs() < 0.035, "{f:?}");
        let along: f64 = f.directions[0].iter().zip(long).map(|(a, b)| a * b).sum();
        assert!(along.abs() > 0.999, "{f:?}");
    }

    #[test]
    fn equal_pores_are_isotropic_also_in_unequal_voxels() {
        let wave = |v: f64| (v * std::f64::consts::TAU / 0.32).sin();
        let f = fabric(
            &mask(64, [0.02, 0.02, 0.01], |p| {
                p.iter().map(|&v| wave(v)).sum::<f64>() > 0.0
            }),
            None,
        );
        let f = f.unwrap();
        // Smoothing is by voxels, so a little more in x and y than in z.
        assert!(f.da < 1.05, "{f:?}");
    }

    #[test]
    fn perfect_rods_and_plates_have_no_ellipsoid_and_broken_ones_point_along_themselves() {
        let rod = |p: [f64; 3]| (p[0] - 0.3).powi(2) + (p[1] - 0.3).powi(2) < 0.04;
        assert!(fabric(&mask(30, [0.02; 3], rod), None).is_none());
        let along = principal(&mask(30, [0.02; 3], rod), None).unwrap();
        assert!(
            along.direction[2] > 0.9999 && along.ratio > 50.0,
            "{along:?}"
        );
        assert!(fabric(&mask(30, [0.02; 3], |p| p[0] % 0.2 < 0.1), None).is_none());
        // A rod in pieces, 0.5 long and 0.2 across.
        let pieces =
            |p: [f64; 3]| (p[0] % 0.4 - 0.2).hypot(p[1] % 0.4 - 0.2) < 0.1 && p[2] % 0.6 < 0.5;
        let f = fabric(&mask(60, [0.02; 3], pieces), None).unwrap();
        assert!(f.directions[0][2] > 0.999 && f.da > 2.0, "{f:?}");
        // Tiles 0.4 wide and 0.1 thick: the shortest axis is their normal.
        let tiles = |p: [f64; 3]| p[0] % 0.3 < 0.1 && p[1] % 0.5 < 0.4 && p[2] % 0.5 < 0.4;
        let f = fabric(&mask(60, [0.02; 3], tiles), None).unwrap();
        assert!(f.directions[2][0].abs() > 0.999 && f.da > 2.0, "{f:?}");
    }
}
