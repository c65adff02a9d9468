//! Owns the rows of the operator: for each of the 256 ways in which the elements around a node can exist, the 27
//! blocks that couple it to its neighbours, laid out for eight lanes.

use super::element::ElementMatrix;
use crate::operator::coarsen::Block;

/// Scalars per stencil. Nine rows of neighbours (dy fastest, then dz), each three components of the force times the
/// first eight of nine displacements (dx slowest, then component): 216. Then per row the ninth displacement's
/// column of three, padded to four: 36. Padded to a whole number of cache lines.
pub const STRIDE: usize = 256;
/// Where the ninth columns begin.
pub const NINTH: usize = 216;

/// One stencil, on cache lines of its own: registers are read whole from one line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Aligned<S>([S; STRIDE]);

/// All 256 stencils.
#[derive(Debug, Clone)]
pub struct Stencils<S> {
    table: Vec<Aligned<S>>,
}

impl<S: Copy> Stencils<S> {
    #[inline(always)]
    pub fn stencil(&self, around: u8) -> &[S; STRIDE] {
        &self.table[around as usize].0
    }
}

impl Stencils<f64> {
    pub fn new(k: &ElementMatrix) -> Self {
        let mut table = vec![Aligned([0.0; STRIDE]); 256];
        for (around, stencil) in table.iter_mut().enumerate() {
            for element in (0..8).filter(|e| around >> e & 1 == 1) {
                add_element(&mut stencil.0, element, k);
            }
        }
        Stencils { table }
    }

    /// What rounding left where elements' contributions cancel becomes zero: products with it would fall below what single
    /// precision holds in full, and such take a hundred times as long.
    pub fn to_f32(&self) -> Stencils<f32> {
        let all = self.table.iter().flat_map(|stencil| stencil.0);
        let largest = all.fold(0.0, |m: f64, v| m.max(v.abs()));
        let single = |v: f64| match v.abs() > 1e-12 * largest {
            true => v as f32,
            false => 0.0,
        };
        Stencils {
            table: self
                .table
                .iter()
                .map(|s| Aligned(s.0.map(single)))
                .collect(),
        }
    }

    /// The block that couples a node to its neighbour at `dx` (0, 1 or 2) in a row of neighbours.
    fn block(&self, around: u8, row: usize, dx: usize) -> Block {
        let stencil = self.stencil(around);
        std::array::from_fn(|a| std::array::from_fn(|b| stencil[slot(row, a, 3 * dx + b)] as f32))
    }

    /// The diagonal of the node's own block.
    pub fn diagonal(&self, around: u8) -> [f64; 3] {
        let stencil = self.stencil(around);
        std::array::from_fn(|a| stencil[slot(4, a, 3 + a)])
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
    pub fn new(stencils: &Stencils<f64>) -> Self {
        let (mut starts, mut places, mut blocks) = (vec![0], Vec::new(), Vec::new());
        for around in 0..=255u8 {
            for i in 0..27usize {
                let (row, dx) = (i / 3, i % 3);
                if shares_element(around, [dx, row % 3, row / 3]) {
                    places.push(Place {
                        row: row as u8,
                        dx: dx as u8,
                    });
                    blocks.push(stencils.block(around, row, dx));
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

/// Place of the coefficient of displacement `column` (3 dx + component) of a row in force component `a`.
fn slot(row: usize, a: usize, column: usize) -> usize {
    if column < 8 {
        row * 24 + a * 8 + column
    } else {
        NINTH + 4 * row + a
    }
}

fn add_element(stencil: &mut [f64], element: usize, k: &ElementMatrix) {
    let upper: [usize; 3] = std::array::from_fn(|a| element >> a & 1);
    let own = (0..3).map(|a| (1 - upper[a]) << a).sum::<usize>();
    for corner in 0..8usize {
        let d: [usize; 3] = std::array::from_fn(|a| upper[a] + (corner >> a & 1));
        for a in 0..3 {
            for b in 0..3 {
                stencil[slot(d[1] + 3 * d[2], a, 3 * d[0] + b)] += k[3 * own + a][3 * corner + b];
            }
        }
    }
}
