//! Owns the lattice's kernels in one precision: what they read, and which instruction set runs them.

use super::kernel::{self, Bcc, Bonds, Fcc, Sc, Shape};
use super::{PORTION, range};
use crate::discretisation::lattice::sites::Sites;
use crate::discretisation::lattice::stencil::Structure;
use crate::par::each_chunk;
use crate::simd::vec3::{Precision, Vec3Lanes};
use crate::simd::{Isa, isa};
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
            diagonals: p.diagonals.map(single),
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

    /// The springs' part of `K u` at `range`.
    pub fn springs(&self, sites: &Sites, range: Range<usize>, u: &[[S; 3]], y: &mut [[S; 3]]) {
        assert!(u.len() == sites.len() && y.len() == range.len());
        self.perform(sites, range, Task::Springs { u, y });
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
        let theta = &mut *t;
        self.perform(sites, range.clone(), Task::SpringsAndSums { u, y, theta });
        self.scale_by_weights(range, t);
    }

    /// `w_i T θ_{s,i}` at `range`.
    pub fn pressures(&self, sites: &Sites, range: Range<usize>, u: &[[S; 3]], t: &mut [[S; 2]]) {
        assert!(u.len() == sites.len() && t.len() == range.len());
        let theta = &mut *t;
        self.perform(sites, range.clone(), Task::Sums { u, theta });
        self.scale_by_weights(range, t);
    }

    fn scale_by_weights(&self, range: Range<usize>, t: &mut [[S; 2]]) {
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
        self.perform(sites, range, Task::VolumetricForces { t, y });
    }

    fn perform(&self, sites: &Sites, range: Range<usize>, task: Task<S>) {
        let bonds = Bonds {
            pairs: &self.pairs,
            neighbours: &sites.neighbours,
        };
        let weights = self.weights.as_deref();
        assert!(sites.neighbours.len() == sites.len() && range.end <= sites.len());
        assert!(weights.is_none_or(|w| w.len() == sites.len()));
        // SAFETY: `isa` vouches for the instruction set, `Neighbours` for ends below its length; the assertions above hold
        // the range and the weights to the number of sites, those of the methods that make a task its fields.
        unsafe {
            match sites.frame.structure {
                Structure::Sc => on_this_processor::<Sc, S>(bonds, weights, range, task),
                Structure::Bcc => on_this_processor::<Bcc, S>(bonds, weights, range, task),
                Structure::Fcc => on_this_processor::<Fcc, S>(bonds, weights, range, task),
            }
        }
    }

    /// `y = K u`, part by part; `t` is scratch for every site's `w T θ`. Each part, with its first site, is given to
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

/// What is asked of a range of sites. Displacements and sums are of all sites, the rest of the range.
enum Task<'t, S> {
    Springs {
        u: &'t [[S; 3]],
        y: &'t mut [[S; 3]],
    },
    Sums {
        u: &'t [[S; 3]],
        theta: &'t mut [[S; 2]],
    },
    SpringsAndSums {
        u: &'t [[S; 3]],
        y: &'t mut [[S; 3]],
        theta: &'t mut [[S; 2]],
    },
    VolumetricForces {
        t: &'t [[S; 2]],
        y: &'t mut [[S; 3]],
    },
}

/// # Safety
/// As [`kernel::springs`].
unsafe fn on_this_processor<H: Shape, S: Precision>(
    bonds: Bonds<S>,
    weights: Option<&[S]>,
    sites: Range<usize>,
    task: Task<S>,
) {
    // SAFETY: `isa` says what the processor has; the rest is the caller's promise.
    unsafe {
        match isa() {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 | Isa::Avx512 => with_avx2::<H, S::Fast>(bonds, weights, sites, task),
            _ => perform::<H, S::Plain>(bonds, weights, sites, task),
        }
    }
}

/// [`perform`] compiled for AVX2 with fused multiply-add.
///
/// # Safety
/// As [`kernel::springs`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn with_avx2<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    weights: Option<&[Q::S]>,
    sites: Range<usize>,
    task: Task<Q::S>,
) where
    Q::S: Precision,
{
    // SAFETY: the caller's promise.
    unsafe { perform::<H, Q>(bonds, weights, sites, task) }
}

/// # Safety
/// As [`kernel::springs`].
#[inline(always)]
unsafe fn perform<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    weights: Option<&[Q::S]>,
    sites: Range<usize>,
    task: Task<Q::S>,
) where
    Q::S: Precision,
{
    // SAFETY: the caller's promise; `Scaled` has checked that each field has an entry a site.
    unsafe {
        match (task, weights) {
            (Task::Springs { u, y }, None) => kernel::springs::<H, Q>(bonds, sites, u, y),
            (Task::Springs { u, y }, Some(w)) => {
                kernel::weighted_springs::<H, Q>(bonds, w, sites, u, y);
            }
            (Task::Sums { u, theta }, _) => {
                kernel::volumetric_sums::<H, Q>(bonds, sites, u, theta);
            }
            (Task::SpringsAndSums { u, y, theta }, None) => {
                kernel::springs_and_sums::<H, Q>(bonds, sites, u, y, theta);
            }
            (Task::SpringsAndSums { u, y, theta }, Some(w)) => {
                kernel::weighted_springs::<H, Q>(bonds, w, sites.clone(), u, y);
                kernel::volumetric_sums::<H, Q>(bonds, sites, u, theta);
            }
            (Task::VolumetricForces { t, y }, _) => {
                kernel::volumetric_forces::<H, Q>(bonds, sites, t, y);
            }
        }
    }
}

#[cfg(test)]
mod tests;
