//! Owns how neighbours become words and numbers.

use super::{BITS, Chains, DECODED, FIRST, MOST, NUMBERS};

/// What a task has encoded.
pub struct Stretches {
    pub numbers: Vec<u32>,
    /// The stretch, of the task's own, at each [`DECODED`] sites.
    pub at: Vec<u32>,
}

/// Writes the sites' words. `ends(i, row)` fills in the bonds' ends of site `i`.
pub fn encode(
    sites: usize,
    chains: &Chains,
    words: &mut [u32],
    starts: impl Fn(usize) -> bool,
    ends: impl Fn(usize, &mut [Option<u32>; MOST]),
) -> Stretches {
    let (mut numbers, mut at) = (Vec::new(), Vec::new());
    let mut row = [None; MOST];
    // By chain: what its first bond leads to, or would lead to next. Unknown until the stretch has met one of its bonds.
    let mut next: [Option<u32>; NUMBERS] = [None; NUMBERS];
    for (i, word) in words.iter_mut().enumerate() {
        ends(i, &mut row);
        let bits = (0..MOST).filter(|&b| row[b].is_some());
        *word = bits.map(|b| BITS[b]).sum();
        if starts(i) {
            if i.is_multiple_of(DECODED) {
                at.push((numbers.len() / chains.count) as u32);
            }
            next = [None; NUMBERS];
            numbers.resize(numbers.len() + chains.count, 0);
        }
        let own = numbers.len() - chains.count;
        for (b, end) in row.iter().enumerate() {
            let Some(end) = end else { continue };
            assert!((*end as usize) < sites, "a bond leads to a site");
            let c = usize::from(chains.of[b]);
            let first = end - chains.ahead(b, *word);
            match next[c] {
                Some(next) => assert_eq!(next, first, "sites are numbered along rows"),
                // Nothing of the chain was met before: its numbers have not moved since the stretch began.
                None => (next[c], numbers[own + c]) = (Some(first), first),
            }
        }
        // The first bond of a chain is the one that is left behind.
        for b in (0..MOST).filter(|&b| chains.before[0][b] == 0 && row[b].is_some()) {
            let next = &mut next[usize::from(chains.of[b])];
            *next = next.map(|n| n + 1);
        }
        if starts(i) {
            *word |= FIRST;
        }
    }
    Stretches { numbers, at }
}
