//! Owns the rows of a smoothed prolongator, made where a sweep over the sites needs them and dropped behind it.

use super::aggregate::NONE;
use super::image::{Gather, Image, Wide};
use super::level::Level;
use std::collections::VecDeque;
use std::ops::Range;

/// Sites per block of the window.
pub const BLOCK: usize = 256;

/// The rows of one block of sites: where each begins, and its aggregates with a block of `D × 6` each.
struct Rows<const D: usize> {
    starts: Vec<u32>,
    aggregates: Vec<u32>,
    blocks: Vec<Wide<D>>,
}

impl<const D: usize> Rows<D> {
    fn new() -> Self {
        let mut starts = Vec::with_capacity(BLOCK + 1);
        starts.push(0);
        Rows {
            starts,
            aggregates: Vec::new(),
            blocks: Vec::new(),
        }
    }

    fn end_row(&mut self) {
        self.starts.push(self.blocks.len() as u32);
    }
}

/// One row: aggregates, and as many blocks.
pub type Row<'r, const D: usize> = (&'r [u32], &'r [Wide<D>]);

/// Rows of consecutive blocks of sites.
pub struct Window<const D: usize> {
    first: usize,
    blocks: VecDeque<Rows<D>>,
}

impl<const D: usize> Window<D> {
    fn new() -> Self {
        Window {
            first: 0,
            blocks: VecDeque::new(),
        }
    }

    #[inline(always)]
    pub fn row(&self, site: usize) -> Row<'_, D> {
        let rows = &self.blocks[site / BLOCK - self.first];
        let at = site % BLOCK;
        let range = rows.starts[at] as usize..rows.starts[at + 1] as usize;
        (&rows.aggregates[range.clone()], &rows.blocks[range])
    }

    /// Drops the blocks before `blocks.start`.
    fn drop_before(&mut self, blocks: &Range<usize>) {
        if blocks.start < self.first || blocks.start > self.first + self.blocks.len() {
            self.blocks.clear();
        }
        if self.blocks.is_empty() {
            self.first = blocks.start;
        }
        while self.first < blocks.start {
            self.blocks.pop_front();
            self.first += 1;
        }
    }

    /// The next block to append until there are those up to `blocks.end`.
    fn missing(&self, blocks: &Range<usize>) -> Option<usize> {
        let next = self.first + self.blocks.len();
        (next < blocks.end).then_some(next)
    }
}

/// Rows of `P = (I − ω D⁻¹A) P₀`.
pub struct Prolongator<'l, L, const D: usize> {
    level: &'l L,
    omega: f32,
    /// Rows of `P₀`: at most one block each.
    modes: Window<D>,
    rows: Window<D>,
    image: Image<D>,
    gather: Gather<D>,
}

impl<'l, const D: usize, L: Level<D>> Prolongator<'l, L, D> {
    pub fn new(level: &'l L, omega: f32) -> Self {
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
    pub fn rows(&self) -> &Window<D> {
        &self.rows
    }

    /// Makes the rows of `sites`; earlier ones are dropped.
    pub fn cover(&mut self, sites: Range<usize>) {
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
                if let ([home], [own]) = (home, own) {
                    gather.image(image, columns, blocks, modes, 0);
                    gather.smooth(image, omega, &level.inverse(site), *home, own);
                    rows.aggregates.extend_from_slice(image.aggregates());
                    rows.blocks.extend_from_slice(image.blocks());
                }
                rows.end_row();
            });
            self.rows.blocks.push_back(rows);
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
                    rows.aggregates.push(aggregate);
                    rows.blocks.push(Wide(modes));
                }
                rows.end_row();
            });
            self.modes.blocks.push_back(rows);
        }
    }
}
