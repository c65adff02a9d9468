//! Owns the finest level: the caller's operator, never assembled.

use super::aggregate::NONE;
use super::aggregate::{Aggregates, Sums};
use super::diagonal::Diagonal;
use super::grouping;
use super::level::{Level, Modes, Six};
use super::rigid::{self, Basis, Mat6};
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::operator::held::Held;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Sites per task of the set-up.
const CHUNK: usize = 2048;

pub struct Fine<O> {
    operator: O,
    /// Zero in held components and at padding.
    diagonal: Diagonal,
    grouped: Arc<Grouped>,
    /// Orthonormal motions of each aggregate from plain ones.
    bases: Vec<[Six; 6]>,
}

/// Aggregates, and the frames that their motions are in.
pub struct Grouped {
    aggregates: Aggregates,
    /// Each aggregate's centre and the inverse of its radius: motions are in units of the radius.
    frames: Vec<[f64; 4]>,
}

impl Grouped {
    fn new(operator: &impl Coarsen, diagonal: &Diagonal, box_mm: [f64; 3]) -> Self {
        let boxes = boxes(operator, diagonal, box_mm);
        let rows = |sites: Range<usize>, visit: &mut dyn FnMut(usize, &[u32])| {
            operator.each_row(sites, &mut |site, columns, _| visit(site, columns));
        };
        let hinges = hinges(operator);
        let strong = |sites: Range<usize>, visit: &mut dyn FnMut(usize, &[u32])| {
            each_strong(operator, diagonal, &hinges, sites, visit);
        };
        let (of, count) = grouping::in_boxes(boxes, &strong, &rows);
        let aggregates = Aggregates::new(&of, count, CHUNK, operator.chunk());
        drop((of, hinges));
        let frames = frames(operator, &aggregates);
        Grouped { aggregates, frames }
    }
}

/// What the next level needs to know of an aggregate.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    pub center: [f64; 3],
    pub radius: f64,
    pub basis: Basis,
}

impl<O: Coarsen> Fine<O> {
    /// `box_mm`: edges of the boxes whose connected pieces are aggregates.
    pub fn new(operator: O, held: &Held, box_mm: [f64; 3]) -> (Self, Vec<Body>) {
        let diagonal = Diagonal::new(&operator, held);
        let grouped = Arc::new(Grouped::new(&operator, &diagonal, box_mm));
        Fine::of(operator, diagonal, grouped)
    }

    /// The same aggregates with other components held.
    pub fn regrouped(operator: O, held: &Held, grouped: &Arc<Grouped>) -> (Self, Vec<Body>) {
        let diagonal = Diagonal::new(&operator, held);
        Fine::of(operator, diagonal, Arc::clone(grouped))
    }

    fn of(operator: O, diagonal: Diagonal, grouped: Arc<Grouped>) -> (Self, Vec<Body>) {
        let mut fine = Fine {
            operator,
            diagonal,
            grouped,
            bases: Vec::new(),
        };
        let bodies = fine.bodies();
        fine.bases = bodies
            .iter()
            .map(|b| b.basis.basis.map(|row| row.map(|v| v as f32)))
            .collect();
        (fine, bodies)
    }

    /// The aggregates, for other supports.
    pub fn grouped(&self) -> &Arc<Grouped> {
        &self.grouped
    }

    /// The aggregates as the next level sees them: their motions made orthonormal.
    fn bodies(&self) -> Vec<Body> {
        let Grouped { aggregates, frames } = &*self.grouped;
        let count = aggregates.count;
        let mut grams: Vec<(Mat6, f64)> = vec![([[0.0; 6]; 6], 0.0); count];
        let visit = |sites: Range<usize>, sums: &mut Sums<(Mat6, f64)>| {
            self.each_modes(sites, |site, modes| {
                let Some((gram, sites)) = sums.of(site) else {
                    return;
                };
                let rows = modes.map(|row| std::array::from_fn(|k| f64::from(row[k])));
                rigid::add_gram(gram, &rows);
                *sites += 1.0;
            });
        };
        let add = |sum: &mut (Mat6, f64), part: &(Mat6, f64)| {
            let both = sum
                .0
                .as_flattened_mut()
                .iter_mut()
                .zip(part.0.as_flattened());
            both.for_each(|(s, p)| *s += p);
            sum.1 += part.1;
        };
        aggregates.sum(&mut grams, ([[0.0; 6]; 6], 0.0), visit, add);
        let body = |((gram, sites), [x, y, z, inverse]): (&(Mat6, f64), &[f64; 4])| Body {
            center: [*x, *y, *z],
            radius: inverse.recip(),
            basis: rigid::orthonormalise(gram, *sites),
        };
        grams.par_iter().zip(frames).map(body).collect()
    }

    /// Forces on plain motions to forces on orthonormal ones.
    pub fn to_basis(&self, raw: &[Six], g: &mut [Six]) {
        for ((g, raw), basis) in g.iter_mut().zip(raw).zip(&self.bases) {
            *g = std::array::from_fn(|k| (0..6).map(|m| basis[m][k] * raw[m]).sum());
        }
    }

    /// Amplitudes of orthonormal motions to those of plain ones.
    pub fn to_plain(&self, e: &[Six], raw: &mut [Six]) {
        for ((e, raw), basis) in e.iter().zip(raw).zip(&self.bases) {
            *raw = std::array::from_fn(|m| (0..6).map(|k| basis[m][k] * e[k]).sum());
        }
    }

    /// Bytes in addition to the operator's.
    pub fn bytes(&self) -> usize {
        let Grouped { aggregates, frames } = &*self.grouped;
        self.diagonal.bytes() + aggregates.bytes() + frames.len() * (32 + 144)
    }
}

/// Calls `visit` with every site of the range and its position in mm.
fn each_position(
    operator: &impl Coarsen,
    sites: Range<usize>,
    mut visit: impl FnMut(usize, &[f64; 3]),
) {
    let mut room = [[0.0; 3]; 512];
    for start in sites.clone().step_by(room.len()) {
        let part = start..(start + room.len()).min(sites.end);
        let positions = &mut room[..part.len()];
        operator.positions(part.clone(), positions);
        part.zip(positions).for_each(|(site, x)| visit(site, x));
    }
}

/// Which sites are hinges.
fn hinges(operator: &impl Coarsen) -> Vec<bool> {
    let mut hinges = vec![false; operator.sites()];
    let chunks = hinges.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(c, hinges)| {
        operator.hinges(c * CHUNK..c * CHUNK + hinges.len(), hinges);
    });
    hinges
}

/// Least strength of a coupling, its Frobenius norm over the root of the two sites' stiffness, along which sites become one
/// aggregate (Vaněk, Mandel & Brezina 1996). Neighbours of one stiffness have 0.05 or more; stiff and soft regions part where
/// they differ by some 30 and more. A stiff part cut by soft voxels then moves on its own on the coarser levels.
const STRONG: f32 = 0.05;

/// Calls `visit` with every site of the range and the columns of its row that are coupled strongly. A site where parts
/// meet in an edge or a corner has none.
fn each_strong(
    operator: &impl Coarsen,
    diagonal: &Diagonal,
    hinges: &[bool],
    sites: Range<usize>,
    visit: &mut dyn FnMut(usize, &[u32]),
) {
    let is_uniform = operator.is_uniform();
    let mut kept = Vec::with_capacity(27);
    operator.each_row(sites, &mut |site, columns, blocks| {
        kept.clear();
        if hinges[site] {
            return visit(site, &kept);
        }
        if is_uniform {
            kept.extend(columns.iter().filter(|j| !hinges[**j as usize]));
        } else {
            let own = STRONG * STRONG * diagonal.stiffness(site);
            let is_strong = |j: u32, block: &Block| {
                let squared: f32 = block.as_flattened().iter().map(|v| v * v).sum();
                squared >= own * diagonal.stiffness(j as usize) && !hinges[j as usize]
            };
            let pairs = columns.iter().zip(blocks);
            kept.extend(pairs.filter(|(j, b)| is_strong(**j, b)).map(|(j, _)| *j));
        }
        visit(site, &kept);
    });
}

/// A number for every box that holds a free site.
fn boxes(operator: &impl Coarsen, diagonal: &Diagonal, box_mm: [f64; 3]) -> Vec<u32> {
    // Half a site's spacing at least off the boxes' walls on regular grids that begin at zero.
    let cells = |x: &[f64; 3]| -> [u64; 3] {
        std::array::from_fn(|a| (x[a].max(0.0) / box_mm[a] + 1e-6).floor() as u64)
    };
    let sites = diagonal.sites();
    let chunk = |c: usize| c * CHUNK..((c + 1) * CHUNK).min(sites);
    let most = (0..sites.div_ceil(CHUNK))
        .into_par_iter()
        .map(|c| {
            let mut most = [0; 3];
            each_position(operator, chunk(c), |_, x| {
                let cell = cells(x);
                most = std::array::from_fn(|a| cell[a].max(most[a]));
            });
            most
        })
        .reduce(|| [0; 3], |m, c| std::array::from_fn(|a| m[a].max(c[a])));
    // Frames have at most 2^32 places for sites, and a box is wider than a place.
    let count = most.iter().map(|n| u128::from(*n) + 1).product::<u128>();
    assert!(
        count < u128::from(NONE),
        "{count} boxes: too many to number"
    );
    let mut boxes = vec![NONE; sites];
    boxes
        .par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(c, boxes)| {
            each_position(operator, chunk(c), |site, x| {
                if diagonal.free(site) != [0.0; 3] {
                    let at = cells(x);
                    let number = (at[2] * (most[1] + 1) + at[1]) * (most[0] + 1) + at[0];
                    boxes[site - c * CHUNK] = number as u32;
                }
            });
        });
    boxes
}

/// Each aggregate's centre and the inverse of its radius (the root of its sites' mean squared distance).
fn frames(operator: &impl Coarsen, aggregates: &Aggregates) -> Vec<[f64; 4]> {
    let add = |sum: &mut [f64; 4], part: &[f64; 4]| {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    };
    let mut frames = vec![[0.0; 4]; aggregates.count];
    let visit = |sites: Range<usize>, sums: &mut Sums<[f64; 4]>| {
        each_position(operator, sites, |site, x| {
            if let Some(sum) = sums.of(site) {
                add(sum, &[x[0], x[1], x[2], 1.0]);
            }
        });
    };
    aggregates.sum(&mut frames, [0.0; 4], visit, add);
    for [x, y, z, n] in &mut frames {
        [x, y, z].into_iter().for_each(|c| *c /= *n);
    }
    let mut squared = vec![[0.0; 2]; aggregates.count];
    let visit = |sites: Range<usize>, sums: &mut Sums<[f64; 2]>| {
        each_position(operator, sites, |site, x| {
            if let Some(sum) = sums.of(site) {
                let center = &frames[aggregates.of(site) as usize];
                sum[0] += (0..3).map(|c| (x[c] - center[c]).powi(2)).sum::<f64>();
                sum[1] += 1.0;
            }
        });
    };
    aggregates.sum(&mut squared, [0.0; 2], visit, |s, p| {
        (s[0], s[1]) = (s[0] + p[0], s[1] + p[1]);
    });
    for (frame, [sum, n]) in frames.iter_mut().zip(squared) {
        frame[3] = if sum > 0.0 { (n / sum).sqrt() } else { 1.0 };
    }
    frames
}

impl<O: Coarsen> Level<3> for Fine<O> {
    fn sites(&self) -> usize {
        self.diagonal.sites()
    }

    fn chunk(&self) -> usize {
        self.operator.chunk()
    }

    fn rows(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        self.operator.rows_f32(sites, x, y);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        self.operator.each_row(sites, visit);
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.operator.reach(sites)
    }

    #[inline]
    fn scale(&self, site: usize, r: &[f32; 3]) -> [f32; 3] {
        self.diagonal.scale(site, r)
    }

    #[inline]
    fn inverse(&self, site: usize) -> [[f32; 3]; 3] {
        self.diagonal.inverse_block(site)
    }

    #[inline]
    fn unscale(&self, site: usize, t: &[f32; 3]) -> Option<[f32; 3]> {
        self.diagonal.unscale(site, t)
    }

    fn stiffness(&self, site: usize) -> f32 {
        self.diagonal.stiffness(site)
    }

    fn aggregates(&self) -> &Aggregates {
        &self.grouped.aggregates
    }

    #[inline]
    fn each_modes(&self, sites: Range<usize>, mut visit: impl FnMut(usize, Modes<3>)) {
        let Grouped { aggregates, frames } = &*self.grouped;
        each_position(&self.operator, sites, |site, x| {
            let aggregate = aggregates.of(site);
            if aggregate == NONE {
                return visit(site, [[0.0; 8]; 3]);
            }
            let frame = &frames[aggregate as usize];
            let [x, y, z] = [0, 1, 2].map(|c| ((x[c] - frame[c]) * frame[3]) as f32);
            let f = self.diagonal.free(site);
            let modes = [
                [f[0], 0.0, 0.0, 0.0, f[0] * z, -f[0] * y, 0.0, 0.0],
                [0.0, f[1], 0.0, -f[1] * z, 0.0, f[1] * x, 0.0, 0.0],
                [0.0, 0.0, f[2], f[2] * y, -f[2] * x, 0.0, 0.0, 0.0],
            ];
            visit(site, modes);
        });
    }

    fn eigenvalue_bound(&self) -> f32 {
        self.operator.eigenvalue_bound() as f32
    }
}
