//! Segmentation of made scans: what stays, what is counted, what is refused.

use super::*;

fn scan() -> Volume<f32> {
    // A bar of 500 along z through a field of 100, and a speck.
    let grid = Grid::new([10, 10, 8], [0.1, 0.1, 0.1]);
    let values = (0..grid.len()).map(|at| match [at % 10, at / 10 % 10, at / 100] {
        [3..=5, 4..=6, _] | [8, 8, 4] => 500.0,
        _ => 100.0,
    });
    Volume::from_vec(grid, values.collect())
}

fn params() -> SegmentParams {
    SegmentParams {
        lower: Some(200.0),
        ..Default::default()
    }
}

#[test]
fn the_largest_component_stays_and_the_rest_is_counted() {
    let s = segment("bar", &scan(), &params(), None).unwrap().summary;
    assert_eq!(
        (
            s.selected_voxels,
            s.components,
            s.removed_voxels,
            s.bone_voxels
        ),
        (73, 2, 1, 72)
    );
    assert!((s.bv_tv - 72.0 / 800.0).abs() < 1e-15);
    let all = SegmentParams {
        keep_all: true,
        ..params()
    };
    assert_eq!(
        segment("bar", &scan(), &all, None)
            .unwrap()
            .summary
            .bone_voxels,
        73
    );
}

#[test]
fn nan_and_infinite_voxels_are_pore_even_where_the_window_is_open_below() {
    let mut scan = scan();
    scan.values[[0, 5, 4]] = f32::INFINITY;
    scan.values[[7, 0, 0]] = f32::NAN;
    let open = SegmentParams {
        upper: Some(600.0),
        ..Default::default()
    };
    let s = segment("bar", &scan, &open, None).unwrap();
    assert_eq!(
        (s.summary.non_finite_voxels, s.summary.bone_voxels),
        (2, 798)
    );
    assert!(s.summary.warnings[0].contains("NaN"));
    assert_eq!(s.specimen.bone.values[[0, 5, 4]], 0);
}

#[test]
fn crop_comes_first_and_a_given_cylinder_stays_in_scan_coordinates() {
    let p = SegmentParams {
        crop: Some([[2, 8], [2, 8], [1, 5]]),
        voi: Voi::Cylinder {
            diameter_mm: Some(0.2),
            center_mm: Some([0.45, 0.55]),
        },
        ..params()
    };
    let scan = scan();
    let s = segment("bar", &scan, &p, None).unwrap();
    assert_eq!(s.summary.voxels, [6, 6, 4]);
    // Centre of voxel (4, 5): the voxel and its four neighbours in a circle of radius one voxel, in 4 slices.
    assert_eq!(s.summary.bone_voxels, 20);
    assert!((s.summary.tv_mm3 - 20.0 * 1e-3).abs() < 1e-12);
    assert_eq!(s.summary.bv_tv, 1.0);
    assert_eq!(s.summary.tv_definition, "cylinder d=0.2 mm");
}

#[test]
fn a_mask_voi_is_counted_and_must_fit() {
    let grid = scan().grid;
    let p = SegmentParams {
        voi: Voi::Mask("v.nii.gz".into()),
        ..params()
    };
    let half: Vec<u8> = (0..grid.len()).map(|at| u8::from(at / 100 < 4)).collect();
    let s = segment("bar", &scan(), &p, Some(&Volume::from_vec(grid, half)))
        .unwrap()
        .summary;
    assert_eq!((s.bone_voxels, s.outside_voi_voxels), (36, 37));
    assert!((s.tv_mm3 - 0.4).abs() < 1e-12);
    let other = Volume::from_vec(Grid::new([1, 1, 1], [0.1; 3]), vec![1]);
    assert!(segment("bar", &scan(), &p, Some(&other)).is_err());
}

#[test]
fn unusable_settings_say_what_to_do() {
    let cases = [
        (SegmentParams::default(), "no threshold"),
        (
            SegmentParams {
                otsu: true,
                ..params()
            },
            "exclude",
        ),
        (
            SegmentParams {
                upper: Some(100.0),
                ..params()
            },
            "above upper",
        ),
        (
            SegmentParams {
                gaussian_voxels: -1.0,
                ..params()
            },
            "found -1",
        ),
        (
            SegmentParams {
                lower: Some(5000.0),
                ..Default::default()
            },
            "run from 100 to 500",
        ),
        (
            SegmentParams {
                crop: Some([[0, 10], [5, 5], [0, 8]]),
                ..params()
            },
            "5:5",
        ),
        (
            SegmentParams {
                voi: Voi::Cylinder {
                    diameter_mm: Some(2.0),
                    center_mm: None,
                },
                ..params()
            },
            "does not lie in",
        ),
        (
            SegmentParams {
                resample_mm: Some([1e-7; 3]),
                ..params()
            },
            "coarser",
        ),
        (
            SegmentParams {
                align: Some(Align::Direction([0.0; 3])),
                ..params()
            },
            "direction",
        ),
        (
            SegmentParams {
                plane_cut_mm: Some(-1.0),
                ..params()
            },
            "tile",
        ),
    ];
    for (params, expected) in cases {
        let e = segment("bar", &scan(), &params, None)
            .unwrap_err()
            .to_string();
        assert!(
            e.contains(expected) && e.contains("what to do"),
            "{expected}: {e}"
        );
    }
}

#[test]
fn otsu_finds_the_bar() {
    let p = SegmentParams {
        otsu: true,
        ..Default::default()
    };
    let s = segment("bar", &scan(), &p, None).unwrap().summary;
    assert_eq!(s.bone_voxels, 72);
    assert!((s.lower.unwrap() - 300.0).abs() < 1.0);
}
