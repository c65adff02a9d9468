//! Owns the three cubic lattices: where sites may sit and which bonds a site has.

use serde::{Deserialize, Serialize};

/// The cubic lattice. Sites sit on a grid of spacing `g`: SC uses every node, `g = LP`; BCC and FCC use the nodes
/// allowed by a parity rule, `g = LP/2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Structure {
    /// Simple cubic.
    #[default]
    Sc,
    /// Body-centred cubic.
    Bcc,
    /// Face-centred cubic.
    Fcc,
}

/// Bonds of one site, in grid steps: opposite bonds stand next to each other, the first shell comes first.
#[derive(Debug, Clone, Copy)]
pub struct Stencil {
    /// One direction of each opposite pair; the other is its negative.
    pub pairs: &'static [[i32; 3]],
    /// How many of the pairs belong to the first shell.
    pub first_shell_pairs: usize,
}

const SC: [[i32; 3]; 9] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
];

const BCC: [[i32; 3]; 7] = [
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
    [2, 0, 0],
    [0, 2, 0],
    [0, 0, 2],
];

const FCC: [[i32; 3]; 9] = [
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [2, 0, 0],
    [0, 2, 0],
    [0, 0, 2],
];

impl Structure {
    /// The three lattices.
    pub const ALL: [Structure; 3] = [Structure::Sc, Structure::Bcc, Structure::Fcc];

    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Sc => "sc",
            Structure::Bcc => "bcc",
            Structure::Fcc => "fcc",
        }
    }

    /// Bonds of a site: 6 + 12 (SC), 8 + 6 (BCC), 12 + 6 (FCC).
    pub fn stencil(self) -> Stencil {
        match self {
            Structure::Sc => Stencil {
                pairs: &SC,
                first_shell_pairs: 3,
            },
            Structure::Bcc => Stencil {
                pairs: &BCC,
                first_shell_pairs: 4,
            },
            Structure::Fcc => Stencil {
                pairs: &FCC,
                first_shell_pairs: 6,
            },
        }
    }

    /// Grid steps per lattice parameter, which is as far apart as places for sites in a row along an axis are.
    pub fn steps_per_lp(self) -> f64 {
        if self == Structure::Sc { 1.0 } else { 2.0 }
    }

    /// Whether a site may sit at these grid indices; `(0, 0, 0)` always is a site.
    pub fn allows(self, [i, j, k]: [i32; 3]) -> bool {
        let odd = |v: i32| v & 1;
        match self {
            Structure::Sc => true,
            Structure::Bcc => odd(i) == odd(j) && odd(j) == odd(k),
            Structure::Fcc => odd(i + j + k) == 0,
        }
    }

    /// Distance of first neighbours in lattice parameters.
    pub fn first_neighbour(self) -> f64 {
        match self {
            Structure::Sc => 1.0,
            Structure::Bcc => 0.75f64.sqrt(),
            Structure::Fcc => 0.5f64.sqrt(),
        }
    }

    /// Volume of a site's cell in LP³.
    pub fn cell_volume(self) -> f64 {
        match self {
            Structure::Sc => 1.0,
            Structure::Bcc => 0.5,
            Structure::Fcc => 0.25,
        }
    }
}

impl Stencil {
    /// Bonds of a fully coordinated site.
    pub fn coordination(&self) -> usize {
        2 * self.pairs.len()
    }

    /// Bonds in chains: ends in one row along x with no other place for a site between them, in the order of x.
    pub fn chains(&self) -> Vec<Vec<usize>> {
        let mut order: Vec<usize> = (0..self.coordination()).collect();
        order.sort_by_key(|&b| self.direction(b)[0]);
        let mut chains: Vec<Vec<usize>> = Vec::new();
        for b in order {
            let [_, y, z] = self.direction(b);
            let is_next = |chain: &&mut Vec<usize>| {
                let [_, other_y, other_z] = self.direction(chain[0]);
                // In the site's own row, the site stands between.
                [y, z] != [0, 0] && [y, z] == [other_y, other_z]
            };
            match chains.iter_mut().find(is_next) {
                Some(chain) => chain.push(b),
                None => chains.push(vec![b]),
            }
        }
        chains
    }

    /// Direction of bond `b`: even bonds point along their pair, odd ones against it.
    pub fn direction(&self, b: usize) -> [i32; 3] {
        let sign = if b.is_multiple_of(2) { 1 } else { -1 };
        self.pairs[b / 2].map(|c| sign * c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of a chain are as far apart as sites in a row are, and every bond is in one chain.
    #[test]
    fn chains_have_no_gaps() {
        for s in Structure::ALL {
            let stencil = s.stencil();
            let chains = stencil.chains();
            for chain in &chains {
                for pair in chain.windows(2) {
                    let [a, b] = [stencil.direction(pair[0]), stencil.direction(pair[1])];
                    assert_eq!(
                        [b[0] - a[0], b[1] - a[1], b[2] - a[2]],
                        [s.steps_per_lp() as i32, 0, 0]
                    );
                }
            }
            let mut all = chains.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..stencil.coordination()));
        }
    }

    #[test]
    fn bonds_lead_from_site_to_site_and_have_the_paper_counts() {
        // Zojaji et al. 2024: 18 bonds for SC and FCC, 14 for BCC; shells 6+12, 8+6, 12+6.
        for (s, z, first) in [
            (Structure::Sc, 18, 6),
            (Structure::Bcc, 14, 8),
            (Structure::Fcc, 18, 12),
        ] {
            let stencil = s.stencil();
            assert_eq!(stencil.coordination(), z);
            assert_eq!(2 * stencil.first_shell_pairs, first);
            for b in 0..z {
                let d = stencil.direction(b);
                assert!(s.allows(d), "{s:?} {d:?}");
                let length =
                    (d.iter().map(|c| c * c).sum::<i32>() as f64).sqrt() / s.steps_per_lp();
                let in_first = b < first;
                assert_eq!((length - s.first_neighbour()).abs() < 1e-12, in_first);
            }
        }
    }
}
