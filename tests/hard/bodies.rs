//! Bodies whose soft motions multigrid finds late: stiff parts cut by soft voxels, frames, hinges, necks, sparse media.

use bonepd_ct::grid::Grid;
use bonepd_ct::physics::material::{Label, Law, Material};
use bonepd_ct::pipeline::apparent::{Ends, SolveParams};
use bonepd_ct::volume::{Specimen, Volume};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

pub struct Body {
    pub name: String,
    pub specimen: Specimen,
    pub params: SolveParams,
}

/// Moduli of the soft and of the stiff label are 1 and `contrast` MPa; label 0 is pore.
fn labelled(
    name: String,
    n: [usize; 3],
    contrast: f64,
    label: impl FnMut([usize; 3]) -> u8,
) -> Body {
    let grid = Grid::new(n, [0.02; 3]);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let labels: Vec<u8> = (0..grid.len()).map(at).map(label).collect();
    let values = labels.iter().map(|&l| f32::from(l)).collect();
    let bone = labels.iter().map(|&l| u8::from(l > 0)).collect();
    let tissue = |value: i32, young_mpa: f64| Label {
        value,
        young_mpa,
        poisson: None,
    };
    let specimen = Specimen {
        name: name.clone(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, bone),
        tv_definition: "box".into(),
        grey: Some(Volume::from_vec(grid, values)),
        threshold: None,
    };
    let params = SolveParams {
        material: Some(Material::new(Law::Labels(vec![
            tissue(1, 1.0),
            tissue(2, contrast),
        ]))),
        ..SolveParams::default()
    };
    Body {
        name,
        specimen,
        params,
    }
}

/// One tissue.
fn solid(name: String, n: [usize; 3], bone: impl FnMut([usize; 3]) -> bool) -> Body {
    let mut bone = bone;
    let body = labelled(name, n, 2.0, |p| u8::from(bone(p)));
    Body {
        specimen: Specimen {
            grey: None,
            ..body.specimen
        },
        params: SolveParams::default(),
        ..body
    }
}

/// Stiff wires of 2 × 2 voxels along the load in a soft matrix, each cut by two soft voxels at two places.
pub fn cut_wires(seed: u64, contrast: f64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = random.random_range(18..27);
    let wires: Vec<([usize; 2], [usize; 2])> = (0..random.random_range(1..5))
        .map(|_| {
            let place = [0, 1].map(|_| random.random_range(2..n - 3));
            let cuts = [0, 1].map(|_| random.random_range(3..n - 4));
            (place, cuts)
        })
        .collect();
    let in_wire = |p: [usize; 3]| {
        wires.iter().any(|(place, cuts)| {
            (0..2).all(|a| p[a] == place[a] || p[a] == place[a] + 1)
                && cuts.iter().all(|&c| p[2] != c)
        })
    };
    labelled(
        format!("cut wires {seed}, contrast {contrast:.0e}"),
        [n; 3],
        contrast,
        |p| 1 + u8::from(in_wire(p)),
    )
}

/// Soft and stiff voxels at random, `pores` of the volume empty, in blocks of `block` voxels.
pub fn random_labels(seed: u64, contrast: f64, pores: f64, block: usize) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = random.random_range(12..21);
    let cells = n / block + 1;
    let stiff = random.random_range(0.2..0.8);
    let labels: Vec<u8> = (0..cells * cells * cells)
        .map(|_| match random.random::<f64>() < pores {
            true => 0,
            false => 1 + u8::from(random.random::<f64>() < stiff),
        })
        .collect();
    labelled(
        format!("random labels {seed}, pores {pores}, blocks of {block}, contrast {contrast:.0e}"),
        [n; 3],
        contrast,
        |p| labels[(p[2] / block * cells + p[1] / block) * cells + p[0] / block],
    )
}

/// Two arms and a back, loaded so that the arms open.
pub fn c_frame(seed: u64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = [
        random.random_range(30..70),
        random.random_range(4..9),
        random.random_range(20..44),
    ];
    let thick = random.random_range(1..4);
    solid(format!("C frame {seed}"), n, |p| {
        p[0] < thick || p[2] < thick || p[2] >= n[2] - thick
    })
}

/// Blocks that meet in an edge (`corners` false) or a corner, one after the other along the load.
pub fn necks(seed: u64, corners: bool) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let half = random.random_range(3..7);
    let height = random.random_range(3..8);
    let blocks = random.random_range(2..5);
    let sides: Vec<[bool; 2]> = (0..blocks)
        .map(|b| {
            let other = b % 2 == 1;
            [other, if corners { other } else { false }]
        })
        .collect();
    let [x, y] = [2 * half, if corners { 2 * half } else { half }];
    let body = solid(
        format!(
            "blocks that meet in {} {seed}",
            if corners { "corners" } else { "edges" }
        ),
        [x, y, blocks * height],
        |p| {
            let [right, back] = sides[p[2] / height];
            (p[0] < half) != right && ((p[1] < half) != back || !corners)
        },
    );
    let ends = match random.random::<bool>() {
        true => Ends::Bonded,
        false => Ends::Free,
    };
    Body {
        params: SolveParams {
            ends,
            ..body.params
        },
        ..body
    }
}

/// Two thick halves joined by a thin diagonal neck of voxels that meet in edges.
pub fn diagonal_neck(seed: u64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = random.random_range(10..17);
    let long = random.random_range(2..6);
    let thick = random.random_range(1..4);
    let height = 2 * n + long;
    solid(format!("diagonal neck {seed}"), [n, n, height], |p| {
        if p[2] < n || p[2] >= n + long {
            return true;
        }
        let at = n / 3 + p[2] - n;
        (at..at + thick).contains(&p[0]) && (n / 2..n / 2 + thick).contains(&p[1])
    })
}

/// Rows joined at alternate ends: one long path.
pub fn serpentine(seed: u64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let thick = random.random_range(1..4);
    let gap = random.random_range(1..4);
    let rows = 2 * random.random_range(1..4) + 1;
    let wide = random.random_range(10..40);
    let deep = random.random_range(1..5);
    let pitch = thick + gap;
    let body = solid(
        format!("serpentine {seed}, {rows} rows of {wide}, {thick} thick"),
        [wide, deep, rows * pitch - gap],
        |p| {
            let (row, left) = (p[2] / pitch, p[2] % pitch);
            left < thick
                || match row % 2 {
                    0 => p[0] >= wide - thick,
                    _ => p[0] < thick,
                }
        },
    );
    Body {
        params: SolveParams {
            ends: Ends::Bonded,
            ..body.params
        },
        ..body
    }
}

/// Voxels at random.
pub fn sparse(seed: u64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = random.random_range(12..25);
    let share = random.random_range(0.3..0.55);
    let bone: Vec<bool> = (0..n * n * n)
        .map(|_| random.random::<f64>() < share)
        .collect();
    solid(
        format!("random voxels {seed}, share {share:.2}"),
        [n; 3],
        |p| bone[(p[2] * n + p[1]) * n + p[0]],
    )
}

/// Struts on a grid of cells, many of them broken.
pub fn broken_foam(seed: u64) -> Body {
    let mut random = Pcg64::seed_from_u64(seed);
    let n = random.random_range(24..41);
    let (cell, thick) = (random.random_range(6..14), random.random_range(1..4));
    let broken = random.random_range(0.2..0.6);
    let cells = n / cell + 1;
    let missing: Vec<bool> = (0..3 * cells * cells * cells)
        .map(|_| random.random::<f64>() < broken)
        .collect();
    solid(format!("broken foam {seed}"), [n; 3], |p| {
        let thin = p.map(|v| v % cell < thick);
        (0..3).any(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let cell = (p[a] / cell * cells + p[b] / cell) * cells + p[c] / cell;
            thin[b] && thin[c] && (thin[a] || !missing[3 * cell + a])
        })
    })
}

/// The `i`th of the random cases: one of eleven kinds, contrasts from 1e2 to 1e6.
pub fn random_case(i: u64) -> Body {
    let contrast = 10f64.powi(2 + (i / 11 % 5) as i32);
    match i % 11 {
        0 | 1 => cut_wires(i, contrast),
        2 => random_labels(i, contrast, 0.0, 1),
        3 => random_labels(i, contrast, 0.5, 1),
        4 => random_labels(i, contrast, 0.4, 2),
        5 => c_frame(i),
        6 => necks(i, i.is_multiple_of(2)),
        7 => diagonal_neck(i),
        8 => serpentine(i),
        9 => sparse(i),
        _ => broken_foam(i),
    }
}
