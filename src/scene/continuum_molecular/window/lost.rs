//! Owns the bonds of a window, and what broken ones no longer carry: as forces, and as entries of the matrix.

use crate::physics::continuum_molecular::bond::Blocks;
use crate::scene::continuum_molecular::setup::Setup;

/// A bond between points `a` and `b` of the window (window numbers), and its places in the family's list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowBond {
    pub a: u32,
    pub b: u32,
    /// Kinds in the stencil seen from `a` and from `b`.
    pub kinds: [u16; 2],
    pub slots: [usize; 2],
}

/// Slot and kind of the bond from `q` back to `p`.
pub fn opposite(setup: &Setup, p: usize, q: usize) -> (usize, usize) {
    let back = setup.family.range(q).find(|&s| setup.family.kind(s).0 == p);
    let back = back.expect("bonds are listed at both ends");
    (back, setup.family.kind(back).1)
}

/// Adds the forces the broken bonds no longer carry.
pub fn add_forces<const D: usize>(
    bonds: &[(WindowBond, f64)],
    blocks: &[Blocks<D>],
    x: &[f64],
    y: &mut [f64],
) {
    let at = |p: u32| -> [f64; D] { std::array::from_fn(|d| x[p as usize * D + d]) };
    for (bond, lost) in bonds {
        let (a, b) = (at(bond.a), at(bond.b));
        let forces = [
            (bond.a, blocks[bond.kinds[0] as usize].apply(&a, &b)),
            (bond.b, blocks[bond.kinds[1] as usize].apply(&b, &a)),
        ];
        for (p, force) in forces {
            for (d, f) in force.into_iter().enumerate() {
                y[p as usize * D + d] += lost * f;
            }
        }
    }
}

/// The same as matrix entries.
pub fn entries<const D: usize>(
    bonds: &[(WindowBond, f64)],
    blocks: &[Blocks<D>],
) -> impl Iterator<Item = (usize, usize, f64)> {
    bonds.iter().flat_map(move |(bond, lost)| {
        let ends = [
            (bond.a, bond.b, bond.kinds[0]),
            (bond.b, bond.a, bond.kinds[1]),
        ];
        ends.into_iter().flat_map(move |(here, there, kind)| {
            let block = blocks[kind as usize];
            (0..D * D).flat_map(move |k| {
                let (i, j) = (k / D, k % D);
                let row = here as usize * D + i;
                [
                    (row, here as usize * D + j, lost * block.own[i][j]),
                    (row, there as usize * D + j, lost * block.cross[i][j]),
                ]
            })
        })
    })
}
