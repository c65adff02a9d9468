//! Owns the lattice element: central springs in two shells and a volumetric term per shell.
//!
//! Source: Zojaji et al. 2024, eqs 2–7. The paper prints one volumetric sum over all neighbours (eq 5), with which its
//! own eq 7 is wrong; squaring the sum shell by shell (Chen & Liu 2016) makes eq 7 exact, and is what stands here:
//!
//! `U = Σ_i w_i [ ½ Σ_s k_s Σ_{j∈s} dl_ij² + ½ T Σ_s (Σ_{j∈s} dl_ij)² ]`, `dl_ij = ½ n_ij · (u_j − u_i)`,
//!
//! with `w_i = 1`, or the bone fraction of the site's cell on graded lattices.

pub mod moduli;

mod kernel;
pub mod multigrid;
pub mod pieces;
mod quad;

use crate::operator::Operator;
use crate::par::sum_chunks;
use crate::simd::{Isa, isa};
use crate::topology::sites::Sites;
use kernel::Bonds;
pub use moduli::{Moduli, check_solid};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;

/// One opposite pair of bonds: its direction in grid steps and the moduli scaled for it.
#[derive(Debug, Clone, Copy)]
struct Pair {
    d: [f64; 3],
    shell: usize,
    /// `k / (2 |d|²)`: a bond pulls by `spring · d (d · Δu)`.
    spring: f64,
    /// `1 / (2 |d|)`: a bond adds `half · d · Δu` to its site's volumetric sum.
    half: f64,
}

/// Sites a task takes at once: a few hundred kilobytes of what it reads.
const PORTION: usize = 1024;

/// Sites of portion `c`, which is `len` long.
fn range(c: usize, len: usize) -> Range<usize> {
    c * PORTION..c * PORTION + len
}

/// The linearised lattice as an operator: `K u` is the gradient of the energy. N and mm.
pub struct Lattice<'a> {
    sites: &'a Sites,
    moduli: Moduli,
    pairs: Vec<Pair>,
    scaled: Vec<kernel::Pair<f64>>,
    /// `w_i T θ_{s,i}` of the last application; empty at ν = ¼, where no volumetric pass is made.
    volumetric: Mutex<Vec<[f64; 2]>>,
}

impl<'a> Lattice<'a> {
    pub fn new(sites: &'a Sites, moduli: Moduli) -> Self {
        let stencil = sites.frame.structure.stencil();
        let pair = |(p, d): (usize, &[i32; 3])| {
            let d = d.map(f64::from);
            let squared: f64 = d.iter().map(|c| c * c).sum();
            let shell = usize::from(p >= stencil.first_shell_pairs);
            Pair {
                d,
                shell,
                spring: 0.5 * moduli.k[shell] / squared,
                half: 0.5 / squared.sqrt(),
            }
        };
        let pairs: Vec<Pair> = stencil.pairs.iter().enumerate().map(pair).collect();
        let graded = sites.weights.is_some();
        let scaled = pairs.iter().map(|p| p.scaled(graded)).collect();
        let scratch = if moduli.t == 0.0 { 0 } else { sites.len() };
        Lattice {
            sites,
            moduli,
            pairs,
            scaled,
            volumetric: Mutex::new(vec![[0.0; 2]; scratch]),
        }
    }

    fn weight(&self, site: usize) -> f64 {
        self.sites.weights.as_ref().map_or(1.0, |w| w[site])
    }

    /// Every pair with both neighbours along it; a missing one is the site itself.
    fn bonded(&self, site: usize) -> impl Iterator<Item = (&Pair, usize, usize)> {
        let row = self.sites.neighbours_of(site);
        let pairs = self.pairs.iter().enumerate();
        pairs.map(move |(p, pair)| (pair, row[2 * p] as usize, row[2 * p + 1] as usize))
    }

    /// Volumetric sums `θ_s = Σ_{j∈s} dl_ij` of one site.
    fn volumetric_sums(&self, u: &[[f64; 3]], site: usize) -> [f64; 2] {
        let mut theta = [0.0; 2];
        for (pair, plus, minus) in self.bonded(site) {
            theta[pair.shell] += pair.half * along(pair.d, u[plus], u[minus]);
        }
        theta
    }

    /// Elastic energy in N mm.
    pub fn energy(&self, u: &[[f64; 3]]) -> f64 {
        sum_chunks(self.sites.len(), |range| {
            range.map(|s| self.site_energy(u, s)).sum()
        })
    }

    /// Energy of one site in N mm, by the formula of the module's head.
    pub fn site_energy(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let mut springs = 0.0;
        for (pair, plus, minus) in self.bonded(site) {
            for end in [plus, minus] {
                let dl = pair.half * along(pair.d, u[end], u[site]);
                springs += self.moduli.k[pair.shell] * dl * dl;
            }
        }
        let [a, b] = self.volumetric_sums(u, site);
        self.weight(site) * 0.5 * (springs + self.moduli.t * (a * a + b * b))
    }

    /// `V_i σ_aa,i` in N mm along the load axis: the derivative of the site's energy by a strain along it. Of a bond,
    /// only the part between the innermost gripped planes counts.
    pub fn site_virial(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let (axis, grips) = (self.sites.frame.axis.index(), self.sites.grips);
        let theta = if self.moduli.t == 0.0 {
            [0.0; 2]
        } else {
            self.volumetric_sums(u, site)
        };
        let plane = self.sites.plane(site);
        let mut sum = 0.0;
        for (pair, plus, minus) in self.bonded(site) {
            if pair.d[axis] == 0.0 {
                continue;
            }
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let other = plane + (sign * pair.d[axis]) as i32;
                let inside = plane.max(other).min(grips.high) - plane.min(other).max(grips.low);
                if inside <= 0 {
                    continue;
                }
                let dl = sign * pair.half * along(pair.d, u[end], u[site]);
                let share = f64::from(inside) / pair.d[axis].abs();
                let lever = pair.half * pair.d[axis] * pair.d[axis] * self.sites.frame.step_mm;
                sum += share
                    * lever
                    * (self.moduli.k[pair.shell] * dl + self.moduli.t * theta[pair.shell]);
            }
        }
        self.weight(site) * sum
    }
}

impl Pair {
    /// The pair as the kernels want it; on graded lattices with the half of `½ (w_i + w_j)`.
    fn scaled(&self, graded: bool) -> kernel::Pair<f64> {
        let d = self.d;
        let c = -self.spring * if graded { 0.5 } else { 1.0 };
        let cyclic = |turn: usize| {
            let [x, y, z] = [0, 1, 2].map(|a| c * d[a] * d[(a + turn) % 3]);
            [x, y, z, 0.0]
        };
        kernel::Pair {
            shell: self.shell,
            diagonals: [cyclic(0), cyclic(1), cyclic(2)],
            axial: d.iter().filter(|&&c| c != 0.0).count() == 1,
            lever: [self.half * d[0], self.half * d[1], self.half * d[2], 0.0],
        }
    }
}

/// The kernels on this processor.
impl Lattice<'_> {
    fn bonds(&self) -> Bonds<'_, f64> {
        Bonds {
            pairs: &self.scaled,
            neighbours: &self.sites.neighbours,
        }
    }

    /// The springs' part of `K u` at `sites`.
    fn springs(&self, sites: Range<usize>, u: &[[f64; 3]], y: &mut [[f64; 3]]) {
        assert_eq!(u.len(), self.sites.len());
        let weights = self.sites.weights.as_deref();
        // SAFETY: `isa` vouches for the instruction set, `Sites` for neighbours below its length.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => avx2::springs(self.bonds(), weights, sites, u, y),
                _ => springs::<quad::Plain64>(self.bonds(), weights, sites, u, y),
            }
        }
    }

    /// The springs' part of `K u` and the volumetric sums at `sites`.
    fn springs_and_sums(
        &self,
        sites: Range<usize>,
        u: &[[f64; 3]],
        y: &mut [[f64; 3]],
        theta: &mut [[f64; 2]],
    ) {
        assert_eq!(u.len(), self.sites.len());
        let weights = self.sites.weights.as_deref();
        // SAFETY: as `springs`.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => {
                    avx2::springs_and_sums(self.bonds(), weights, sites, u, y, theta);
                }
                _ => springs_and_sums::<quad::Plain64>(self.bonds(), weights, sites, u, y, theta),
            }
        }
    }

    fn add_volumetric_forces(&self, sites: Range<usize>, t: &[[f64; 2]], y: &mut [[f64; 3]]) {
        assert_eq!(t.len(), self.sites.len());
        // SAFETY: as `springs`.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => avx2::volumetric_forces(self.bonds(), sites, t, y),
                _ => kernel::volumetric_forces::<quad::Plain64>(self.bonds(), sites, t, y),
            }
        }
    }
}

/// Uniform or graded springs.
///
/// # Safety
/// As [`kernel::springs`].
#[inline(always)]
unsafe fn springs<Q: quad::Quad>(
    bonds: Bonds<Q::S>,
    weights: Option<&[Q::S]>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    unsafe {
        match weights {
            None => kernel::springs::<Q>(bonds, sites, u, y),
            Some(w) => kernel::graded_springs::<Q>(bonds, w, sites, u, y),
        }
    }
}

/// The same with volumetric sums.
///
/// # Safety
/// As [`kernel::springs`].
#[inline(always)]
unsafe fn springs_and_sums<Q: quad::Quad>(
    bonds: Bonds<Q::S>,
    weights: Option<&[Q::S]>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    unsafe {
        match weights {
            None => kernel::springs_and_sums::<Q>(bonds, sites, u, y, theta),
            Some(w) => {
                kernel::graded_springs::<Q>(bonds, w, sites.clone(), u, y);
                kernel::volumetric_sums::<Q>(bonds, sites, u, theta);
            }
        }
    }
}

/// The kernels compiled for AVX2 with fused multiply-add.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::kernel::{self, Bonds};
    use super::quad::{Avx32, Avx64};
    use std::ops::Range;

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn springs(
        bonds: Bonds<f64>,
        weights: Option<&[f64]>,
        sites: Range<usize>,
        u: &[[f64; 3]],
        y: &mut [[f64; 3]],
    ) {
        unsafe { super::springs::<Avx64>(bonds, weights, sites, u, y) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn springs_f32(
        bonds: Bonds<f32>,
        weights: Option<&[f32]>,
        sites: Range<usize>,
        u: &[[f32; 3]],
        y: &mut [[f32; 3]],
    ) {
        unsafe { super::springs::<Avx32>(bonds, weights, sites, u, y) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn springs_and_sums(
        bonds: Bonds<f64>,
        weights: Option<&[f64]>,
        sites: Range<usize>,
        u: &[[f64; 3]],
        y: &mut [[f64; 3]],
        theta: &mut [[f64; 2]],
    ) {
        unsafe { super::springs_and_sums::<Avx64>(bonds, weights, sites, u, y, theta) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn volumetric_forces(
        bonds: Bonds<f64>,
        sites: Range<usize>,
        t: &[[f64; 2]],
        y: &mut [[f64; 3]],
    ) {
        unsafe { kernel::volumetric_forces::<Avx64>(bonds, sites, t, y) }
    }
}

/// `d · (a − b)`.
fn along(d: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    d[0] * (a[0] - b[0]) + d[1] * (a[1] - b[1]) + d[2] * (a[2] - b[2])
}

impl Operator<3> for Lattice<'_> {
    fn sites(&self) -> usize {
        self.sites.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let t = self.moduli.t;
        if t == 0.0 {
            let springs = |(c, y): (usize, &mut [[f64; 3]])| self.springs(range(c, y.len()), x, y);
            y.par_chunks_mut(PORTION).enumerate().for_each(springs);
            return;
        }
        let mut scratch = self
            .volumetric
            .lock()
            .expect("no application panics while it holds the scratch");
        let chunks = scratch
            .par_chunks_mut(PORTION)
            .zip(y.par_chunks_mut(PORTION));
        chunks.enumerate().for_each(|(c, (theta, y))| {
            let sites = range(c, theta.len());
            self.springs_and_sums(sites.clone(), x, y, theta);
            for (site, theta) in sites.zip(theta) {
                *theta = theta.map(|sum| self.weight(site) * t * sum);
            }
        });
        let scratch = &*scratch;
        y.par_chunks_mut(PORTION).enumerate().for_each(|(c, y)| {
            self.add_volumetric_forces(range(c, y.len()), scratch, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut()
            .enumerate()
            .for_each(|(s, d)| *d = self.site_diagonal(s));
    }
}

impl Lattice<'_> {
    fn site_diagonal(&self, site: usize) -> [f64; 3] {
        let (t, w) = (self.moduli.t, self.weight(site));
        let (mut d, mut gradient) = ([0.0; 3], [[0.0; 3]; 2]);
        for (pair, plus, minus) in self.bonded(site) {
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let spring = 0.5 * (w + self.weight(end)) * pair.spring;
                let volumetric = self.weight(end) * t * pair.half * pair.half;
                for c in 0..3 {
                    d[c] += (spring + volumetric) * pair.d[c] * pair.d[c];
                    gradient[pair.shell][c] += sign * pair.half * pair.d[c];
                }
            }
        }
        for c in 0..3 {
            d[c] += w * t * (gradient[0][c].powi(2) + gradient[1][c].powi(2));
        }
        d
    }
}
