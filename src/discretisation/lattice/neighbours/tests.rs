//! Owns the test that neighbours come out as they went in.

use super::*;
use crate::discretisation::lattice::stencil::Structure;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// Sites of a random mask on a grid, along x, and their numbers on the grid.
fn sites(structure: Structure, n: [i32; 3], dense: u32) -> (Vec<[i32; 3]>, Vec<Option<u32>>) {
    let mut random = Pcg64Mcg::new(u128::from(dense) * 2 + 1);
    let (mut sites, mut number) = (Vec::new(), Vec::new());
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let here = structure.allows([i, j, k]) && random.next_u32() % 100 < dense;
                number.push(here.then_some(sites.len() as u32));
                if here {
                    sites.push([i, j, k]);
                }
            }
        }
    }
    (sites, number)
}

/// Every structure, sparse to full, rows longer and shorter than what is decoded at a time.
#[test]
fn what_goes_in_comes_out() {
    for structure in Structure::ALL {
        for (n, dense) in [
            ([150, 9, 8], 100),
            ([150, 9, 8], 90),
            ([40, 30, 20], 50),
            ([40, 30, 20], 12),
            ([3, 40, 50], 60),
            ([1, 1, 1], 100),
        ] {
            let (sites, number) = sites(structure, n, dense);
            let stencil = structure.stencil();
            let end = |s: usize, b: usize| {
                let at: [i32; 3] = std::array::from_fn(|a| sites[s][a] + stencil.direction(b)[a]);
                let inside = (0..3).all(|a| (0..n[a]).contains(&at[a]));
                inside.then(|| number[((at[2] * n[1] + at[1]) * n[0] + at[0]) as usize])?
            };
            let step = structure.steps_per_lp() as i32;
            let follows = |s: usize| {
                let [i, j, k] = sites[s];
                s > 0 && sites[s - 1] == [i - step, j, k]
            };
            let neighbours = Neighbours::new(sites.len(), &stencil, follows, end);
            let expected = |s: usize, b: usize| end(s, b).unwrap_or(s as u32);
            let z = stencil.coordination();
            for s in (0..sites.len()).step_by(7) {
                let row = neighbours.row(s);
                assert!(row.len() == z && (0..z).all(|b| row[b] == expected(s, b)));
                let bonds = (0..z).filter(|&b| end(s, b).is_some()).count();
                assert_eq!(neighbours.bonds(s) as usize, bonds);
            }
            for start in (0..sites.len()).step_by(41) {
                let range = start..(start + 200).min(sites.len());
                let mut met = start;
                neighbours.each(range.clone(), |s, row| {
                    assert_eq!(s, met);
                    assert!(
                        (0..z).all(|b| row[b] == expected(s, b)),
                        "{structure:?} {s}"
                    );
                    met += 1;
                });
                assert_eq!(met, range.end);
            }
        }
    }
}
