//! Owns the lattice's inner loops: what one site gathers from its neighbours.

use super::quad::{Precision, Quad};
use crate::topology::neighbours::{DECODED, MOST, Neighbours, Table};
use std::ops::Range;

/// One opposite pair of bonds, scaled for the kernels.
#[derive(Debug, Clone, Copy)]
pub struct Pair<S> {
    pub shell: usize,
    /// `spring · d dᵀ` by cyclic diagonals: `(d_x d_x, …)`, `(d_x d_y, d_y d_z, d_z d_x)`, `(d_x d_z, …)`.
    pub diagonals: [[S; 4]; 3],
    /// Whether `d` lies along an axis, so that only the first diagonal is there.
    pub axial: bool,
    /// `half · d`.
    pub lever: [S; 4],
}

/// What the loops read. A site has two neighbours a pair; a missing one is the site itself.
#[derive(Clone, Copy)]
pub struct Bonds<'a, S> {
    pub pairs: &'a [Pair<S>],
    pub neighbours: &'a Neighbours,
}

/// Calls `visit` with every site, its place in the range and its neighbours.
#[inline(always)]
fn each_site<S>(
    bonds: &Bonds<S>,
    sites: Range<usize>,
    mut visit: impl FnMut(usize, usize, &[u32]),
) {
    let z = 2 * bonds.pairs.len();
    let mut table: Table = [0; MOST * DECODED];
    let first = sites.start;
    for start in sites.clone().step_by(DECODED) {
        let part = start..(start + DECODED).min(sites.end);
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(table.chunks_exact(z)) {
            visit(site, site - first, row);
        }
    }
}

/// Adds `spring · d (d · s)`, with its sign turned.
#[inline(always)]
unsafe fn pull<Q: Quad>(f: Q, pair: &Pair<Q::S>, s: Q) -> Q {
    unsafe {
        let f = f.fma(Q::constant(&pair.diagonals[0]), s);
        if pair.axial {
            return f;
        }
        let f = f.fma(Q::constant(&pair.diagonals[1]), s.turn());
        f.fma(Q::constant(&pair.diagonals[2]), s.turn_back())
    }
}

/// Springs: `y[i − sites.start] = Σ_j ½ k n (n · (u_i − u_j))`, the diagonals carrying the minus sign.
///
/// # Safety
/// The instruction set of `Q` is available; neighbours are below the number of sites in `u`; `y` has an entry a site.
#[inline(always)]
pub unsafe fn springs<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    each_site(&bonds, sites, |site, place, row| unsafe {
        let here = at(site as u32);
        let mut f = Q::zero();
        for (pair, ends) in bonds.pairs.iter().zip(row.chunks_exact(2)) {
            let ahead = at(ends[0]).sub(here);
            let behind = at(ends[1]).sub(here);
            f = pull(f, pair, ahead.add(behind));
        }
        f.store(y[place].as_mut_ptr());
    });
}

/// Springs of a graded lattice: bond `ij` is worth `½ (w_i + w_j)`. The diagonals carry the half, too.
///
/// # Safety
/// As [`springs`]; `weights` has an entry a site.
#[inline(always)]
pub unsafe fn graded_springs<Q: Quad>(
    bonds: Bonds<Q::S>,
    weights: &[Q::S],
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    let share = |j: u32| unsafe { Q::splat(*weights.get_unchecked(j as usize)) };
    each_site(&bonds, sites, |site, place, row| unsafe {
        let (here, own) = (at(site as u32), share(site as u32));
        let mut f = Q::zero();
        for (pair, ends) in bonds.pairs.iter().zip(row.chunks_exact(2)) {
            let (plus, minus) = (ends[0], ends[1]);
            let s = Q::zero().fma(own.add(share(plus)), at(plus).sub(here));
            f = pull(f, pair, s.fma(own.add(share(minus)), at(minus).sub(here)));
        }
        f.store(y[place].as_mut_ptr());
    });
}

/// [`springs`] and the volumetric sums `θ_s = Σ_{j∈s} ½ n · (u_j − u_i)` of both shells in one pass over neighbours.
///
/// # Safety
/// As [`springs`]; `theta` has an entry a site.
#[inline(always)]
pub unsafe fn springs_and_sums<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    each_site(&bonds, sites, |site, place, row| unsafe {
        let here = at(site as u32);
        let twice = here.add(here);
        let mut f = Q::zero();
        let mut sums = [Q::zero(); 2];
        for (pair, ends) in bonds.pairs.iter().zip(row.chunks_exact(2)) {
            let (ahead, behind) = (at(ends[0]), at(ends[1]));
            f = pull(f, pair, ahead.add(behind).sub(twice));
            let sum = &mut sums[pair.shell];
            *sum = sum.fma(Q::constant(&pair.lever), ahead.sub(behind));
        }
        f.store(y[place].as_mut_ptr());
        theta[place] = [sums[0].sum(), sums[1].sum()];
    });
}

/// Volumetric sums alone.
///
/// # Safety
/// As [`springs`]; `theta` has an entry a site.
#[inline(always)]
pub unsafe fn volumetric_sums<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    each_site(&bonds, sites, |_, place, row| unsafe {
        let mut sums = [Q::zero(); 2];
        for (pair, ends) in bonds.pairs.iter().zip(row.chunks_exact(2)) {
            let stretch = at(ends[0]).sub(at(ends[1]));
            sums[pair.shell] = sums[pair.shell].fma(Q::constant(&pair.lever), stretch);
        }
        theta[place] = [sums[0].sum(), sums[1].sum()];
    });
}

/// Adds `−Σ_j ½ n (t_i + t_j)` over existing bonds, `t = w T θ`.
///
/// # Safety
/// As [`springs`]; `t` has an entry a site.
#[inline(always)]
pub unsafe fn volumetric_forces<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    t: &[[Q::S; 2]],
    y: &mut [[Q::S; 3]],
) where
    Q::S: Precision,
{
    let term = |here: Q::S, site: usize, j: u32, shell: usize| {
        let there = unsafe { t.get_unchecked(j as usize)[shell] };
        // Selected, not branched on: which neighbours exist follows no pattern.
        std::hint::select_unpredictable(j as usize == site, Q::S::default(), here + there)
    };
    each_site(&bonds, sites, |site, place, row| unsafe {
        let here = t[site];
        let mut f = Q::load(y[place].as_ptr());
        for (pair, ends) in bonds.pairs.iter().zip(row.chunks_exact(2)) {
            let s = pair.shell;
            let pressure = term(here[s], site, ends[1], s) - term(here[s], site, ends[0], s);
            f = f.fma(Q::constant(&pair.lever), Q::splat(pressure));
        }
        f.store(y[place].as_mut_ptr());
    });
}
