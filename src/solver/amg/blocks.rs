//! Owns assembled coarse matrices: symmetric, 6 × 6 blocks in single precision, the upper triangle stored only.
//!
//! A row gathers from its own blocks and, transposed, from those of earlier rows in its column, which mostly are still
//! in the cache: half the memory and nearly half the traffic of storing both triangles.

use super::level::Six;
use crate::simd;
use crate::simd::{Isa, Lanes};
use std::ops::Range;

/// Column by column, so that one column is one load of eight lanes of which six count.
pub type Block6 = [f32; 36];

/// The transposed block.
pub fn mirrored(block: &Block6) -> Block6 {
    std::array::from_fn(|i| block[6 * (i % 6) + i / 6])
}

#[derive(Debug, Clone)]
pub struct BlockMatrix {
    /// Where each row's blocks begin, its diagonal block first; one more at the end.
    starts: Vec<u32>,
    columns: Vec<u32>,
    /// One zero block more than columns: the last column's load runs over.
    blocks: Vec<Block6>,
    /// The blocks below the diagonal, as (column, its block in `blocks`), and where each row's begin.
    lower: Vec<(u32, u32)>,
    lower_starts: Vec<u32>,
}

impl BlockMatrix {
    /// From the places (row, column >= row) of its blocks, in order, the diagonal of every row among them, and the
    /// blocks. One zero block more than places is kept.
    pub fn from_upper(places: &[(u32, u32)], mut blocks: Vec<Block6>) -> Self {
        blocks.push([0.0; 36]);
        let diagonals = places.iter().enumerate().filter(|(_, (r, c))| r == c);
        let mut starts: Vec<u32> = diagonals.map(|(k, _)| k as u32).collect();
        starts.push(places.len() as u32);
        let mut m = BlockMatrix {
            lower: Vec::new(),
            lower_starts: vec![0; starts.len()],
            starts,
            columns: places.iter().map(|p| p.1).collect(),
            blocks,
        };
        m.link_lower();
        m
    }

    fn link_lower(&mut self) {
        for row in 0..self.rows() {
            for &column in &self.columns[self.upper(row)][1..] {
                self.lower_starts[column as usize + 1] += 1;
            }
        }
        for row in 0..self.rows() {
            self.lower_starts[row + 1] += self.lower_starts[row];
        }
        let mut next = self.lower_starts.clone();
        self.lower = vec![(0, 0); self.columns.len() - self.rows()];
        for row in 0..self.rows() {
            for k in self.upper(row).skip(1) {
                let at = &mut next[self.columns[k] as usize];
                self.lower[*at as usize] = (row as u32, k as u32);
                *at += 1;
            }
        }
    }

    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    fn upper(&self, row: usize) -> Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    fn lower(&self, row: usize) -> &[(u32, u32)] {
        &self.lower[self.lower_starts[row] as usize..self.lower_starts[row + 1] as usize]
    }

    pub fn diagonal(&self, row: usize) -> &Block6 {
        &self.blocks[self.starts[row] as usize]
    }

    /// Columns of a row with their blocks, those left of the diagonal as they are stored: transposed.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, &Block6, bool)> {
        let left = self.lower(row).iter();
        let left = left.map(|&(column, k)| (column, &self.blocks[k as usize], true));
        let right = self.upper(row);
        left.chain(right.map(|k| (self.columns[k], &self.blocks[k], false)))
    }

    pub fn bytes(&self) -> usize {
        self.blocks.len() * 148 + self.lower.len() * 8 + self.starts.len() * 8
    }

    /// `y[i − rows.start] = (A x)_i`.
    pub fn multiply(&self, rows: Range<usize>, x: &[Six], y: &mut [Six]) {
        assert!(x.len() == self.rows() && rows.end <= x.len() && y.len() == rows.len());
        match simd::isa() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe { self.multiply_avx2(rows, x, y) },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe { self.multiply_lanes::<simd::PlainF32>(rows, x, y) },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn multiply_avx2(&self, rows: Range<usize>, x: &[Six], y: &mut [Six]) {
        // SAFETY: this function has the features that the lanes ask for.
        unsafe { self.multiply_lanes::<simd::Avx2F32>(rows, x, y) };
    }

    /// # Safety
    /// The instruction set of `L` is there.
    #[inline(always)]
    unsafe fn multiply_lanes<L: Lanes<S = f32>>(
        &self,
        rows: Range<usize>,
        x: &[Six],
        y: &mut [Six],
    ) {
        for (i, y) in rows.zip(y) {
            let mut wide = [0f32; 8];
            // SAFETY: a block's last load runs two scalars over, into the next block or the one kept after the last.
            unsafe {
                let (mut even, mut odd) = (L::zero(), L::zero());
                for k in self.upper(i) {
                    let block = self.blocks.as_ptr().add(k).cast::<f32>();
                    let x = &x[self.columns[k] as usize];
                    for c in 0..3 {
                        even = even.fma(L::load(block.add(12 * c)), L::splat(x[2 * c]));
                        odd = odd.fma(L::load(block.add(12 * c + 6)), L::splat(x[2 * c + 1]));
                    }
                }
                even.fma(odd, L::splat(1.0)).store(wide.as_mut_ptr());
                let mut columns = [L::zero(); 6];
                for &(j, k) in self.lower(i) {
                    let block = self.blocks.as_ptr().add(k as usize).cast::<f32>();
                    let mut own = [0f32; 8];
                    own[..6].copy_from_slice(&x[j as usize]);
                    let x = L::load(own.as_ptr());
                    for (c, sum) in columns.iter_mut().enumerate() {
                        *sum = sum.fma(L::load(block.add(6 * c)), x);
                    }
                }
                for (c, sum) in columns.into_iter().enumerate() {
                    let mut lanes = [0f32; 8];
                    sum.store(lanes.as_mut_ptr());
                    wide[c] += lanes[..6].iter().sum::<f32>();
                }
            }
            y.copy_from_slice(&wide[..6]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_matrix_multiplies_like_all_of_it() {
        let places = [(0u32, 0u32), (0, 2), (0, 3), (1, 1), (1, 3), (2, 2), (3, 3)];
        let block = |p: (u32, u32)| -> Block6 {
            std::array::from_fn(|i| {
                let (r, c) = (i % 6, i / 6);
                let (r, c) = if p.0 == p.1 {
                    (r.min(c), r.max(c))
                } else {
                    (r, c)
                };
                ((13 * p.0 + 7 * p.1) as f32 + (3 * r + 5 * c) as f32).sin()
            })
        };
        let m = BlockMatrix::from_upper(&places, places.iter().map(|&p| block(p)).collect());
        assert_eq!(m.rows(), 4);
        let x: Vec<Six> = (0..4)
            .map(|i| std::array::from_fn(|c| (i * 6 + c) as f32 * 0.3 - 2.0))
            .collect();
        let mut expected = [[0.0; 6]; 4];
        for &p in &places {
            let b = block(p);
            for r in 0..6 {
                for c in 0..6 {
                    expected[p.0 as usize][r] += b[6 * c + r] * x[p.1 as usize][c];
                    if p.0 != p.1 {
                        expected[p.1 as usize][c] += b[6 * c + r] * x[p.0 as usize][r];
                    }
                }
            }
        }
        let mut y = vec![[0.0; 6]; 4];
        m.multiply(0..4, &x, &mut y);
        for (y, e) in y.iter().flatten().zip(expected.iter().flatten()) {
            assert!((y - e).abs() < 1e-5, "{y} {e}");
        }
        assert_eq!(m.row(3).map(|e| e.0).collect::<Vec<_>>(), [0, 1, 3]);
    }
}
