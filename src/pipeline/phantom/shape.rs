//! Owns the shape of a phantom: perforated sheets of given thickness with rounded rims, like trabecular plates and rods.
//!
//! The sheets follow the zero level of one Gaussian random field `f`; `|f| / |∇f|` is the distance from it, so that all
//! have the same thickness. A second field `g` cuts holes until the wanted share of bone is left: plates turn into rods
//! as BV/TV falls, as they do in bone. Fields are known in millimetres, not in voxels: the same seed at another voxel
//! size is the same specimen.

use super::PhantomParams;
use super::waves::{Numbers, Waves};
use crate::grid::Grid;
use rayon::prelude::*;

/// Steps of the table of fields per wavelength; cubic interpolation between them is good to 0.1 % of the amplitude.
const STEPS_PER_WAVE: f64 = 14.0;
/// Holes are this much finer than the sheets' waves.
const HOLES: f64 = 1.5;

/// `f`, `|∇f|²` and `g` on a coarse table.
pub struct Shape {
    n: [usize; 3],
    step: f64,
    fields: [Vec<f32>; 3],
    half_mm: f64,
    /// Softens `|∇f|` where sheets merge, per mm².
    soft: f32,
    /// Typical `|∇g|`, per mm.
    slope_g: f32,
}

impl Shape {
    /// The sheets of `params` with a wavelength at which they fill the right share of the box before holes are cut.
    pub fn new(params: &PhantomParams) -> Self {
        Self::with_waves(params, fitted_waves_per_mm(params), 1.0)
    }

    fn with_waves(params: &PhantomParams, per_mm: f64, coarse: f64) -> Self {
        let thickness_mm = params.thickness_mm;
        let sheets = Waves::new(Numbers::new(params.seed, 0), per_mm, params.anisotropy);
        let holes = Waves::new(
            Numbers::new(params.seed, 1),
            HOLES * per_mm,
            params.anisotropy,
        );
        let step = coarse / (STEPS_PER_WAVE * per_mm * HOLES);
        // One point of margin on either side for the cubic.
        let n = params.size_mm.map(|l| (l / step).ceil() as usize + 4);
        let plane = n[0] * n[1];
        let mut fields = [(); 3].map(|()| vec![0f32; plane * n[2]]);
        let [f, h, g] = &mut fields;
        f.par_chunks_mut(n[0])
            .zip(h.par_chunks_mut(n[0]))
            .zip(g.par_chunks_mut(n[0]))
            .enumerate()
            .for_each(|(row, ((f, h), g))| {
                let (j, k) = (row % n[1], row / n[1]);
                let from = [-step, (j as f64 - 1.0) * step, (k as f64 - 1.0) * step];
                sheets.line(from, step, n[0], |i, value, grad| {
                    f[i] = value as f32;
                    h[i] = grad.iter().map(|d| d * d).sum::<f64>() as f32;
                });
                holes.line(from, step, n[0], |i, value, _| g[i] = value as f32);
            });
        let wave = std::f64::consts::TAU * per_mm;
        Shape {
            n,
            step,
            fields,
            half_mm: thickness_mm / 2.0,
            // Near a saddle the field bends as ½ k² r²: half a thickness away its slope is k² T/2 times a third.
            soft: (wave * wave * thickness_mm / 6.0).powi(2) as f32,
            slope_g: (HOLES * wave / 3f64.sqrt()) as f32,
        }
    }

    /// For each voxel the hole level above which it is bone; infinite outside the sheets. Calls `visit(k, levels)` for
    /// every slice, in parallel, and returns the results in order.
    pub fn slices<R: Send>(
        &self,
        grid: &Grid,
        visit: impl Fn(usize, &[f32]) -> R + Sync,
    ) -> Vec<R> {
        let [tx, ty, tz] = [0, 1, 2].map(|a| self.taps(grid.n[a], grid.spacing_mm[a], self.n[a]));
        let [nx, ny, nz] = grid.n;
        let plane = self.n[0] * self.n[1];
        (0..nz)
            .into_par_iter()
            .map(|k| {
                let blend = |field: &Vec<f32>| {
                    let (base, w) = tz[k];
                    let at = |t: usize| &field[(base + t) * plane..(base + t + 1) * plane];
                    weighted([at(0), at(1), at(2), at(3)], w)
                };
                let slabs = self.fields.each_ref().map(blend);
                let mut levels = vec![0f32; nx * ny];
                for (row, &(base, w)) in levels.chunks_exact_mut(nx).zip(&ty) {
                    let line = slabs.each_ref().map(|slab| {
                        let at =
                            |t: usize| &slab[(base + t) * self.n[0]..(base + t + 1) * self.n[0]];
                        weighted([at(0), at(1), at(2), at(3)], w)
                    });
                    for (level, &(base, w)) in row.iter_mut().zip(&tx) {
                        let [f, h, g] = line.each_ref().map(|l| {
                            l[base] * w[0]
                                + l[base + 1] * w[1]
                                + l[base + 2] * w[2]
                                + l[base + 3] * w[3]
                        });
                        *level = self.level(f, h, g);
                    }
                }
                visit(k, &levels)
            })
            .collect()
    }

    /// Distance from the mid-sheet decides; towards a hole the rim is a half circle of the sheet's thickness.
    fn level(&self, f: f32, h: f32, g: f32) -> f32 {
        let half = self.half_mm as f32;
        let d2 = f * f / (h.max(0.0) + self.soft);
        if d2 >= half * half {
            return f32::INFINITY;
        }
        g + (half - (half * half - d2).sqrt()) * self.slope_g
    }

    /// Table index and Catmull–Rom weights for voxel centres.
    fn taps(&self, voxels: usize, spacing: f64, points: usize) -> Vec<(usize, [f32; 4])> {
        (0..voxels)
            .map(|i| {
                let u = (i as f64 + 0.5) * spacing / self.step + 1.0;
                let base = (u.floor() as usize).min(points - 3);
                let t = u - base as f64;
                let w = [
                    0.5 * t * (-1.0 + t * (2.0 - t)),
                    0.5 * (2.0 + t * t * (-5.0 + 3.0 * t)),
                    0.5 * t * (1.0 + t * (4.0 - 3.0 * t)),
                    0.5 * t * t * (t - 1.0),
                ];
                (base - 1, w.map(|v| v as f32))
            })
            .collect()
    }

    /// Share of the table's points that lie in the sheets.
    fn sheet_share(&self) -> f64 {
        let [f, h, g] = &self.fields;
        let inside = f
            .iter()
            .zip(h)
            .zip(g)
            .filter(|((f, h), g)| self.level(**f, **h, **g).is_finite())
            .count();
        inside as f64 / f.len() as f64
    }
}

fn weighted(rows: [&[f32]; 4], w: [f32; 4]) -> Vec<f32> {
    let [a, b, c, d] = rows;
    let pairs = a.iter().zip(b).zip(c.iter().zip(d));
    pairs
        .map(|((a, b), (c, d))| a * w[0] + b * w[1] + c * w[2] + d * w[3])
        .collect()
}

/// Waves per mm at which sheets of this thickness fill `BV/TV / (1 − perforation)` of the box.
fn fitted_waves_per_mm(params: &PhantomParams) -> f64 {
    let wanted = params.bvtv / (1.0 - params.perforation());
    // Area of a Gaussian field's zero level per volume: (2/π) √(k²/3) (Rice), before sheets touch.
    let mut per_mm = wanted / params.thickness_mm * 3f64.sqrt() / 4.0;
    // Few tables of few points: the share is what counts here, and a fixed number of steps repeats everywhere.
    for _ in 0..6 {
        let share = Shape::with_waves(params, per_mm, 4.0).sheet_share();
        per_mm *= (wanted / share.max(0.02)).clamp(0.6, 1.6);
    }
    per_mm
}
