//! `solve`: the apparent modulus.

use super::settings::{LatticeSettings, TissueSettings};
use super::{print_json, words};
use bonepd_ct::command::{Outcome, run_settings};
use bonepd_ct::error::{Error, Result};
use bonepd_ct::export::tetrahedra::Kind;
use bonepd_ct::grid::Axis;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::apparent::fields::Field;
use bonepd_ct::pipeline::apparent::{CoarsenBy, Conditions, Ends, Load, Method, SolveParams};
use clap::Args;
use std::path::{Path, PathBuf};

/// Compress a segmented scan and compute its apparent modulus E_app
///
/// Solves every lattice asked for here or by `lattice` before, and writes DIR/results.csv (one row per solve) and
/// DIR/results.json (the same with provenance) after each.
#[derive(Args)]
pub struct SolveArgs {
    /// Folder of a segmented scan
    dir: PathBuf,
    #[command(flatten)]
    settings: SolveSettings,
    #[command(flatten)]
    lattice: LatticeSettings,
    /// Choose the resolution so that the stated error (solver, elements, shape) stays below this, as 3% or
    /// 0.03; exit 1 where it cannot be met
    #[arg(long, help_heading = "Solve", value_name = "ERROR", value_parser = words::fraction, conflicts_with_all = ["method", "refine", "refine_mask", "coarsen", "element_mm", "lp", "boundary", "structure"])]
    error: Option<f64>,
    /// Also write the model for another program: inp (voxel-fe, geometry-fe: CalculiX, Abaqus), stl (geometry-fe: the
    /// surface), vtu (geometry-fe: the mesh, for ParaView)
    #[arg(long, value_name = "FORMAT", value_parser = ["inp", "stl", "vtu"])]
    export: Option<String>,
    /// Of an exported model: different moduli at most; more are rounded to the means of as many bins
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    bins: u16,
}

#[derive(Args)]
#[command(next_help_heading = "Solve")]
pub struct SolveSettings {
    /// lattice (the lattice element method), voxel-fe (one hexahedron per bone voxel), or geometry-fe (tetrahedra of ten
    /// nodes inside the smooth surface of the bone) [default: lattice]
    #[arg(long, value_parser = words::choice::<Method>(Method::WORDS))]
    method: Option<Method>,
    #[command(flatten)]
    tissue: TissueSettings,
    /// Poisson's ratio of the bone tissue, below 0.5; from 0.4 to 0.49 voxel elements pass from full integration to mean
    /// dilatation [default: 0.3]
    #[arg(long, value_name = "NU", value_parser = words::number, allow_negative_numbers = true)]
    poisson: Option<f64>,
    /// Nominal strain, as -1% or -0.01; negative is compression [default: -0.01]
    #[arg(long, value_name = "S", value_parser = words::strain, allow_hyphen_values = true)]
    strain: Option<f64>,
    /// Thickness of each grip in mm; 0 grips the end planes [default: 0]
    #[arg(long, value_name = "MM", value_parser = words::number)]
    grip_mm: Option<f64>,
    /// uniaxial, confined (sides held), or stiffness (voxel-fe: all six unit strains, to DIR/stiffness.json) [default: uniaxial]
    #[arg(long, value_parser = words::choice::<Load>(&["uniaxial", "confined", "stiffness"]))]
    load: Option<Load>,
    /// free: the loaded ends slide sideways (no friction); bonded: they are held sideways [default: free]
    #[arg(long, value_parser = words::choice::<Ends>(&["free", "bonded"]))]
    ends: Option<Ends>,
    /// --load stiffness: what the unit strains do on the faces: kinematic (an upper bound), or mixed
    /// (periodicity-compatible, Pahr & Zysset 2008) [default: kinematic]
    #[arg(long, value_parser = words::choice::<Conditions>(&["kinematic", "mixed"]))]
    conditions: Option<Conditions>,
    /// Load axis [default: z]
    #[arg(long, value_parser = words::choice::<Axis>(&["x", "y", "z"]))]
    axis: Option<Axis>,
    /// Algebraic error allowed in the modulus, as 0.1% or 0.001 [default: 0.1%]
    #[arg(long, value_name = "ERROR", value_parser = words::fraction)]
    tolerance: Option<f64>,
    /// voxel-fe: N³ elements a voxel. Grey values are interpolated and thresholded again; the voxels of a mask are split
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "coarsen")]
    refine: Option<u16>,
    /// voxel-fe: split each voxel of the mask into N³ elements, also of a grey scan: converges to the voxel staircase
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), conflicts_with_all = ["coarsen", "refine"])]
    refine_mask: Option<u16>,
    /// voxel-fe: one element per N³ voxels
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    coarsen: Option<u16>,
    /// geometry-fe: edge of the cells that elements are made in [default: from the thickness of the struts]
    #[arg(long, value_name = "MM", value_parser = words::positive)]
    element_mm: Option<f64>,
    /// What becomes of N³ voxels: threshold (bone where at least half of them is), or fraction (the modulus times the bone
    /// fraction) [default: threshold]
    #[arg(long, value_name = "RULE", value_parser = words::choice::<CoarsenBy>(&["threshold", "fraction"]), requires = "coarsen")]
    coarsen_by: Option<CoarsenBy>,
    /// Count zero-energy modes (direct factorisation; small models only)
    #[arg(long)]
    mechanisms: bool,
    /// Fields to write, comma-separated: displacement (mm), sed (strain energy density, MPa), von-mises (MPa, voxel-fe only),
    /// fraction (bone in an element, weight of a site). Of voxel-fe as NIfTI on the scan's grid and fields.vti for ParaView,
    /// of a lattice as fields-LATTICE.vtk, by site [default: none]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = words::choice::<Field>(&["displacement", "sed", "von-mises", "fraction"]))]
    fields: Vec<Field>,
    /// voxel-fe: find the failure load, where 2 % of the bone exceed an effective strain of 0.007 (Pistoia et al. 2002)
    #[arg(long)]
    failure: bool,
    /// Share of the bone in that criterion, as 2% or 0.02
    #[arg(long, value_name = "SHARE", value_parser = words::fraction, requires = "failure")]
    critical_volume: Option<f64>,
    /// Effective strain in that criterion
    #[arg(long, value_name = "STRAIN", value_parser = words::positive, requires = "failure")]
    critical_strain: Option<f64>,
}

impl SolveSettings {
    /// What was said here wins over `params`.
    pub fn apply(&self, params: &mut SolveParams) -> Result<()> {
        params.method = self.method.unwrap_or(params.method);
        self.tissue.apply(params)?;
        params.poisson = self.poisson.unwrap_or(params.poisson);
        params.strain = self.strain.unwrap_or(params.strain);
        params.grip_mm = self.grip_mm.unwrap_or(params.grip_mm);
        params.load = self.load.unwrap_or(params.load);
        params.ends = self.ends.unwrap_or(params.ends);
        params.conditions = self.conditions.unwrap_or(params.conditions);
        params.axis = self.axis.unwrap_or(params.axis);
        params.tolerance = self.tolerance.unwrap_or(params.tolerance);
        let refine = self.refine.or(self.refine_mask);
        params.refine = refine.map_or(params.refine, usize::from);
        params.refine_mask = match refine {
            Some(_) => self.refine_mask.is_some(),
            None => params.refine_mask,
        };
        params.coarsen_by = self.coarsen_by.unwrap_or(params.coarsen_by);
        params.coarsen = self.coarsen.map_or(params.coarsen, usize::from);
        params.element_mm = self.element_mm.or(params.element_mm);
        params.mechanisms |= self.mechanisms;
        if !self.fields.is_empty() {
            params.fields.clone_from(&self.fields);
        }
        if self.failure {
            let criterion = params.pistoia.get_or_insert_default();
            criterion.critical_volume = self.critical_volume.unwrap_or(criterion.critical_volume);
            criterion.critical_strain = self.critical_strain.unwrap_or(criterion.critical_strain);
        }
        params.check()
    }
}

pub fn run(args: &SolveArgs, session: &Session, json: bool) -> Result<Outcome> {
    let mut params = start(args, session);
    args.settings.apply(&mut params)?;
    let mut lattice = bonepd_ct::command::lattice::settings(&args.dir)?;
    args.lattice.apply(&mut lattice)?;
    if let Some(format) = &args.export {
        export(&args.dir, format, &params, args.bins.into(), session)?;
    }
    let (rows, met) = match args.error {
        Some(target) => {
            let found =
                bonepd_ct::command::adaptive::solve_to(&args.dir, target, &params, session)?;
            (found.rows, found.met)
        }
        None => {
            let rows = bonepd_ct::command::solve::solve(&args.dir, &lattice, &params, session)?;
            (rows, true)
        }
    };
    if !session.dry_run {
        bonepd_ct::command::answer::keep(&args.dir, &rows, args.error)?;
    }
    if json {
        print_json(&rows);
    }
    Ok(
        match !met || rows.iter().any(|row| row.converged() == Some(false)) {
            true => Outcome::NotConverged,
            false => Outcome::Done,
        },
    )
}

fn export(
    dir: &Path,
    format: &str,
    params: &SolveParams,
    bins: usize,
    session: &Session,
) -> Result<()> {
    use bonepd_ct::command::solve::{export_inp, export_smooth};
    let smooth = params.method == Method::GeometryFe;
    match format {
        "inp" if !smooth => export_inp(dir, params, bins, session),
        "inp" => export_smooth(dir, Kind::Inp, params, bins, session),
        _ if !smooth => Err(Error::setting(
            format!("--export {format}"),
            "only smooth elements have such a file",
            "add --method geometry-fe",
        )),
        "stl" => export_smooth(dir, Kind::Stl, params, bins, session),
        _ => export_smooth(dir, Kind::Vtu, params, bins, session),
    }
}

/// The settings that options are laid over: those of the run that the folder belongs to, else the defaults.
fn start(args: &SolveArgs, session: &Session) -> SolveParams {
    let Some((path, params)) = run_settings::of_run(&args.dir) else {
        return SolveParams::default();
    };
    session.say(format!(
        "note: settings of the run ({}) are taken, options here win: {}",
        path.display(),
        run_settings::in_words(&params)
    ));
    params
}
