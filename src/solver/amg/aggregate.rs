//! Owns which site moves with which aggregate, and sums over aggregates.
//!
//! Sites are stored in chunks, each with the list of the few aggregates that it has part in: a site's own entry is two
//! bytes, and sums go chunk by chunk, then list by list, in an order that does not depend on the number of threads.

use rayon::prelude::*;
use std::ops::Range;

/// No aggregate: padding, or a site with nothing free.
pub const NONE: u32 = u32::MAX;

const NOWHERE: u16 = u16::MAX;

/// Sites by aggregate.
#[derive(Debug, Clone)]
pub struct Aggregates {
    pub count: usize,
    /// Sites per chunk, a power of two, and chunks per task.
    chunk: usize,
    together: usize,
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

/// The sums of one task's chunks.
pub struct Sums<'a, T> {
    first: usize,
    chunk: usize,
    /// Where the sums of each chunk begin among those of all.
    starts: &'a [u32],
    places: &'a [u16],
    sums: &'a mut [T],
}

impl<T> Sums<'_, T> {
    /// The sum that a site of the task adds to; None for a site without an aggregate.
    #[inline]
    pub fn of(&mut self, site: usize) -> Option<&mut T> {
        let i = site - self.first;
        let start = self.starts[i >> self.chunk.trailing_zeros()] - self.starts[0];
        match self.places[i] {
            NOWHERE => None,
            place => Some(&mut self.sums[start as usize + place as usize]),
        }
    }
}

impl Aggregates {
    /// From each site's aggregate, or [`NONE`], in chunks of that many sites, a power of two up to 2¹⁵.
    /// Sums are made by tasks of that many sites, in whole chunks.
    pub fn new(of: &[u32], count: usize, chunk: usize, task: usize) -> Self {
        let chunks: Vec<(Vec<u16>, Vec<u32>)> = of.par_chunks(chunk).map(places).collect();
        let mut all = Aggregates {
            count,
            chunk,
            together: task.div_ceil(chunk),
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
            place => {
                self.lists
                    [self.starts[site >> self.chunk.trailing_zeros()] as usize + place as usize]
            }
        }
    }

    /// `out[a] = Σ` over the sites of aggregate `a`; `visit` adds what the sites of one task have.
    pub fn sum<T: Copy + Send + Sync>(
        &self,
        out: &mut [T],
        zero: T,
        visit: impl Fn(Range<usize>, &mut Sums<T>) + Sync,
        add: impl Fn(&mut T, &T) + Sync,
    ) {
        let mut parts = vec![zero; self.lists.len()];
        let mut tasks = Vec::with_capacity(self.starts.len() / self.together + 1);
        let mut rest = &mut parts[..];
        for first in (0..self.starts.len() - 1).step_by(self.together) {
            let last = (first + self.together).min(self.starts.len() - 1);
            let starts = &self.starts[first..=last];
            let (here, others) = rest.split_at_mut((starts[starts.len() - 1] - starts[0]) as usize);
            tasks.push((first * self.chunk, starts, here));
            rest = others;
        }
        tasks.into_par_iter().for_each(|(first, starts, sums)| {
            let sites = first..(first + self.together * self.chunk).min(self.places.len());
            let mut sums = Sums {
                first,
                chunk: self.chunk,
                starts,
                places: &self.places[sites.clone()],
                sums,
            };
            visit(sites, &mut sums);
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
        let of: Vec<u32> = (0..3 * 1024 + 17)
            .map(|i| {
                if i % 11 == 3 {
                    NONE
                } else {
                    i * 7 % 5003 % 900
                }
            })
            .collect();
        let all = Aggregates::new(&of, 900, 1024, 2000);
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
