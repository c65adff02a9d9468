//! Vibration of the tetrachiral lattice against its blocks.

use super::{number, solved};
use bonepd_ct::solver::lanczos::lowest;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Blocks on a side of the square, as in Diana (2023).
const BLOCKS: usize = 25;
const BLOCK_MM: f64 = 20.0;
const INTERFACE_MM: f64 = 0.04;
const YOUNG_MPA: f64 = 10.0;
const POISSON: f64 = 0.4999;
const DENSITY: f64 = 1e-9;
const CHIRALITY_DEG: f64 = 26.56505117707799;

/// The lowest frequencies (Hz) of the rigid blocks themselves, three unknowns each, joined by interfaces that resist opening,
/// sliding and bending as layers of elastic material. No continuum is in it.
fn frequencies_of_blocks(count: usize) -> Vec<f64> {
    let beta = CHIRALITY_DEG.to_radians();
    let (s, c) = beta.sin_cos();
    let reach = 0.5 * BLOCK_MM / c;
    let length = (1.0 - beta.tan()) * BLOCK_MM;
    let normal = length / INTERFACE_MM * YOUNG_MPA / (1.0 - POISSON * POISSON);
    let shear = 0.5 * length / INTERFACE_MM * YOUNG_MPA / (1.0 + POISSON);
    let n = 3 * BLOCKS * BLOCKS;
    let mass_of = |v: usize| match v % 3 {
        2 => DENSITY * BLOCK_MM.powi(4) / 6.0,
        _ => DENSITY * BLOCK_MM.powi(2),
    };
    let mass: Vec<f64> = (0..n).map(mass_of).collect();
    let shift = 1e6;
    let mut k = Mat::<f64>::zeros(n, n);
    for v in 0..n {
        k[(v, v)] = shift * mass[v];
    }
    // A spring between blocks `i` and `j` that resists `gap · (x of both)`.
    let mut add = |i: usize, j: usize, stiffness: f64, gap: [f64; 6]| {
        let at = |q: usize| if q < 3 { 3 * i + q } else { 3 * j + q - 3 };
        for p in 0..6 {
            for q in 0..6 {
                k[(at(p), at(q))] += stiffness * gap[p] * gap[q];
            }
        }
    };
    for block in 0..BLOCKS * BLOCKS {
        let (x, y) = (block % BLOCKS, block / BLOCKS);
        for (dx, dy) in [(1, 0), (0, 1)] {
            if x + dx == BLOCKS || y + dy == BLOCKS {
                continue;
            }
            let other = block + dx + BLOCKS * dy;
            // From a block's centre to the interface, and what a turn of the block does there.
            let to = [reach * dx as f64, reach * dy as f64];
            let turned = [-to[1], to[0]];
            let across = if dx == 1 { [c, s] } else { [-s, c] };
            let along = [-across[1], across[0]];
            for (stiffness, [a, b]) in [(normal, across), (shear, along)] {
                let turn = -(turned[0] * a + turned[1] * b);
                add(block, other, stiffness, [-a, -b, turn, a, b, turn]);
            }
            let bending = normal * length * length / 12.0;
            add(block, other, bending, [0.0, 0.0, -1.0, 0.0, 0.0, 1.0]);
        }
    }
    let factor = k.llt(Side::Lower).unwrap();
    let found = lowest(count, &mass, shift, |x| {
        let column = Mat::from_fn(n, 1, |i, _| x[i]);
        let solved = factor.solve(&column);
        (0..n).for_each(|i| x[i] = solved[(i, 0)]);
    });
    assert!(found.settled);
    let hertz = |m: &bonepd_ct::solver::lanczos::Mode| {
        m.eigenvalue.max(0.0).sqrt() / (2.0 * std::f64::consts::PI)
    };
    found.modes.iter().map(hertz).collect()
}

/// The continuum has the blocks' frequencies: within 1.5 % at four points a period and a horizon of five, where its surfaces are
/// still too stiff. The blocks' own density would make all of them 10.6 % too low.
#[test]
fn the_continuum_vibrates_as_the_blocks_do() {
    let blocks = frequencies_of_blocks(8);
    // Of the same blocks, in NumPy.
    let known = [830.08, 1048.15, 1048.15, 1414.45, 1427.04];
    for (found, known) in blocks[3..].iter().zip(known) {
        assert!((found / known - 1.0).abs() < 1e-5, "{found} {known}");
    }
    let text = std::fs::read_to_string("pipelines/scene-tetrachiral-modes.toml").unwrap();
    let (summary, _) = solved(&text);
    for (mode, block) in blocks.iter().enumerate().skip(3) {
        let found = number(&summary, &format!("frequency_{}", mode + 1));
        println!("mode {}: continuum {found}, blocks {block} Hz", mode + 1);
        assert!((found / block - 1.0).abs() < 0.015, "{found} {block}");
    }
    assert!((number(&summary, "density") / (0.8 * DENSITY) - 1.0).abs() < 1e-12);
}
