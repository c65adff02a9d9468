//! Owns the lattice's inner loops: what one site gathers from its neighbours.

use super::quad::Quad;
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

/// What the loops read. `neighbours` has two entries a pair and site; a missing neighbour is the site itself.
#[derive(Clone, Copy)]
pub struct Bonds<'a, S> {
    pub pairs: &'a [Pair<S>],
    pub neighbours: &'a [u32],
}

/// Row of a site in the neighbour table.
#[inline(always)]
fn row<'a, S>(bonds: &Bonds<'a, S>, site: usize) -> &'a [u32] {
    let z = 2 * bonds.pairs.len();
    &bonds.neighbours[site * z..(site + 1) * z]
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
/// The instruction set of `Q` is available; neighbours are below the number of sites in `u`.
#[inline(always)]
pub unsafe fn springs<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    for (site, y) in sites.zip(y) {
        let row = row(&bonds, site);
        unsafe {
            let here = at(site as u32);
            let mut f = Q::zero();
            for (p, pair) in bonds.pairs.iter().enumerate() {
                let ahead = at(row[2 * p]).sub(here);
                let behind = at(row[2 * p + 1]).sub(here);
                f = pull(f, pair, ahead.add(behind));
            }
            f.store(y.as_mut_ptr());
        }
    }
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
    for (site, y) in sites.zip(y) {
        let row = row(&bonds, site);
        unsafe {
            let (here, own) = (at(site as u32), share(site as u32));
            let mut f = Q::zero();
            for (p, pair) in bonds.pairs.iter().enumerate() {
                let (plus, minus) = (row[2 * p], row[2 * p + 1]);
                let s = Q::zero().fma(own.add(share(plus)), at(plus).sub(here));
                f = pull(f, pair, s.fma(own.add(share(minus)), at(minus).sub(here)));
            }
            f.store(y.as_mut_ptr());
        }
    }
}

/// Volumetric sums `θ_s = Σ_{j∈s} ½ n · (u_j − u_i)` of both shells.
///
/// # Safety
/// As [`springs`].
#[inline(always)]
pub unsafe fn volumetric_sums<Q: Quad>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    let at = |j: u32| unsafe { Q::load(u.as_ptr().add(j as usize).cast()) };
    for (site, theta) in sites.zip(theta) {
        let row = row(&bonds, site);
        unsafe {
            let mut sums = [Q::zero(); 2];
            for (p, pair) in bonds.pairs.iter().enumerate() {
                let stretch = at(row[2 * p]).sub(at(row[2 * p + 1]));
                sums[pair.shell] = sums[pair.shell].fma(Q::constant(&pair.lever), stretch);
            }
            *theta = [sums[0].sum(), sums[1].sum()];
        }
    }
}

/// Adds `−Σ_j ½ n (t_i + t_j)` over existing bonds, `t = w T θ`.
///
/// # Safety
/// As [`springs`]; `t` has an entry a site.
#[inline(always)]
pub unsafe fn volumetric_forces<Q: Quad<S = f64>>(
    bonds: Bonds<f64>,
    sites: Range<usize>,
    t: &[[f64; 2]],
    y: &mut [[f64; 3]],
) {
    let term = |here: f64, site: usize, j: u32, shell: usize| {
        let there = unsafe { t.get_unchecked(j as usize)[shell] };
        if j as usize == site {
            0.0
        } else {
            here + there
        }
    };
    for (site, y) in sites.zip(y) {
        let row = row(&bonds, site);
        let here = t[site];
        unsafe {
            let mut f = Q::load(y.as_ptr());
            for (p, pair) in bonds.pairs.iter().enumerate() {
                let s = pair.shell;
                let pressure =
                    term(here[s], site, row[2 * p + 1], s) - term(here[s], site, row[2 * p], s);
                f = f.fma(Q::constant(&pair.lever), Q::splat(pressure));
            }
            f.store(y.as_mut_ptr());
        }
    }
}
