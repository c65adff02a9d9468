//! Owns the pictures of fields: slices, stills and views, written and found again.

use crate::draw::colour_bar::{self, Coloured};
use crate::draw::{field, map, still, view};
use crate::error::Result;
use crate::grid::Axis;
use crate::io::atomic;
use crate::pipeline::apparent::fields::FieldVolume;
use crate::volume::Specimen;
use std::path::Path;

/// What the names of stills end with.
const STILL: &str = "-3d.png";

/// Slices of a scalar field: `field-NAME.png`. Of displacements along the load axis, and of what follows from strains, a still
/// (`field-NAME-3d.png`) and a view (`view-NAME.html`) too. Nothing of fields with several components.
pub(super) fn write(
    dir: &Path,
    shown: &FieldVolume,
    specimen: &Specimen,
    load: Axis,
) -> Result<()> {
    let [values] = &shown.components[..] else {
        return Ok(());
    };
    let Some(range) = colour_bar::range(values) else {
        return Ok(());
    };
    let name = &in_words(&shown.name);
    let coloured = Coloured {
        values,
        name,
        range,
    };
    let stem = shown.name.replace('_', "-");
    let slices = field::draw(&coloured);
    map::write_png(&dir.join(format!("field-{stem}.png")), &slices)?;
    if !has_still(&shown.name, load) {
        return Ok(());
    }
    let bone = &specimen.bone;
    let picture = still::field(bone, &coloured, load);
    map::write_shaded_png(&dir.join(format!("field-{stem}{STILL}")), picture)?;
    let page = view::page(&specimen.name, bone, load, Some(&coloured));
    atomic::write(&dir.join(format!("view-{stem}.html")), page)
}

fn has_still(name: &str, load: Axis) -> bool {
    match name.strip_prefix("displacement_") {
        Some(rest) => rest.starts_with(load.name()),
        None => name != "fraction",
    }
}

/// The name of a field with its unit, in two lines.
fn in_words(name: &str) -> String {
    match name {
        "sed_mpa" => "strain energy\ndensity (MPa)".to_owned(),
        "sed_in_vivo_mpa" => "strain energy density\nof daily loads (MPa)".to_owned(),
        "von_mises_mpa" => "von Mises\nstress (MPa)".to_owned(),
        "displacement_x_mm" => "displacement\nalong x (mm)".to_owned(),
        "displacement_y_mm" => "displacement\nalong y (mm)".to_owned(),
        "displacement_z_mm" => "displacement\nalong z (mm)".to_owned(),
        other => other.replace('_', " ").replacen(' ', "\n", 1),
    }
}

/// The pictures of fields in a scan's folder, each with its caption; a still before the slices.
pub(in crate::command) fn found(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let names = names(dir, "field-", ".png").into_iter();
    let picture = |name: String| {
        let field = name.trim_start_matches("field-");
        let caption = match field.strip_suffix(STILL) {
            Some(field) => format!(
                "Field {field} on the bone, each place the mean of the elements around; the colour scale ends at the 98th percentile of the elements"
            ),
            None => format!(
                "Field {}, mid-slices of the three planes; the colour scale ends at the 98th percentile of the elements",
                field.trim_end_matches(".png")
            ),
        };
        Some((caption, std::fs::read(dir.join(&name)).ok()?))
    };
    names.filter_map(picture).collect()
}

/// The views of fields in a scan's folder: name of the field, and file.
pub(in crate::command) fn views(dir: &Path) -> Vec<(String, String)> {
    let field = |file: String| {
        let field = file.trim_start_matches("view-").trim_end_matches(".html");
        (field.to_owned(), file.clone())
    };
    names(dir, "view-", ".html")
        .into_iter()
        .map(field)
        .collect()
}

/// Files of a folder, in the order of their names.
fn names(dir: &Path, first: &str, last: &str) -> Vec<String> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names
        .filter(|name| name.starts_with(first) && name.ends_with(last))
        .collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stills_are_of_the_load_axis_and_of_what_follows_from_strains() {
        let has = |name| has_still(name, Axis::Y);
        assert!(has("displacement_y_mm") && has("sed_mpa") && has("plastic_strain"));
        assert!(!has("displacement_x_mm") && !has("fraction"));
        assert_eq!(in_words("effective_strain"), "effective\nstrain");
    }
}
