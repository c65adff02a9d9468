//! Owns the fields of a solve on disk.

pub(super) mod pictures;

use crate::error::Result;
use crate::export::tetrahedra::vtu;
use crate::export::{vti, vtk};
use crate::format::orient::{self, Turn};
use crate::grid::Axis;
use crate::image::nifti;
use crate::pipeline::apparent::fields::{FieldVolume, MeshFields, Place, Recorded, SiteFields};
use crate::volume::{Specimen, Volume};
use std::path::Path;

/// What was asked for of a solved model.
pub enum Fields {
    /// Nothing.
    None,
    /// Along the specimen's axes, and how those follow from the file's.
    OfVoxels(Vec<FieldVolume>, Turn),
    /// Name of the lattice, values of its sites.
    OfSites(String, SiteFields),
    /// Of smooth elements.
    OfMesh(MeshFields),
}

impl Fields {
    /// `stem` names a lattice; `axes` lead from the scan's file to the specimen.
    pub(super) fn of(stem: String, mut recorded: Recorded, axes: Turn) -> Fields {
        match (recorded.sites.take(), recorded.mesh.take()) {
            (Some(sites), _) => Fields::OfSites(stem, sites),
            (_, Some(mesh)) => Fields::OfMesh(mesh),
            _ => Fields::OfVoxels(recorded.fields, axes),
        }
    }

    /// The strain energy density of voxels, in place of all fields; None where there is none.
    pub(super) fn take_energy_density(&mut self) -> Option<Volume<f32>> {
        let Fields::OfVoxels(fields, _) = std::mem::replace(self, Fields::None) else {
            return None;
        };
        let field = fields.into_iter().find(|field| field.name == "sed_mpa");
        field.and_then(|mut field| field.components.pop())
    }

    /// Of voxels `field-NAME.nii.gz` on the scan's grid each, with pictures, and all of them in `fields.vti` for ParaView; of sites
    /// `fields-LATTICE.vtk`; of smooth elements `fields-geometry-fe.vtu`.
    pub(super) fn write(&self, dir: &Path, specimen: &Specimen, load: Axis) -> Result<()> {
        match self {
            Fields::None => Ok(()),
            Fields::OfMesh(mesh) => vtu::write_fields(&dir.join("fields-geometry-fe.vtu"), mesh),
            Fields::OfVoxels(fields, axes) => {
                for field in fields {
                    pictures::write(dir, field, specimen, load)?;
                }
                write_voxels(dir, fields, &axes.inverse())
            }
            Fields::OfSites(name, sites) => {
                vtk::write_fields(&dir.join(format!("fields-{name}.vtk")), name, sites)
            }
        }
    }
}

/// In the order and at the place of the scan's file, to which `back` leads.
fn write_voxels(dir: &Path, fields: &[FieldVolume], back: &Turn) -> Result<()> {
    let mut stored = Vec::new();
    for one in fields {
        let file = format!("field-{}.nii.gz", one.name.replace('_', "-"));
        let turned = |v: &Volume<f32>| orient::turned(v.clone(), back);
        let components: Vec<Volume<f32>> = one.components.iter().map(turned).collect();
        nifti::write_field(&dir.join(file), &components, &one.about)?;
        stored.push((one, components));
    }
    let arrays: Vec<vti::Array> = stored
        .iter()
        .map(|(field, components): &(&FieldVolume, _)| vti::Array {
            name: &field.name,
            about: &field.about,
            labels: field.labels,
            components,
            is_of_nodes: field.place == Place::Nodes,
        })
        .collect();
    vti::write(&dir.join("fields.vti"), &arrays)
}
