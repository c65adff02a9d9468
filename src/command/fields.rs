//! Owns the fields of a solve on disk.

use crate::draw::{field, map};
use crate::error::Result;
use crate::export::tetrahedra::vtu;
use crate::export::{vti, vtk};
use crate::format::orient::{self, Turn};
use crate::image::nifti;
use crate::pipeline::apparent::fields::{FieldVolume, MeshFields, Place, Recorded, SiteFields};
use crate::volume::Volume;
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

    /// Of voxels `field-NAME.nii.gz` on the scan's grid each, and all of them in `fields.vti` for ParaView; of sites
    /// `fields-LATTICE.vtk`; of smooth elements `fields-geometry-fe.vtu`.
    pub(super) fn write(&self, dir: &Path) -> Result<()> {
        match self {
            Fields::None => Ok(()),
            Fields::OfMesh(mesh) => vtu::write_fields(&dir.join("fields-geometry-fe.vtu"), mesh),
            Fields::OfVoxels(fields, axes) => write_voxels(dir, fields, &axes.inverse()),
            Fields::OfSites(name, sites) => {
                vtk::write_fields(&dir.join(format!("fields-{name}.vtk")), name, sites)
            }
        }
    }
}

/// Mid-slices of a field, for the page.
fn picture_name(field: &str) -> String {
    format!("field-{}.png", field.replace('_', "-"))
}

/// The pictures of fields in a scan's folder, each with its caption.
pub(super) fn pictures(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names
        .filter(|name| name.starts_with("field-") && name.ends_with(".png"))
        .collect();
    names.sort();
    let picture = |name: &String| {
        let field = name.trim_start_matches("field-").trim_end_matches(".png");
        let caption = format!(
            "Field {field}, mid-slices of the three planes; the colour scale ends at the 99th percentile of the elements"
        );
        Some((caption, std::fs::read(dir.join(name)).ok()?))
    };
    names.iter().filter_map(picture).collect()
}

/// In the order and at the place of the scan's file, to which `back` leads.
fn write_voxels(dir: &Path, fields: &[FieldVolume], back: &Turn) -> Result<()> {
    let mut stored = Vec::new();
    for one in fields {
        let file = format!("field-{}.nii.gz", one.name.replace('_', "-"));
        let turned = |v: &Volume<f32>| orient::turned(v.clone(), back);
        let components: Vec<Volume<f32>> = one.components.iter().map(turned).collect();
        nifti::write_field(&dir.join(file), &components, &one.about)?;
        if let [scalar] = &one.components[..]
            && let Some(picture) = field::draw(scalar)
        {
            map::write_png(&dir.join(picture_name(&one.name)), &picture)?;
        }
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
