//! Owns the rows of the operator: for each of the 256 ways in which the elements around a node can exist, the 27
//! blocks that couple it to its neighbours.

use super::element::ElementMatrix;
use crate::operator::coarsen::Block;

/// All 256: the blocks of nine rows of neighbours (dx fastest, then dy, then dz).
#[derive(Debug, Clone)]
pub struct Stencils {
    table: Vec<[[[f64; 3]; 3]; 27]>,
}

impl Stencils {
    pub fn new(k: &ElementMatrix) -> Self {
        let mut table = vec![[[[0.0; 3]; 3]; 27]; 256];
        for (around, stencil) in table.iter_mut().enumerate() {
            for element in (0..8).filter(|e| around >> e & 1 == 1) {
                add_element(stencil, element, k);
            }
        }
        Stencils { table }
    }

    fn block(&self, around: u8, neighbour: usize) -> Block {
        self.table[around as usize][neighbour].map(|row| row.map(|v| v as f32))
    }

    /// The node's own block.
    pub fn own(&self, around: u8) -> Block {
        self.block(around, 13)
    }

    /// The diagonal of the node's own block.
    pub fn diagonal(&self, around: u8) -> [f64; 3] {
        let own = &self.table[around as usize][13];
        std::array::from_fn(|a| own[a][a])
    }
}

/// The non-zero blocks of every stencil.
#[derive(Debug, Clone)]
pub struct Couplings {
    starts: Vec<u32>,
    places: Vec<Place>,
    blocks: Vec<Block>,
}

/// Which neighbour: the one at `dx` (0, 1 or 2) in a row of neighbours.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub row: u8,
    pub dx: u8,
}

impl Place {
    /// Its number among the 27.
    pub fn index(self) -> usize {
        3 * self.row as usize + self.dx as usize
    }
}

impl Couplings {
    pub fn new(stencils: &Stencils) -> Self {
        let (mut starts, mut places, mut blocks) = (vec![0], Vec::new(), Vec::new());
        for around in 0..=255u8 {
            for i in 0..27usize {
                let (row, dx) = (i / 3, i % 3);
                if shares_element(around, [dx, row % 3, row / 3]) {
                    places.push(Place {
                        row: row as u8,
                        dx: dx as u8,
                    });
                    blocks.push(stencils.block(around, i));
                }
            }
            starts.push(places.len() as u32);
        }
        Couplings {
            starts,
            places,
            blocks,
        }
    }

    pub fn of(&self, around: u8) -> (&[Place], &[Block]) {
        let i = around as usize;
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        (&self.places[range.clone()], &self.blocks[range])
    }
}

/// Whether a node and its neighbour `d` (each 0, 1 or 2) have an element in common.
fn shares_element(around: u8, d: [usize; 3]) -> bool {
    (0..8usize).any(|e| {
        let reaches = (0..3).all(|a| d[a] == 1 || (d[a] == 2) == ((e >> a) & 1 == 1));
        around >> e & 1 == 1 && reaches
    })
}

fn add_element(stencil: &mut [[[f64; 3]; 3]; 27], element: usize, k: &ElementMatrix) {
    let upper: [usize; 3] = std::array::from_fn(|a| element >> a & 1);
    let own = (0..3).map(|a| (1 - upper[a]) << a).sum::<usize>();
    for corner in 0..8usize {
        let d: [usize; 3] = std::array::from_fn(|a| upper[a] + (corner >> a & 1));
        let block = &mut stencil[d[0] + 3 * d[1] + 9 * d[2]];
        for a in 0..3 {
            for b in 0..3 {
                block[a][b] += k[3 * own + a][3 * corner + b];
            }
        }
    }
}
