//! Owns what can be said of a scan without reading its voxels: its extent, and whether a TIFF file is a whole stack.

use crate::image::tiff::directories;
use crate::image::{nifti, slices};
use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// What a header says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Along x, y, z as stored.
    pub voxels: [usize; 3],
    pub spacing_mm: Option<[f64; 3]>,
}

/// None where a header does not say it cheaply; reading the scan says what is wrong.
pub fn of(path: &Path) -> Option<Extent> {
    if path.is_dir() {
        let files = slices::files(path).ok()?;
        let [nx, ny, pages] = pages(files.first()?)?;
        let nz = if files.len() == 1 { pages } else { files.len() };
        return Some(Extent {
            voxels: [nx, ny, nz],
            spacing_mm: None,
        });
    }
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    if [".nii", ".hdr", ".img"]
        .iter()
        .any(|end| name.ends_with(end))
    {
        let (voxels, spacing_mm) = nifti::extent(path)?;
        return Some(Extent { voxels, spacing_mm });
    }
    pages(path).map(|voxels| Extent {
        voxels,
        spacing_mm: None,
    })
}

/// Whether a TIFF file holds more than one page: a scan of its own, not a slice.
pub fn is_stack(path: &Path) -> bool {
    pages(path).is_some_and(|[_, _, pages]| pages > 1)
}

/// Width, height, and pages of a TIFF file; an ImageJ stack of one directory gives its pages in its description.
fn pages(path: &Path) -> Option<[usize; 3]> {
    let mut file = File::open(path).ok()?;
    let bytes = file.metadata().ok()?.len();
    if directories::fault(&mut file, bytes).is_some() {
        return None;
    }
    file.rewind().ok()?;
    let mut decoder = Decoder::new(BufReader::new(file)).ok()?;
    let (width, height) = decoder.dimensions().ok()?;
    let description = decoder.get_tag_ascii_string(Tag::ImageDescription);
    let stated = description.ok().and_then(|text| {
        text.lines()
            .find_map(|line| line.strip_prefix("images=")?.trim().parse().ok())
    });
    let mut pages = 1;
    while decoder.more_images() && decoder.next_image().is_ok() {
        pages += 1;
    }
    Some([
        width as usize,
        height as usize,
        stated.unwrap_or(1).max(pages),
    ])
}
