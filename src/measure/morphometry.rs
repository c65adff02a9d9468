//! Owns morphometry of a mask: thickness, separation, connectivity and fabric.

use crate::measure::fabric::{Fabric, fabric};
use crate::measure::spheres::{Spread, local_thickness};
use crate::volume::Volume;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is measured of a mask in addition to BV/TV.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Morphometry {
    /// Local thickness of bone (Tb.Th); None without bone.
    pub tb_th: Option<Spread>,
    /// Local thickness of the pores (Tb.Sp).
    pub tb_sp: Option<Spread>,
    /// Connectivity density in 1/mm³ (Conn.D).
    pub conn_d_per_mm3: f64,
    /// Mean intercept lengths and DA.
    pub fabric: Option<Fabric>,
}

impl Morphometry {
    /// Name, value and unit of each number, as people read them. NA is missing.
    pub fn listed(&self) -> [(&'static str, String, &'static str); 4] {
        let or_na = |words: Option<String>| words.unwrap_or_else(|| "NA".to_owned());
        let spread = |s: &Option<Spread>| {
            let words = |s: &Spread| format!("{:.3} ± {:.3}", s.mean_mm, s.sd_mm);
            or_na(s.as_ref().map(words))
        };
        let da = self.fabric.map(|f| format!("{:.3}", f.da));
        [
            ("Tb.Th", spread(&self.tb_th), "mm"),
            ("Tb.Sp", spread(&self.tb_sp), "mm"),
            ("Conn.D", format!("{:.3}", self.conn_d_per_mm3), "1/mm³"),
            ("DA", or_na(da), ""),
        ]
    }
}

/// Measures `bone` in its volume of interest of `tv_mm3`: its box, or what is `within` (non-zero). Spacing may differ along
/// the axes.
pub fn morphometry(bone: &Volume<u8>, within: Option<&Volume<u8>>, tv_mm3: f64) -> Morphometry {
    Morphometry {
        tb_th: local_thickness(bone, true, within),
        tb_sp: local_thickness(bone, false, within),
        conn_d_per_mm3: connectivity_density(bone, tv_mm3),
        fabric: fabric(bone, within),
    }
}

/// `(1 − χ) / TV` with Euler's number χ of the bone joined through voxel faces, counted from vertices, edges, faces and
/// voxels (Odgaard and Gundersen 1993): for a body of one piece without cavities, the struts that can be cut before it
/// falls apart. Bone that meets in an edge or corner only is not joined: voxels' duals are counted.
pub fn connectivity_density(bone: &Volume<u8>, tv_mm3: f64) -> f64 {
    (1 - euler(bone)) as f64 / tv_mm3
}

/// Euler's number for 6-connected bone: voxels − joined pairs + full squares − full cubes.
pub fn euler(bone: &Volume<u8>) -> i64 {
    let [nx, ny, nz] = bone.grid.n;
    let voxels = bone.as_slice();
    let at = |i: usize, j: usize, k: usize| {
        i < nx && j < ny && k < nz && voxels[(k * ny + j) * nx + i] != 0
    };
    (0..nz)
        .into_par_iter()
        .map(|k| {
            let mut sum = 0i64;
            for j in 0..ny {
                for i in (0..nx).filter(|&i| at(i, j, k)) {
                    let [x, y, z] = [at(i + 1, j, k), at(i, j + 1, k), at(i, j, k + 1)];
                    let xy = x && y && at(i + 1, j + 1, k);
                    let xz = x && z && at(i + 1, j, k + 1);
                    let yz = y && z && at(i, j + 1, k + 1);
                    let xyz = xy && xz && yz && at(i + 1, j + 1, k + 1);
                    let pairs = i64::from(x) + i64::from(y) + i64::from(z);
                    let squares = i64::from(xy) + i64::from(xz) + i64::from(yz);
                    sum += 1 - pairs + squares - i64::from(xyz);
                }
            }
            sum
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::specimens::mask;

    #[test]
    fn euler_numbers_of_known_bodies() {
        let block = |p: [usize; 3]| p.iter().all(|x| (1..6).contains(x));
        let n = [7; 3];
        assert_eq!(euler(&mask(n, [1.0; 3], block)), 1);
        // A tunnel: a ring.
        assert_eq!(
            euler(&mask(n, [1.0; 3], |p| block(p) && !(p[0] == 3 && p[1] == 3))),
            0
        );
        // A cavity: a hollow shell.
        assert_eq!(euler(&mask(n, [1.0; 3], |p| block(p) && p != [3; 3])), 2);
        // Two voxels that meet in an edge are two pieces.
        assert_eq!(
            euler(&mask(n, [1.0; 3], |p| p == [1, 1, 1] || p == [2, 2, 1])),
            2
        );
        // Two tunnels that cross in the middle: genus 3.
        let cross =
            |p: [usize; 3]| block(p) && !(p[0] == 3 && p[1] == 3) && !(p[0] == 3 && p[2] == 3);
        assert_eq!(euler(&mask(n, [1.0; 3], cross)), -2);
    }
}
