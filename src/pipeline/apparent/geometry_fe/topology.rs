//! Owns the choice of smaller elements where those of the default size bridge gaps or lose struts, as Euler numbers say.

use super::mesh::{filled, has_other_pieces, keep_loaded};
use super::nodes::Grips;
use super::surface::{self, Source};
use super::{cost, size};
use crate::discretisation::tetrahedra::quality::euler;
use crate::error::{Error, Result};
use crate::measure::morphometry;
use crate::pipeline::apparent::params::{Method, SolveParams};
use crate::volume::Specimen;
use std::borrow::Cow;

/// The default size is divided by these in turn.
const FINER: [f64; 2] = [1.5, 2.0];

/// Difference of the Euler numbers of mesh and mask, over the mask's, from which on smaller elements are tried.
const APART: f64 = 0.04;

/// Smaller elements are taken where they leave at most this part of the difference. Noise and single voxels, which no size of elements
/// follows, do not make them smaller.
const LEFT: f64 = 0.5;

/// Elements up to which smaller ones are tried: some 4 GiB for a solve. Beyond, a trial takes minutes; the row then says that the Euler
/// numbers differ.
const MOST_ELEMENTS: f64 = 6e6;

/// The settings with the surface and the size of elements that they leave open.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn settled<'a>(specimen: &Specimen, params: &'a SolveParams) -> Result<Cow<'a, SolveParams>> {
    if params.method != Method::GeometryFe {
        return Ok(Cow::Borrowed(params));
    }
    let source = Source::of(specimen, params);
    if source == Source::Mask && params.surface.is_some() {
        return Err(Error::setting(
            "solve.surface",
            "a mask has no grey values: its surface is a guess, and there is no other",
            "segment the grey scan and keep its grey values, or leave the setting out",
        ));
    }
    let (surface, corrected_blur_voxels) = source.named();
    let size_mm = match params.element_mm {
        Some(given) => given,
        None => {
            size::check(specimen, params)?;
            chosen(specimen, source, params)?
        }
    };
    Ok(Cow::Owned(SolveParams {
        element_mm: Some(size_mm),
        surface,
        corrected_blur_voxels,
        ..params.clone()
    }))
}

/// The default size, or a smaller one that comes nearer to the mask's Euler number.
fn chosen(specimen: &Specimen, source: Source, params: &SolveParams) -> Result<f64> {
    let default = size::of(specimen, params);
    let is_small = |size_mm: f64| cost::elements(specimen, size_mm) < MOST_ELEMENTS;
    if !is_small(default) {
        return Ok(default);
    }
    let grips = Grips::of(specimen, params)?;
    let surface = surface::of(specimen, source);
    let mask = morphometry::euler(&specimen.bone);
    let apart = |size_mm: f64| -> Result<f64> {
        let mut mesh = filled(specimen, &surface, &grips, size_mm)?;
        if !has_other_pieces(specimen) {
            keep_loaded(&mut mesh, &grips, params);
        }
        let difference = euler(&mesh).abs_diff(mask) as f64;
        Ok(difference / mask.unsigned_abs().max(1) as f64)
    };
    let mut chosen = (default, apart(default)?);
    for size_mm in FINER.map(|part| size::rounded(default / part)) {
        if chosen.1 < APART || !is_small(size_mm) {
            break;
        }
        let left = apart(size_mm)?;
        if left <= LEFT * chosen.1 {
            chosen = (size_mm, left);
        }
    }
    Ok(chosen.0)
}
