//! `solve`: the apparent modulus.

use super::settings::overrides::lay_over;
use super::settings::{LatticeSettings, TissueSettings};
use super::{print_json, words};
use crate::cli::words::law;
use bonepd_ct::command::in_words::answer_in_words;
use bonepd_ct::command::{Outcome, answer, run_settings};
use bonepd_ct::error::{Error, Result};
use bonepd_ct::export::tetrahedra::Kind;
use bonepd_ct::grid::Axis;
use bonepd_ct::machine::session::Session;
use bonepd_ct::physics::plasticity::Plasticity;
use bonepd_ct::pipeline::apparent::checks::needs_modulus;
use bonepd_ct::pipeline::apparent::fields::Field;
use bonepd_ct::pipeline::apparent::{
    CoarsenBy, Conditions, Ends, HeldLabel, Load, LoadSteps, Method, MovedLabel, PushedLabel, Sed,
    SolveParams, SurfaceOf,
};
use bonepd_ct::result::answer::AnswerLine;
use bonepd_ct::result::row::Row;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Compress a segmented scan and compute its apparent modulus E_app
///
/// Solves every lattice that is asked for here, or was by `lattice`, and writes DIR/results.csv (one row per solve) and
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
    /// 0.03; exit 1 where it cannot be met. With --plasticity the error of the strength (load steps, elements,
    /// solver)
    #[arg(long, help_heading = "Solve", value_name = "ERROR", value_parser = words::fraction, conflicts_with_all = ["method", "refine", "refine_mask", "coarsen", "element_mm", "surface", "lp_mm", "boundary", "structure"])]
    error: Option<f64>,
    /// Also write the model for another program: inp (voxel-fe, geometry-fe: CalculiX, Abaqus), stl (geometry-fe: the
    /// surface), vtu (geometry-fe: the mesh, for ParaView)
    #[arg(long, value_name = "FORMAT", value_parser = ["inp", "stl", "vtu"])]
    export: Option<String>,
    /// Maximum number of different moduli in an exported model; more are rounded to the means of as many bins
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    bins: u16,
}

/// The fields are the keys of `[solve]`, but for those that are skipped.
#[derive(Args, Serialize)]
#[command(next_help_heading = "Solve")]
pub struct SolveSettings {
    /// lattice (the lattice element method), voxel-fe (one hexahedron per bone voxel), or geometry-fe (tetrahedra of ten
    /// nodes inside the smooth surface of the bone) [default: lattice]
    #[arg(long, value_parser = words::choice::<Method>(Method::WORDS))]
    method: Option<Method>,
    #[command(flatten)]
    #[serde(skip)]
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
    /// voxel-fe: grip the bone that is seen from each end plane, down to this depth, in place of the end planes: uneven ends
    /// between platens [default: 0]
    #[arg(long = "ends-depth", value_name = "MM", value_parser = words::number)]
    ends_depth_mm: Option<f64>,
    /// uniaxial; confined (sides held); stiffness (voxel-fe: all six unit strains, to DIR/stiffness.json); shear-x, -y, -z (the
    /// upper end moves that way by strain times height); bending-x, -y, -z (both ends tilt about that axis by half of
    /// --angle-deg, in opposite directions); torsion (the upper end turns about the long axis by --angle-deg). Shear, bending and
    /// torsion hold both ends in all components, about the middle of the grid. labels: what --held, --moved and --pushed say, which
    /// imply it [default: uniaxial]
    #[arg(long, value_parser = words::choice::<Load>(Load::WORDS), hide_possible_values = true)]
    load: Option<Load>,
    /// voxel-fe: hold the nodes of this label's voxels, in the components named or in all (repeat it for further labels). Labels are the
    /// scan's own (segment --labels) or those of --supports
    #[arg(long, value_name = "LABEL[:xyz]", value_parser = HeldLabel::from_str, conflicts_with_all = ["strain", "ends", "grip_mm", "angle_deg", "conditions"])]
    held: Vec<HeldLabel>,
    /// voxel-fe: displace the nodes of this label by so many mm along x, y, z; - leaves a component free
    #[arg(long, value_name = "LABEL:UX,UY,UZ", value_parser = MovedLabel::from_str, conflicts_with_all = ["strain", "ends", "grip_mm", "angle_deg", "conditions"])]
    moved: Vec<MovedLabel>,
    /// voxel-fe: a total force in N along x, y, z, spread evenly over the nodes of this label. Writes, as --held and --moved do,
    /// DIR/labels.csv: forces, moments, displacements and work of each label
    #[arg(long, value_name = "LABEL:FX,FY,FZ", value_parser = PushedLabel::from_str, conflicts_with_all = ["strain", "ends", "grip_mm", "angle_deg", "conditions"])]
    pushed: Vec<PushedLabel>,
    /// Label image of --held, --moved and --pushed, on the scan's grid (before crop, turn, resampling and alignment, which it follows) or
    /// on the mask's [default: the scan's own labels]
    #[arg(long, value_name = "FILE")]
    supports: Option<PathBuf>,
    /// Bending and torsion: degrees by which the ends turn against each other [default: 1]
    #[arg(long, value_name = "A", value_parser = words::number, allow_negative_numbers = true)]
    angle_deg: Option<f64>,
    /// Uniaxial and confined loads: free, the loaded ends slide sideways (no friction), or bonded, they are held sideways
    /// [default: free]
    #[arg(long, value_parser = words::choice::<Ends>(&["free", "bonded"]))]
    ends: Option<Ends>,
    /// --load stiffness: what the unit strains do on the faces: kinematic (an upper bound), mixed (periodicity-compatible,
    /// Pahr & Zysset 2008), or symshear (rollers, and shears on two pairs of faces: direct mechanics of Faim)
    /// [default: kinematic]
    #[arg(long, value_parser = words::choice::<Conditions>(Conditions::WORDS))]
    conditions: Option<Conditions>,
    /// Long axis, from end to end [default: z]
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
    #[serde(skip)]
    refine_mask: Option<u16>,
    /// voxel-fe: one element per N³ voxels
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    coarsen: Option<u16>,
    /// geometry-fe: edge of the cells that elements are made in [default: from the thickness of the struts]
    #[arg(long, value_name = "MM", value_parser = words::positive)]
    element_mm: Option<f64>,
    /// geometry-fe: the surface of the image, or that of the body: the image's corrected for its blur, which thins struts and fills
    /// joints [default: body where segment was given --blur-voxels, else image]
    #[arg(long, value_name = "OF", value_parser = words::choice::<SurfaceOf>(&["image", "body"]))]
    surface: Option<SurfaceOf>,
    /// What becomes of N³ voxels: threshold (bone where at least half of them is), or fraction (the modulus times the bone
    /// fraction; less than 2 % bone is left out) [default: threshold]
    #[arg(long, value_name = "RULE", value_parser = words::choice::<CoarsenBy>(&["threshold", "fraction"]), requires = "coarsen")]
    coarsen_by: Option<CoarsenBy>,
    /// Count zero-energy modes (direct factorisation; small models only)
    #[arg(long)]
    mechanisms: bool,
    /// Fields to write, comma-separated: displacement (mm), sed (strain energy density, MPa), fraction (bone in an element, weight
    /// of a site), nodal-force (N); of voxel-fe also von-mises (MPa), effective-strain, strain and stress (xx, yy, zz, yz, xz,
    /// xy; engineering shears), principal-strain and principal-stress (values and directions),
    /// with --plasticity plastic-strain; of geometry-fe displacement, sed, von-mises, effective-strain, strain and stress. Of voxel-fe
    /// as NIfTI on the scan's grid, fields.vti for ParaView and pictures, of a lattice as fields-LATTICE.vtk, by site, of geometry-fe as
    /// fields-geometry-fe.vtu [default: none]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = words::choice::<Field>(Field::WORDS), hide_possible_values = true)]
    fields: Vec<Field>,
    /// voxel-fe, geometry-fe: the strain energy density of elements, of which effective strains and the failure load follow: centre (of the
    /// strain at the element's centre, as Faim and ParOSol), or mean (energy over volume) [default: centre]
    #[arg(long, value_name = "WHERE", value_parser = words::choice::<Sed>(Sed::WORDS))]
    sed: Option<Sed>,
    /// voxel-fe: how strains and stresses are distributed over each label's tissue (DIR/tissue.csv), and what each carries at
    /// both ends and in the middle (DIR/sections.csv)
    #[arg(long)]
    statistics: bool,
    /// voxel-fe: find the failure load, where 2 % of the bone exceed an effective strain of 0.007 (Pistoia et al. 2002); the failure
    /// loads at 1 to 7 % go to DIR/failure.csv
    #[arg(long)]
    #[serde(skip)]
    failure: bool,
    /// Share of the bone in that criterion, as 2% or 0.02
    #[arg(long, value_name = "SHARE", value_parser = words::fraction, requires = "failure")]
    #[serde(skip)]
    critical_volume: Option<f64>,
    /// Effective strain in that criterion
    #[arg(long, value_name = "STRAIN", value_parser = words::fraction, requires = "failure")]
    #[serde(skip)]
    critical_strain: Option<f64>,
    /// voxel-fe: tissue that yields: von-mises:YIELD[,HARDENING], or asymmetric:TENSION,COMPRESSION[,HARDENING] (Drucker-Prager
    /// through both yield stresses), MPa; without HARDENING it is perfectly plastic. Per label as
    /// labels:100=von-mises:68,127=asymmetric:50,75. Writes DIR/curve.csv
    #[arg(long, value_name = "LAW", value_parser = law::plasticity)]
    plasticity: Option<Plasticity>,
    /// Load steps with --plasticity: so many even ones, or adaptive ones, whose lengths follow the curve (adaptive/2: half as
    /// long); a step that fails is halved [default: adaptive]
    #[arg(long, value_name = "N", value_parser = LoadSteps::parse, requires = "plasticity")]
    steps: Option<LoadSteps>,
    /// Only the bone of these labels counts in that criterion, comma-separated
    #[arg(
        long,
        value_name = "LABELS",
        value_delimiter = ',',
        requires = "failure"
    )]
    failure_labels: Vec<i32>,
}

impl SolveSettings {
    /// Whether a load is given.
    pub fn names_load(&self) -> bool {
        self.load.is_some()
    }

    /// Options that were given override `params`. `by_error`: an error target chooses the voxel elements.
    ///
    /// # Errors
    /// Settings that do not fit each other, or the error target.
    pub fn apply(&self, params: &mut SolveParams, by_error: bool) -> Result<()> {
        if by_error {
            self.refuse_resolution()?;
            if params.element_mm.is_none() && params.surface.is_none() {
                params.method = Method::VoxelFe;
            }
        }
        self.replace_supports(params);
        lay_over(params, self)?;
        self.tissue.apply(params)?;
        if let Some(n) = self.refine_mask {
            params.refine = n.into();
        }
        if self.refine.or(self.refine_mask).is_some() {
            params.refine_mask = self.refine_mask.is_some();
        }
        if self.failure {
            let criterion = params.pistoia.get_or_insert_default();
            criterion.critical_volume = self.critical_volume.unwrap_or(criterion.critical_volume);
            criterion.critical_strain = self.critical_strain.unwrap_or(criterion.critical_strain);
        }
        params.check()
    }

    /// Supports and loads that options name replace those that were there, be they on labels or of ends.
    fn replace_supports(&self, params: &mut SolveParams) {
        let by_label = !(self.held.is_empty() && self.moved.is_empty() && self.pushed.is_empty());
        if by_label || self.load.is_some_and(|load| load != Load::Labels) {
            params.held.clear();
            params.moved.clear();
            params.pushed.clear();
            params.supports = None;
        }
        if by_label {
            params.load = Load::Labels;
            (params.ends, params.grip_mm, params.ends_depth_mm) = (Ends::Free, 0.0, 0.0);
        }
    }

    /// # Errors
    /// A method or resolution where the error target of a recipe chooses both.
    fn refuse_resolution(&self) -> Result<()> {
        let given = [
            ("--method", self.method.is_some()),
            ("--refine", self.refine.is_some()),
            ("--refine-mask", self.refine_mask.is_some()),
            ("--coarsen", self.coarsen.is_some()),
            ("--element-mm", self.element_mm.is_some()),
            ("--surface", self.surface.is_some()),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((flag, _)) => Err(Error::setting(
                *flag,
                "the recipe's error target chooses method and element size",
                format!("leave {flag} out, or take a recipe without `error` (paper, quick)"),
            )),
        }
    }
}

pub fn run(args: &SolveArgs, session: &Session, json: bool) -> Result<Outcome> {
    let mut params = start(args, session);
    args.settings.apply(&mut params, args.error.is_some())?;
    bonepd_ct::command::solve::supports::lay(&args.dir, &mut params)?;
    let mut lattice = bonepd_ct::command::lattice::settings(&args.dir)?;
    args.lattice.apply(&mut lattice)?;
    if let Some(format) = &args.export {
        export(&args.dir, format, &params, args.bins.into(), session)?;
    }
    let (rows, met) = match args.error {
        Some(target) => {
            if params.plasticity.is_none() {
                needs_modulus(params.load, "error")?;
            }
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
        let kept = answer::keep(&args.dir, &rows, args.error)?;
        kept.iter()
            .for_each(|answer| say_where_another_answers(answer, &rows, session));
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

/// Says so where a row of an earlier solve stays the answer of the scan.
fn say_where_another_answers(answer: &AnswerLine, rows: &[Row], session: &Session) {
    let is_own =
        |row: &Row| row.e_app_mpa() == answer.e_app_mpa && row.key.lp_mm == answer.element_mm;
    if answer.e_app_mpa.is_some() && !rows.iter().any(is_own) {
        session.result(format!(
            "the answer of {} stays that of an earlier solve: {}",
            answer.scan,
            answer_in_words(answer)
        ));
    }
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
    let (path, params) = match run_settings::of_run(&args.dir) {
        Ok(Some(of_run)) => of_run,
        Ok(None) => return SolveParams::default(),
        Err(e) => {
            session.warn(format!(
                "load, ends and tissue are not taken from the run that made this folder: {e}"
            ));
            return SolveParams::default();
        }
    };
    session.say(format!(
        "note: load, ends and tissue are those of the run ({}), where no option here sets them: {}. Method and resolution are not the run's",
        path.display(),
        run_settings::in_words(&params)
    ));
    params
}
