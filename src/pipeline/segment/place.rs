//! Owns what is done to a scan before bone is found in it: cropped, turned, resampled, rotated, in that order.

use super::params::{Align, AlignBox};
use super::region::{check_crop, same_grid};
use super::window::{Grey, Window, bone_of, grey_range, window};
use super::{SegmentParams, Voi};
use crate::error::{Error, Result};
use crate::grid::{Axis, Grid};
use crate::mask::regrid::{Between, resampled, turned};
use crate::mask::rotate::Rotated;
use crate::measure::fabric::{Principal, principal};
use crate::volume::Volume;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// How a scan was rotated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rotation {
    /// What became z: a unit vector along x, y, z of the scan after `turn`.
    pub direction: [f64; 3],
    /// By how much.
    pub angle_deg: f64,
    /// Volume of the box over that of the scan's before.
    pub kept: f64,
    /// Of a fabric: its longest mean intercept length over the next.
    pub mil_ratio: Option<f64>,
}

/// A scan in its place, and the window of bone in it.
pub(super) struct Placed<'a> {
    pub scan: Cow<'a, Volume<f32>>,
    pub voi_mask: Option<Cow<'a, Volume<u8>>>,
    /// Of the volume, in the scan's own millimetres after `turn`; zero where it was rotated.
    pub corner_mm: [f64; 3],
    /// Before it was rotated.
    pub grey: Grey,
    pub window: Window,
    pub rotation: Option<Rotation>,
}

/// More than this is taken for a mistake: 2³¹ voxels are 8 GiB of grey values.
const MOST_VOXELS: f64 = 2_147_483_648.0;

pub(super) fn place<'a>(
    scan: &'a Volume<f32>,
    params: &SegmentParams,
    voi_mask: Option<&'a Volume<u8>>,
) -> Result<Placed<'a>> {
    let mut scan = Cow::Borrowed(scan);
    let mut voi_mask = voi_mask.map(Cow::Borrowed);
    if let (Voi::Mask(path), Some(mask)) = (&params.voi, &voi_mask) {
        same_grid(path, mask, scan.grid)?;
    }
    let mut corner_mm = [0.0; 3];
    if let Some(crop) = params.crop {
        check_crop(&crop, scan.grid.n)?;
        corner_mm = std::array::from_fn(|a| crop[a][0] as f64 * scan.grid.spacing_mm[a]);
        scan = Cow::Owned(scan.cropped(&crop));
        voi_mask = voi_mask.map(|mask| Cow::Owned(mask.cropped(&crop)));
    }
    if params.turn != Axis::Z {
        corner_mm.rotate_left((params.turn.index() + 1) % 3);
        scan = Cow::Owned(turned(&scan, params.turn));
        voi_mask = voi_mask.map(|mask| Cow::Owned(turned(&mask, params.turn)));
    }
    let between = match params.labels.is_empty() {
        true => Between::Means,
        false => Between::Nearest,
    };
    if let Some(spacing) = params.resample_mm {
        let size = scan.grid.size_mm();
        check_count(
            "segment.resample_mm",
            (0..3).map(|a| size[a] / spacing[a]).product(),
        )?;
        scan = Cow::Owned(resampled(&scan, spacing, between));
        let near = |mask: Cow<Volume<u8>>| resampled(&grey_of(&mask), spacing, Between::Nearest);
        voi_mask = voi_mask.map(|mask| Cow::Owned(mask_of(&near(mask))));
    }
    let grey = grey_range(&scan)?;
    let mut placed = Placed {
        window: window(&scan, params, &grey)?,
        scan,
        voi_mask,
        corner_mm,
        grey,
        rotation: None,
    };
    if let Some(align) = params.align {
        placed.rotate(align, params, between)?;
    }
    Ok(placed)
}

impl Placed<'_> {
    fn rotate(&mut self, align: Align, params: &SegmentParams, between: Between) -> Result<()> {
        let (direction, mil_ratio) = match align {
            Align::Direction(direction) => (direction, None),
            Align::Fabric => {
                let found = self.fabric(params)?;
                (found.direction, Some(found.ratio))
            }
        };
        let old = self.scan.grid;
        let edge_mm = old.spacing_mm.into_iter().fold(f64::INFINITY, f64::min);
        let whole = params.align_box == AlignBox::Whole;
        let volume: f64 = old.size_mm().iter().product();
        // The box around a cube on its corner is 5.2 times as large.
        let most = if whole { 5.2 } else { 1.0 };
        check_count("segment.align", most * volume / edge_mm.powi(3))?;
        let rotated = Rotated::to_z(&old, direction, edge_mm, whole);
        // Nothing is known there: no label, or the least grey value.
        let outside = match between {
            Between::Nearest => 0.0,
            _ => self.grey.min,
        };
        self.scan = Cow::Owned(rotated.read(&self.scan, between, outside));
        if let Some(mask) = &self.voi_mask {
            let read = rotated.read(&grey_of(mask), Between::Nearest, 0.0);
            self.voi_mask = Some(Cow::Owned(mask_of(&read)));
        }
        self.corner_mm = [0.0; 3];
        let [_, _, z] = rotated.axes;
        self.rotation = Some(Rotation {
            direction: z,
            angle_deg: z[2].clamp(-1.0, 1.0).acos().to_degrees(),
            kept: rotated.grid.size_mm().iter().product::<f64>() / volume,
            mil_ratio,
        });
        Ok(())
    }

    /// Of all bone, or of that in a volume of interest that is a mask: a cylinder stands in the rotated scan.
    fn fabric(&self, params: &SegmentParams) -> Result<Principal> {
        let bone = bone_of(&self.scan, params, &self.grey, &self.window);
        principal(&bone, self.voi_mask.as_deref()).ok_or_else(|| {
            Error::specimen(
                "no surface of bone to measure a fabric by",
                "check the threshold against the grey values (bonepd-ct info), or give --align X,Y,Z",
            )
        })
    }
}

fn check_count(key: &str, voxels: f64) -> Result<()> {
    if voxels <= MOST_VOXELS {
        return Ok(());
    }
    Err(Error::setting(
        key,
        format!("the scan would come to {voxels:.1e} voxels, more than {MOST_VOXELS:.1e}"),
        "give coarser voxels (--resample), or --crop first",
    ))
}

fn grey_of(mask: &Volume<u8>) -> Volume<f32> {
    let voxels = mask.as_slice().iter();
    let values = voxels.map(|&v| f32::from(u8::from(v != 0))).collect();
    Volume {
        affine: mask.affine,
        ..Volume::from_vec(Grid::new(mask.grid.n, mask.grid.spacing_mm), values)
    }
}

fn mask_of(grey: &Volume<f32>) -> Volume<u8> {
    let voxels = grey.as_slice().iter();
    Volume {
        affine: grey.affine,
        ..Volume::from_vec(grey.grid, voxels.map(|&v| u8::from(v != 0.0)).collect())
    }
}
