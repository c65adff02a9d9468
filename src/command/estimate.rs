//! Owns what a scan needs, memory and time: roughly from its header, to share a machine by, and from its bone.

use crate::command::ladder;
use crate::error::{Error, Result};
use crate::image::extent;
use crate::machine::host;
use crate::pipeline::apparent::{Method, SolveParams, memory};
use crate::pipeline::lattice::{Boundary, Case, LatticeParams};
use crate::recipe::Recipe;
use crate::volume::Specimen;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Bytes of the program before it reads anything, its threads' stacks and what allocators keep among them.
const BASE: f64 = 23.7e6;

/// Bytes per voxel while a scan is segmented: grey values, labels, mask (5.6 to 5.9 measured on 8 and 125 million voxels); and
/// where it is turned to its fabric or measured, with what that keeps (16.5).
const BYTES_PER_VOXEL: f64 = 6.0;
const BYTES_PER_TURNED_VOXEL: f64 = 17.0;

/// Bytes per lattice site and per hexahedron, before the bone is known.
const BYTES_PER_SITE: f64 = 260.0;
/// Per place at which a site could be, while they are chosen.
const BYTES_PER_PLACE: f64 = 4.5;
/// The least and the most that a lattice site takes (solid bone; sheets one site thick), and one that is not solved.
const LEAST_PER_SITE: f64 = 115.0;
const MOST_PER_SITE: f64 = 430.0;
const BUILT_PER_SITE: f64 = 40.0;
const BYTES_PER_ELEMENT: f64 = 220.0;

/// Share of candidate sites that a padded lattice of trabecular bone fills: 120 096 of 274 625 measured at LP 0.06 mm.
const FILLED: f64 = 0.5;

/// Seconds per lattice site and per hexahedron on two cores: 0.55 s for 120 096 sites, 6.4 s for 1 869 627 elements.
const S_PER_SITE: f64 = 5e-6;
const S_PER_ELEMENT: f64 = 3.5e-6;

/// What a scan needs, roughly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// None where the header does not tell.
    pub voxels: Option<[usize; 3]>,
    pub memory_mib: f64,
    /// None where the voxel size is not known before reading.
    pub time_s: Option<f64>,
    /// The bone is known, and none of it would bear load.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub no_bone: bool,
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.voxels {
            Some([x, y, z]) => write!(f, "{x} × {y} × {z} voxels, ")?,
            None => write!(f, "size not known before reading, ")?,
        }
        if self.no_bone {
            return write!(f, "no bone from face to face: E_app is 0");
        }
        write!(f, "about {:.0} MiB", self.memory_mib)?;
        match self.time_s {
            Some(t) if t < 1.0 => write!(f, ", less than 1 s"),
            Some(t) => write!(f, ", {t:.0} s"),
            None => Ok(()),
        }
    }
}

/// Needs of one scan under a recipe. Unknown sizes are taken as four times the bytes on disk.
pub fn estimate(input: &Path, spacing_mm: Option<[f64; 3]>, recipe: &Recipe) -> Estimate {
    let extent = extent::of(input);
    let voxels = match (recipe.segment.crop, extent) {
        (Some(crop), _) => Some(crop.map(|[first, end]| end.saturating_sub(first))),
        (None, extent) => extent.map(|e| e.voxels),
    };
    let count = |n: [usize; 3]| n.iter().map(|&v| v as f64).product::<f64>();
    let read = extent.map_or(4.0 * bytes_on_disk(input), |e| count(e.voxels));
    let spacing = spacing_mm.or(extent.and_then(|e| e.spacing_mm));
    let size_mm = voxels
        .zip(spacing)
        .map(|(n, h)| [0, 1, 2].map(|a| n[a] as f64 * h[a]));
    let worked_on = match (recipe.segment.resample_mm, size_mm) {
        (Some(to), Some(size)) => (0..3).map(|a| size[a] / to[a]).product(),
        _ => voxels.map_or(read, count),
    };
    let (model_bytes, time_s) = match recipe.solve.method {
        Method::Lattice => lattice(size_mm, recipe),
        Method::VoxelFe => {
            let scale = (recipe.solve.refine as f64 / recipe.solve.coarsen as f64).powi(3);
            let elements = worked_on * FILLED * scale;
            (elements * BYTES_PER_ELEMENT, Some(elements * S_PER_ELEMENT))
        }
    };
    Estimate {
        voxels: extent.map(|e| e.voxels),
        memory_mib: mib(BASE + (read.max(worked_on) * reading_bytes(recipe)).max(model_bytes)),
        time_s,
        no_bone: false,
    }
}

fn reading_bytes(recipe: &Recipe) -> f64 {
    match recipe.segment.align.is_some() || recipe.segment.morphometry {
        true => BYTES_PER_TURNED_VOXEL,
        false => BYTES_PER_VOXEL,
    }
}

/// Bytes of the largest lattice, seconds of all.
fn lattice(size_mm: Option<[f64; 3]>, recipe: &Recipe) -> (f64, Option<f64>) {
    let Some(size) = size_mm else {
        return (0.0, None);
    };
    let (mut bytes, mut time) = (0.0f64, 0.0);
    for case in recipe.lattice.cases() {
        let cell = case.structure.cell_volume() * case.lp_mm.powi(3);
        let sites = FILLED * size.iter().product::<f64>() / cell;
        bytes = bytes.max(sites * BYTES_PER_SITE);
        time += sites * S_PER_SITE;
    }
    (bytes, Some(time))
}

/// Needs of a scan whose bone is known: the most that one of its solves takes, and reading the scan before.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn of_specimen(specimen: &Specimen, first: &Estimate, recipe: &Recipe) -> Result<Estimate> {
    let params = &match recipe.error {
        Some(target) => ladder::expected(&specimen.bone, target, &recipe.solve),
        None => recipe.solve.clone(),
    };
    let kept = kept_bytes(specimen, params);
    let reading = first.voxels.map_or(specimen.bone.grid.len() as f64, |n| {
        n.iter().map(|v| *v as f64).product()
    });
    let mut bytes = reading * reading_bytes(recipe);
    let mut no_bone = true;
    for case in cases(&recipe.lattice, params) {
        let needed = needed(specimen, case.as_ref(), params)?;
        bytes = bytes.max(kept + needed);
        no_bone &= needed == 0.0;
    }
    let time_s = match params.method {
        _ if no_bone => Some(0.0),
        Method::Lattice => lattice(Some(specimen.bone.grid.size_mm()), recipe).1,
        Method::VoxelFe => Some(elements(specimen, params) * S_PER_ELEMENT),
    };
    Ok(Estimate {
        memory_mib: mib(BASE + bytes),
        time_s,
        no_bone,
        ..*first
    })
}

/// Voxel elements, before those without load are dropped.
fn elements(specimen: &Specimen, params: &SolveParams) -> f64 {
    let bone = specimen.bv_mm3() / specimen.bone.grid.voxel_mm3();
    bone * (params.refine as f64 / params.coarsen as f64).powi(3)
}

fn cases(lattices: &LatticeParams, params: &SolveParams) -> Vec<Option<Case>> {
    match params.method {
        Method::Lattice => lattices.cases().into_iter().map(Some).collect(),
        Method::VoxelFe => vec![None],
    }
}

/// Bytes that a lattice takes at the least and at the most, told without building it.
fn bounds(specimen: &Specimen, case: &Case) -> [f64; 2] {
    let step = case.lp_mm / case.structure.steps_per_lp();
    let cell = case.structure.cell_volume() * case.lp_mm.powi(3);
    let places = specimen.tv_mm3 / step.powi(3) * BYTES_PER_PLACE;
    let solid = specimen.bv_mm3() / cell;
    // Where little of a place's cell, or only its neighbours', must be bone, any place can be a site.
    let most = match case.boundary {
        Boundary::Floppy => 1.2 * solid,
        Boundary::Firm | Boundary::Graded => specimen.tv_mm3 / cell,
    };
    [
        places.max(LEAST_PER_SITE * solid),
        places + MOST_PER_SITE * most,
    ]
}

/// Bytes of a solve: counted, unless it takes more than is free in any case.
fn needed(specimen: &Specimen, case: Option<&Case>, params: &SolveParams) -> Result<f64> {
    let least = case.map_or(0.0, |case| bounds(specimen, case)[0]);
    match host::available_mib() {
        Some(free) if mib(least) > free => Ok(least),
        _ => memory::of(specimen, case, params),
    }
}

/// MiB that the program takes while it solves this.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn of_solve_mib(specimen: &Specimen, case: Option<&Case>, params: &SolveParams) -> Result<f64> {
    let kept = kept_bytes(specimen, params);
    Ok(mib(BASE + kept + needed(specimen, case, params)?))
}

/// Bytes of a specimen: its mask and, where moduli follow grey values, those and each voxel's modulus.
fn kept_bytes(specimen: &Specimen, params: &SolveParams) -> f64 {
    let by_voxel = if params.material.is_some() { 9.0 } else { 1.0 };
    specimen.bone.grid.len() as f64 * by_voxel
}

/// Refuses a lattice, to be built but not solved, that this machine has no memory for.
///
/// # Errors
/// A lattice that needs more than is free.
pub fn refuse_lattice_that_does_not_fit(specimen: &Specimen, case: &Case) -> Result<()> {
    let [least, _] = bounds(specimen, case);
    let needed = mib(least * BUILT_PER_SITE / LEAST_PER_SITE);
    match host::available_mib() {
        Some(free) if needed > free => Err(does_not_fit(
            "lattice",
            needed,
            free,
            coarser(case, needed / free),
        )),
        _ => Ok(()),
    }
}

/// Refuses a solve that this machine has no memory for, and says what it has memory for.
///
/// # Errors
/// A solve that needs more than is free.
pub fn refuse_what_does_not_fit(
    specimen: &Specimen,
    case: Option<&Case>,
    params: &SolveParams,
) -> Result<()> {
    let Some(free) = host::available_mib() else {
        return Ok(());
    };
    let most = match case {
        Some(case) => bounds(specimen, case)[1],
        None => elements(specimen, params) * BYTES_PER_ELEMENT,
    };
    // Counting takes time, and room on lattices, so it is left out where there is no question.
    if mib(most) < 0.5 * free {
        return Ok(());
    }
    let needed = mib(needed(specimen, case, params)?);
    if needed < free {
        return Ok(());
    }
    let factor = needed / free;
    let advice = match case {
        Some(case) => coarser(case, factor),
        None if params.refine > 1 => {
            let fits = (params.refine as f64 / (1.1 * factor).cbrt())
                .floor()
                .max(1.0);
            format!("crop the scan, or --refine {fits:.0}")
        }
        None => format!(
            "crop the scan, or --coarsen {} (the modulus will be less exact), or use lattices",
            (params.coarsen as f64 * (1.1 * factor).cbrt()).ceil()
        ),
    };
    Err(does_not_fit("solve", needed, free, advice))
}

fn does_not_fit(what: &str, needed: f64, free: f64, advice: String) -> Error {
    let needs = format!("this {what} needs about {needed:.0} MiB, {free:.0} MiB are free");
    Error::specimen(needs, advice)
}

/// What to do about a lattice that takes `factor` times the memory there is.
fn coarser(case: &Case, factor: f64) -> String {
    let fits = case.lp_mm * (1.1 * factor).cbrt();
    // To two digits, upwards: what is advised must fit.
    let digit = 10f64.powi(fits.log10().floor() as i32 - 1);
    let fits = (fits / digit).ceil() * digit;
    let places = (-digit.log10().round()).max(0.0) as usize;
    format!("crop the scan, or take a lattice parameter of {fits:.places$} mm or more")
}

fn mib(bytes: f64) -> f64 {
    bytes / (1024.0 * 1024.0)
}

fn bytes_on_disk(input: &Path) -> f64 {
    let len = |path: &Path| path.metadata().map_or(0, |m| m.len()) as f64;
    match std::fs::read_dir(input) {
        Ok(entries) => entries.flatten().map(|entry| len(&entry.path())).sum(),
        Err(_) => len(input),
    }
}
