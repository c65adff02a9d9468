//! Owns a lattice's neighbour lists in a bit a bond: 11 bytes a site of plump structure, 30 of sheets one site thick.
//!
//! Sites are numbered along rows of the grid, and so are their neighbours in the rows next to them. From one site to the next
//! in its row, the end of a bond therefore moves on by one where the bond exists, and stays where it does not: a site
//! stores a bit a bond, and only the first site of a stretch the numbers that its bonds begin with.

// Lanes read best by index.
#![allow(clippy::needless_range_loop)]

mod encode;

use crate::discretisation::lattice::stencil::Stencil;
use encode::{Stretches, encode};
use rayon::prelude::*;
use std::ops::{Deref, Range};

/// Bonds of a site at most (SC and FCC).
pub const MOST: usize = 18;

/// Entries of a decoded row: its bonds, filled up to whole registers.
pub const LANES: usize = 24;

/// Sites decoded at a time: their table stays in the first-level cache.
pub const DECODED: usize = 64;

/// Where the inner loops find neighbours: a row per site, its bonds first.
pub type Table = [[u32; LANES]; DECODED];

/// An empty table.
pub const EMPTY: Table = [[0; LANES]; DECODED];

/// Marks the first site of a stretch in its word.
const FIRST: u32 = 1 << 31;

/// The bit of every lane's bond.
const BITS: [u32; LANES] = {
    let mut bits = [0; LANES];
    let mut b = 0;
    while b < MOST {
        bits[b] = 1 << b;
        b += 1;
    }
    bits
};

/// Sites that one task encodes; a multiple of [`DECODED`].
const CHUNK: usize = 8192;

/// Numbers a stretch begins with, at most (FCC has 14).
const NUMBERS: usize = 16;

/// The neighbours of every site, bond by bond in the stencil's order; a missing one is the site itself.
#[derive(Debug, Clone)]
pub struct Neighbours {
    coordination: usize,
    chains: Chains,
    /// Per site: the bits of its bonds, and whether a stretch begins there.
    words: Vec<u32>,
    /// Per stretch a number a chain: what the first of the chain's bonds leads to, or would lead to next.
    numbers: Vec<u32>,
    /// The stretch at each [`DECODED`] sites, where one always begins.
    stretches: Vec<u32>,
}

/// Bonds whose ends lie side by side in one row: where they exist, their numbers follow each other.
#[derive(Debug, Clone)]
struct Chains {
    count: usize,
    /// Each bond's chain.
    of: [u8; LANES],
    /// The bits of the bonds before each in its chain; two at most.
    before: [[u32; LANES]; 2],
}

/// The neighbours of one site.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    ends: [u32; LANES],
    coordination: usize,
}

impl Deref for Row {
    type Target = [u32];
    fn deref(&self) -> &[u32] {
        &self.ends[..self.coordination]
    }
}

impl Chains {
    fn new(stencil: &Stencil) -> Self {
        let lists = stencil.chains();
        assert!(lists.len() <= NUMBERS && stencil.coordination() <= MOST);
        let mut chains = Chains {
            count: lists.len(),
            of: [0; LANES],
            before: [[0; LANES]; 2],
        };
        for (c, list) in lists.iter().enumerate() {
            assert!(list.len() <= 3);
            for (place, &b) in list.iter().enumerate() {
                chains.of[b] = c as u8;
                for (before, &earlier) in chains.before.iter_mut().zip(&list[..place]) {
                    before[b] = BITS[earlier];
                }
            }
        }
        chains
    }

    /// How many of the bonds before `b` in its chain a site has.
    #[inline(always)]
    fn ahead(&self, b: usize, word: u32) -> u32 {
        let [one, other] = [self.before[0][b], self.before[1][b]];
        u32::from(word & one != 0) + u32::from(word & other != 0)
    }

    /// What each bond leads to, or would lead to next, at the first site of a stretch.
    #[inline(always)]
    fn spread(&self, numbers: &[u32], word: u32) -> [u32; LANES] {
        let mut all = [0; NUMBERS];
        for (all, &number) in all.iter_mut().zip(numbers) {
            *all = number;
        }
        let mut next = [0; LANES];
        for b in 0..LANES {
            next[b] = all[usize::from(self.of[b]) % NUMBERS];
        }
        for b in 0..LANES {
            next[b] += self.ahead(b, word);
        }
        next
    }
}

impl Neighbours {
    /// `follows(site)` is whether the site stands next to the one before it in a row of the grid; `end(site, bond)` is
    /// the site that the bond leads to, if it exists. Sites are numbered along rows.
    pub fn new(
        sites: usize,
        stencil: &Stencil,
        follows: impl Fn(usize) -> bool + Sync,
        end: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Self {
        let chains = Chains::new(stencil);
        let z = stencil.coordination();
        let mut words = vec![0; sites];
        let parts: Vec<Stretches> = words
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(c, words)| {
                let first = c * CHUNK;
                let starts = |i: usize| i.is_multiple_of(DECODED) || !follows(first + i);
                encode(sites, &chains, words, starts, |i, row| {
                    (0..z).for_each(|b| row[b] = end(first + i, b));
                })
            })
            .collect();
        let count = chains.count;
        let mut numbers = Vec::with_capacity(parts.iter().map(|p| p.numbers.len()).sum());
        let mut stretches = Vec::with_capacity(sites.div_ceil(DECODED));
        for part in &parts {
            let before = (numbers.len() / count) as u32;
            stretches.extend(part.at.iter().map(|at| before + at));
            numbers.extend_from_slice(&part.numbers);
        }
        Neighbours {
            coordination: z,
            chains,
            words,
            numbers,
            stretches,
        }
    }

    pub fn coordination(&self) -> usize {
        self.coordination
    }

    pub fn len(&self) -> usize {
        self.words.len()
    }

    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        4 * (self.words.capacity() + self.numbers.capacity() + self.stretches.capacity())
    }

    pub fn has(&self, site: usize, bond: usize) -> bool {
        self.words[site] & BITS[bond] != 0
    }

    /// Bonds of one site.
    pub fn bonds(&self, site: usize) -> u32 {
        (self.words[site] & !FIRST).count_ones()
    }

    /// The neighbours of one site. In loops over sites, [`Neighbours::decode`] is cheaper.
    pub fn row(&self, site: usize) -> Row {
        let mut row = Row {
            ends: [0; LANES],
            coordination: self.coordination,
        };
        self.decode(site..site + 1, std::slice::from_mut(&mut row.ends));
        row
    }

    /// Calls `visit` with every site and its neighbours. Inlined, as [`Neighbours::decode`].
    #[inline(always)]
    pub fn each(&self, sites: Range<usize>, mut visit: impl FnMut(usize, &[u32; LANES])) {
        let mut table = EMPTY;
        for start in sites.clone().step_by(DECODED) {
            let part = start..(start + DECODED).min(sites.end);
            self.decode(part.clone(), &mut table);
            for (site, row) in part.zip(&table) {
                visit(site, row);
            }
        }
    }

    /// Writes the neighbours of `sites` to the head of `rows`, which has a row a site at least. Cheapest from multiples of
    /// [`DECODED`] on. Inlined, so that it is compiled for the caller's instruction set.
    #[inline(always)]
    pub fn decode(&self, sites: Range<usize>, rows: &mut [[u32; LANES]]) {
        let block = sites.start / DECODED;
        let first = block * DECODED;
        let (skipped, words) = (
            &self.words[first..sites.start],
            &self.words[sites.start..sites.end],
        );
        let numbers = &self.numbers[self.stretches[block] as usize * self.chains.count..];
        let mut ends = Ends {
            chains: &self.chains,
            numbers,
            next: [0; LANES],
        };
        for &word in skipped {
            ends.enter(word);
            ends.leave(word);
        }
        for ((site, &word), row) in sites.zip(words).zip(rows) {
            ends.enter(word);
            for b in 0..LANES {
                let there = word & BITS[b] != 0;
                row[b] = if there { ends.next[b] } else { site as u32 };
            }
            ends.leave(word);
        }
    }
}

/// Where bonds lead to, while going from site to site.
struct Ends<'a> {
    chains: &'a Chains,
    /// Of the stretches to come.
    numbers: &'a [u32],
    next: [u32; LANES],
}

impl Ends<'_> {
    #[inline(always)]
    fn enter(&mut self, word: u32) {
        if word & FIRST != 0 {
            let (own, rest) = self.numbers.split_at(self.chains.count);
            self.next = self.chains.spread(own, word);
            self.numbers = rest;
        }
    }

    #[inline(always)]
    fn leave(&mut self, word: u32) {
        for b in 0..LANES {
            self.next[b] += u32::from(word & BITS[b] != 0);
        }
    }
}

#[cfg(test)]
mod tests;
