//! Owns the rows of a smoothed prolongator, made where a sweep over the sites needs them and dropped behind it.

use super::aggregate::NONE;
use super::level::{Level, Modes};
use crate::simd::Lanes;
use std::collections::VecDeque;
use std::ops::Range;

/// One entry of a row of `P` or `AP`: a block of `D × 6` by aggregate.
#[derive(Clone, Copy)]
pub struct Entry<const D: usize> {
    pub aggregate: u32,
    pub block: Modes<D>,
}

/// Sites per block of the window.
pub const BLOCK: usize = 256;

/// Values of consecutive blocks of sites, each site with any number of them.
struct Window<T> {
    first: usize,
    blocks: VecDeque<(Vec<u32>, Vec<T>)>,
}

impl<T> Window<T> {
    fn new() -> Self {
        Window {
            first: 0,
            blocks: VecDeque::new(),
        }
    }

    fn of(&self, site: usize) -> &[T] {
        let (starts, values) = &self.blocks[site / BLOCK - self.first];
        let at = site % BLOCK;
        &values[starts[at] as usize..starts[at + 1] as usize]
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

/// The rows of a few sites, one after the other. Arithmetic goes over these in plain loops: closures that a level calls
/// would be compiled without the instruction set of the loop around them.
pub struct Rows<const D: usize> {
    starts: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<[[f32; D]; D]>,
}

impl<const D: usize> Rows<D> {
    pub fn new() -> Self {
        Rows {
            starts: Vec::new(),
            columns: Vec::new(),
            blocks: Vec::new(),
        }
    }

    pub fn read(&mut self, level: &impl Level<D>, sites: Range<usize>) {
        self.blocks.clear();
        self.columns.clear();
        self.starts.clear();
        self.starts.push(0);
        level.each_row(sites, &mut |_, columns, blocks| {
            self.columns.extend_from_slice(columns);
            self.blocks.extend_from_slice(blocks);
            self.starts.push(self.blocks.len() as u32);
        });
    }

    /// The row of the `i`th site that was read.
    #[inline(always)]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, [[f32; D]; D])> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        let columns = self.columns[range.clone()].iter().copied();
        // By value, so that blocks stay in registers.
        columns.zip(self.blocks[range].iter().copied())
    }
}

/// Rows of `P = (I − ω D⁻¹A) P₀`.
pub struct Prolongator<'l, L, const D: usize> {
    level: &'l L,
    omega: f32,
    modes: Window<Modes<D>>,
    rows: Window<Entry<D>>,
    read: Rows<D>,
}

impl<'l, const D: usize, L: Level<D>> Prolongator<'l, L, D> {
    pub fn new(level: &'l L, omega: f32) -> Self {
        Prolongator {
            level,
            omega,
            modes: Window::new(),
            rows: Window::new(),
            read: Rows::new(),
        }
    }

    /// Row `site`, which the last [`Prolongator::cover`] must have covered.
    pub fn row(&self, site: usize) -> &[Entry<D>] {
        self.rows.of(site)
    }

    /// Makes the rows of `sites`; earlier ones are dropped.
    ///
    /// # Safety
    /// The instruction set of `N` is there.
    #[inline(always)]
    pub unsafe fn cover<N: Lanes<S = f32>>(&mut self, sites: Range<usize>) {
        let n = self.level.sites();
        let span = |b: usize| b * BLOCK..((b + 1) * BLOCK).min(n);
        let blocks = |r: Range<usize>| r.start / BLOCK..r.end.div_ceil(BLOCK);
        let wanted = blocks(sites);
        self.rows.drop_before(&wanted);
        while let Some(b) = self.rows.missing(&wanted) {
            self.cover_modes(blocks(self.level.reach(span(b))));
            self.read.read(self.level, span(b));
            let (mut starts, mut entries) = (Vec::with_capacity(BLOCK + 1), Vec::new());
            starts.push(0);
            for (k, i) in span(b).enumerate() {
                let (row, modes) = (self.read.row(k), &self.modes);
                // SAFETY: the caller's.
                unsafe {
                    append_row::<N, L, D>(self.level, self.omega, modes, i, row, &mut entries)
                };
                starts.push(entries.len() as u32);
            }
            self.rows.blocks.push_back((starts, entries));
        }
    }

    fn cover_modes(&mut self, wanted: Range<usize>) {
        self.modes.drop_before(&wanted);
        while let Some(b) = self.modes.missing(&wanted) {
            let sites = b * BLOCK..((b + 1) * BLOCK).min(self.level.sites());
            let mut values = Vec::with_capacity(BLOCK);
            self.level.each_modes(sites, |_, m| values.push(m));
            let starts = (0..=values.len() as u32).collect();
            self.modes.blocks.push_back((starts, values));
        }
    }
}

/// Appends row `i` of `P`: `P₀_i − ω D_i⁻¹ Σ_j A_ij P₀_j`.
///
/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
unsafe fn append_row<N: Lanes<S = f32>, L: Level<D>, const D: usize>(
    level: &L,
    omega: f32,
    modes: &Window<Modes<D>>,
    i: usize,
    row: impl Iterator<Item = (u32, [[f32; D]; D])>,
    entries: &mut Vec<Entry<D>>,
) {
    let aggregates = level.aggregates();
    let home = aggregates.of(i);
    if home == NONE {
        return;
    }
    let first = entries.len();
    for (j, block) in row {
        let aggregate = aggregates.of(j as usize);
        if aggregate != NONE {
            let slot = find(entries, first, aggregate);
            // SAFETY: the caller's.
            unsafe { add_product::<N, D>(&mut slot.block, &block, &modes.of(j as usize)[0]) };
        }
    }
    for entry in &mut entries[first..] {
        for column in 0..6 {
            let r: [f32; D] = std::array::from_fn(|d| entry.block[d][column]);
            let s = level.scale(i, &r);
            for d in 0..D {
                entry.block[d][column] = -omega * s[d];
            }
        }
    }
    let own = find(entries, first, home);
    for (own, mode) in own.block.iter_mut().zip(&modes.of(i)[0]) {
        own.iter_mut().zip(mode).for_each(|(o, m)| *o += m);
    }
}

/// The entry of an aggregate among those from `first` on, made where there is none.
#[inline(always)]
pub fn find<const D: usize>(
    entries: &mut Vec<Entry<D>>,
    first: usize,
    aggregate: u32,
) -> &mut Entry<D> {
    let known = entries[first..]
        .iter()
        .position(|e| e.aggregate == aggregate);
    let at = match known {
        Some(at) => first + at,
        None => {
            entries.push(Entry {
                aggregate,
                block: [[0.0; 8]; D],
            });
            entries.len() - 1
        }
    };
    &mut entries[at]
}

/// `sum += a b`.
///
/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
pub unsafe fn add_product<N: Lanes<S = f32>, const D: usize>(
    sum: &mut Modes<D>,
    a: &[[f32; D]; D],
    b: &Modes<D>,
) {
    // SAFETY: the caller vouches for the instruction set; rows of `Modes` are arrays of eight scalars.
    unsafe {
        let b: [N; D] = std::array::from_fn(|k| N::load(b[k].as_ptr()));
        for r in 0..D {
            let mut lanes = N::load(sum[r].as_ptr());
            for k in 0..D {
                lanes = lanes.fma(N::splat(a[r][k]), b[k]);
            }
            lanes.store(sum[r].as_mut_ptr());
        }
    }
}
