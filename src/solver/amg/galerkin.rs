//! Owns the coarse matrix `PᵀAP` of a smoothed prolongator `P = (I − ω D⁻¹A) P₀`.
//!
//! Made part by part of the sites: a sweep over a part makes rows of `P` ahead of itself and drops them behind, and rows
//! of `AP` one at a time. Six columns are kept in eight lanes.

use super::aggregate::NONE;
use super::blocks::{self, Block6, BlockMatrix};
use super::fine::Body;
use super::image::{Gather, Image, Wide6};
use super::level::Level;
use super::rigid::{self, Mat6};
use super::window::{BLOCK, Rows, Wide, Window};
use rayon::prelude::*;
use std::borrow::Borrow;
use std::ops::Range;

/// Blocks of a part of the coarse matrix, upper triangle (column >= row), in the plain motions of [`Level::each_modes`].
pub struct Part {
    places: Vec<(u32, u32)>,
    blocks: Vec<Block6>,
}

/// `PᵀAP` with six unknowns per aggregate, in the basis of [`Level::each_modes`], or in that of `bodies` if given.
pub fn product<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    bodies: Option<&[Body]>,
) -> BlockMatrix {
    merge(parts(level, omega, &All), bodies)
}

/// What sites add to `PᵀAP`, part by part.
pub fn parts<const D: usize>(level: &impl Level<D>, omega: f32, of: &impl Which) -> Vec<Part> {
    let per = level.sites().div_ceil(PARTS).max(2 * BLOCK);
    let sites = |c: usize| c * per..((c + 1) * per).min(level.sites());
    (0..level.sites().div_ceil(per))
        .into_par_iter()
        .map(|c| part(level, omega, of, sites(c)))
        .collect()
}

/// The sites that a product is summed over.
pub trait Which: Sync {
    /// Whether a site is one of them.
    fn is_summed(&self, site: usize) -> bool;
    /// Whether a site is one of them or a neighbour of one.
    fn is_next(&self, site: usize) -> bool;
}

/// All of them.
struct All;

impl Which for All {
    #[inline(always)]
    fn is_summed(&self, _: usize) -> bool {
        true
    }

    #[inline(always)]
    fn is_next(&self, _: usize) -> bool {
        true
    }
}

/// Parts of the sites: enough for many threads, few enough that little is made twice at their borders.
const PARTS: usize = 16;

/// From the plain motions of the aggregates to their orthonormal ones.
fn in_basis(block: &Block6, row: &Body, column: &Body) -> Block6 {
    let a: Mat6 = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(block[6 * c + r])));
    let right = rigid::multiply(&a, &column.basis.basis);
    let left = &row.basis.basis;
    std::array::from_fn(|k| {
        let (r, c) = (k % 6, k / 6);
        (0..6).map(|m| left[m][r] * right[m][c]).sum::<f64>() as f32
    })
}

fn part<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    of: &impl Which,
    sites: Range<usize>,
) -> Part {
    let spans = sites.clone().step_by(BLOCK);
    let spans: Vec<Range<usize>> = spans.map(|s| s..(s + BLOCK).min(sites.end)).collect();
    // What a span of sites reaches, with everything that later ones reach: the sweep never turns back.
    let mut reaches: Vec<Range<usize>> = spans.iter().map(|s| level.reach(s.clone())).collect();
    for i in (1..reaches.len()).rev() {
        reaches[i - 1].start = reaches[i - 1].start.min(reaches[i].start);
    }
    let gather = Gather::here();
    let mut prolongator = Prolongator::new(level, omega);
    let mut image = Image::new(level.aggregates().count);
    let mut sum = Sum::new(level.aggregates().count);
    for (span, reach) in spans.into_iter().zip(reaches) {
        prolongator.cover(reach, of);
        let rows = prolongator.rows();
        level.each_row(span, &mut |site, columns, blocks| {
            if !of.is_summed(site) {
                return;
            }
            let (aggregates, entries) = rows.row(site);
            // Blocks left of the diagonal are not kept.
            let Some(&least) = aggregates.iter().min() else {
                return;
            };
            gather.image(&mut image, columns, blocks, rows, least);
            for (&left, a) in aggregates.iter().zip(entries) {
                for (&right, b) in image.aggregates().iter().zip(image.blocks()) {
                    if right >= left {
                        gather.add_transposed(sum.slot(left, right), a, b);
                    }
                }
            }
        });
    }
    Part {
        places: sum.places,
        blocks: sum.blocks.iter().map(packed).collect(),
    }
}

/// Rows of `P = (I − ω D⁻¹A) P₀`.
struct Prolongator<'l, L, const D: usize> {
    level: &'l L,
    omega: f32,
    /// Rows of `P₀`: at most one block each.
    modes: Window<D>,
    rows: Window<D>,
    image: Image<D>,
    gather: Gather<D>,
}

impl<'l, const D: usize, L: Level<D>> Prolongator<'l, L, D> {
    fn new(level: &'l L, omega: f32) -> Self {
        Prolongator {
            level,
            omega,
            modes: Window::new(),
            rows: Window::new(),
            image: Image::new(level.aggregates().count),
            gather: Gather::here(),
        }
    }

    /// The rows that the last [`Prolongator::cover`] made.
    fn rows(&self) -> &Window<D> {
        &self.rows
    }

    /// Makes the rows of `sites`, those that the sum needs; earlier ones are dropped.
    fn cover(&mut self, sites: Range<usize>, of: &impl Which) {
        let n = self.level.sites();
        let span = |b: usize| b * BLOCK..((b + 1) * BLOCK).min(n);
        let blocks = |r: Range<usize>| r.start / BLOCK..r.end.div_ceil(BLOCK);
        let wanted = blocks(sites);
        self.rows.drop_before(&wanted);
        while let Some(b) = self.rows.missing(&wanted) {
            self.cover_modes(blocks(self.level.reach(span(b))));
            let mut rows = Rows::new();
            let (level, omega, modes, gather) = (self.level, self.omega, &self.modes, self.gather);
            let image = &mut self.image;
            level.each_row(span(b), &mut |site, columns, blocks| {
                let (home, own) = modes.row(site);
                if let ([home], [own], true) = (home, own, of.is_next(site)) {
                    gather.image(image, columns, blocks, modes, 0);
                    gather.smooth(image, omega, &level.inverse(site), *home, own);
                    rows.extend(image.aggregates(), image.blocks());
                }
                rows.end_row();
            });
            self.rows.push(rows);
        }
    }

    fn cover_modes(&mut self, wanted: Range<usize>) {
        self.modes.drop_before(&wanted);
        while let Some(b) = self.modes.missing(&wanted) {
            let sites = b * BLOCK..((b + 1) * BLOCK).min(self.level.sites());
            let mut rows = Rows::new();
            let aggregates = self.level.aggregates();
            self.level.each_modes(sites, |site, modes| {
                let aggregate = aggregates.of(site);
                if aggregate != NONE {
                    rows.extend(&[aggregate], &[Wide(modes)]);
                }
                rows.end_row();
            });
            self.modes.push(rows);
        }
    }
}

/// Column by column, the two idle lanes left out.
fn packed(wide: &Wide6) -> Block6 {
    std::array::from_fn(|i| wide.0[i % 6][i / 6])
}

/// Coarse blocks of one part. Rows are few and short, so a block is found by its row's list.
struct Sum {
    places: Vec<(u32, u32)>,
    blocks: Vec<Wide6>,
    /// Per aggregate, one more than the number of its list; 0 where it has none yet.
    list: Vec<u32>,
    /// Columns of a row and where their blocks are.
    lists: Vec<Vec<(u32, u32)>>,
}

impl Sum {
    fn new(aggregates: usize) -> Self {
        Sum {
            places: Vec::new(),
            blocks: Vec::new(),
            list: vec![0; aggregates],
            lists: Vec::new(),
        }
    }

    #[inline(always)]
    fn slot(&mut self, row: u32, column: u32) -> &mut Wide6 {
        let list = &mut self.list[row as usize];
        if *list == 0 {
            self.lists.push(Vec::with_capacity(16));
            *list = self.lists.len() as u32;
        }
        let list = &mut self.lists[*list as usize - 1];
        let at = match list.iter().find(|c| c.0 == column) {
            Some(c) => c.1 as usize,
            None => {
                list.push((column, self.blocks.len() as u32));
                self.places.push((row, column));
                self.blocks.push(Wide6([[0.0; 8]; 6]));
                self.blocks.len() - 1
            }
        };
        &mut self.blocks[at]
    }
}

/// Adds up the parts in their order, changes the basis and makes the diagonal blocks even.
pub fn merge<P: Borrow<Part> + Sync>(parts: Vec<P>, bodies: Option<&[Body]>) -> BlockMatrix {
    let mut index: Vec<(u32, u32, u32, u32)> =
        Vec::with_capacity(parts.iter().map(|p| p.borrow().places.len()).sum());
    for (p, part) in parts.iter().enumerate() {
        let places = part.borrow().places.iter().enumerate();
        index.extend(places.map(|(k, &(row, column))| (row, column, p as u32, k as u32)));
    }
    index.par_sort_unstable();
    let same: Vec<&[(u32, u32, u32, u32)]> =
        index.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).collect();
    let places: Vec<(u32, u32)> = same.iter().map(|s| (s[0].0, s[0].1)).collect();
    let block = |at: &&[(u32, u32, u32, u32)]| {
        let mut sum = [0f32; 36];
        for &(_, _, p, k) in *at {
            let part = &parts[p as usize].borrow().blocks[k as usize];
            sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
        }
        finished(sum, at[0].0, at[0].1, bodies)
    };
    let mut blocks = Vec::with_capacity(same.len() + 1);
    same.par_iter().map(block).collect_into_vec(&mut blocks);
    drop(parts);
    BlockMatrix::from_upper(&places, blocks)
}

/// A block column by column, in the basis of `bodies`, even on the diagonal.
fn finished(mut block: Block6, row: u32, column: u32, bodies: Option<&[Body]>) -> Block6 {
    if let Some(bodies) = bodies {
        block = in_basis(&block, &bodies[row as usize], &bodies[column as usize]);
    }
    if row == column {
        let mirrored = blocks::mirrored(&block);
        block = std::array::from_fn(|i| 0.5 * (block[i] + mirrored[i]));
    }
    block
}
