//! Owns the coarse matrix `PᵀAP` of a smoothed prolongator `P = (I − ω D⁻¹A) P₀`.
//!
//! Made chunk by chunk of sites: rows of `P` for the chunk and its neighbours, rows of `AP` one at a time, nothing of
//! which outlives its chunk. Six columns are kept in eight lanes.

use super::blocks::{self, Block6, BlockMatrix};
use super::fine::Body;
use super::level::{Level, Modes, NONE};
use super::rigid::{self, Mat6};
use crate::simd::{self, Isa, Lanes};
use rayon::prelude::*;
use std::ops::Range;

/// One row of `P` or `AP`: blocks of `D × 6` by aggregate.
#[derive(Clone, Copy)]
struct Entry<const D: usize> {
    aggregate: u32,
    block: Modes<D>,
}

/// A coarse block in the making, row by row of eight lanes.
type Wide = [[f32; 8]; 6];

/// Rows of a part of the coarse matrix, upper triangle (column >= row).
type Part = Vec<(u32, u32, Wide)>;

/// `PᵀAP` with six unknowns per aggregate, in the basis of [`Level::modes`], or in that of `bodies` if given.
pub fn product<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    aggregates: usize,
    bodies: Option<&[Body]>,
) -> BlockMatrix {
    let per = per_chunk(level.sites());
    let parts: Vec<Part> = (0..level.sites().div_ceil(per))
        .into_par_iter()
        .map(|c| {
            let range = c * per..((c + 1) * per).min(level.sites());
            chunk_product(level, omega, range, aggregates)
        })
        .collect();
    merge(parts, aggregates, bodies)
}

/// Sites per chunk: several planes of nodes of a large scan, so that little is made twice, and enough chunks of a
/// small one for all threads.
fn per_chunk(sites: usize) -> usize {
    (sites / 64).clamp(1 << 16, 1 << 19).min(sites / 8).max(512)
}

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

fn chunk_product<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    sites: Range<usize>,
    aggregates: usize,
) -> Part {
    match simd::isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 | Isa::Avx2 => unsafe { chunk_avx2(level, omega, sites, aggregates) },
        // SAFETY: plain arrays ask for nothing.
        _ => unsafe { chunk_lanes::<simd::PlainF32, D>(level, omega, sites, aggregates) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chunk_avx2<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    sites: Range<usize>,
    aggregates: usize,
) -> Part {
    // SAFETY: this function has the features that the lanes ask for.
    unsafe { chunk_lanes::<simd::Avx2F32, D>(level, omega, sites, aggregates) }
}

/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn chunk_lanes<L: Lanes<S = f32>, const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    sites: Range<usize>,
    aggregates: usize,
) -> Part {
    let mut row = Vec::new();
    let (mut low, mut high) = (sites.start, sites.end);
    for i in sites.clone() {
        row.clear();
        level.row(i, &mut row);
        for (j, _) in &row {
            low = low.min(*j as usize);
            high = high.max(*j as usize + 1);
        }
    }
    let mut entries: Vec<Entry<D>> = Vec::new();
    let mut starts = Vec::with_capacity(high - low + 1);
    starts.push(0);
    for i in low..high {
        // SAFETY: the caller's.
        unsafe { prolongator_row::<L, D>(level, omega, i, &mut row, &mut entries) };
        starts.push(entries.len());
    }
    let of = |j: usize| &entries[starts[j - low]..starts[j - low + 1]];
    let mut sum = Sum::new(aggregates);
    let mut image: Vec<Entry<D>> = Vec::new();
    for i in sites {
        let own = of(i);
        if own.is_empty() {
            continue;
        }
        row.clear();
        level.row(i, &mut row);
        image.clear();
        for (j, block) in &row {
            for entry in of(*j as usize) {
                let slot = find(&mut image, entry.aggregate);
                // SAFETY: the caller's.
                unsafe { add_product::<L, D>(&mut slot.block, block, &entry.block) };
            }
        }
        for left in own {
            for right in image.iter().filter(|r| r.aggregate >= left.aggregate) {
                let slot = sum.slot(left.aggregate, right.aggregate);
                // SAFETY: the caller's.
                unsafe { add_transposed::<L, D>(slot, &left.block, &right.block) };
            }
        }
    }
    sum.parts
}

/// Appends row `i` of `P`: `P₀_i − ω D_i⁻¹ Σ_j A_ij P₀_j`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn prolongator_row<L: Lanes<S = f32>, const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    i: usize,
    row: &mut Vec<(u32, [[f32; D]; D])>,
    entries: &mut Vec<Entry<D>>,
) {
    if level.aggregate(i) == NONE {
        return;
    }
    let first = entries.len();
    row.clear();
    level.row(i, row);
    for (j, block) in row.iter() {
        let aggregate = level.aggregate(*j as usize);
        if aggregate != NONE {
            let slot = find_from(entries, first, aggregate);
            let modes = level.modes(*j as usize);
            // SAFETY: the caller's.
            unsafe { add_product::<L, D>(&mut slot.block, block, &modes) };
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
    let own = find_from(entries, first, level.aggregate(i));
    let modes = level.modes(i);
    for d in 0..D {
        for column in 0..6 {
            own.block[d][column] += modes[d][column];
        }
    }
}

fn find<const D: usize>(entries: &mut Vec<Entry<D>>, aggregate: u32) -> &mut Entry<D> {
    find_from(entries, 0, aggregate)
}

#[inline(always)]
fn find_from<const D: usize>(
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
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn add_product<L: Lanes<S = f32>, const D: usize>(
    sum: &mut Modes<D>,
    a: &[[f32; D]; D],
    b: &Modes<D>,
) {
    unsafe {
        let b: [L; D] = std::array::from_fn(|k| L::load(b[k].as_ptr()));
        for r in 0..D {
            let mut lanes = L::load(sum[r].as_ptr());
            for k in 0..D {
                lanes = lanes.fma(L::splat(a[r][k]), b[k]);
            }
            lanes.store(sum[r].as_mut_ptr());
        }
    }
}

/// `sum += aᵀ b`.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn add_transposed<L: Lanes<S = f32>, const D: usize>(
    sum: &mut Wide,
    a: &Modes<D>,
    b: &Modes<D>,
) {
    unsafe {
        let b: [L; D] = std::array::from_fn(|k| L::load(b[k].as_ptr()));
        for r in 0..6 {
            let mut lanes = L::load(sum[r].as_ptr());
            for k in 0..D {
                lanes = lanes.fma(L::splat(a[k][r]), b[k]);
            }
            lanes.store(sum[r].as_mut_ptr());
        }
    }
}

/// Coarse blocks of one chunk. Rows are few and short, so a block is found by its row's list.
struct Sum {
    parts: Part,
    /// Per aggregate, one more than the number of its list; 0 where it has none yet.
    list: Vec<u32>,
    /// Columns of a row and where their blocks are.
    lists: Vec<Vec<(u32, u32)>>,
}

impl Sum {
    fn new(aggregates: usize) -> Self {
        Sum {
            parts: Vec::new(),
            list: vec![0; aggregates],
            lists: Vec::new(),
        }
    }

    #[inline(always)]
    fn slot(&mut self, row: u32, column: u32) -> &mut Wide {
        let list = &mut self.list[row as usize];
        if *list == 0 {
            self.lists.push(Vec::with_capacity(16));
            *list = self.lists.len() as u32;
        }
        let list = &mut self.lists[*list as usize - 1];
        let at = match list.iter().find(|c| c.0 == column) {
            Some(c) => c.1,
            None => {
                list.push((column, self.parts.len() as u32));
                self.parts.push((row, column, [[0.0; 8]; 6]));
                self.parts.len() as u32 - 1
            }
        };
        &mut self.parts[at as usize].2
    }
}

/// Adds up the parts in their order, changes the basis and mirrors the upper triangle.
fn merge(parts: Vec<Part>, aggregates: usize, bodies: Option<&[Body]>) -> BlockMatrix {
    let mut index: Vec<(u32, u32, u32, u32)> = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    for (p, part) in parts.iter().enumerate() {
        let places = part.iter().enumerate();
        index.extend(places.map(|(k, &(row, column, _))| (row, column, p as u32, k as u32)));
    }
    index.par_sort_unstable();
    let same: Vec<&[(u32, u32, u32, u32)]> =
        index.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).collect();
    let upper: Vec<(u32, u32, Block6)> = same
        .into_par_iter()
        .map(|places| {
            let mut sum = [[0f32; 8]; 6];
            for &(_, _, p, k) in places {
                let wide = &parts[p as usize][k as usize].2;
                for (s, w) in sum.iter_mut().zip(wide) {
                    s.iter_mut().zip(w).for_each(|(s, w)| *s += w);
                }
            }
            let (row, column, ..) = places[0];
            (row, column, finished(&sum, row, column, bodies))
        })
        .collect();
    drop(parts);
    BlockMatrix::from_upper(&upper, aggregates)
}

/// A block column by column, in the basis of `bodies`, even on the diagonal.
fn finished(wide: &Wide, row: u32, column: u32, bodies: Option<&[Body]>) -> Block6 {
    let mut block: Block6 = std::array::from_fn(|i| wide[i % 6][i / 6]);
    if let Some(bodies) = bodies {
        block = in_basis(&block, &bodies[row as usize], &bodies[column as usize]);
    }
    if row == column {
        let mirrored = blocks::mirrored(&block);
        block = std::array::from_fn(|i| 0.5 * (block[i] + mirrored[i]));
    }
    block
}
