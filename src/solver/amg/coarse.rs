//! Owns the assembled levels: six unknowns per site, the rigid motions of what it stands for.

use super::aggregate::{Aggregates, Sums};
use super::blocks::{self, Block6, BlockMatrix};
use super::eigenvalue;
use super::fine::Body;
use super::grouping;
use super::level::{Level, Modes, Six};
use super::rigid::{self, Mat6};
use crate::operator::coarsen::VisitRow;
use rayon::prelude::*;
use std::ops::Range;

pub struct Coarse {
    pub matrix: BlockMatrix,
    /// Inverse diagonal blocks.
    inverse: Vec<Block6>,
    aggregates: Aggregates,
    /// Orthonormal motions of a site's aggregate.
    modes: Vec<Block6>,
}

impl Coarse {
    /// A level over `bodies`, aggregated by its own graph; the bodies of the next. `mean_site_stiffness` is how stiff the parts of each
    /// site are, see [`mean_site_stiffness`].
    pub fn new(
        matrix: BlockMatrix,
        bodies: &[Body],
        mean_site_stiffness: &[f32],
    ) -> (Self, Vec<Body>) {
        let inverse: Vec<Block6> = (0..matrix.rows())
            .into_par_iter()
            .map(|i| inverse_block(matrix.diagonal(i), mean_site_stiffness[i]))
            .collect();
        let (of, count) =
            grouping::greedy(matrix.rows(), STRONG, |i, list| strengths(&matrix, i, list));
        let mut members = vec![Vec::new(); count];
        for (i, &a) in of.iter().enumerate() {
            members[a as usize].push(i as u32);
        }
        let next: Vec<Body> = members.par_iter().map(|m| joined(m, bodies)).collect();
        let modes = (0..matrix.rows())
            .into_par_iter()
            .map(|i| {
                let whole = &next[of[i] as usize];
                let q = rigid::multiply(&carried(&bodies[i], whole), &whole.basis.basis);
                std::array::from_fn(|k| q[k % 6][k / 6] as f32)
            })
            .collect();
        let level = Coarse {
            matrix,
            inverse,
            aggregates: Aggregates::new(&of, count, CHUNK, CHUNK),
            modes,
        };
        (level, next)
    }

    pub fn bytes(&self) -> usize {
        self.matrix.bytes() + self.inverse.len() * 2 * 144 + self.aggregates.bytes()
    }
}

/// Motions of `part` as its aggregate `whole` moves, in the orthonormal unknowns of `part`.
fn carried(part: &Body, whole: &Body) -> Mat6 {
    let d = std::array::from_fn(|c| part.center[c] - whole.center[c]);
    rigid::multiply(
        &part.basis.motions,
        &rigid::carry(d, whole.radius, part.radius),
    )
}

fn joined(members: &[u32], bodies: &[Body]) -> Body {
    let n = members.len() as f64;
    let mut whole = Body {
        center: [0.0; 3],
        radius: 0.0,
        basis: rigid::orthonormalise(&[[0.0; 6]; 6], 1.0),
    };
    for &i in members {
        for c in 0..3 {
            whole.center[c] += bodies[i as usize].center[c] / n;
        }
    }
    let mut squared = 0.0;
    for &i in members {
        let b = &bodies[i as usize];
        squared += b.radius * b.radius / n;
        for c in 0..3 {
            squared += (b.center[c] - whole.center[c]).powi(2) / n;
        }
    }
    whole.radius = squared.sqrt();
    let mut gram = [[0.0; 6]; 6];
    for &i in members {
        rigid::add_gram(&mut gram, &carried(&bodies[i as usize], &whole));
    }
    let most = (0..3).map(|k| gram[k][k]).fold(0.0, f64::max);
    whole.basis = rigid::orthonormalise(&gram, most);
    whole
}

/// Least strength of a coupling along which sites become one aggregate (Vaněk, Mandel & Brezina 1996): parts that are
/// joined by less move on their own.
const STRONG: f32 = 0.02;

/// Couplings of a site, each with the Frobenius norm of its block over the root of the diagonal blocks' product.
fn strengths(matrix: &BlockMatrix, i: usize, list: &mut Vec<(u32, f32)>) {
    let norm = |block: &Block6| block.iter().map(|v| v * v).sum::<f32>().sqrt();
    let own = norm(matrix.diagonal(i));
    list.clear();
    for (j, block, _) in matrix.row(i) {
        if j as usize != i {
            let scale = (own * norm(matrix.diagonal(j as usize))).sqrt();
            list.push((j, norm(block) / scale.max(f32::MIN_POSITIVE)));
        }
    }
}

/// The stiffness of each aggregate's sites, on average: what the stiffness of the aggregate as a whole is the small
/// remainder of, so that its rounding is that of this.
pub fn mean_site_stiffness<const D: usize>(level: &impl Level<D>) -> Vec<f32> {
    let mut sums = vec![[0f32; 2]; level.aggregates().count];
    let visit = |sites: Range<usize>, sums: &mut Sums<[f32; 2]>| {
        for site in sites {
            if let Some([stiffness, sites]) = sums.of(site) {
                *stiffness += level.stiffness(site);
                *sites += 1.0;
            }
        }
    };
    level.aggregates().sum(&mut sums, [0.0; 2], visit, |s, p| {
        *s = [s[0] + p[0], s[1] + p[1]];
    });
    sums.iter()
        .map(|[stiffness, sites]| stiffness / sites)
        .collect()
}

/// Share of the mean_site_stiffness stiffness below which a motion's own is rounding: it is a mechanism, or held.
pub const LEAST_STIFFNESS: f64 = 1e-6;

/// Inverse of a diagonal block; unknowns without stiffness get zero rows and columns.
fn inverse_block(block: &Block6, mean_site_stiffness: f32) -> Block6 {
    let a = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(block[6 * c + r])));
    let b = rigid::orthonormalise_to(&a, f64::from(mean_site_stiffness), LEAST_STIFFNESS).basis;
    std::array::from_fn(|k| (0..6).map(|m| b[k % 6][m] * b[k / 6][m]).sum::<f64>() as f32)
}

/// Over the eigenvalue that is found from below; a polynomial of degree 2 bears what lies up to 1.12 times above its
/// interval. Without a margin the cycle turned indefinite on thin phantoms; a wider one costs iterations (1.2: one in
/// eight).
const MARGIN: f32 = 1.1;

/// Steps that find it.
const STEPS: usize = 24;

fn times(block: &Block6, r: &Six) -> Six {
    let mut out = [0.0; 6];
    for c in 0..6 {
        for a in 0..6 {
            out[a] += block[6 * c + a] * r[c];
        }
    }
    out
}

/// Sites per task: a level of a few thousand sites is shared by sixteen threads.
const CHUNK: usize = 128;

impl Level<6> for Coarse {
    fn sites(&self) -> usize {
        self.inverse.len()
    }

    fn chunk(&self) -> usize {
        CHUNK
    }

    fn rows(&self, sites: Range<usize>, x: &[Six], y: &mut [Six]) {
        self.matrix.multiply(sites, x, y);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<[Six; 6]>) {
        let (mut columns, mut squares) = (Vec::new(), Vec::new());
        for site in sites {
            columns.clear();
            squares.clear();
            for (j, block, transposed) in self.matrix.row(site) {
                // Stored by columns: by rows, what is stored is the transposed block.
                let by_rows = if transposed {
                    *block
                } else {
                    blocks::mirrored(block)
                };
                let row = |r: usize| std::array::from_fn(|c| by_rows[6 * r + c]);
                columns.push(j);
                squares.push(std::array::from_fn(row));
            }
            visit(site, &columns, &squares);
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let columns = sites.clone().flat_map(|i| self.matrix.row(i));
        columns.fold(sites, |r, (j, ..)| {
            r.start.min(j as usize)..r.end.max(j as usize + 1)
        })
    }

    #[inline]
    fn scale(&self, site: usize, r: &Six) -> Six {
        times(&self.inverse[site], r)
    }

    #[inline]
    fn inverse(&self, site: usize) -> [Six; 6] {
        let inverse = &self.inverse[site];
        std::array::from_fn(|r| std::array::from_fn(|c| inverse[6 * c + r]))
    }

    /// The inverse drops what has no stiffness.
    #[inline]
    fn unscale(&self, _: usize, _: &Six) -> Option<Six> {
        None
    }

    fn stiffness(&self, site: usize) -> f32 {
        let block = self.matrix.diagonal(site);
        (0..6).map(|k| block[7 * k]).sum::<f32>() / 6.0
    }

    fn aggregates(&self) -> &Aggregates {
        &self.aggregates
    }

    #[inline]
    fn each_modes(&self, sites: Range<usize>, mut visit: impl FnMut(usize, Modes<6>)) {
        for site in sites {
            let q = &self.modes[site];
            let row = |r: usize| std::array::from_fn(|c| if c < 6 { q[6 * c + r] } else { 0.0 });
            visit(site, std::array::from_fn(row));
        }
    }

    fn eigenvalue_bound(&self) -> f32 {
        let scaled = |r: &[Six], z: &mut [Six]| {
            let sites = z.par_iter_mut().with_min_len(CHUNK).zip(r).enumerate();
            sites.for_each(|(i, (z, r))| *z = self.scale(i, r));
        };
        MARGIN * eigenvalue::largest(self, STEPS, scaled)
    }
}
