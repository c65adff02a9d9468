//! Owns the choice of smaller elements where those of the default size bridge gaps or lose struts, as Euler numbers say.

use super::mesh::{filled, has_other_pieces, keep_loaded};
use super::nodes::Grips;
use super::size;
use super::surface::{self, Source};
use crate::discretisation::tetrahedra::quality::euler;
use crate::error::Result;
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

/// The settings with the size of elements that they leave open.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn settled<'a>(specimen: &Specimen, params: &'a SolveParams) -> Result<Cow<'a, SolveParams>> {
    if params.method != Method::GeometryFe || params.element_mm.is_some() {
        return Ok(Cow::Borrowed(params));
    }
    size::check(specimen, params)?;
    let grips = Grips::of(specimen, params)?;
    let surface = surface::of(specimen, Source::of(specimen, params));
    let mask = morphometry::euler(&specimen.bone);
    let apart = |size_mm: f64| -> Result<f64> {
        let mut mesh = filled(specimen, &surface, &grips, size_mm)?;
        if !has_other_pieces(specimen) {
            keep_loaded(&mut mesh, &grips, params);
        }
        let difference = euler(&mesh).abs_diff(mask) as f64;
        Ok(difference / mask.unsigned_abs().max(1) as f64)
    };
    let default = size::of(specimen, params);
    let mut chosen = (default, apart(default)?);
    for part in FINER {
        if chosen.1 < APART {
            break;
        }
        let size_mm = size::rounded(default / part);
        let left = apart(size_mm)?;
        if left <= LEFT * chosen.1 {
            chosen = (size_mm, left);
        }
    }
    Ok(Cow::Owned(SolveParams {
        element_mm: Some(chosen.0),
        ..params.clone()
    }))
}
