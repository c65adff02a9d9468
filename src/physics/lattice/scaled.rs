//! Owns the lattice's kernels in one precision: what they read, and which instruction set runs them.

use super::kernel::{self, Bonds};
use super::quad::{Precision, Quad};
use super::{PORTION, range};
use crate::par::each_chunk;
use crate::simd::{Isa, isa};
use crate::topology::sites::Sites;
use rayon::prelude::*;
use std::ops::Range;

/// What the kernels need of a lattice, by precision.
#[derive(Debug)]
pub struct Scaled<S> {
    pub pairs: Vec<kernel::Pair<S>>,
    pub weights: Option<Vec<S>>,
    /// `T`.
    pub volumetric: S,
    /// `w_i T` of each site, where they are not one `T`.
    pub own_volumetric: Option<Vec<S>>,
}

impl Scaled<f64> {
    pub fn to_single(&self) -> Scaled<f32> {
        let single = |v: [f64; 4]| v.map(|x| x as f32);
        let pair = |p: &kernel::Pair<f64>| kernel::Pair {
            shell: p.shell,
            diagonals: p.diagonals.map(single),
            axial: p.axial,
            lever: single(p.lever),
        };
        let by_site = |values: &Option<Vec<f64>>| {
            let values = values.as_ref();
            values.map(|v| v.iter().map(|&v| v as f32).collect())
        };
        Scaled {
            pairs: self.pairs.iter().map(pair).collect(),
            weights: by_site(&self.weights),
            volumetric: self.volumetric as f32,
            own_volumetric: by_site(&self.own_volumetric),
        }
    }
}

/// The kernels on this processor.
impl<S: Precision> Scaled<S> {
    /// Whether any site has a volumetric term: at ν = ¼ none has.
    pub fn is_volumetric(&self) -> bool {
        self.own_volumetric.is_some() || self.volumetric.into() != 0.0
    }

    /// `w_i T`.
    pub fn volumetric(&self, site: usize) -> S {
        match (&self.own_volumetric, &self.weights) {
            (Some(own), _) => own[site],
            (None, Some(weights)) => weights[site] * self.volumetric,
            (None, None) => self.volumetric,
        }
    }

    fn bonds<'a>(&'a self, sites: &'a Sites) -> Bonds<'a, S> {
        Bonds {
            pairs: &self.pairs,
            neighbours: &sites.neighbours,
        }
    }

    /// The springs' part of `K u` at `range`.
    pub fn springs(&self, sites: &Sites, range: Range<usize>, u: &[[S; 3]], y: &mut [[S; 3]]) {
        assert!(u.len() == sites.len() && y.len() == range.len());
        let (bonds, weights) = (self.bonds(sites), self.weights.as_deref());
        // SAFETY: `isa` vouches for the instruction set, `Sites` for neighbours below its length.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => avx2::springs::<S::Fast>(bonds, weights, range, u, y),
                _ => springs::<S::Plain>(bonds, weights, range, u, y),
            }
        }
    }

    /// The springs' part of `K u` and `w_i T θ_{s,i}` at `range`.
    pub fn springs_and_pressures(
        &self,
        sites: &Sites,
        range: Range<usize>,
        u: &[[S; 3]],
        y: &mut [[S; 3]],
        t: &mut [[S; 2]],
    ) {
        assert!(u.len() == sites.len() && y.len() == range.len() && t.len() == range.len());
        let (bonds, weights, own) = (self.bonds(sites), self.weights.as_deref(), range.clone());
        // SAFETY: as `springs`.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => {
                    avx2::springs_and_sums::<S::Fast>(bonds, weights, own, u, y, t);
                }
                _ => springs_and_sums::<S::Plain>(bonds, weights, own, u, y, t),
            }
        }
        for (site, t) in range.zip(t) {
            let factor = self.volumetric(site);
            *t = t.map(|sum| factor * sum);
        }
    }

    /// Adds what the volumetric term pulls by, from every site's `w T θ`.
    pub fn add_volumetric_forces(
        &self,
        sites: &Sites,
        range: Range<usize>,
        t: &[[S; 2]],
        y: &mut [[S; 3]],
    ) {
        assert!(t.len() == sites.len() && y.len() == range.len());
        let bonds = self.bonds(sites);
        // SAFETY: as `springs`.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => {
                    avx2::volumetric_forces::<S::Fast>(bonds, range, t, y);
                }
                _ => kernel::volumetric_forces::<S::Plain>(bonds, range, t, y),
            }
        }
    }

    /// `y = K u`, part by part; `t` is room for every site's `w T θ`. Each part, with its first site, is given to
    /// `finish`, whose values are added up in order.
    pub fn apply(
        &self,
        sites: &Sites,
        u: &[[S; 3]],
        y: &mut [[S; 3]],
        t: &mut [[S; 2]],
        finish: impl Fn(usize, &mut [[S; 3]]) -> f64 + Sync,
    ) -> f64 {
        if !t.is_empty() {
            let parts = t.par_chunks_mut(PORTION).zip(y.par_chunks_mut(PORTION));
            parts.enumerate().for_each(|(c, (t, y))| {
                self.springs_and_pressures(sites, range(c, t.len()), u, y, t);
            });
        }
        let t = &*t;
        let [sum] = each_chunk(y, PORTION, |first, y| {
            let own = first..first + y.len();
            match t.is_empty() {
                true => self.springs(sites, own, u, y),
                false => self.add_volumetric_forces(sites, own, t, y),
            }
            [finish(first, y)]
        });
        sum
    }
}

/// Uniform or graded springs.
///
/// # Safety
/// As [`kernel::springs`].
#[inline(always)]
unsafe fn springs<Q: Quad>(
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
unsafe fn springs_and_sums<Q: Quad>(
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
    use super::{Bonds, Precision, Quad, kernel};
    use std::ops::Range;

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn springs<Q: Quad>(
        bonds: Bonds<Q::S>,
        weights: Option<&[Q::S]>,
        sites: Range<usize>,
        u: &[[Q::S; 3]],
        y: &mut [[Q::S; 3]],
    ) {
        unsafe { super::springs::<Q>(bonds, weights, sites, u, y) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn springs_and_sums<Q: Quad>(
        bonds: Bonds<Q::S>,
        weights: Option<&[Q::S]>,
        sites: Range<usize>,
        u: &[[Q::S; 3]],
        y: &mut [[Q::S; 3]],
        theta: &mut [[Q::S; 2]],
    ) {
        unsafe { super::springs_and_sums::<Q>(bonds, weights, sites, u, y, theta) }
    }

    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn volumetric_forces<Q: Quad>(
        bonds: Bonds<Q::S>,
        sites: Range<usize>,
        t: &[[Q::S; 2]],
        y: &mut [[Q::S; 3]],
    ) where
        Q::S: Precision,
    {
        unsafe { kernel::volumetric_forces::<Q>(bonds, sites, t, y) }
    }
}
