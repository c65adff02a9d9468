//! Owns assembled coarse matrices: compressed rows of 6 × 6 blocks in single precision.

use super::level::Six;
use crate::simd::{self, Isa, Lanes};
use std::ops::Range;

/// Column by column, so that one column is one load of eight lanes of which six count.
pub type Block6 = [f32; 36];

/// The transposed block.
pub fn mirrored(block: &Block6) -> Block6 {
    std::array::from_fn(|i| block[6 * (i % 6) + i / 6])
}

#[derive(Debug, Clone, Default)]
pub struct BlockMatrix {
    /// Where each row's blocks begin; one more at the end.
    pub starts: Vec<usize>,
    pub columns: Vec<u32>,
    /// One zero block more than columns: the last column's load runs over.
    blocks: Vec<Block6>,
}

impl BlockMatrix {
    /// From the blocks with column >= row, in the order of rows and columns.
    pub fn from_upper(upper: &[(u32, u32, Block6)], rows: usize) -> Self {
        let mut starts = vec![0; rows + 1];
        for &(row, column, _) in upper {
            starts[row as usize + 1] += 1;
            if row != column {
                starts[column as usize + 1] += 1;
            }
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; starts[rows]];
        let mut blocks = vec![[0.0; 36]; starts[rows] + 1];
        let mut put = |row: u32, column: u32, block: Block6| {
            let at = &mut next[row as usize];
            columns[*at] = column;
            blocks[*at] = block;
            *at += 1;
        };
        // A row's blocks left of its diagonal come from earlier rows, so that columns rise.
        for (row, column, block) in upper {
            put(*row, *column, *block);
            if row != column {
                put(*column, *row, mirrored(block));
            }
        }
        BlockMatrix {
            starts,
            columns,
            blocks,
        }
    }

    pub fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, &Block6)> {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()]
            .iter()
            .copied()
            .zip(&self.blocks[range])
    }

    pub fn bytes(&self) -> usize {
        self.blocks.len() * 148 + self.starts.len() * 8
    }

    /// `y[i − rows.start] = (A x)_i`.
    pub fn multiply(&self, rows: Range<usize>, x: &[Six], y: &mut [Six]) {
        assert!(x.len() == self.rows() && rows.end <= x.len() && y.len() == rows.len());
        match simd::isa() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe { self.multiply_avx2(rows, x, y) },
            _ => self.multiply_lanes::<simd::PlainF32>(rows, x, y),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn multiply_avx2(&self, rows: Range<usize>, x: &[Six], y: &mut [Six]) {
        self.multiply_lanes::<simd::Avx2F32>(rows, x, y);
    }

    #[inline(always)]
    fn multiply_lanes<L: Lanes<S = f32>>(&self, rows: Range<usize>, x: &[Six], y: &mut [Six]) {
        for (i, y) in rows.zip(y) {
            let mut wide = [0f32; 8];
            // SAFETY: a block's last load runs two scalars over, into the next block or the one kept after the last.
            unsafe {
                let (mut even, mut odd) = (L::zero(), L::zero());
                for k in self.starts[i]..self.starts[i + 1] {
                    let block = self.blocks.as_ptr().add(k).cast::<f32>();
                    let x = &x[self.columns[k] as usize];
                    for c in 0..3 {
                        even = even.fma(L::load(block.add(12 * c)), L::splat(x[2 * c]));
                        odd = odd.fma(L::load(block.add(12 * c + 6)), L::splat(x[2 * c + 1]));
                    }
                }
                even.fma(odd, L::splat(1.0)).store(wide.as_mut_ptr());
            }
            y.copy_from_slice(&wide[..6]);
        }
    }
}
