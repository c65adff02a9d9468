//! Owns a lattice's neighbour lists in about 1.1 bytes a bond: sites in a row have neighbours in rows, so within a block
//! of consecutive sites the numbers of bond `b`'s ends lie close together, and one byte tells them apart.

use rayon::prelude::*;
use std::ops::{Deref, Range};

/// Bonds of a site at most (SC and FCC).
pub const MOST: usize = 18;

/// Sites decoded at a time: their table stays in the first-level cache.
pub const DECODED: usize = 64;

/// Where the inner loops find neighbours: `coordination` entries per site, in [`DECODED`] sites at most.
pub type Table = [u32; MOST * DECODED];

/// The code of a missing neighbour.
const MISSING: u8 = u8::MAX;

/// Sites that one task encodes.
const CHUNK: usize = 8192;

/// The neighbours of every site, bond by bond in the stencil's order; a missing one is the site itself.
#[derive(Debug, Clone)]
pub struct Neighbours {
    coordination: usize,
    sites: usize,
    blocks: Vec<Block>,
    /// Per site and bond the end's number less the block's base.
    codes: Vec<u8>,
}

/// Sites from `start` to the next block's.
#[derive(Debug, Clone, Copy)]
struct Block {
    start: u32,
    base: [u32; MOST],
}

/// The neighbours of one site.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    ends: [u32; MOST],
    coordination: usize,
}

impl Deref for Row {
    type Target = [u32];
    fn deref(&self) -> &[u32] {
        &self.ends[..self.coordination]
    }
}

impl Neighbours {
    /// `end(site, bond)` is the site that the bond leads to, if it exists.
    ///
    /// # Panics
    /// If there are more than [`MOST`] bonds a site.
    pub fn new(
        sites: usize,
        coordination: usize,
        end: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) -> Self {
        assert!(coordination <= MOST);
        let mut codes = vec![MISSING; sites * coordination];
        let blocks: Vec<Vec<Block>> = codes
            .par_chunks_mut(CHUNK * coordination)
            .enumerate()
            .map(|(c, codes)| encode(c * CHUNK, coordination, codes, &end))
            .collect();
        Neighbours {
            coordination,
            sites,
            blocks: blocks.concat(),
            codes,
        }
    }

    pub fn coordination(&self) -> usize {
        self.coordination
    }

    pub fn len(&self) -> usize {
        self.sites
    }

    pub fn is_empty(&self) -> bool {
        self.sites == 0
    }

    /// Bytes on the heap.
    pub fn bytes(&self) -> usize {
        self.codes.capacity() + self.blocks.capacity() * size_of::<Block>()
    }

    fn block_of(&self, site: usize) -> usize {
        self.blocks.partition_point(|b| b.start as usize <= site) - 1
    }

    /// The neighbours of one site. In loops over sites, [`Neighbours::decode`] is cheaper.
    pub fn row(&self, site: usize) -> Row {
        let (z, base) = (self.coordination, &self.blocks[self.block_of(site)].base);
        let codes = &self.codes[site * z..(site + 1) * z];
        let mut ends = [0; MOST];
        for (b, end) in ends.iter_mut().enumerate().take(z) {
            *end = decoded(codes[b], base[b], site as u32);
        }
        Row {
            ends,
            coordination: z,
        }
    }

    /// Writes the neighbours of `sites`, at most [`DECODED`], to the table's head. Inlined, so that it is compiled for
    /// the caller's instruction set.
    #[inline(always)]
    pub fn decode(&self, sites: Range<usize>, table: &mut Table) {
        match self.coordination {
            18 => self.decode_rows::<18>(sites, table),
            14 => self.decode_rows::<14>(sites, table),
            z => {
                for (site, out) in sites.zip(table.chunks_exact_mut(z)) {
                    out.copy_from_slice(&self.row(site));
                }
            }
        }
    }

    #[inline(always)]
    fn decode_rows<const Z: usize>(&self, sites: Range<usize>, table: &mut Table) {
        assert!(sites.len() <= DECODED && sites.end <= self.sites);
        let (mut block, mut site) = (self.block_of(sites.start), sites.start);
        while site < sites.end {
            let next = self.blocks.get(block + 1);
            let end = next.map_or(sites.end, |b| sites.end.min(b.start as usize));
            let base: &[u32; Z] = self.blocks[block].base[..Z].try_into().expect("MOST >= Z");
            let codes = self.codes[site * Z..end * Z].as_chunks::<Z>().0;
            let out = &mut table[(site - sites.start) * Z..(end - sites.start) * Z];
            for (i, (out, codes)) in out.as_chunks_mut::<Z>().0.iter_mut().zip(codes).enumerate() {
                let own = (site + i) as u32;
                for b in 0..Z {
                    out[b] = decoded(codes[b], base[b], own);
                }
            }
            (block, site) = (block + 1, end);
        }
    }
}

#[inline(always)]
fn decoded(code: u8, base: u32, site: u32) -> u32 {
    if code == MISSING {
        site
    } else {
        base + u32::from(code)
    }
}

/// Codes of the sites from `first` on, and their blocks: as long as each bond's ends lie within a byte of each other.
fn encode(
    first: usize,
    coordination: usize,
    codes: &mut [u8],
    end: &(impl Fn(usize, usize) -> Option<u32> + Sync),
) -> Vec<Block> {
    let count = codes.len() / coordination;
    let mut blocks = Vec::new();
    let mut row = [None; MOST];
    let mut start = 0;
    while start < count {
        let (mut low, mut high) = ([u32::MAX; MOST], [0u32; MOST]);
        let mut stop = start;
        'grow: while stop < count {
            for b in 0..coordination {
                row[b] = end(first + stop, b);
                if let Some(n) = row[b]
                    && n.max(high[b]) - n.min(low[b]) >= u32::from(MISSING)
                {
                    break 'grow;
                }
            }
            for b in 0..coordination {
                if let Some(n) = row[b] {
                    (low[b], high[b]) = (low[b].min(n), high[b].max(n));
                }
            }
            stop += 1;
        }
        for (site, codes) in
            (start..stop).zip(codes[start * coordination..].chunks_exact_mut(coordination))
        {
            for (b, code) in codes.iter_mut().enumerate() {
                if let Some(n) = end(first + site, b) {
                    *code = (n - low[b]) as u8;
                }
            }
        }
        blocks.push(Block {
            start: (first + start) as u32,
            base: low,
        });
        start = stop;
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends that jump and are missing at times; of both coordinations that have a path of their own, and another.
    #[test]
    fn what_goes_in_comes_out() {
        for (z, n) in [(18, 20_000usize), (14, 9_000), (6, 3_000), (18, 1)] {
            let end = |s: usize, b: usize| {
                let jump =
                    (s / 700) * 5000 + (s / 13) * (b % 3) + s * (1 + usize::from(b == 5) * 40);
                (!(s * 31 + b * 17).is_multiple_of(5)).then_some((jump + 100 * b) as u32)
            };
            let neighbours = Neighbours::new(n, z, end);
            let expected = |s: usize, b: usize| end(s, b).unwrap_or(s as u32);
            for s in (0..n).step_by(7) {
                let row = neighbours.row(s);
                assert!((0..z).all(|b| row[b] == expected(s, b)));
            }
            let mut table = [0; MOST * DECODED];
            for start in (0..n).step_by(41) {
                let sites = start..(start + DECODED).min(n);
                neighbours.decode(sites.clone(), &mut table);
                for (i, s) in sites.enumerate() {
                    assert!((0..z).all(|b| table[i * z + b] == expected(s, b)));
                }
            }
        }
    }
}
