//! Owns assembled square matrices in compressed rows: a pattern set once, values filled as often as needed, each row
//! summed by itself so that the result does not depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// Rows per parallel task.
const BLOCK: usize = 256;

/// A square matrix in compressed rows; columns ascend within a row.
#[derive(Debug, Clone)]
pub struct Sparse {
    pub(crate) start: Vec<u32>,
    pub(crate) column: Vec<u32>,
    pub(crate) value: Vec<f64>,
}

/// The rows a task may write to.
pub struct Rows<'a> {
    rows: Range<usize>,
    start: &'a [u32],
    column: &'a [u32],
    value: &'a mut [f64],
}

impl Rows<'_> {
    pub fn range(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Adds to an entry of the pattern.
    ///
    /// # Panics
    /// If the entry is not in the pattern or the row not among these.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let base = self.start[self.rows.start] as usize;
        let (a, b) = (self.start[row] as usize, self.start[row + 1] as usize);
        let place = self.column[a..b]
            .binary_search(&(column as u32))
            .expect("an entry of the pattern");
        self.value[a - base + place] += value;
    }

    /// Moves a row's entries out of a dense row, leaving zeros.
    fn take(&mut self, row: usize, dense: &mut [f64]) {
        let base = self.start[self.rows.start] as usize;
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        for k in range {
            let column = self.column[k] as usize;
            self.value[k - base] = std::mem::take(&mut dense[column]);
        }
    }
}

impl Sparse {
    /// A matrix of zeros. `columns(row, list)` pushes the columns of a row, in any order, repeats allowed.
    pub fn from_pattern(n: usize, mut columns: impl FnMut(usize, &mut Vec<u32>)) -> Self {
        let mut start = vec![0];
        let mut column = Vec::new();
        let mut list = Vec::new();
        for row in 0..n {
            list.clear();
            columns(row, &mut list);
            list.sort_unstable();
            list.dedup();
            column.extend_from_slice(&list);
            start.push(column.len() as u32);
        }
        let value = vec![0.0; column.len()];
        Sparse {
            start,
            column,
            value,
        }
    }

    pub fn n(&self) -> usize {
        self.start.len() - 1
    }

    /// Stored entries.
    pub fn entries(&self) -> usize {
        self.column.len()
    }

    /// Columns and values of a row.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.start[i] as usize..self.start[i + 1] as usize;
        range.map(|k| (self.column[k] as usize, self.value[k]))
    }

    /// Replaces all values: `gather` adds the entries of the rows it is handed.
    pub fn fill(&mut self, gather: impl Fn(&mut Rows) + Sync) {
        let n = self.n();
        let (start, column) = (&self.start, &self.column);
        let mut rest = self.value.as_mut_slice();
        let mut tasks = Vec::new();
        for first in (0..n).step_by(BLOCK) {
            let rows = first..(first + BLOCK).min(n);
            let (here, next) = rest.split_at_mut((start[rows.end] - start[rows.start]) as usize);
            rest = next;
            tasks.push(Rows {
                rows,
                start,
                column,
                value: here,
            });
        }
        tasks.into_par_iter().for_each(|mut task| {
            task.value.fill(0.0);
            gather(&mut task);
        });
    }

    /// Replaces all values, a row at a time: `gather(row, dense)` adds the row's entries to a dense row of zeros. For
    /// rows with many entries each added to several times; entries outside the pattern are not allowed.
    pub fn fill_rows(&mut self, gather: impl Fn(usize, &mut [f64]) + Sync) {
        let n = self.n();
        self.fill(|rows| {
            let mut dense = vec![0.0; n];
            for row in rows.range() {
                gather(row, &mut dense);
                rows.take(row, &mut dense);
            }
        });
    }

    /// `y = A x`.
    pub fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.par_chunks_mut(BLOCK).enumerate().for_each(|(block, y)| {
            for (k, out) in y.iter_mut().enumerate() {
                *out = self.row(block * BLOCK + k).map(|(j, a)| a * x[j]).sum();
            }
        });
    }

    /// Largest absolute value.
    pub fn max(&self) -> f64 {
        self.value.iter().fold(0.0, |m, v| v.abs().max(m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_gather_and_multiply() {
        let n = 1000;
        let mut a = Sparse::from_pattern(n, |i, list| {
            list.extend([(i + 1) % n, i, i].map(|j| j as u32));
        });
        assert_eq!(a.entries(), 2 * n);
        for _ in 0..2 {
            a.fill(|rows| {
                for i in rows.range() {
                    rows.add(i, i, 2.0);
                    rows.add(i, (i + 1) % n, -1.0);
                    rows.add(i, i, i as f64);
                }
            });
        }
        let mut y = vec![0.0; n];
        a.apply(&vec![1.0; n], &mut y);
        assert!((0..n).all(|i| y[i] == 1.0 + i as f64));
        assert_eq!(a.max(), 1001.0);
        let before = a.value.clone();
        a.fill_rows(|i, dense| {
            dense[i] += 2.0 + i as f64;
            dense[(i + 1) % n] -= 1.0;
        });
        assert_eq!(a.value, before);
    }
}
