//! Owns segmentation: crop, smooth, threshold, volume of interest, connectivity, in that order.

mod params;
mod region;
mod window;

pub use params::{GreyUnit, SegmentParams, Voi};

use crate::error::{Error, Result};
use crate::mask::components::Components;
use crate::measure::morphometry::{Morphometry, morphometry};
use crate::measure::thickness::plate_thickness_mm;
use crate::volume::{Specimen, Volume};
use region::{check_crop, inside};
use serde::{Deserialize, Serialize};
use window::{count, grey_range, labelled, no_label, nothing_selected, of_bone, select, window};

/// What segmentation found, as plain numbers; the results part of `segment.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SegmentSummary {
    pub voxels: [usize; 3],
    pub spacing_mm: [f64; 3],
    /// The window in use, in the image's units; Otsu's threshold is a lower bound.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    /// `window`, `otsu` or `labels`.
    pub threshold: String,
    /// Range of the finite grey values before smoothing.
    pub grey_min: f64,
    pub grey_max: f64,
    /// NaN and infinite voxels; they are pore.
    pub non_finite_voxels: u64,
    /// Voxels in the window, before the volume of interest and connectivity.
    pub selected_voxels: u64,
    pub outside_voi_voxels: u64,
    /// 6-connected components inside the volume of interest.
    pub components: u64,
    /// Voxels of all but the largest component; 0 with `keep_all`.
    pub removed_voxels: u64,
    pub bone_voxels: u64,
    pub tv_definition: String,
    pub tv_mm3: f64,
    pub bv_mm3: f64,
    pub bv_tv: f64,
    /// 2 BV / BS, see `measure::thickness`.
    pub mean_thickness_mm: Option<f64>,
    /// On request only.
    #[serde(default)]
    pub morphometry: Option<Morphometry>,
    pub warnings: Vec<String>,
}

/// A segmented scan with its numbers.
#[derive(Debug, Clone)]
pub struct Segmented {
    pub specimen: Specimen,
    pub summary: SegmentSummary,
}

/// Segments `scan`. `voi_mask` is the volume that `Voi::Mask` names, on the scan's grid (before the crop).
pub fn segment(
    name: &str,
    scan: &Volume<f32>,
    params: &SegmentParams,
    voi_mask: Option<&Volume<u8>>,
) -> Result<Segmented> {
    params.check()?;
    let threshold = params.otsu || params.lower.is_some() || params.upper.is_some();
    if !threshold && params.labels.is_empty() {
        return Err(Error::setting(
            "lower",
            "no threshold given",
            "give --lower (and --upper), --otsu, or the --labels of a segmented scan",
        ));
    }
    let cropped;
    let (scan, voi_mask, corner_mm) = match params.crop {
        None => (scan, voi_mask.cloned(), [0.0; 3]),
        Some(crop) => {
            check_crop(&crop, scan.grid.n)?;
            let mask = voi_mask.map(|mask| mask.cropped(&crop));
            cropped = scan.cropped(&crop);
            let corner = std::array::from_fn(|a| crop[a][0] as f64 * scan.grid.spacing_mm[a]);
            (&cropped, mask, corner)
        }
    };
    let (inside, tv_definition) = inside(&params.voi, scan.grid, voi_mask.as_ref(), corner_mm)?;
    let grey = grey_range(scan)?;
    let (lower, upper) = window(scan, params, &grey)?;
    let mut bone = match params.labels.is_empty() {
        true => select(scan, params.gaussian_voxels, &grey, lower, upper),
        false => labelled(scan, &params.labels),
    };
    let selected = count(&bone);
    if selected == 0 && !params.labels.is_empty() {
        return Err(no_label(scan, &params.labels));
    }
    if selected == 0 {
        return Err(nothing_selected(lower, upper, &grey));
    }
    let outside = inside.clear_outside(&mut bone);
    let components = Components::of(&bone);
    let Some(largest) = components.largest() else {
        return Err(Error::specimen(
            format!(
                "all {selected} voxels in the window lie outside the volume of interest ({tv_definition})"
            ),
            "check the volume of interest against the picture of the scan",
        ));
    };
    let removed = if params.keep_all {
        0
    } else {
        components.keep_only(largest, &mut bone);
        selected - outside - components.voxels[largest as usize]
    };
    let tv_mm3 = inside.tv_mm3(&scan.grid);
    let specimen = Specimen {
        name: name.into(),
        grey: params.keeps_grey().then(|| of_bone(scan, &bone)),
        bone,
        tv_mm3,
        tv_definition,
    };
    let mut summary = SegmentSummary {
        voxels: scan.grid.n,
        spacing_mm: scan.grid.spacing_mm,
        lower,
        upper,
        threshold: params.threshold().into(),
        grey_min: f64::from(grey.min),
        grey_max: f64::from(grey.max),
        non_finite_voxels: grey.non_finite,
        selected_voxels: selected,
        outside_voi_voxels: outside,
        components: components.voxels.len() as u64,
        removed_voxels: removed,
        bone_voxels: selected - outside - removed,
        tv_definition: specimen.tv_definition.clone(),
        tv_mm3,
        bv_mm3: specimen.bv_mm3(),
        bv_tv: specimen.bv_tv(),
        mean_thickness_mm: plate_thickness_mm(&specimen.bone),
        morphometry: params.morphometry.then(|| {
            let within = inside.mask(scan.grid);
            morphometry(&specimen.bone, within.as_ref(), tv_mm3)
        }),
        warnings: Vec::new(),
    };
    summary.warnings = warnings(&summary);
    Ok(Segmented { specimen, summary })
}

fn warnings(s: &SegmentSummary) -> Vec<String> {
    let mut found = Vec::new();
    if s.non_finite_voxels > 0 {
        found.push(format!(
            "{} voxels are NaN or infinite: taken as pore",
            s.non_finite_voxels
        ));
    }
    if let Some(t) = s.mean_thickness_mm {
        let voxels = t / s.spacing_mm.iter().copied().fold(0.0, f64::max);
        if voxels < 3.0 {
            found.push(format!(
                "struts are {voxels:.1} voxels thick on average (2 BV/BS = {t:.3} mm); under 3 voxels moduli are unreliable"
            ));
        }
    }
    if s.removed_voxels > s.bone_voxels / 10 {
        found.push(format!(
            "{} voxels in {} smaller components were removed, {:.0} % of what was selected: check the threshold",
            s.removed_voxels,
            s.components - 1,
            100.0 * s.removed_voxels as f64 / (s.removed_voxels + s.bone_voxels) as f64
        ));
    }
    if s.bv_tv > 0.95 {
        found.push(format!(
            "BV/TV is {:.3}: nearly everything was selected",
            s.bv_tv
        ));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

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
        let s = segment("bar", &scan(), &p, None).unwrap();
        assert_eq!(s.summary.voxels, [6, 6, 4]);
        // Centre of voxel (4, 5): the voxel and its four neighbours in a circle of radius one voxel, in 4 slices.
        assert_eq!(s.summary.bone_voxels, 20);
        assert!((s.summary.tv_mm3 - std::f64::consts::PI * 0.01 * 0.4).abs() < 1e-12);
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
}
