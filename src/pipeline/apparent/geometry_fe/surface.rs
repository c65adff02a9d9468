//! Owns where a specimen's bone ends between voxels: where its grey values cross the threshold, or a smooth guess from its mask.

use crate::discretisation::tetrahedra::surface::{Bound, Surface};
use crate::grid::Grid;
use crate::mask::{deblur, gaussian, upsample};
use crate::pipeline::apparent::params::{SolveParams, SurfaceOf};
use crate::result::settings::Elements;
use crate::result::shape::BLURRED_VOXELS;
use crate::volume::{Specimen, Volume};

/// σ in voxels of the smoothing that makes a surface of a mask: wide enough for planes at any angle, narrow enough for struts of
/// three voxels.
const SMOOTHED_MASK: f64 = 0.8;

/// What the surface is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    Grey,
    /// Grey values whose only blur is the voxel's own box, corrected for that.
    Sharpened,
    /// Grey values corrected for their blur.
    Deblurred {
        /// σ of the blur.
        sigma_voxels: f64,
    },
    Mask,
}

impl Source {
    /// Of a specimen: the body's surface where it is asked for, where the scanner's blur was given, or where no blur is seen.
    pub fn of(specimen: &Specimen, params: &SolveParams) -> Source {
        let (Some(_), Some(threshold)) = (&specimen.grey, &specimen.threshold) else {
            return Source::Mask;
        };
        let sigma_voxels = threshold.blur_voxels.unwrap_or(0.0);
        let is_sharp = sigma_voxels < BLURRED_VOXELS;
        let of_body = match params.surface {
            Some(of) => of == SurfaceOf::Body,
            None => threshold.is_blur_given || is_sharp,
        };
        match (of_body, is_sharp) {
            (true, true) => Source::Sharpened,
            (true, false) => Source::Deblurred { sigma_voxels },
            (false, _) => Source::Grey,
        }
    }

    /// The settings that say so; None of a mask, whose surface is a guess.
    pub fn named(self) -> (Option<SurfaceOf>, Option<f64>) {
        match self {
            Source::Grey => (Some(SurfaceOf::Image), None),
            Source::Sharpened => (Some(SurfaceOf::Body), None),
            Source::Deblurred { sigma_voxels } => (Some(SurfaceOf::Body), Some(sigma_voxels)),
            Source::Mask => (None, None),
        }
    }

    /// In a few words.
    pub fn words(self) -> String {
        match self {
            Source::Grey => "surface of cubic interpolation of grey values".into(),
            Source::Sharpened => {
                "surface of cubic interpolation of grey values, corrected for the voxel's own box"
                    .into()
            }
            Source::Deblurred { sigma_voxels } => format!(
                "surface of cubic interpolation of grey values, corrected for a blur of {sigma_voxels:.2} voxels (standard deviation)"
            ),
            Source::Mask => "surface of a smoothed mask of the same volume, a guess".into(),
        }
    }

    pub fn elements(self) -> Elements {
        match self {
            Source::Grey | Source::Sharpened => Elements::SmoothGrey,
            Source::Deblurred { .. } => Elements::SmoothDeblurred,
            Source::Mask => Elements::SmoothMask,
        }
    }
}

/// The surface of a specimen's bone; flat where the grid ends.
pub fn of(specimen: &Specimen, source: Source) -> Surface {
    let (Some(grey), Some(threshold)) = (&specimen.grey, &specimen.threshold) else {
        return Surface::new(vec![smoothed(&specimen.bone)]);
    };
    let values = match source {
        Source::Deblurred { sigma_voxels } => deblur::deblurred(grey, sigma_voxels),
        Source::Sharpened => upsample::sharpened(grey),
        Source::Grey | Source::Mask => grey.clone(),
    };
    let mut bounds = Vec::new();
    for (level, sign) in [(threshold.lower, 1.0), (threshold.upper, -1.0)] {
        let among = values.as_slice().iter();
        let matters = |v: &f32| sign * (v - level) < 0.0;
        if level.is_finite() && among.clone().any(matters) {
            bounds.push(Bound {
                values: values.clone(),
                level,
                sign,
            });
        }
    }
    bounds.extend(threshold.inside.as_ref().map(smoothed));
    if bounds.is_empty() {
        // All of the grid is bone.
        let least = values
            .as_slice()
            .iter()
            .copied()
            .fold(f32::INFINITY, f32::min);
        bounds.push(Bound {
            values,
            level: least - 1.0,
            sign: 1.0,
        });
    }
    Surface::new(bounds)
}

/// A mask smoothed, and the level at which it keeps its volume.
fn smoothed(mask: &Volume<u8>) -> Bound {
    let values = mask.as_slice().iter().map(|v| f32::from(u8::from(*v != 0)));
    let sharp = Volume::from_vec(mask.grid, values.collect());
    let values = gaussian::smoothed(&sharp, SMOOTHED_MASK);
    let bone = mask.as_slice().iter().filter(|v| **v != 0).count() as f64;
    let level = keeping_volume(&values, bone);
    Bound {
        values,
        level,
        sign: 1.0,
    }
}

/// The level above which smoothed values fill `bone` voxels. A voxel whose value is near the level counts in part, as the surface
/// cuts it.
fn keeping_volume(values: &Volume<f32>, bone: f64) -> f32 {
    // The value's change across half a voxel at a plane.
    let half = (0.5 / (SMOOTHED_MASK * (2.0 * std::f64::consts::PI).sqrt())) as f32;
    let filled = |level: f32| {
        let part = |v: &f32| f64::from(((v - level) / half).clamp(-1.0, 1.0) * 0.5 + 0.5);
        values.as_slice().iter().map(part).sum::<f64>()
    };
    let (mut low, mut high) = (0.0f32, 1.0f32);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if filled(middle) > bone {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The planes between cells along each axis: the grid's ends and the grips are among them.
pub fn planes_mm(grid: &Grid, size_mm: f64, axis: usize, grip_mm: f64) -> [Vec<f64>; 3] {
    let ends = grid.size_mm();
    std::array::from_fn(|a| {
        let stops = match a == axis && grip_mm > 0.0 {
            true => vec![0.0, grip_mm, ends[a] - grip_mm, ends[a]],
            false => vec![0.0, ends[a]],
        };
        crate::discretisation::tetrahedra::lattice::planes(&stops, size_mm)
    })
}
