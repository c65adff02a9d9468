//! Owns the inverse diagonal blocks of the finest level, one number per site: most sites have one of few blocks.

use crate::operator::coarsen::{Block, Coarsen};
use std::collections::HashMap;

/// Symmetric 3 × 3: xx, yy, zz, yz, xz, xy. Zero rows and columns for held components.
pub type Symmetric = [f32; 6];

pub struct Diagonal {
    /// The distinct blocks; the first is zero.
    kinds: Vec<Symmetric>,
    of: Vec<u32>,
}

impl Diagonal {
    /// Chunks made on their own, in order.
    pub fn from_chunks(chunks: Vec<Vec<Symmetric>>) -> Self {
        let mut known: HashMap<[u32; 6], u32> = HashMap::new();
        let mut kinds = vec![[0.0; 6]];
        known.insert([0; 6], 0);
        let mut of = Vec::with_capacity(chunks.iter().map(Vec::len).sum());
        for block in chunks.into_iter().flatten() {
            let kind = *known.entry(block.map(f32::to_bits)).or_insert_with(|| {
                kinds.push(block);
                kinds.len() as u32 - 1
            });
            of.push(kind);
        }
        Diagonal { kinds, of }
    }

    pub fn sites(&self) -> usize {
        self.of.len()
    }

    #[inline]
    pub fn times(&self, site: usize, r: &[f32; 3]) -> [f32; 3] {
        let [xx, yy, zz, yz, xz, xy] = self.kinds[self.of[site] as usize];
        [
            xx * r[0] + xy * r[1] + xz * r[2],
            xy * r[0] + yy * r[1] + yz * r[2],
            xz * r[0] + yz * r[1] + zz * r[2],
        ]
    }

    /// 1 where a component is free, 0 where it is held or has no stiffness.
    #[inline]
    pub fn free(&self, site: usize) -> [f32; 3] {
        let d = &self.kinds[self.of[site] as usize];
        [0, 1, 2].map(|c| if d[c] > 0.0 { 1.0 } else { 0.0 })
    }
}

/// The inverse of a site's diagonal block on its free components.
pub fn inverse(block: &Block, held: u8) -> Symmetric {
    let free = [0, 1, 2].map(|c: usize| held & (1 << c) == 0 && block[c][c] > 0.0);
    // Held components become a unit diagonal, and zero again in the inverse.
    let a = |r: usize, c: usize| match (free[r] && free[c], r == c) {
        (true, _) => f64::from(block[r][c]),
        (false, true) => 1.0,
        (false, false) => 0.0,
    };
    let minor = |r: usize, c: usize| {
        let (p, q) = ((r + 1) % 3, (r + 2) % 3);
        let (s, t) = ((c + 1) % 3, (c + 2) % 3);
        a(p, s) * a(q, t) - a(p, t) * a(q, s)
    };
    let determinant = (0..3).map(|c| a(0, c) * minor(0, c)).sum::<f64>();
    let scale = a(0, 0) * a(1, 1) * a(2, 2);
    let keep = |r: usize, c: usize, v: f64| if free[r] && free[c] { v as f32 } else { 0.0 };
    if determinant <= 1e-5 * scale {
        // A direction without stiffness of its own (a single bond, say): the diagonal alone.
        return std::array::from_fn(|k| {
            if k < 3 {
                keep(k, k, a(k, k).recip())
            } else {
                0.0
            }
        });
    }
    let entry = |r: usize, c: usize| keep(r, c, minor(c, r) / determinant);
    [
        entry(0, 0),
        entry(1, 1),
        entry(2, 2),
        entry(1, 2),
        entry(0, 2),
        entry(0, 1),
    ]
}

/// Inverse blocks of the sites `start..start + held.len()`.
pub fn chunk(operator: &impl Coarsen, start: usize, held: &[u8]) -> Vec<Symmetric> {
    let mut row = Vec::with_capacity(32);
    held.iter()
        .enumerate()
        .map(|(i, &held)| {
            row.clear();
            operator.row(start + i, &mut row);
            let own = row.iter().find(|(j, _)| *j as usize == start + i);
            own.map_or([0.0; 6], |(_, block)| inverse(block, held))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_that_of_the_free_components() {
        let block = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 5.0]];
        for held in 0..8 {
            let d = Diagonal::from_chunks(vec![vec![inverse(&block, held)]]);
            for c in 0..3 {
                // D⁻¹ applied to the free part of column c of the block.
                let free = |k: usize| held & (1 << k) == 0;
                let column = [0, 1, 2].map(|k| if free(k) { block[k][c] } else { 0.0 });
                let back = d.times(0, &column);
                for (k, &v) in back.iter().enumerate() {
                    let expected = if k == c && free(c) { 1.0 } else { 0.0 };
                    assert!(!free(c) || (v - expected).abs() < 1e-6);
                }
            }
        }
    }
}
