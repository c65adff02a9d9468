//! Owns an elimination order of a graph and the size of the factor that it gives, found before anything of the factor is stored.
//!
//! The order is that of minimum degree (AMD, by faer). Values are counted row by row up the elimination tree (Davis 2006, Direct Methods for
//! Sparse Linear Systems, Section 4.4): a step a value, so a count that has a limit costs no more than that limit.

use crate::error::Result;
use crate::solver::direct::failed;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Who is bonded to whom, both ways, without a site's bond to itself: the others of site `i` are `others[start[i]..start[i + 1]]`.
pub struct Graph {
    pub start: Vec<u32>,
    pub others: Vec<u32>,
}

/// An order of the sites in which their matrix keeps its factor sparse.
pub struct Order {
    /// `order[k]` is the site eliminated `k`-th.
    pub order: Vec<u32>,
    /// Blocks of the factor on and below its diagonal.
    pub blocks: usize,
}

impl Graph {
    /// The order of minimum degree, or None where its factor has more than `most` blocks.
    ///
    /// # Errors
    /// faer's: no memory for the order.
    pub fn order(&self, most: usize) -> Result<Option<Order>> {
        let order = self.minimum_degree()?;
        let blocks = self.blocks(&order, most);
        Ok(blocks.map(|blocks| Order { order, blocks }))
    }

    fn minimum_degree(&self) -> Result<Vec<u32>> {
        let n = self.start.len() - 1;
        let (mut order, mut place) = (vec![0; n], vec![0; n]);
        let pattern =
            SymbolicSparseColMatRef::new_unsorted_checked(n, n, &self.start, None, &self.others);
        let room = amd::order_maybe_unsorted_scratch::<u32>(n, self.others.len());
        amd::order_maybe_unsorted(
            &mut order,
            &mut place,
            pattern,
            amd::Control::default(),
            MemStack::new(&mut MemBuffer::new(room)),
        )
        .map_err(|e| failed("Cholesky", format!("{e:?}")))?;
        Ok(order)
    }

    /// Blocks of the factor in this order: of row `k` those on the paths of the elimination tree from its earlier neighbours up to `k`.
    fn blocks(&self, order: &[u32], most: usize) -> Option<usize> {
        const NONE: u32 = u32::MAX;
        let n = order.len();
        let (mut place, mut parent, mut seen) = (vec![0; n], vec![NONE; n], vec![NONE; n]);
        for (k, &site) in order.iter().enumerate() {
            place[site as usize] = k as u32;
        }
        let mut blocks = n;
        for (k, &site) in order.iter().enumerate() {
            let row = k as u32;
            seen[k] = row;
            let range = self.start[site as usize] as usize..self.start[site as usize + 1] as usize;
            for &other in &self.others[range] {
                let mut at = place[other as usize] as usize;
                while at < k && seen[at] != row {
                    if parent[at] == NONE {
                        parent[at] = row;
                    }
                    seen[at] = row;
                    blocks += 1;
                    at = parent[at] as usize;
                }
            }
            if blocks > most {
                return None;
            }
        }
        Some(blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bonds along both axes of `m` by `m` sites.
    fn grid(m: usize) -> Graph {
        let (mut start, mut others) = (vec![0], Vec::new());
        for site in 0..m * m {
            let (x, y) = (site % m, site / m);
            let near = [
                (x > 0).then(|| site - 1),
                (x + 1 < m).then_some(site + 1),
                (y > 0).then(|| site.wrapping_sub(m)),
                (y + 1 < m).then_some(site + m),
            ];
            others.extend(near.into_iter().flatten().map(|s| s as u32));
            start.push(others.len() as u32);
        }
        Graph { start, others }
    }

    /// Blocks by elimination itself: every pair of later neighbours of an eliminated site is joined.
    fn eliminated(graph: &Graph, order: &[u32]) -> usize {
        let n = order.len();
        let mut joined = vec![vec![false; n]; n];
        for (i, joined) in joined.iter_mut().enumerate() {
            let range = graph.start[i] as usize..graph.start[i + 1] as usize;
            graph.others[range]
                .iter()
                .for_each(|&j| joined[j as usize] = true);
        }
        let (mut left, mut blocks) = (vec![true; n], 0);
        for &site in order {
            let site = site as usize;
            left[site] = false;
            let later: Vec<usize> = (0..n).filter(|&j| left[j] && joined[site][j]).collect();
            blocks += 1 + later.len();
            for &i in &later {
                later
                    .iter()
                    .filter(|&&j| j != i)
                    .for_each(|&j| joined[i][j] = true);
            }
        }
        blocks
    }

    #[test]
    fn blocks_are_those_of_elimination() {
        for m in [1, 2, 7, 12] {
            let graph = grid(m);
            let found = graph.order(usize::MAX).unwrap().unwrap();
            let mut sorted = found.order.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().enumerate().all(|(i, &s)| s as usize == i));
            assert_eq!(found.blocks, eliminated(&graph, &found.order), "{m}");
            let rows: Vec<u32> = (0..(m * m) as u32).collect();
            let by_rows = graph.blocks(&rows, usize::MAX).unwrap();
            assert_eq!(by_rows, eliminated(&graph, &rows), "{m}");
            assert!(found.blocks <= by_rows);
        }
    }

    #[test]
    fn a_factor_that_is_too_large_is_none() {
        let graph = grid(12);
        let blocks = graph.order(usize::MAX).unwrap().unwrap().blocks;
        assert!(graph.order(blocks).unwrap().is_some());
        assert!(graph.order(blocks - 1).unwrap().is_none());
    }
}
