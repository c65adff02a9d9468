//! Geometry-based finite elements of random sub-volumes: each is meshed without an inverted element, or refused in words.

use crate::segment::real_stack;
use bonepd_ct::command::segment::in_memory;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::apparent::discretisation::{Discretisation, Prepared};
use bonepd_ct::pipeline::apparent::geometry_fe::GeometryModel;
use bonepd_ct::pipeline::apparent::tissue::Tissue;
use bonepd_ct::pipeline::apparent::{Load, Method, SolveParams};
use bonepd_ct::pipeline::phantom::{PhantomParams, scan, structure};
use bonepd_ct::pipeline::segment::{SegmentParams, segment};
use bonepd_ct::volume::{Specimen, Volume};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A scan to cut sub-volumes from, and its thresholds.
struct Source {
    grey: Volume<f32>,
    spacing_mm: f64,
    levels: std::ops::Range<f64>,
}

fn phantom(params: &PhantomParams, levels: std::ops::Range<f64>) -> Source {
    let spacing_mm = params.spacing_mm;
    let made = scan(&mut structure(params).unwrap(), params);
    let values = made.as_slice().iter().map(|&v| f32::from(v)).collect();
    Source {
        grey: Volume::from_vec(made.grid, values),
        spacing_mm,
        levels,
    }
}

/// Bone, bone with a crack of half a voxel, and bone of which noise and a high threshold leave single voxels and thin bridges.
fn phantoms() -> [Source; 3] {
    let foam = PhantomParams {
        size_mm: [1.0; 3],
        spacing_mm: 0.02,
        bvtv: 0.25,
        thickness_mm: 0.1,
        noise_hu: 120.0,
        blur_voxels: 0.7,
        seed: 20,
        ..PhantomParams::default()
    };
    let cracked = PhantomParams {
        gap_mm: 0.01,
        noise_hu: 0.0,
        ..foam
    };
    let specks = PhantomParams {
        bvtv: 0.12,
        debris_per_mm3: 100.0,
        noise_hu: 600.0,
        ..foam
    };
    [
        phantom(&foam, 0.0..400.0),
        phantom(&cracked, 0.0..400.0),
        phantom(&specks, 400.0..1300.0),
    ]
}

/// The stack of real bone, smoothed as its threshold of 63 asks for.
fn real() -> Source {
    let window = SegmentParams {
        spacing_mm: Some([0.0195; 3]),
        gaussian_voxels: 1.0,
        lower: Some(63.0),
        ..SegmentParams::default()
    };
    let specimen = in_memory(&real_stack(), None, &window, &Session::default()).unwrap();
    Source {
        grey: specimen.grey.unwrap(),
        spacing_mm: 0.0195,
        levels: 50.0..90.0,
    }
}

/// How a sub-volume ended.
#[derive(Debug, PartialEq)]
enum End {
    /// With so many elements.
    Meshed(usize),
    /// By `segment` (no bone) or by the model.
    Refused(String),
}

fn words_of(error: &bonepd_ct::error::Error) -> End {
    let words = error.to_string();
    assert!(!words.contains("inside out"), "{words}");
    End::Refused(words)
}

/// A sub-volume of 3 to 20 voxels along each edge, at a random threshold, load and size of elements.
fn end_of(source: &Source, random: &mut Pcg64) -> End {
    let n = source.grey.grid.n;
    let crop = n.map(|n| {
        let size = random.random_range(3..21usize);
        let low = random.random_range(0..n - size);
        [low, low + size]
    });
    let part = source.grey.cropped(&crop);
    let window = SegmentParams {
        lower: Some(random.random_range(source.levels.clone())),
        keep_all: random.random_range(0..2) == 1,
        ..SegmentParams::default()
    };
    let sized = random.random_range(0..2) == 1;
    let size_mm = source.spacing_mm * random.random_range(0.7..3.0);
    let loads = [
        Load::Uniaxial,
        Load::Confined,
        Load::Torsion,
        Load::Stiffness,
    ];
    let params = SolveParams {
        method: Method::GeometryFe,
        load: loads[random.random_range(0..loads.len())],
        grip_mm: [0.0, 1.3][random.random_range(0..2)] * source.spacing_mm,
        element_mm: sized.then_some(size_mm),
        ..SolveParams::default()
    };
    match segment("part", &part, &window, None) {
        Ok(segmented) => meshed(&segmented.specimen, &params),
        Err(error) => words_of(&error),
    }
}

fn meshed(specimen: &Specimen, params: &SolveParams) -> End {
    let tissue = &Tissue::of(specimen, params).unwrap();
    let prepared = Prepared { specimen, tissue };
    match GeometryModel::build(&(), prepared, params) {
        Ok(model) => {
            let tet = model.elements();
            let elements = tet.mesh.elements.len();
            let least = (0..elements).map(|e| tet.volume_mm3(e));
            assert!(least.fold(f64::INFINITY, f64::min) > 0.0);
            End::Meshed(elements)
        }
        Err(error) => words_of(&error),
    }
}

/// Meshed with bone that carries load, meshed without, refused: of so many sub-volumes, each of another source in turn.
fn counts(sources: &[Source], number: usize) -> [usize; 3] {
    let mut random = Pcg64::seed_from_u64(22);
    let mut counts = [0; 3];
    for case in 0..number {
        let end = end_of(&sources[case % sources.len()], &mut random);
        match &end {
            End::Meshed(1..) => counts[0] += 1,
            End::Meshed(0) => counts[1] += 1,
            End::Refused(words) => {
                assert!(words.contains("what to do"), "case {case}: {words}");
                counts[2] += 1;
            }
        }
    }
    counts
}

#[test]
fn sub_volumes_of_phantoms_are_meshed_or_refused() {
    let [loaded, unloaded, refused] = counts(&phantoms(), 90);
    println!("{loaded} meshed, {unloaded} without bone that carries load, {refused} refused");
    assert!(loaded > 45, "{loaded} {unloaded} {refused}");
}

#[test]
#[ignore = "needs the real stack (BONEPD_STACK)"]
fn five_hundred_sub_volumes_of_the_stack_and_of_phantoms_are_meshed_or_refused() {
    let [foam, cracked, specks] = phantoms();
    let [loaded, unloaded, refused] = counts(&[real(), foam, cracked, specks], 500);
    println!("{loaded} meshed, {unloaded} without bone that carries load, {refused} refused");
    assert!(loaded > 200, "{loaded} {unloaded} {refused}");
}
