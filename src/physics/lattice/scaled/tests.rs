//! Owns the tests of the loops: against bonds one by one, on all registers.

use super::*;
use crate::discretisation::lattice::placement::{Boundary, Frame};
use crate::discretisation::lattice::sites::Grips;
use crate::grid::{Axis, Grid};
use crate::physics::lattice::{Lattice, Moduli};

/// A lattice on a random mask, dense or not, of random weights or of none.
fn sites(structure: Structure, dense: u64, weighted: bool) -> Sites {
    let grid = Grid::new([9, 8, 7], [0.1; 3]);
    let frame = Frame::new(&grid, structure, 0.1, Boundary::Floppy, Axis::Z, [0.0; 3]).unwrap();
    let mut state = dense;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
        state >> 33
    };
    let weights = (0..frame.candidates()).map(|c| {
        let there = structure.allows(frame.indices(c)) && random() % 100 < dense;
        let weight = if weighted {
            0.5 + (random() % 8) as f32
        } else {
            1.0
        };
        if there { weight } else { 0.0 }
    });
    let weights = weights.collect();
    let grips = Grips::new(&frame, 0.7, 0.0).unwrap();
    Sites::connect(frame, weights, grips)
}

fn numbers<S: Precision>(n: usize, of: impl Fn(f64) -> S) -> Vec<[S; 3]> {
    let number = |i: usize| of((i as f64 * 0.7).sin());
    (0..n)
        .map(|i| [0, 1, 2].map(|a| number(3 * i + a)))
        .collect()
}

/// Bond by bond from the energy in the module's head.
fn bond_by_bond(model: &Lattice, u: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let bonds = |i: usize| {
        let row = model.sites.neighbours_of(i);
        let pairs = model.pairs.iter().zip(row.as_chunks().0.to_vec());
        let ends = pairs.flat_map(|(p, [plus, minus]): (_, [u32; 2])| {
            let back = p.d.map(|c| -c);
            [(p, p.d, plus as usize), (p, back, minus as usize)]
        });
        ends.filter(move |e| e.2 != i).collect::<Vec<_>>()
    };
    let along = |d: [f64; 3], a: usize, b: usize| -> f64 {
        (0..3).map(|c| d[c] * (u[b][c] - u[a][c])).sum()
    };
    let pressures: Vec<[f64; 2]> = (0..u.len())
        .map(|i| {
            let mut t = [0.0; 2];
            for (p, d, j) in bonds(i) {
                t[p.shell] += model.volumetric(i) * p.half * along(d, i, j);
            }
            t
        })
        .collect();
    let force = |i: usize| {
        let mut f = [0.0; 3];
        for (p, d, j) in bonds(i) {
            let share = 0.5 * (model.weight(i) + model.weight(j));
            let pull = share * p.spring * along(d, i, j)
                + p.half * (pressures[i][p.shell] + pressures[j][p.shell]);
            (0..3).for_each(|c| f[c] -= pull * d[c]);
        }
        f
    };
    (0..u.len()).map(force).collect()
}

/// The same by the loops, in two ranges that begin and end anywhere; with AVX2 or without.
fn by_loops<H: Shape, S: Precision>(
    scaled: &Scaled<S>,
    sites: &Sites,
    u: &[[S; 3]],
    fast: bool,
) -> Vec<[S; 3]> {
    let n = sites.len();
    let perform = |range: Range<usize>, task: Task<S>| {
        let bonds = Bonds {
            pairs: &scaled.pairs,
            neighbours: &sites.neighbours,
        };
        let weights = scaled.weights.as_deref();
        // SAFETY: `fast` is true only where there is AVX2.
        unsafe {
            match fast {
                #[cfg(target_arch = "x86_64")]
                true => with_avx2::<H, S::Fast>(bonds, weights, range, task),
                _ => perform::<H, S::Plain>(bonds, weights, range, task),
            }
        }
    };
    let mut y = vec![[S::default(); 3]; n];
    let mut t = vec![[S::default(); 2]; n];
    for range in [0..n / 3, n / 3..n] {
        let (y, theta) = (&mut y[range.clone()], &mut t[range.clone()]);
        let (mut springs, mut sums) = (y.to_vec(), theta.to_vec());
        perform(range.clone(), Task::Springs { u, y: &mut springs });
        let alone = &mut sums;
        perform(range.clone(), Task::Sums { u, theta: alone });
        let both = Task::SpringsAndSums { u, y, theta };
        perform(range.clone(), both);
        let near = |a: S, b: S| (a.into() - b.into()).abs() < 1e-4;
        let all = y.as_flattened().iter().zip(springs.as_flattened());
        assert!(all.into_iter().all(|(a, b)| near(*a, *b)));
        let theta = &mut t[range.clone()];
        let all = theta.as_flattened().iter().zip(sums.as_flattened());
        assert!(all.into_iter().all(|(a, b)| near(*a, *b)));
        scaled.scale_by_weights(range, theta);
    }
    for range in [0..n / 3, n / 3..n] {
        let y = &mut y[range.clone()];
        perform(range, Task::VolumetricForces { t: &t, y });
    }
    y
}

/// All structures, uniform and weighted, in both precisions, with AVX2 and without.
#[test]
fn loops_pull_as_bonds_do() {
    fn check<H: Shape>(structure: Structure) {
        for (dense, weighted) in [(100, false), (70, false), (40, true), (95, true)] {
            let sites = sites(structure, dense, weighted);
            assert!(sites.len() > 64 && sites.weights.is_some() == weighted);
            let moduli = Moduli::new(structure, 0.1, 100.0, 0.3).unwrap();
            let model = Lattice::new(sites.clone(), moduli);
            let u = numbers(sites.len(), |v| v);
            let single = numbers(sites.len(), |v| v as f32);
            let exact = bond_by_bond(&model, &u);
            let scale = exact
                .as_flattened()
                .iter()
                .fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(scale > 1.0);
            let worst = |y: Vec<[f64; 3]>| {
                let pairs = y.as_flattened().iter().zip(exact.as_flattened());
                pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / scale
            };
            for fast in [false, isa() != Isa::Portable] {
                let y = by_loops::<H, f64>(&model.double, &sites, &u, fast);
                assert!(worst(y) < 1e-14, "{structure:?}, {fast}");
                let y = by_loops::<H, f32>(&model.single, &sites, &single, fast);
                let y = y.iter().map(|f| f.map(f64::from)).collect();
                assert!(worst(y) < 2e-6, "{structure:?}, {fast}");
            }
        }
    }
    check::<Sc>(Structure::Sc);
    check::<Bcc>(Structure::Bcc);
    check::<Fcc>(Structure::Fcc);
}

/// What the loops are compiled for is what the stencils say.
#[test]
fn shapes_are_those_of_the_stencils() {
    fn agree<H: Shape>(structure: Structure) {
        let stencil = structure.stencil();
        assert_eq!(stencil.pairs.len(), H::PAIRS);
        assert_eq!(stencil.first_shell_pairs, H::FIRST_SHELL);
        for (p, d) in stencil.pairs.iter().enumerate() {
            let axial = d.iter().filter(|&&c| c != 0).count() == 1;
            assert_eq!(axial, (H::AXIAL..H::AXIAL + 3).contains(&p));
        }
    }
    agree::<Sc>(Structure::Sc);
    agree::<Bcc>(Structure::Bcc);
    agree::<Fcc>(Structure::Fcc);
}
