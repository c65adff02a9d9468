//! Owns what a scan needs, memory and time: roughly from its header, to share a machine by, and from its bone.

use crate::command::ladder;
use crate::error::{Error, Result};
use crate::image::extent;
use crate::machine::host;
use crate::pipeline::apparent::discretisation::memory::Memory;
use crate::pipeline::apparent::discretisation::{Cost, Known, Prepared, Resolution};
use crate::pipeline::apparent::job::{Job, bone_connects};
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{SolveParams, jobs, settled};
use crate::recipe::Recipe;
use crate::volume::Specimen;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Bytes of the program before it reads anything, its threads' stacks and what allocators keep among them.
const BASE: f64 = 23.7e6;

/// Bytes per voxel while a scan is segmented: grey values, labels, mask (5.6 to 5.9 measured on 8 and 125 million voxels), and the
/// smoothed values that are kept; and
/// where it is turned to its fabric or measured, with what that keeps (16.5).
const BYTES_PER_VOXEL: f64 = 10.0;
const BYTES_PER_TURNED_VOXEL: f64 = 21.0;

/// Seconds per voxel to read and segment a scan: 0.9 s for 8 million voxels.
const S_PER_VOXEL: f64 = 1.1e-7;

/// Bytes per site of a lattice that is built and not solved, over those of its solve.
const BUILT: f64 = 40.0 / 115.0;

/// What a scan needs, roughly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// None where the header does not say.
    pub voxels: Option<[usize; 3]>,
    /// Memory at the highest, in MiB.
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
            Some(t) => write!(f, ", {}", time_in_words(t)),
            None => Ok(()),
        }
    }
}

/// A time as a plan says it.
pub fn time_in_words(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than 1 s".to_owned(),
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.0} days", s / 86400.0),
    }
}

/// Needs of one scan under a recipe. Unknown sizes are taken as four times the bytes on disk.
///
/// # Errors
/// Settings that fit no scan.
pub fn estimate(input: &Path, spacing_mm: Option<[f64; 3]>, recipe: &Recipe) -> Result<Estimate> {
    let extent = extent::of(input);
    let voxels = match (recipe.segment.crop, extent) {
        (Some(crop), _) => Some(crop.map(|[first, end]| end.saturating_sub(first))),
        (None, extent) => extent.map(|e| e.voxels),
    };
    let read = extent.map_or(4.0 * bytes_on_disk(input), |e| count(e.voxels));
    let spacing = spacing_mm.or(extent.and_then(|e| e.spacing_mm));
    let size_mm = voxels
        .zip(spacing)
        .map(|(n, h)| [0, 1, 2].map(|a| n[a] as f64 * h[a]));
    let worked_on = match (recipe.segment.resample_mm, size_mm) {
        (Some(to), Some(size)) => (0..3).map(|a| size[a] / to[a]).product(),
        _ => voxels.map_or(read, count),
    };
    let known = Known::Header {
        voxels: worked_on,
        volume_mm3: size_mm.map(|size| size.iter().product()),
    };
    let (mut model_bytes, mut time_s) = (0.0f64, Some(0.0));
    for params in recipe
        .solves()
        .iter()
        .flat_map(|solve| steps(recipe, solve))
    {
        for job in jobs(&recipe.lattice, &params) {
            let cost = job.cost(&params, known)?;
            model_bytes = model_bytes.max(cost.bytes[1]);
            time_s = time_s.zip(cost.time_s).map(|(a, b)| a + b);
        }
    }
    Ok(Estimate {
        voxels: extent.map(|e| e.voxels),
        memory_mib: mib(BASE + (read.max(worked_on) * reading_bytes(recipe)).max(model_bytes)),
        time_s,
        no_bone: false,
    })
}

/// The solves of one load: the most that an error target may take, or the one that the recipe says.
fn steps(recipe: &Recipe, solve: &SolveParams) -> Vec<SolveParams> {
    match recipe.error {
        Some(target) => ladder::expected(target, solve),
        None => vec![solve.clone()],
    }
}

fn count(n: [usize; 3]) -> f64 {
    n.iter().map(|&v| v as f64).product()
}

fn reading_bytes(recipe: &Recipe) -> f64 {
    match recipe.segment.align.is_some() || recipe.segment.morphometry {
        true => BYTES_PER_TURNED_VOXEL,
        false => BYTES_PER_VOXEL,
    }
}

/// Needs of a scan whose bone is known: the most that one of its solves takes, and reading the scan before.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn of_specimen(specimen: &Specimen, first: &Estimate, recipe: &Recipe) -> Result<Estimate> {
    let steps = steps(recipe, &recipe.solve);
    let tissue = Tissue::of(specimen, &recipe.solve)?;
    let prepared = Prepared {
        specimen,
        tissue: &tissue,
    };
    let kept = kept_bytes(specimen, &recipe.solve);
    let reading = first.voxels.map_or(specimen.bone.grid.len() as f64, count);
    let mut bytes = reading * reading_bytes(recipe);
    let (mut no_bone, mut time_s) = (true, Some(reading * S_PER_VOXEL));
    let loads = recipe.solves().len() as f64;
    for params in &steps {
        let params = &*settled(specimen, params)?;
        for job in jobs(&recipe.lattice, params) {
            let cost = needed(&job, prepared, params)?;
            bytes = bytes.max(kept + cost.bytes[0]);
            no_bone &= cost.bytes[0] == 0.0;
            time_s = time_s.zip(cost.time_s).map(|(a, b)| a + loads * b);
        }
    }
    // A lattice may lose the path that the bone has.
    let no_bone = no_bone && !bone_connects(specimen, &recipe.solve);
    Ok(Estimate {
        memory_mib: mib(BASE + bytes),
        time_s: if no_bone { Some(0.0) } else { time_s },
        no_bone,
        ..*first
    })
}

/// The cost of a solve, its bytes counted unless it takes more than is free in any case.
fn needed(job: &Job, prepared: Prepared, params: &SolveParams) -> Result<Cost> {
    let cost = job.cost(params, Known::Bone(prepared))?;
    let [least, _] = cost.bytes;
    match host::available_mib() {
        Some(free) if mib(least) > free => Ok(Cost {
            bytes: [least; 2],
            ..cost
        }),
        _ => job.counted_cost(prepared, params),
    }
}

/// Bytes of a specimen: its mask, its grey values where the solve needs them, and each voxel's modulus where it follows a law.
fn kept_bytes(specimen: &Specimen, params: &SolveParams) -> f64 {
    let grey = if params.needs_grey() { 4.0 } else { 0.0 };
    let moduli = if params.material.is_some() { 4.0 } else { 0.0 };
    specimen.bone.grid.len() as f64 * (1.0 + grey + moduli)
}

/// Refuses a lattice, to be built but not solved, that this machine has no memory for.
///
/// # Errors
/// A lattice that needs more than is free.
#[doc(hidden)]
pub fn refuse_lattice_that_does_not_fit(
    job: &Job,
    prepared: Prepared,
    params: &SolveParams,
) -> Result<()> {
    let cost = job.cost(params, Known::Bone(prepared))?;
    let free = host::available_mib();
    refuse("lattice", cost.bytes[0] * BUILT, cost.resolution, free)
}

/// The memory that is free, which a solve may take.
pub struct FreeMemory {
    /// None where the system does not say.
    mib: Option<f64>,
}

impl FreeMemory {
    /// What is free now.
    pub fn now() -> Self {
        FreeMemory {
            mib: host::available_mib(),
        }
    }
}

impl Memory for FreeMemory {
    fn surely_holds(&self, bytes: f64) -> bool {
        self.mib.is_none_or(|free| mib(bytes) < 0.5 * free)
    }

    fn refuse(&self, cost: &Cost) -> Result<()> {
        refuse("solve", cost.bytes[0], cost.resolution, self.mib)
    }
}

/// MiB that the program takes while it solves this.
///
/// # Errors
/// Settings that do not fit the specimen, a solve that needs more than is free.
#[doc(hidden)]
pub fn of_solve_mib(job: &Job, prepared: Prepared, params: &SolveParams) -> Result<f64> {
    let cost = needed(job, prepared, params)?;
    let [bytes, _] = cost.bytes;
    FreeMemory::now().refuse(&cost)?;
    Ok(mib(BASE + kept_bytes(prepared.specimen, params) + bytes))
}

fn refuse(what: &str, bytes: f64, resolution: Resolution, free_mib: Option<f64>) -> Result<()> {
    let needed = mib(bytes);
    match free_mib {
        Some(free) if needed >= free => Err(Error::specimen(
            format!("this {what} needs about {needed:.0} MiB, {free:.0} MiB are free"),
            format!("crop the scan, or {}", coarser(resolution, needed / free)),
        )),
        _ => Ok(()),
    }
}

/// The resolution for a solve that takes `factor` times the memory there is.
fn coarser(resolution: Resolution, factor: f64) -> String {
    let by = (1.1 * factor).cbrt();
    match resolution {
        Resolution::LatticeParameter(lp_mm) => {
            // To two digits, upwards: what is advised must fit.
            let digit = 10f64.powi((lp_mm * by).log10().floor() as i32 - 1);
            let fits = (lp_mm * by / digit).ceil() * digit;
            let places = (-digit.log10().round()).max(0.0) as usize;
            format!("take a lattice parameter of {fits:.places$} mm or more")
        }
        Resolution::Refine(refine) => {
            format!("--refine {:.0}", (refine as f64 / by).floor().max(1.0))
        }
        Resolution::Element(size_mm) if size_mm > 0.0 => {
            format!("take elements of {:.3} mm: --element-mm", size_mm * by)
        }
        Resolution::Element(_) => "take larger elements: --element-mm".into(),
        Resolution::Coarsen(coarsen) => format!(
            "--coarsen {} (the modulus will be less exact), or use lattices",
            (coarsen as f64 * by).ceil()
        ),
    }
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
