//! Owns the size of elements: the default from the struts' thickness, and the error that a size leaves.

use crate::error::{Error, Result};
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::Specimen;

/// Default edge of a cell over the thickness `2 BV / BS` of the mask: half of it for rods, whose diameter is twice that. With 0.6
/// the truth set's lattices and foams came out 10 % too stiff: quadratic displacements do not follow strains where struts meet.
const OF_THICKNESS: f64 = 0.45;

/// Cells of the default are not larger than this many voxels, and not smaller than this many.
const MOST_VOXELS: f64 = 2.25;
const LEAST_VOXELS: f64 = 0.75;

/// Edge of a cell: as the settings say, or from the thickness of struts, rounded to two digits.
pub fn of(specimen: &Specimen, params: &SolveParams) -> f64 {
    params.element_mm.unwrap_or_else(|| {
        let voxel_mm = specimen.bone.grid.voxel_mm3().cbrt();
        let thickness = plate_thickness_mm(&specimen.bone).unwrap_or(f64::INFINITY);
        let size = OF_THICKNESS * thickness;
        rounded(size.clamp(LEAST_VOXELS * voxel_mm, MOST_VOXELS * voxel_mm))
    })
}

/// To two digits.
pub fn rounded(size: f64) -> f64 {
    let digit = 10f64.powi(size.log10().floor() as i32 - 1);
    // Through text, so that 0.034 is that and not a neighbour of it.
    let rounded = (size / digit).round() * digit;
    format!("{rounded:.6}").parse().unwrap_or(rounded)
}

/// # Errors
/// Cells that the grips do not hold, or larger than the specimen is thick.
pub fn check(specimen: &Specimen, params: &SolveParams) -> Result<()> {
    let size = of(specimen, params);
    let ends = specimen.bone.grid.size_mm();
    let least = ends.into_iter().reduce(f64::min).unwrap_or(0.0);
    if !(size > 0.0 && size.is_finite()) || size > 0.5 * least {
        return Err(Error::setting(
            "element_mm",
            format!("elements of {size} mm do not fit a specimen that is {least} mm thick"),
            "give a size in mm of at most half the thickness, or leave it out: it then follows from the struts",
        ));
    }
    Ok(())
}
