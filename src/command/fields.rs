//! Owns the fields of a solve on disk.

use crate::error::Result;
use crate::export::{vti, vtk};
use crate::image::nifti;
use crate::pipeline::apparent::fields::{Recorded, SiteFields};
use std::path::Path;

/// What was asked for of a solved model.
pub(super) enum Fields {
    None,
    OfVoxels(Recorded),
    /// Name of the lattice, values of its sites.
    OfSites(String, SiteFields),
}

impl Fields {
    /// Of voxels `field-NAME.nii.gz` on the scan's grid each, and all of them in `fields.vti` for ParaView; of sites
    /// `fields-LATTICE.vtk`.
    pub(super) fn write(&self, dir: &Path) -> Result<()> {
        match self {
            Fields::None => Ok(()),
            Fields::OfVoxels(recorded) => write_voxels(dir, recorded),
            Fields::OfSites(name, sites) => {
                vtk::write_fields(&dir.join(format!("fields-{name}.vtk")), name, sites)
            }
        }
    }
}

fn write_voxels(dir: &Path, recorded: &Recorded) -> Result<()> {
    for field in &recorded.fields {
        let file = format!("field-{}.nii.gz", field.name.replace('_', "-"));
        nifti::write(&dir.join(file), &field.values)?;
    }
    let arrays: Vec<_> = recorded
        .fields
        .iter()
        .map(|f| (f.name, &f.values))
        .collect();
    vti::write(&dir.join("fields.vti"), &arrays)
}
