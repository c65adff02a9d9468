//! Owns which site moves with which aggregate, and sums over aggregates.
//!
//! Sites are told in chunks, each with the list of the few aggregates that it has part in: a site's own entry is two
//! bytes, and sums go chunk by chunk, then list by list, in an order that does not depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// No aggregate: padding, or a site with nothing free.
pub const NONE: u32 = u32::MAX;

/// Sites per chunk.
pub const CHUNK: usize = 2048;

const NOWHERE: u16 = u16::MAX;

/// Sites by aggregate.
#[derive(Debug, Clone)]
pub struct Aggregates {
    pub count: usize,
    /// Per site the place of its aggregate in its chunk's list, or [`NOWHERE`].
    places: Vec<u16>,
    /// Aggregates of the chunks, list after list.
    lists: Vec<u32>,
    /// Where each chunk's list begins; one more at the end.
    starts: Vec<u32>,
    /// Per aggregate where it is in `lists`, in order, and where each aggregate's entries begin.
    entries: Vec<u32>,
    entry_starts: Vec<u32>,
}

/// The sums of one chunk.
pub struct Sums<'a, T> {
    start: usize,
    places: &'a [u16],
    sums: &'a mut [T],
}

impl<T> Sums<'_, T> {
    /// The sum that a site of the chunk adds to; None for a site without an aggregate.
    #[inline]
    pub fn of(&mut self, site: usize) -> Option<&mut T> {
        self.sums.get_mut(self.places[site - self.start] as usize)
    }
}

impl Aggregates {
    /// From each site's aggregate, or [`NONE`].
    pub fn new(of: &[u32], count: usize) -> Self {
        let chunks: Vec<(Vec<u16>, Vec<u32>)> = of.par_chunks(CHUNK).map(places).collect();
        let mut all = Aggregates {
            count,
            places: Vec::with_capacity(of.len()),
            lists: Vec::new(),
            starts: vec![0],
            entries: Vec::new(),
            entry_starts: vec![0; count + 1],
        };
        for (places, list) in chunks {
            all.places.extend(places);
            all.lists.extend(list);
            all.starts.push(all.lists.len() as u32);
        }
        for &a in &all.lists {
            all.entry_starts[a as usize + 1] += 1;
        }
        for a in 0..count {
            all.entry_starts[a + 1] += all.entry_starts[a];
        }
        let mut next = all.entry_starts.clone();
        all.entries = vec![0; all.lists.len()];
        for (i, &a) in all.lists.iter().enumerate() {
            all.entries[next[a as usize] as usize] = i as u32;
            next[a as usize] += 1;
        }
        all
    }

    /// Number of sites that have an aggregate.
    pub fn sites(&self) -> usize {
        self.places.par_iter().filter(|p| **p != NOWHERE).count()
    }

    pub fn bytes(&self) -> usize {
        2 * self.places.len() + 4 * (2 * self.lists.len() + self.starts.len() + self.count)
    }

    /// The aggregate of a site, or [`NONE`].
    #[inline]
    pub fn of(&self, site: usize) -> u32 {
        match self.places[site] {
            NOWHERE => NONE,
            place => self.lists[self.starts[site / CHUNK] as usize + place as usize],
        }
    }

    /// `out[a] = Σ` over the sites of aggregate `a`; `visit` adds what the sites of one chunk have.
    pub fn sum<T: Copy + Send + Sync>(
        &self,
        out: &mut [T],
        zero: T,
        visit: impl Fn(Range<usize>, &mut Sums<T>) + Sync,
        add: impl Fn(&mut T, &T) + Sync,
    ) {
        let mut parts = vec![zero; self.lists.len()];
        let mut chunks = Vec::with_capacity(self.starts.len());
        let mut rest = &mut parts[..];
        for ends in self.starts.windows(2) {
            let (here, others) = rest.split_at_mut((ends[1] - ends[0]) as usize);
            chunks.push(here);
            rest = others;
        }
        chunks.into_par_iter().enumerate().for_each(|(c, sums)| {
            let start = c * CHUNK;
            let sites = start..(start + CHUNK).min(self.places.len());
            let places = &self.places[sites.clone()];
            visit(
                sites,
                &mut Sums {
                    start,
                    places,
                    sums,
                },
            );
        });
        let sum = |(a, out): (usize, &mut T)| {
            *out = zero;
            let own = self.entry_starts[a] as usize..self.entry_starts[a + 1] as usize;
            for &entry in &self.entries[own] {
                add(out, &parts[entry as usize]);
            }
        };
        out.par_iter_mut()
            .with_min_len(64)
            .enumerate()
            .for_each(sum);
    }
}

/// The places of one chunk's sites in the list of its aggregates.
fn places(of: &[u32]) -> (Vec<u16>, Vec<u32>) {
    let mut list: Vec<u32> = of.iter().copied().filter(|&a| a != NONE).collect();
    list.sort_unstable();
    list.dedup();
    let place = |a: &u32| list.binary_search(a).map_or(NOWHERE, |p| p as u16);
    (of.iter().map(place).collect(), list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_each_aggregates_sites() {
        let of: Vec<u32> = (0..3 * CHUNK as u32 + 17)
            .map(|i| {
                if i % 11 == 3 {
                    NONE
                } else {
                    i * 7 % 5003 % 900
                }
            })
            .collect();
        let all = Aggregates::new(&of, 900);
        let mut expected = vec![0u64; 900];
        for (i, &a) in of.iter().enumerate() {
            assert_eq!(all.of(i), a);
            if a != NONE {
                expected[a as usize] += i as u64;
            }
        }
        let mut sums = vec![1u64; 900];
        let visit = |sites: Range<usize>, sums: &mut Sums<u64>| {
            for i in sites {
                if let Some(s) = sums.of(i) {
                    *s += i as u64;
                }
            }
        };
        all.sum(&mut sums, 0, visit, |s, v| *s += v);
        assert_eq!(sums, expected);
        assert_eq!(all.sites(), of.iter().filter(|a| **a != NONE).count());
    }
}
