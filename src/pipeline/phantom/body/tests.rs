//! Tests of the analytic bodies: volumes, partial volumes, the same body at two voxel sizes.

use super::super::{PhantomParams, scan, structure};
use super::frame::Vec3;
use super::sample::{mask, partial_volumes};
use super::{Body, BodyKind, BodyParams, Orientation};

fn body(kind: BodyKind, cell_mm: f64) -> BodyParams {
    BodyParams {
        kind,
        cell_mm,
        orientation: Orientation::Random,
        fillet: 0.5,
        spread: 0.0,
        broken: 0.0,
        broken_gap: 1.0,
        crack_mm: 0.0,
        crack_share: 0.5,
        shift_mm: [0.0; 3],
        turn_degrees: 0.0,
    }
}

fn params(body: BodyParams, bvtv: f64, spacing_mm: f64) -> PhantomParams {
    PhantomParams {
        size_mm: [1.0; 3],
        spacing_mm,
        bvtv,
        noise_hu: 0.0,
        blur_voxels: 0.0,
        body: Some(body),
        ..Default::default()
    }
}

fn made(params: &PhantomParams) -> Body {
    Body::new(params, &params.body.unwrap())
}

const KINDS: [BodyKind; 12] = [
    BodyKind::GyroidNetwork,
    BodyKind::GyroidSheet,
    BodyKind::SchwarzPNetwork,
    BodyKind::SchwarzPSheet,
    BodyKind::SchwarzDNetwork,
    BodyKind::SchwarzDSheet,
    BodyKind::Cubic,
    BodyKind::Bcc,
    BodyKind::Octet,
    BodyKind::Kelvin,
    BodyKind::Foam,
    BodyKind::Plates,
];

fn share(partial: &[f32]) -> f64 {
    partial.iter().map(|v| f64::from(*v)).sum::<f64>() / partial.len() as f64
}

#[test]
fn every_kind_has_the_volume_fraction_asked_for() {
    for kind in KINDS {
        // Whole periods fill the box.
        let cell = if kind == BodyKind::Plates { 0.25 } else { 0.5 };
        let p = params(
            BodyParams {
                orientation: Orientation::Tilted {
                    tilt: 0.0,
                    azimuth: 0.0,
                },
                ..body(kind, cell)
            },
            0.25,
            0.05,
        );
        let partial = partial_volumes(&made(&p), &p, 0);
        // Counted on 64³ points there, good to 0.0005, on 100³ parts here.
        let found = share(partial.as_slice());
        assert!((found - 0.25).abs() < 2e-3, "{kind:?} {found}");
    }
}

#[test]
fn shapes_with_a_known_volume_have_it() {
    let aligned = |kind, cell| BodyParams {
        orientation: Orientation::Tilted {
            tilt: 0.0,
            azimuth: 0.0,
        },
        fillet: 0.0,
        ..body(kind, cell)
    };
    // One strut along each axis, sharp joints: 3 π r² − 8 √2 r³ of a cell of 1 (r = 0.2 gives 0.2865).
    let r: f64 = 0.2;
    let bvtv = 3.0 * std::f64::consts::PI * r * r - 8.0 * 2f64.sqrt() * r.powi(3);
    let p = params(aligned(BodyKind::Cubic, 1.0), bvtv, 0.05);
    let super::Shape::Struts(struts) = made(&p).shape else {
        panic!("a cubic lattice is made of struts");
    };
    assert!((struts.radius_mm - r).abs() < 5e-4, "{}", struts.radius_mm);
    // The gyroid halves space at level 0, as do the others.
    for kind in [
        BodyKind::GyroidNetwork,
        BodyKind::SchwarzPNetwork,
        BodyKind::SchwarzDNetwork,
    ] {
        let p = params(aligned(kind, 0.5), 0.5, 0.05);
        assert!(made(&p).level_mm.abs() < 1e-3, "{kind:?}");
    }
}

#[test]
fn partial_volumes_of_a_plane_are_its_share_of_each_voxel() {
    // Plates of half a period across x: their faces cut voxels at 0.35 + n of them.
    let turned = Orientation::Tilted {
        tilt: 90.0,
        azimuth: 0.0,
    };
    let one = BodyParams {
        orientation: turned,
        ..body(BodyKind::Plates, 0.4)
    };
    let p = params(one, 0.3, 0.05);
    let made = made(&p);
    let partial = partial_volumes(&made, &p, 0);
    for i in 0..20 {
        // The share of the voxel along x, counted finely.
        let x = |n: usize| (i as f64 + (n as f64 + 0.5) / 2000.0) * 0.05 - 0.5;
        let inside = (0..2000).filter(|&n| made.value([x(n), 0.1, 0.2]) < 0.0);
        let exact = inside.count() as f64 / 2000.0;
        let found = f64::from(partial.values[[7, 3, i]]);
        assert!((found - exact).abs() < 1e-3, "{i}: {found} {exact}");
    }
    let grey = scan(&mut structure(&p).unwrap(), &p);
    for (grey, share) in grey.as_slice().iter().zip(partial.as_slice()) {
        assert_eq!(f32::from(*grey), (2400.0 * share - 1000.0).round());
    }
}

#[test]
fn finer_voxels_show_the_same_body() {
    for kind in KINDS {
        let one = BodyParams {
            broken: if kind.has_struts() { 0.3 } else { 0.0 },
            crack_mm: 0.1,
            turn_degrees: 20.0,
            shift_mm: [0.013, -0.02, 0.004],
            ..body(kind, 0.5)
        };
        let coarse = params(one, 0.25, 0.05);
        let fine = params(one, 0.25, 0.01);
        let fine = mask(&made(&fine), &fine);
        let partial = partial_volumes(&made(&coarse), &coarse, 0);
        let mut sum = 0.0;
        for ((k, j, i), &share) in partial.values.indexed_iter() {
            let window = ndarray::s![5 * k..5 * k + 5, 5 * j..5 * j + 5, 5 * i..5 * i + 5];
            let fine = fine.values.slice(window);
            let counted = fine.iter().filter(|v| **v == 1).count() as f64 / 125.0;
            // A flat face may lie anywhere in the fine voxels that it cuts: half a layer of 25.
            let off = f64::from(share) - counted;
            assert!(off.abs() < 0.11, "{kind:?} {off}");
            sum += off;
        }
        let mean = sum / partial.grid.len() as f64;
        assert!(mean.abs() < 2e-3, "{kind:?} {mean}");
    }
}

#[test]
fn a_value_is_no_farther_than_the_surface() {
    let points: Vec<Vec3> = (0..4000u64)
        .map(|n| {
            std::array::from_fn(|a| {
                (n.wrapping_mul([7919, 104_729, 1_299_709][a]) % 997) as f64 / 997.0 - 0.5
            })
        })
        .collect();
    for kind in KINDS {
        let one = BodyParams {
            crack_mm: 0.05,
            ..body(kind, 0.5)
        };
        let made = made(&params(one, 0.25, 0.04));
        for pair in points.windows(2) {
            // Close by: a step of 0.01 of the way to the next point.
            let near = std::array::from_fn(|a| pair[0][a] + 0.01 * (pair[1][a] - pair[0][a]));
            let step = super::frame::norm(super::frame::minus(near, pair[0]));
            let change = (made.value(near) - made.value(pair[0])).abs();
            assert!(
                change <= step * (1.0 + 1e-6) + 1e-9,
                "{kind:?} {change} {step}"
            );
        }
    }
}

#[test]
fn broken_struts_and_cracks_take_bone_away_and_nothing_else() {
    let whole = params(body(BodyKind::Foam, 0.4), 0.25, 0.02);
    let broken = BodyParams {
        broken: 0.4,
        ..body(BodyKind::Foam, 0.4)
    };
    let cracked = BodyParams {
        crack_mm: 0.1,
        crack_share: 1.0,
        ..body(BodyKind::Foam, 0.4)
    };
    let count = |m: &[u8]| m.iter().filter(|v| **v == 1).count();
    let sound = structure(&whole).unwrap();
    assert!(sound.summary.connects_z);
    for one in [broken, cracked] {
        let p = params(one, 0.25, 0.02);
        let cut = structure(&p).unwrap();
        let pairs = cut.mask.as_slice().iter().zip(sound.mask.as_slice());
        assert!(pairs.clone().all(|(cut, sound)| cut <= sound));
        let lost = count(sound.mask.as_slice()) - count(cut.mask.as_slice());
        assert!(lost * 100 > count(sound.mask.as_slice()), "{lost}");
        assert_eq!(cut.summary.connects_z, one.crack_mm == 0.0);
    }
}
