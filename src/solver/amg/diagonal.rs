//! Owns the diagonal blocks of the finest level: most sites have one of few blocks, so a site's own entry is two bytes.

use crate::operator::coarsen::{Block, Coarsen};
use crate::operator::held::Held;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Symmetric 3 × 3: xx, yy, zz, yz, xz, xy. Zero rows and columns for held components.
pub type Symmetric = [f32; 6];

/// A block's inverse and the block.
pub type Pair = [Symmetric; 2];

pub enum Diagonal {
    /// The distinct blocks, inverse and not, their stiffness, and each site's.
    Few {
        kinds: Vec<Pair>,
        stiffness: Vec<f32>,
        of: Vec<u16>,
    },
    /// An inverse block a site.
    Each(Vec<Symmetric>),
}

/// Sites per task of the set-up.
const CHUNK: usize = 1 << 14;

impl Diagonal {
    pub fn new(operator: &impl Coarsen, held: &Held) -> Self {
        let chunks = held.0.par_chunks(CHUNK).enumerate();
        let few: Vec<(Vec<Pair>, Vec<u16>)> = chunks
            .clone()
            .map(|(c, held)| distinct(operator, c * CHUNK, held))
            .collect();
        Diagonal::few(few).unwrap_or_else(|| {
            let mut all = vec![[0.0; 6]; held.0.len()];
            all.par_chunks_mut(CHUNK)
                .zip(chunks)
                .for_each(|(all, (c, held))| {
                    let mut all = all.iter_mut();
                    each_pair(operator, c * CHUNK, held, |[inverse, _]| {
                        all.next().into_iter().for_each(|a| *a = inverse);
                    });
                });
            Diagonal::Each(all)
        })
    }

    /// From each chunk's blocks and its sites' places in them; None where there are too many.
    fn few(chunks: Vec<(Vec<Pair>, Vec<u16>)>) -> Option<Self> {
        let mut known: HashMap<[u32; 6], u16> = HashMap::new();
        let mut kinds = Vec::new();
        let mut renamed = Vec::with_capacity(chunks.len());
        for (blocks, _) in &chunks {
            let mut names = Vec::with_capacity(blocks.len());
            for pair in blocks {
                let kind = *known.entry(pair[0].map(f32::to_bits)).or_insert_with(|| {
                    kinds.push(*pair);
                    kinds.len() as u16 - 1
                });
                names.push(kind);
                if kinds.len() > MOST_KINDS {
                    return None;
                }
            }
            renamed.push(names);
        }
        let mut of = Vec::with_capacity(chunks.iter().map(|c| c.1.len()).sum());
        for ((_, places), names) in chunks.iter().zip(&renamed) {
            of.extend(places.iter().map(|&p| names[p as usize]));
        }
        let stiffness = kinds
            .iter()
            .map(|[inverse, _]| stiffness(inverse))
            .collect();
        Some(Diagonal::Few {
            kinds,
            stiffness,
            of,
        })
    }

    pub fn sites(&self) -> usize {
        match self {
            Diagonal::Few { of, .. } => of.len(),
            Diagonal::Each(all) => all.len(),
        }
    }

    pub fn bytes(&self) -> usize {
        match self {
            Diagonal::Few { kinds, of, .. } => 52 * kinds.len() + 2 * of.len(),
            Diagonal::Each(all) => 24 * all.len(),
        }
    }

    #[inline]
    fn inverse(&self, site: usize) -> &Symmetric {
        match self {
            Diagonal::Few { kinds, of, .. } => &kinds[of[site] as usize][0],
            Diagonal::Each(all) => &all[site],
        }
    }

    /// `D⁻¹ r`.
    #[inline]
    pub fn scale(&self, site: usize, r: &[f32; 3]) -> [f32; 3] {
        times(self.inverse(site), r)
    }

    /// `D⁻¹`.
    #[inline]
    pub fn inverse_block(&self, site: usize) -> [[f32; 3]; 3] {
        let [xx, yy, zz, yz, xz, xy] = *self.inverse(site);
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    }

    /// `D t` on the free components, where the blocks are kept.
    #[inline]
    pub fn unscale(&self, site: usize, t: &[f32; 3]) -> Option<[f32; 3]> {
        match self {
            Diagonal::Few { kinds, of, .. } => Some(times(&kinds[of[site] as usize][1], t)),
            Diagonal::Each(_) => None,
        }
    }

    /// Roughly the mean of the diagonal on the free components.
    pub fn stiffness(&self, site: usize) -> f32 {
        match self {
            Diagonal::Few { stiffness, of, .. } => stiffness[of[site] as usize],
            Diagonal::Each(all) => stiffness(&all[site]),
        }
    }

    /// 1 where a component is free, 0 where it is held or has no stiffness.
    #[inline]
    pub fn free(&self, site: usize) -> [f32; 3] {
        free(self.inverse(site))
    }
}

fn free(inverse: &Symmetric) -> [f32; 3] {
    [0, 1, 2].map(|c| if inverse[c] > 0.0 { 1.0 } else { 0.0 })
}

/// Roughly the mean of the diagonal on the free components.
fn stiffness(inverse: &Symmetric) -> f32 {
    let free: f32 = free(inverse).iter().sum();
    let trace: f32 = inverse[..3].iter().sum();
    if free > 0.0 { free / trace } else { 0.0 }
}

/// Kinds up to which the kind of a site takes two bytes: their table should stay in the cache.
const MOST_KINDS: usize = 4096;

#[inline]
fn times([xx, yy, zz, yz, xz, xy]: &Symmetric, r: &[f32; 3]) -> [f32; 3] {
    [
        xx * r[0] + xy * r[1] + xz * r[2],
        xy * r[0] + yy * r[1] + yz * r[2],
        xz * r[0] + yz * r[1] + zz * r[2],
    ]
}

/// Condition above which a block is taken for singular (a single bond has no stiffness across itself): single precision
/// must have the residual back from `D D⁻¹`.
const MOST_CONDITION: f64 = 1e4;

/// Part of a block's largest entry below which another is what rounding left. As zero it multiplies what is small to zero
/// and not below what single precision holds in full, which costs processors a hundred times a product's time.
const ROUNDING: f64 = 1e-12;

/// The inverse of a site's diagonal block on its free components, and what it is the inverse of.
fn pair(block: &Block, held: u8) -> Pair {
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
    let trace = |f: &dyn Fn(usize) -> f64| (0..3).filter(|&c| free[c]).map(f).sum::<f64>();
    let condition = trace(&|c| a(c, c)) * trace(&|c| minor(c, c) / determinant);
    let symmetric = |f: &dyn Fn(usize, usize) -> f64| {
        let largest = (0..3).map(|c| f(c, c).abs()).fold(0.0, f64::max);
        [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)].map(|(r, c)| {
            let v = if free[r] && free[c] { f(r, c) } else { 0.0 };
            if v.abs() > ROUNDING * largest {
                v as f32
            } else {
                0.0
            }
        })
    };
    if determinant > 0.0 && condition < MOST_CONDITION {
        return [symmetric(&|r, c| minor(c, r) / determinant), symmetric(&a)];
    }
    // Three times the diagonal is above the block, whatever it is, and so keeps the bound of its eigenvalues.
    let diagonal = |f: fn(f64) -> f64| symmetric(&|r, c| if r == c { f(a(c, c)) } else { 0.0 });
    [diagonal(|v| (3.0 * v).recip()), diagonal(|v| 3.0 * v)]
}

/// Calls `visit` with the pair of each site `start..start + held.len()`; zero without a row.
fn each_pair(operator: &impl Coarsen, start: usize, held: &[u8], mut visit: impl FnMut(Pair)) {
    operator.each_diagonal(start..start + held.len(), &mut |site, block| {
        visit(pair(block, held[site - start]));
    });
}

/// The distinct pairs of a chunk and each site's place among them.
fn distinct(operator: &impl Coarsen, start: usize, held: &[u8]) -> (Vec<Pair>, Vec<u16>) {
    let mut known: HashMap<[u32; 6], u16> = HashMap::new();
    let (mut kinds, mut of) = (Vec::new(), Vec::with_capacity(held.len()));
    // Blocks come from few ways in which neighbours exist, so most were inverted a short while ago.
    let mut recent = vec![None; RECENT];
    operator.each_diagonal(start..start + held.len(), &mut |site, block| {
        let key = (*block, held[site - start]);
        let slot = &mut recent[slot(&key)];
        let kind = match *slot {
            Some((before, kind)) if before == key => kind,
            _ => {
                let pair = pair(block, key.1);
                *known.entry(pair[0].map(f32::to_bits)).or_insert_with(|| {
                    kinds.push(pair);
                    kinds.len() as u16 - 1
                })
            }
        };
        *slot = Some((key, kind));
        of.push(kind);
    });
    (kinds, of)
}

/// Blocks that a chunk remembers.
const RECENT: usize = 1024;

/// Where a block and what is held of it are remembered.
fn slot((block, held): &(Block, u8)) -> usize {
    let mut hasher = DefaultHasher::new();
    block.map(|row| row.map(f32::to_bits)).hash(&mut hasher);
    held.hash(&mut hasher);
    hasher.finish() as usize % RECENT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_is_that_of_the_free_components() {
        let block = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 5.0]];
        for held in 0..8 {
            let d = Diagonal::few(vec![(vec![pair(&block, held)], vec![0])]).unwrap();
            for c in 0..3 {
                // D⁻¹ applied to the free part of column c of the block.
                let free = |k: usize| held & (1 << k) == 0;
                let column = [0, 1, 2].map(|k| if free(k) { block[k][c] } else { 0.0 });
                let back = d.scale(0, &column);
                for (k, &v) in back.iter().enumerate() {
                    let expected = if k == c && free(c) { 1.0 } else { 0.0 };
                    assert!(!free(c) || (v - expected).abs() < 1e-6);
                }
                let there = d.unscale(0, &d.scale(0, &column)).unwrap();
                for (k, &v) in there.iter().enumerate() {
                    assert!((v - column[k]).abs() < 1e-5);
                }
            }
        }
    }

    /// `3 diag(B) >= B` for the block of a single bond, whose own inverse does not exist.
    #[test]
    fn a_block_without_inverse_is_replaced_by_one_above_it() {
        let n = [0.6f32, 0.8, 0.0];
        let [inverse, _] = pair(&n.map(|a| n.map(|b| a * b)), 0);
        let z = times(&inverse, &n);
        let quotient: f32 = n.iter().zip(&z).map(|(n, z)| n * z).sum();
        assert!(quotient > 0.0 && quotient <= 1.0, "{quotient}");
    }
}
