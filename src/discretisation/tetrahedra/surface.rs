//! Owns where bone ends between voxels: voxel values interpolated and compared with a level.
//!
//! Cubic interpolation along each axis (Keys 1981, a = −½), as finer voxels take it: values and slopes are continuous. Beyond
//! the outermost voxel centres values go on in a straight line.

use crate::grid::Grid;
use crate::volume::Volume;

/// Bone lies where `sign (value − level)` is positive.
#[derive(Debug, Clone)]
pub struct Bound {
    pub values: Volume<f32>,
    pub level: f32,
    /// 1 where bone has the larger values, −1 where it has the smaller ones.
    pub sign: f32,
}

/// Bone lies where all bounds allow it. All are on one grid.
#[derive(Debug, Clone)]
pub struct Surface {
    bounds: Vec<Bound>,
}

/// Voxels along an axis that a value is made of, their weights and those of its slope per voxel.
struct Taps {
    first: usize,
    weights: [f64; 4],
    slopes: [f64; 4],
}

fn keys(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        (1.5 * x - 2.5) * x * x + 1.0
    } else if x < 2.0 {
        ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0
    } else {
        0.0
    }
}

fn keys_slope(x: f64) -> f64 {
    let (sign, x) = (x.signum(), x.abs());
    sign * if x < 1.0 {
        (4.5 * x - 5.0) * x
    } else if x < 2.0 {
        (-1.5 * x + 5.0) * x - 4.0
    } else {
        0.0
    }
}

impl Taps {
    /// At `at` voxels from the first voxel's centre, of `n` voxels.
    fn new(at: f64, n: usize) -> Taps {
        let last = n as isize - 1;
        let at = at.clamp(-1.0, n as f64);
        let lowest = at.floor() as isize - 1;
        let first = lowest.clamp(0, (last - 3).max(0));
        let (mut weights, mut slopes) = ([0.0; 4], [0.0; 4]);
        for voxel in lowest..lowest + 4 {
            let x = at - voxel as f64;
            let (end, beyond, inner) = match voxel {
                v if v < 0 => (0, -v, 1.min(last)),
                v if v > last => (last, v - last, (last - 1).max(0)),
                v => (v, 0, v),
            };
            for (w, value) in [(&mut weights, keys(x)), (&mut slopes, keys_slope(x))] {
                w[(end - first) as usize] += value * (1 + beyond) as f64;
                w[(inner - first) as usize] -= value * beyond as f64;
            }
        }
        Taps {
            first: first as usize,
            weights,
            slopes,
        }
    }
}

impl Surface {
    /// # Panics
    /// Without a bound.
    pub fn new(bounds: Vec<Bound>) -> Surface {
        assert!(!bounds.is_empty(), "a surface needs a bound");
        Surface { bounds }
    }

    pub fn grid(&self) -> Grid {
        self.bounds[0].values.grid
    }

    fn taps(&self, at_mm: [f64; 3]) -> [Taps; 3] {
        let grid = self.grid();
        std::array::from_fn(|a| Taps::new(at_mm[a] / grid.spacing_mm[a] - 0.5, grid.n[a]))
    }

    /// Positive in bone; in units of the values.
    pub fn value(&self, at_mm: [f64; 3]) -> f64 {
        let [x, y, z] = self.taps(at_mm);
        let of = |b: &Bound| {
            let sum = sum(
                &b.values,
                [&x, &y, &z],
                [&x.weights, &y.weights, &z.weights],
            );
            f64::from(b.sign) * (sum - f64::from(b.level))
        };
        self.bounds.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// The value and its slope per mm, of the bound that is the tightest there.
    pub fn value_and_slope(&self, at_mm: [f64; 3]) -> (f64, [f64; 3]) {
        let [x, y, z] = self.taps(at_mm);
        let mut tightest = (f64::INFINITY, [0.0; 3]);
        for b in &self.bounds {
            let sum = |wx, wy, wz| sum(&b.values, [&x, &y, &z], [wx, wy, wz]);
            let value = sum(&x.weights, &y.weights, &z.weights);
            let value = f64::from(b.sign) * (value - f64::from(b.level));
            if value < tightest.0 {
                let spacing = self.grid().spacing_mm;
                let slope = [
                    sum(&x.slopes, &y.weights, &z.weights),
                    sum(&x.weights, &y.slopes, &z.weights),
                    sum(&x.weights, &y.weights, &z.slopes),
                ];
                let slope = std::array::from_fn(|a| f64::from(b.sign) * slope[a] / spacing[a]);
                tightest = (value, slope);
            }
        }
        tightest
    }

    /// About how far inside bone a place is, in mm: the value over its slope.
    pub fn depth_mm(&self, at_mm: [f64; 3]) -> f64 {
        let (value, slope) = self.value_and_slope(at_mm);
        let steep = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        if steep > 0.0 { value / steep } else { 0.0 }
    }
}

fn sum(volume: &Volume<f32>, [x, y, z]: [&Taps; 3], [wx, wy, wz]: [&[f64; 4]; 3]) -> f64 {
    let [nx, ny, nz] = volume.grid.n;
    let values = volume.as_slice();
    let mut sum = 0.0;
    for (k, wz) in wz.iter().enumerate() {
        let plane = (z.first + k).min(nz - 1) * ny;
        for (j, wy) in wy.iter().enumerate() {
            let row = (plane + (y.first + j).min(ny - 1)) * nx;
            let mut line = 0.0;
            for (i, wx) in wx.iter().enumerate() {
                line += wx * f64::from(values[row + (x.first + i).min(nx - 1)]);
            }
            sum += wz * wy * line;
        }
    }
    sum
}
