//! Owns rows of consecutive sites that a sweep keeps: blocks of `D × 6` by aggregate.

use super::level::Modes;
use std::collections::VecDeque;
use std::ops::Range;

/// Sites per block of the window.
pub const BLOCK: usize = 256;

/// A block of `D × 6` in eight lanes, never across two cache lines.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub struct Wide<const D: usize>(pub Modes<D>);

/// The rows of one block of sites: where each begins, and its aggregates with a block of `D × 6` each.
pub struct Rows<const D: usize> {
    starts: Vec<u32>,
    aggregates: Vec<u32>,
    blocks: Vec<Wide<D>>,
}

impl<const D: usize> Rows<D> {
    pub fn new() -> Self {
        let mut starts = Vec::with_capacity(BLOCK + 1);
        starts.push(0);
        Rows {
            starts,
            aggregates: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Adds to the row in the making.
    pub fn extend(&mut self, aggregates: &[u32], blocks: &[Wide<D>]) {
        self.aggregates.extend_from_slice(aggregates);
        self.blocks.extend_from_slice(blocks);
    }

    pub fn end_row(&mut self) {
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
    pub fn new() -> Self {
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

    /// Appends the rows of the next block.
    pub fn push(&mut self, rows: Rows<D>) {
        self.blocks.push_back(rows);
    }

    /// Drops the blocks before `blocks.start`.
    pub fn drop_before(&mut self, blocks: &Range<usize>) {
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
    pub fn missing(&self, blocks: &Range<usize>) -> Option<usize> {
        let next = self.first + self.blocks.len();
        (next < blocks.end).then_some(next)
    }
}
