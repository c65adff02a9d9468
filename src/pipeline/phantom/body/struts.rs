//! Owns bodies of round struts that join with fillets: a smooth minimum of the distances from their axes.

use super::frame::{Vec3, dot, minus, norm, plus, times};

/// A strut between two points (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strut {
    pub from: Vec3,
    pub to: Vec3,
    /// Radius over the mean radius of all.
    pub radius: f64,
    /// Where it is broken, as a share of its length.
    pub broken: Option<f64>,
}

/// Struts and where to find those near a point.
#[derive(Debug, Clone)]
pub struct Struts {
    struts: Vec<Strut>,
    pub radius_mm: f64,
    /// Width over which two struts' surfaces flow into one another.
    fillet_mm: f64,
    gap_mm: f64,
    /// Distances from a surface beyond this are not resolved.
    reach_mm: f64,
    low: Vec3,
    bin_mm: f64,
    bins: [usize; 3],
    /// Struts near each bin: `near[first[b]..first[b + 1]]`.
    first: Vec<u32>,
    near: Vec<u32>,
}

impl Struts {
    /// Struts of this mean radius within `half_mm` of the origin along each axis. `fillet` and `gap` in mean radii.
    pub fn new(struts: Vec<Strut>, radius_mm: f64, [fillet, gap]: [f64; 2], half_mm: Vec3) -> Self {
        let bin_mm = 1.5 * radius_mm;
        let bins = half_mm.map(|h| ((2.0 * h / bin_mm).ceil() as usize).clamp(1, 256));
        let mut all = Struts {
            struts,
            radius_mm,
            fillet_mm: fillet * radius_mm,
            gap_mm: gap * radius_mm,
            reach_mm: (2.0 * fillet + 1.0) * radius_mm,
            low: half_mm.map(|h| -h),
            bin_mm: bin_mm.max(2.0 * half_mm.into_iter().fold(0.0, f64::max) / 256.0),
            bins,
            first: vec![0],
            near: Vec::new(),
        };
        all.sort_into_bins();
        all
    }

    fn sort_into_bins(&mut self) {
        let [nx, ny, nz] = self.bins;
        let mut per_bin: Vec<Vec<u32>> = vec![Vec::new(); nx * ny * nz];
        for (at, strut) in self.struts.iter().enumerate() {
            let reach = strut.radius * self.radius_mm + self.reach_mm;
            let bound = |a: usize| {
                let (low, high) = (
                    strut.from[a].min(strut.to[a]),
                    strut.from[a].max(strut.to[a]),
                );
                let bin = |v: f64| {
                    (((v - self.low[a]) / self.bin_mm).floor().max(0.0) as usize)
                        .min(self.bins[a] - 1)
                };
                bin(low - reach)..=bin(high + reach)
            };
            let half_diagonal = 0.5 * 3f64.sqrt() * self.bin_mm;
            for k in bound(2) {
                for j in bound(1) {
                    for i in bound(0) {
                        let centre: Vec3 = std::array::from_fn(|a| {
                            self.low[a] + ([i, j, k][a] as f64 + 0.5) * self.bin_mm
                        });
                        if along(strut, centre).1 <= reach + half_diagonal {
                            per_bin[(k * ny + j) * nx + i].push(at as u32);
                        }
                    }
                }
            }
        }
        for bin in per_bin {
            self.near.extend(bin);
            self.first.push(self.near.len() as u32);
        }
    }

    fn near(&self, p: Vec3) -> &[u32] {
        let [i, j, k] = std::array::from_fn(|a| {
            (((p[a] - self.low[a]) / self.bin_mm).floor().max(0.0) as usize).min(self.bins[a] - 1)
        });
        let bin = (k * self.bins[1] + j) * self.bins[0] + i;
        &self.near[self.first[bin] as usize..self.first[bin + 1] as usize]
    }

    /// Distance from the surface (mm), negative inside; never more than `reach` less the fillet.
    pub fn value(&self, p: Vec3) -> f64 {
        let mut all = self.reach_mm;
        for &at in self.near(p) {
            let strut = &self.struts[at as usize];
            let (s, distance) = along(strut, p);
            let mut one = distance - strut.radius * self.radius_mm;
            if let Some(middle) = strut.broken {
                let length = norm(minus(strut.to, strut.from));
                one = one.max(0.5 * self.gap_mm - (s - middle * length).abs());
            }
            all = smooth_minimum(all, one, self.fillet_mm);
        }
        all.min(self.reach_mm - self.fillet_mm)
    }
}

/// How far along the axis (mm, not limited to the strut), and the distance from the strut's axis.
fn along(strut: &Strut, p: Vec3) -> (f64, f64) {
    let axis = minus(strut.to, strut.from);
    let length2 = dot(axis, axis);
    let share = dot(minus(p, strut.from), axis) / length2;
    let nearest = plus(strut.from, times(axis, share.clamp(0.0, 1.0)));
    (share * length2.sqrt(), norm(minus(p, nearest)))
}

/// The lesser of two, rounded off where they differ by less than `width` (polynomial, Quilez 2008).
fn smooth_minimum(a: f64, b: f64, width: f64) -> f64 {
    let near = width - (a - b).abs();
    let rounding = if near > 0.0 {
        near * near / (4.0 * width)
    } else {
        0.0
    };
    a.min(b) - rounding
}
