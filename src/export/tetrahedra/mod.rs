//! Smooth elements as files of other programs: an input deck of CalculiX and Abaqus, the surface, the mesh.

pub mod inp;
pub mod stl;
pub mod vtu;

use crate::error::{Error, Result};
use crate::pipeline::apparent::discretisation::{Discretisation, Prepared};
use crate::pipeline::apparent::geometry_fe::GeometryModel;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{Load, SolveParams, settled};
use crate::volume::Specimen;
use std::path::Path;

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// C3D10 elements, sets, supports, load.
    Inp,
    /// The free surface and the cut faces, binary.
    Stl,
    /// Elements with their moduli, for ParaView.
    Vtu,
}

impl Kind {
    pub fn extension(self) -> &'static str {
        match self {
            Kind::Inp => "inp",
            Kind::Stl => "stl",
            Kind::Vtu => "vtu",
        }
    }
}

/// Writes the elements of a specimen that carry load. Of a deck at most `bins` materials; returned is by what share the element
/// farthest from its material is off.
///
/// # Errors
/// A load that has no such file, a specimen that does not join the grips, an unwritable file.
pub fn write(
    path: &Path,
    kind: Kind,
    specimen: &Specimen,
    params: &SolveParams,
    bins: usize,
) -> Result<f64> {
    if kind == Kind::Inp && params.load == Load::Stiffness {
        return Err(Error::setting(
            "--export inp",
            "six unit strains are six models",
            "use --load uniaxial or confined",
        ));
    }
    let params = &*settled(specimen, params)?;
    let tissue = &Tissue::of(specimen, params)?;
    let model = GeometryModel::build(&(), Prepared { specimen, tissue }, params)?;
    if model.elements().mesh.elements.is_empty() {
        return Err(Error::specimen(
            "no path of bone between the loaded faces",
            "there is nothing to export",
        ));
    }
    match kind {
        Kind::Inp => inp::write(path, &model, params, bins),
        Kind::Stl => stl::write(path, model.elements()).map(|()| 0.0),
        Kind::Vtu => vtu::write(path, model.elements()).map(|()| 0.0),
    }
}
