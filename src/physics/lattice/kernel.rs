//! Owns the lattice's inner loops: what one site gathers from its neighbours.

use crate::discretisation::lattice::neighbours::{DECODED, EMPTY, LANES, Neighbours};
use crate::simd::vec3::{Precision, Vec3Lanes};
use std::ops::Range;

/// One opposite pair of bonds, scaled for the kernels.
#[derive(Debug, Clone, Copy)]
pub struct Pair<S> {
    /// `spring · d dᵀ` by cyclic diagonals, in the order of the components they multiply: `(d_x d_x, d_y d_y, d_z d_z)`,
    /// `(d_z d_x, d_x d_y, d_y d_z)`, `(d_y d_x, d_z d_y, d_x d_z)`.
    pub diagonals: [[S; 4]; 3],
    /// `half · d`.
    pub lever: [S; 4],
}

/// A structure as the loops are compiled for it: its pairs of bonds are known then.
pub trait Shape {
    const PAIRS: usize;
    /// Pairs below it are the first shell.
    const FIRST_SHELL: usize;
    /// The first of three pairs along the axes, of which only the first diagonal is there.
    const AXIAL: usize;
}

/// A simple cubic lattice.
pub struct Sc;
/// A body-centred cubic one.
pub struct Bcc;
/// A face-centred cubic one.
pub struct Fcc;

impl Shape for Sc {
    const PAIRS: usize = 9;
    const FIRST_SHELL: usize = 3;
    const AXIAL: usize = 0;
}

impl Shape for Bcc {
    const PAIRS: usize = 7;
    const FIRST_SHELL: usize = 4;
    const AXIAL: usize = 4;
}

impl Shape for Fcc {
    const PAIRS: usize = 9;
    const FIRST_SHELL: usize = 6;
    const AXIAL: usize = 6;
}

/// The shell of pair `p`.
#[inline(always)]
fn shell<H: Shape>(p: usize) -> usize {
    usize::from(p >= H::FIRST_SHELL)
}

/// What the loops read. A site has two neighbours a pair; a missing one is the site itself.
#[derive(Clone, Copy)]
pub struct Bonds<'a, S> {
    pub pairs: &'a [Pair<S>],
    pub neighbours: &'a Neighbours,
}

/// Sites decoded together.
#[inline(always)]
fn decoded(sites: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<> {
    let end = sites.end;
    let starts = sites.clone().step_by(DECODED);
    starts.map(move |start| start..(start + DECODED).min(end))
}

/// Both ends of pair `p` in a site's row.
#[inline(always)]
fn ends(row: &[u32; LANES], p: usize) -> [u32; 2] {
    [row[2 * p], row[2 * p + 1]]
}

/// # Safety
/// As [`springs`], `j` a site.
#[inline(always)]
unsafe fn at<Q: Vec3Lanes>(u: &[[Q::S; 3]], j: u32) -> Q {
    // SAFETY: `j` is below the length of `u`, and a load reads three scalars.
    unsafe { Q::load(u.as_ptr().add(j as usize).cast()) }
}

/// What a site is pulled by, diagonal by diagonal: turned to their places only when all of a diagonal is there.
#[derive(Clone, Copy)]
struct Pull<Q>([Q; 3]);

impl<Q: Vec3Lanes> Pull<Q> {
    /// # Safety
    /// The instruction set of `Q` is available.
    #[inline(always)]
    unsafe fn zero() -> Self {
        // SAFETY: the caller vouches for the instruction set.
        Pull(unsafe { [Q::zero(); 3] })
    }

    /// Adds `spring · d (d · s)` of pair `p`, with its sign turned.
    ///
    /// # Safety
    /// The instruction set of `Q` is available.
    #[inline(always)]
    unsafe fn add<H: Shape>(&mut self, p: usize, pair: &Pair<Q::S>, s: Q) {
        let [f, g, h] = &mut self.0;
        // SAFETY: the caller vouches for the instruction set; constants are arrays of four.
        unsafe {
            *f = f.fma(Q::constant(&pair.diagonals[0]), s);
            if !(H::AXIAL..H::AXIAL + 3).contains(&p) {
                *g = g.fma(Q::constant(&pair.diagonals[1]), s);
                *h = h.fma(Q::constant(&pair.diagonals[2]), s);
            }
        }
    }

    /// # Safety
    /// The instruction set of `Q` is available.
    #[inline(always)]
    unsafe fn sum(self) -> Q {
        let [f, g, h] = self.0;
        // SAFETY: the caller vouches for the instruction set.
        unsafe { f.add(g.turn().add(h.turn_back())) }
    }
}

// Loops are written out, not handed to closures: registers in those would not be of the instruction set of who calls them.

/// Springs: `y[i − sites.start] = Σ_j ½ k n (n · (u_i − u_j))`, the diagonals carrying the minus sign.
///
/// # Safety
/// The instruction set of `Q` is available; neighbours are below the number of sites in `u`; `y` has an entry a site.
#[inline(always)]
pub unsafe fn springs<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    let pairs = &bonds.pairs[..H::PAIRS];
    let mut table = EMPTY;
    for part in decoded(&sites) {
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(&table) {
            // SAFETY: the caller's promise: the instruction set, and ends of bonds that are sites.
            unsafe {
                let here = at::<Q>(u, site as u32);
                let mut pull = Pull::zero();
                for (p, pair) in pairs.iter().enumerate() {
                    let [plus, minus] = ends(row, p);
                    let (ahead, behind) = (at::<Q>(u, plus).sub(here), at::<Q>(u, minus).sub(here));
                    pull.add::<H>(p, pair, ahead.add(behind));
                }
                pull.sum().store(y[site - sites.start].as_mut_ptr());
            }
        }
    }
}

/// Springs of a lattice of weighted sites: bond `ij` is worth `½ (w_i + w_j)`. The diagonals also carry the half.
///
/// # Safety
/// As [`springs`]; `weights` has an entry a site.
#[inline(always)]
pub unsafe fn weighted_springs<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    weights: &[Q::S],
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
) {
    let pairs = &bonds.pairs[..H::PAIRS];
    let mut table = EMPTY;
    for part in decoded(&sites) {
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(&table) {
            // SAFETY: the caller's promise: the instruction set, and ends of bonds that are sites.
            unsafe {
                let (here, own) = (at::<Q>(u, site as u32), Q::splat(weights[site]));
                let mut pull = Pull::zero();
                for (p, pair) in pairs.iter().enumerate() {
                    let [plus, minus] = ends(row, p);
                    let share = |j: u32| *weights.get_unchecked(j as usize);
                    let (w_plus, w_minus) = (Q::splat(share(plus)), Q::splat(share(minus)));
                    let (ahead, behind) = (at::<Q>(u, plus).sub(here), at::<Q>(u, minus).sub(here));
                    let s = Q::zero().fma(own.add(w_plus), ahead);
                    pull.add::<H>(p, pair, s.fma(own.add(w_minus), behind));
                }
                pull.sum().store(y[site - sites.start].as_mut_ptr());
            }
        }
    }
}

/// [`springs`] and the volumetric sums `θ_s = Σ_{j∈s} ½ n · (u_j − u_i)` of both shells in one pass over neighbours.
///
/// # Safety
/// As [`springs`]; `theta` has an entry a site.
#[inline(always)]
pub unsafe fn springs_and_sums<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    y: &mut [[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    let pairs = &bonds.pairs[..H::PAIRS];
    let mut table = EMPTY;
    for part in decoded(&sites) {
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(&table) {
            // SAFETY: the caller's promise: the instruction set, and ends of bonds that are sites.
            unsafe {
                let here = at::<Q>(u, site as u32);
                let twice = here.add(here);
                let mut pull = Pull::zero();
                let mut sums = [Q::zero(); 2];
                for (p, pair) in pairs.iter().enumerate() {
                    let [plus, minus] = ends(row, p);
                    let (ahead, behind) = (at::<Q>(u, plus), at::<Q>(u, minus));
                    pull.add::<H>(p, pair, ahead.add(behind).sub(twice));
                    let stretch = ahead.sub(behind);
                    sums[shell::<H>(p)] = lengthened(sums[shell::<H>(p)], pair, stretch);
                }
                let place = site - sites.start;
                pull.sum().store(y[place].as_mut_ptr());
                theta[place] = [sums[0].sum(), sums[1].sum()];
            }
        }
    }
}

/// A shell's sum with a pair's stretch.
///
/// # Safety
/// The instruction set of `Q` is available.
#[inline(always)]
unsafe fn lengthened<Q: Vec3Lanes>(sum: Q, pair: &Pair<Q::S>, stretch: Q) -> Q {
    // SAFETY: the caller vouches for the instruction set; a lever is an array of four.
    unsafe { sum.fma(Q::constant(&pair.lever), stretch) }
}

/// Volumetric sums alone.
///
/// # Safety
/// As [`springs`]; `theta` has an entry a site.
#[inline(always)]
pub unsafe fn volumetric_sums<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    u: &[[Q::S; 3]],
    theta: &mut [[Q::S; 2]],
) {
    let pairs = &bonds.pairs[..H::PAIRS];
    let mut table = EMPTY;
    for part in decoded(&sites) {
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(&table) {
            // SAFETY: the caller's promise: the instruction set, and ends of bonds that are sites.
            unsafe {
                let mut sums = [Q::zero(); 2];
                for (p, pair) in pairs.iter().enumerate() {
                    let [plus, minus] = ends(row, p);
                    sums[shell::<H>(p)] = lengthened(
                        sums[shell::<H>(p)],
                        pair,
                        at::<Q>(u, plus).sub(at::<Q>(u, minus)),
                    );
                }
                theta[site - sites.start] = [sums[0].sum(), sums[1].sum()];
            }
        }
    }
}

/// Adds `−Σ_j ½ n (t_i + t_j)` over existing bonds, `t = w T θ`.
///
/// # Safety
/// As [`springs`]; `t` has an entry a site.
#[inline(always)]
pub unsafe fn volumetric_forces<H: Shape, Q: Vec3Lanes>(
    bonds: Bonds<Q::S>,
    sites: Range<usize>,
    t: &[[Q::S; 2]],
    y: &mut [[Q::S; 3]],
) where
    Q::S: Precision,
{
    let term = |here: Q::S, site: usize, j: u32, shell: usize| {
        // SAFETY: `j` is the end of a bond, a site, and `t` has an entry a site.
        let there = unsafe { t.get_unchecked(j as usize)[shell] };
        // Selected, not branched on: which neighbours exist follows no pattern.
        std::hint::select_unpredictable(j as usize == site, Q::S::default(), here + there)
    };
    let pairs = &bonds.pairs[..H::PAIRS];
    let mut table = EMPTY;
    for part in decoded(&sites) {
        bonds.neighbours.decode(part.clone(), &mut table);
        for (site, row) in part.zip(&table) {
            // SAFETY: the caller's promise: the instruction set, and ends of bonds that are sites.
            unsafe {
                let here = t[site];
                let y = &mut y[site - sites.start];
                let mut f = Q::load(y.as_ptr());
                for (p, pair) in pairs.iter().enumerate() {
                    let [plus, minus] = ends(row, p);
                    let s = shell::<H>(p);
                    let pressure = term(here[s], site, minus, s) - term(here[s], site, plus, s);
                    f = f.fma(Q::constant(&pair.lever), Q::splat(pressure));
                }
                f.store(y.as_mut_ptr());
            }
        }
    }
}
