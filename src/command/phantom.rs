//! Owns `phantom` on disk: a synthetic scan as an image file, or as a folder of TIFF slices.

use crate::error::{Error, Result};
use crate::image::{nifti, scan, tiff};
use crate::io::atomic;
use crate::machine::session::Session;
use crate::pipeline::phantom as stage;
use crate::pipeline::phantom::{PhantomParams, PhantomSummary};
use std::path::Path;

/// Writes the scan to `out` (`.nii`, `.nii.gz`, or else a folder of TIFF slices), and the clean mask to `mask`.
pub fn phantom(
    out: &Path,
    mask: Option<&Path>,
    params: &PhantomParams,
    session: &Session,
) -> Result<PhantomSummary> {
    params.check()?;
    let as_nifti = is_nifti(out);
    if !as_nifti && !session.force && std::fs::read_dir(out).is_ok_and(|mut d| d.next().is_some()) {
        return Err(Error::file(
            out,
            "is a folder that is not empty",
            "choose another folder, or --force to write slices into this one",
        ));
    }
    if let Some(mask) = mask.filter(|m| !is_nifti(m)) {
        return Err(Error::file(
            mask,
            "a mask is written as NIfTI",
            "give a name that ends in .nii.gz",
        ));
    }
    let mut phantom = stage::structure(params)?;
    let scan = stage::scan(&mut phantom, params);
    say(&phantom.summary, session);
    if session.dry_run {
        return Ok(phantom.summary);
    }
    if let Some(path) = mask {
        nifti::write(path, &phantom.mask)?;
    }
    drop(phantom.mask);
    if as_nifti {
        nifti::write(out, &scan)?;
    } else {
        atomic::create_dir(out)?;
        tiff::write_slices(out, &scan::name(out), &scan)?;
    }
    Ok(phantom.summary)
}

fn is_nifti(path: &Path) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    name.ends_with(".nii") || name.ends_with(".nii.gz")
}

fn say(s: &PhantomSummary, session: &Session) {
    let [nx, ny, nz] = s.voxels;
    session.say(format!(
        "{nx} × {ny} × {nz} voxels, BV/TV {:.4}, {} specks of debris, plate thickness {} mm",
        s.bv_tv,
        s.debris,
        s.plate_thickness_mm
            .map_or("NA".into(), |t| format!("{t:.3}")),
    ));
    if !s.connects_z {
        session.warn("no path of bone connects the two faces along z");
    }
}
