//! Owns `solve` on disk: every lattice of a segmented scan, `results.csv` and `results.json` written after each; and the same in memory.

pub mod in_vivo;
mod kept_steps;
pub mod supports;

#[doc(hidden)]
pub use crate::command::fields::Fields;
use crate::command::in_words::{in_words, sections_in_words};
use crate::command::lattice::binned;
use crate::command::{estimate, stiffness};
use crate::error::Result;
use crate::export::inp;
use crate::export::tetrahedra::{self, Kind};
use crate::format::orient::Turn;
use crate::io::atomic;
use crate::machine::meter::Meter;
use crate::machine::session::Session;
use crate::mask::ends;
use crate::measure::morphometry::Morphometry;
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::discretisation::yielded::Kept;
use crate::pipeline::apparent::fields::Recorded;
use crate::pipeline::apparent::job::{Job, JobResult};
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{Load, Method, SolveParams, jobs, of_voxels, settled};
use crate::pipeline::lattice::LatticeParams;
use crate::record::details;
use crate::record::results::{self, Results};
use crate::record::specimen::{self, SegmentedScan};
use crate::record::stiffness::StiffnessRecord;
use crate::result::cautions;
use crate::result::derived::with_derived;
use crate::result::details::Details;
use crate::result::notes;
use crate::result::row::{FailureLoad, Marks, Row};
use crate::result::settings::{BoundaryRule, Motion, Settings};
use crate::result::shape;
use crate::result::shape::Image;
use crate::result::voxel_check;
use crate::solver::cg::CgStep;
use crate::volume::{Specimen, Volume};
use in_vivo::UnitField;
use indicatif::ProgressBar;
use kept_steps::{KeptSteps, StepsInMemory};
use std::path::{Path, PathBuf};

/// A segmented scan opened for solves: its mask is read, hashed and measured once for all of them.
pub struct OpenScan {
    /// None: the scan is in memory alone.
    dir: Option<PathBuf>,
    specimen: Specimen,
    tissue: Tissue,
    results: Results,
    /// Quick estimate, 2 BV / BS.
    plate_thickness_mm: Option<f64>,
    /// As `segment` measured them.
    strut_thickness_mm: Option<f64>,
    morphometry: Option<Morphometry>,
    /// From the order of the files of voxels to x, y, z of the results.
    axes: Turn,
    image: Image,
    in_memory: InMemory,
    /// Energy densities of the loads solved since they were asked for, which are not written then.
    unit_fields: Option<Vec<UnitField>>,
    /// Of solves that differ in their loads: the job of the one before, with its model.
    family: Option<Option<Job>>,
}

/// What solves of a scan in memory leave in addition to their rows, in the order of the solves.
#[derive(Default)]
pub struct InMemory {
    /// With the row's settings each.
    #[doc(hidden)]
    pub fields: Vec<(Settings, Fields)>,
    /// The last apparent stiffness.
    #[doc(hidden)]
    pub stiffness: Option<StiffnessRecord>,
}

/// Plane ends that touch less of the area that bone covers are uneven, or lie next to the bone.
const LEAST_TOUCHED: f64 = 0.05;

/// A row with its fields, and whether it was kept from an earlier solve.
struct Made {
    row: Row,
    /// None for a row that was kept: those it had.
    details: Option<Details>,
    fields: Fields,
    is_kept: bool,
}

/// Solves every structure × lattice parameter × boundary for the specimen in `dir`. Rows already there for the same
/// mask and settings are kept unless the session forces.
///
/// # Errors
/// A folder that is not a segmented scan, settings that do not fit it, an unwritable folder. Not converging is no error:
/// the row says so.
pub fn solve(
    dir: &Path,
    lattices: &LatticeParams,
    params: &SolveParams,
    session: &Session,
) -> Result<Vec<Row>> {
    let redo = session.force;
    OpenScan::open(dir, params, redo, session)?.solve(lattices, params, session)
}

impl OpenScan {
    /// Opens the scan in `dir` for solves of the tissue that `params` describe; `redo` leaves its results out.
    ///
    /// # Errors
    /// A folder that is not a segmented scan, a material that does not fit it.
    pub fn open(dir: &Path, params: &SolveParams, redo: bool, session: &Session) -> Result<Self> {
        if !session.dry_run {
            atomic::sweep(dir);
        }
        results::keep_other_version(dir, session);
        let mut scan = loaded(dir, params)?;
        let record = std::mem::take(&mut scan.record_json);
        let results = Results::open(dir, &scan.mask_blake3, record, redo);
        Self::of(scan, params, results, Some(dir))
    }

    /// Opens a scan that was segmented in memory; its solves write nothing.
    ///
    /// # Errors
    /// A material that does not fit the scan.
    #[doc(hidden)]
    pub fn in_memory(mut scan: SegmentedScan, params: &SolveParams) -> Result<Self> {
        if !params.needs_grey() {
            (scan.specimen.grey, scan.specimen.threshold) = (None, None);
        }
        let record = std::mem::take(&mut scan.record_json);
        let results = Results::in_memory(&scan.mask_blake3, record);
        Self::of(scan, params, results, None)
    }

    fn of(
        scan: SegmentedScan,
        params: &SolveParams,
        results: Results,
        dir: Option<&Path>,
    ) -> Result<Self> {
        let image = scan.image();
        let (specimen, measured) = (scan.specimen, scan.record.results);
        Ok(OpenScan {
            tissue: Tissue::of(&specimen, params)?,
            results,
            plate_thickness_mm: plate_thickness_mm(&specimen.bone),
            strut_thickness_mm: measured.mean_thickness_mm,
            morphometry: measured.morphometry,
            dir: dir.map(Path::to_path_buf),
            axes: scan.record.input.axes,
            image,
            specimen,
            in_memory: InMemory::default(),
            unit_fields: None,
            family: None,
        })
    }

    /// Whether elements and multigrid are kept from solve to solve, where the next has other loads on the same elements.
    pub(crate) fn keep_models(&mut self, keep: bool) {
        self.family = keep.then_some(None);
    }

    /// The solves that the settings name. Elements are kept in a family of loads; lattices, of which there are several, are not.
    fn jobs(&mut self, lattices: &LatticeParams, params: &SolveParams) -> Vec<Job> {
        match &mut self.family {
            Some(before) if params.method == Method::VoxelFe => {
                vec![before.take().unwrap_or_else(|| of_voxels().of_a_family())]
            }
            _ => jobs(lattices, params),
        }
    }

    /// Keeps the energy densities of the solves to come in memory, in place of files.
    pub(crate) fn keep_unit_fields(&mut self) {
        self.unit_fields = Some(Vec::new());
    }

    /// What the solves of a scan in memory left so far; it is taken out.
    pub fn take_in_memory(&mut self) -> InMemory {
        std::mem::take(&mut self.in_memory)
    }

    /// The mask, with the grey values where the settings need them.
    pub fn specimen(&self) -> &Specimen {
        &self.specimen
    }

    /// The specimen with its tissue.
    #[doc(hidden)]
    pub fn prepared(&self) -> Prepared<'_> {
        Prepared {
            specimen: &self.specimen,
            tissue: &self.tissue,
        }
    }

    /// The scan's folder; None where it is in memory alone.
    pub fn dir(&self) -> Option<&Path> {
        self.dir.as_deref()
    }

    /// What the scan says of the surface within a voxel.
    pub fn image(&self) -> Image {
        self.image
    }

    /// `S` of [`shape`] for elements whose energy density at the surface has this `ratio` to the mean. A block of bone without a surface leaves
    /// nothing open.
    pub fn surface(&self, ratio: Option<f64>) -> f64 {
        let voxel_mm = self.specimen.bone.grid.voxel_mm3().cbrt();
        self.plate_thickness_mm
            .map_or(0.0, |t| shape::surface(ratio, t / voxel_mm))
    }

    /// The mask.
    pub fn bone(&self) -> &Volume<u8> {
        &self.specimen.bone
    }

    /// `2 BV / BS` of the mask, in mm; None where the bone has no surface.
    pub fn plate_thickness_mm(&self) -> Option<f64> {
        self.plate_thickness_mm
    }

    /// The rows in the folder, old and new.
    #[doc(hidden)]
    pub fn results(&mut self) -> &mut Results {
        &mut self.results
    }

    /// All rows of the settings, those that follow from others among them. The tissue must be that of the opening.
    ///
    /// # Errors
    /// As [`solve`].
    pub fn solve(
        &mut self,
        lattices: &LatticeParams,
        params: &SolveParams,
        session: &Session,
    ) -> Result<Vec<Row>> {
        lattices.check()?;
        params.check()?;
        let params = &*settled(&self.specimen, params)?;
        let jobs: Vec<(Job, Row)> = self
            .jobs(lattices, params)
            .into_iter()
            .map(|job| {
                let row = self.blank(&job, params);
                (job, row)
            })
            .collect();
        let of_lattices = jobs.iter().any(|(_, blank)| blank.key.boundary.is_some());
        if let Some(note) = lattices.note().filter(|_| of_lattices) {
            session.say(note);
        }
        self.warn_of_coarse(jobs.iter().map(|(_, blank)| blank), session);
        let height_mm = self.specimen.length_mm(params.axis);
        if let Some((_, blank)) = jobs.first() {
            warn_of_unusual(&blank.key, height_mm, session);
        }
        let touching = self.barely_touching(params);
        touching.iter().for_each(|words| session.warn(words));
        let mut rows = Vec::new();
        for (job, blank) in &jobs {
            let Some(Made {
                mut row,
                details,
                mut fields,
                is_kept,
            }) = self.row(job, blank, params, session)?
            else {
                continue;
            };
            if let Some(units) = &mut self.unit_fields {
                let taken = fields.take_energy_density().map(|sed_mpa| UnitField {
                    row: row.clone(),
                    sed_mpa,
                });
                units.extend(taken);
            }
            mark(&mut row, self.morphometry.as_ref());
            cautions::mark(&mut row, height_mm);
            if let Some(words) = &touching {
                notes::add(
                    &mut row.marks.note,
                    &format!("{}{words}", cautions::WARNING),
                );
            }
            session.result(format!("{}{}", in_words(&row), said_of_kept(is_kept)));
            if let Some(line) = details.as_ref().and_then(sections_in_words) {
                session.result(line);
            }
            // The row first: fields that cannot be written do not cost it.
            let curve = match &details {
                None => self.results.details(blank, params).curve,
                Some(details) => details.curve.clone(),
            };
            self.results.store(blank, params, &row, details)?;
            match &self.dir {
                None => self.in_memory.fields.push((row.key.clone(), fields)),
                Some(dir) => {
                    if !curve.is_empty() {
                        details::write_curve(dir, &curve)?;
                        kept_steps::forget(dir);
                    }
                    fields.write(dir, &self.specimen, params.axis)?;
                }
            }
            rows.push(row);
        }
        if let Some(before) = &mut self.family
            && params.method == Method::VoxelFe
        {
            *before = jobs.into_iter().next().map(|(job, _)| job);
        }
        let known = self.results.solved();
        let all = with_derived(&rows, &known);
        for row in all.iter().filter(|row| row.key.is_derived()) {
            session.result(in_words(row));
        }
        warn_of_contradictions(&rows, &known, session);
        Ok(all)
    }

    /// A row of settings, before its solve.
    fn blank(&self, job: &Job, params: &SolveParams) -> Row {
        let settings = self.tissue.label(params.key(&self.specimen), params);
        Row {
            key: job.label(&self.specimen, params, settings),
            solved: None,
            marks: Marks {
                mean_thickness_mm: self.plate_thickness_mm,
                ..Marks::default()
            },
        }
    }

    /// The row that was kept, or its solve; None where the session only says what it would do.
    fn row(
        &mut self,
        job: &Job,
        blank: &Row,
        params: &SolveParams,
        session: &Session,
    ) -> Result<Option<Made>> {
        let prepared = Prepared {
            specimen: &self.specimen,
            tissue: &self.tissue,
        };
        // Fields are written over by the next solve: whether those there are these is not known.
        let has_matrix = || {
            let dir = self.dir.as_deref();
            dir.is_some_and(|dir| stiffness::is_current(dir, params, self.results.mask_blake3()))
        };
        let kept = params.fields.is_empty() && (params.load != Load::Stiffness || has_matrix());
        if let Some(row) = self.results.find(blank, params).filter(|_| kept) {
            return Ok(Some(Made {
                row,
                details: None,
                fields: Fields::None,
                is_kept: true,
            }));
        }
        if session.dry_run {
            let mib = estimate::of_solve_mib(job, prepared, params)?;
            session.say(format!(
                "would solve {} {} mm, about {mib:.0} MiB",
                name(&blank.key),
                blank.key.lp_mm
            ));
            return Ok(None);
        }
        self.solve_job(job, blank, params, session).map(Some)
    }

    fn solve_job(
        &mut self,
        job: &Job,
        blank: &Row,
        params: &SolveParams,
        session: &Session,
    ) -> Result<Made> {
        let prepared = Prepared {
            specimen: &self.specimen,
            tissue: &self.tissue,
        };
        let meter = Meter::start(session.shares_process);
        let bar = session.bar(
            1000,
            &format!("{} {} mm", name(&blank.key), blank.key.lp_mm),
        );
        bar.set_message("building the model and its multigrid");
        let loads = if params.load == Load::Stiffness { 6 } else { 1 };
        let of_this = || self.results.fingerprint(blank, params);
        let mut kept: Box<dyn Kept> = match &self.dir {
            Some(dir) => Box::new(KeptSteps::new(dir, of_this(), session)),
            None => Box::new(StepsInMemory(session)),
        };
        let memory = &estimate::FreeMemory::now();
        let solution = job.solve(prepared, params, memory, &mut *kept, &mut |load, step| {
            session.stop.obey();
            show(&bar, [load, loads], step, params.tolerance);
        })?;
        drop(kept);
        bar.finish_and_clear();
        let (row, details, fields) = match solution {
            JobResult::Modulus(solved, mut recorded) => {
                let mut row = with_recorded(solved.row(blank.clone()), &recorded);
                self.state(&mut row, recorded.euler);
                if row.is_disconnected() {
                    row.state_no_errors();
                }
                let stem = format!("{}-{}", name(&blank.key).replace(' ', "-"), blank.key.lp_mm);
                let details = std::mem::take(&mut recorded.details);
                let fields = Fields::of(stem, recorded, self.axes);
                (row, details, fields)
            }
            JobResult::Stiffness(solved) => {
                let mask_blake3 = self.results.mask_blake3();
                let fabric = self.morphometry.as_ref().and_then(|m| m.fabric.as_ref());
                let mil_mm = fabric.map(|fabric| fabric.mil_mm);
                let record =
                    stiffness::record(&solved, &self.specimen, params, mask_blake3, mil_mm);
                let row = stiffness::row(&solved, params, blank);
                match &self.dir {
                    Some(dir) => stiffness::write(dir, &record, session)?,
                    None => self.in_memory.stiffness = Some(record),
                }
                (row, Details::default(), Fields::None)
            }
        };
        Ok(Made {
            row: metered(row, &meter),
            details: Some(details),
            fields,
            is_kept: false,
        })
    }

    /// What one solve by finite elements states of its error against the body; `euler`: numbers of smooth elements and mask.
    fn state(&self, row: &mut Row, euler: Option<[i64; 2]>) {
        let ratio = row.solved.as_ref().and_then(|s| s.surface_energy_ratio);
        let voxel_mm = self.specimen.bone.grid.voxel_mm3().cbrt();
        let size = row.key.lp_mm / voxel_mm;
        if self.has_interfaces(row) {
            shape::state(row, None);
            notes::add(&mut row.marks.note, shape::INTERFACES);
        } else if let Some(elements) = row.key.elements {
            let surface = self.surface(ratio);
            let stated = match euler {
                Some(euler) => Some(shape::of_smooth(self.image, size, surface, euler)),
                None => shape::of_one_solve(self.image, elements, size, surface),
            };
            shape::state(row, stated);
        }
    }

    /// Whether labelled tissues differ by so much that their interfaces matter.
    fn has_interfaces(&self, row: &Row) -> bool {
        let labelled = row
            .key
            .material
            .as_ref()
            .is_some_and(|law| law.starts_with("labels"));
        labelled && self.tissue.contrast(self.specimen.bone.as_slice()) > shape::MOST_CONTRAST
    }

    /// What to say where plane ends touch little of the bone.
    fn barely_touching(&self, params: &SolveParams) -> Option<String> {
        let has_plane_ends = !matches!(params.load.motion(), None | Some(Motion::ByLabel))
            && params.ends_depth_mm == 0.0
            && params.grip_mm == 0.0;
        let touched = has_plane_ends
            .then(|| ends::touched(&self.specimen.bone, params.axis))
            .flatten()?;
        let [lower, upper] = touched.map(|share| format!("{:.1} %", 100.0 * share));
        touched.iter().any(|share| *share < LEAST_TOUCHED).then(|| {
            format!(
                "the end planes touch little bone: {lower} of the area that all bone covers along {} at the lower end, {upper} at the upper. If the ends are uneven, grip what is seen of them (voxel-fe: --ends-depth MM), cut them flat (segment --plane-cut MM), or --crop",
                params.axis.name()
            )
        })
    }

    /// Struts thinner than two lattice parameters are one or two sites thick, which sites of firm and floppy lattices
    /// cannot make up for.
    fn warn_of_coarse<'a>(&self, blanks: impl Iterator<Item = &'a Row>, session: &Session) {
        let Some(thickness) = self.strut_thickness_mm else {
            return;
        };
        let whole = |key: &&Settings| {
            [Some(BoundaryRule::Firm), Some(BoundaryRule::Floppy)].contains(&key.boundary)
        };
        let coarse = |key: &&Settings| key.lp_mm > 0.5 * thickness;
        let keys = blanks.map(|row| &row.key).filter(whole).filter(coarse);
        let mut coarse: Vec<f64> = keys.map(|key| key.lp_mm).collect();
        coarse.sort_by(f64::total_cmp);
        coarse.dedup();
        let coarse: Vec<String> = coarse.iter().map(f64::to_string).collect();
        if !coarse.is_empty() {
            session.warn(format!(
                "lattice parameters {} mm exceed {:.3} mm, half of the mean strut thickness: E_app is far from converged there",
                coarse.join(", "),
                0.5 * thickness
            ));
        }
    }
}

/// Warns of the means and limits of all `known` rows whose error is not stated, under the conditions of the rows just solved.
fn warn_of_contradictions(solved: &[Row], known: &[Row], session: &Session) {
    let conditions: Vec<_> = solved
        .iter()
        .map(|row| row.key.without_discretisation())
        .collect();
    let mut derived = with_derived(known, known);
    derived.retain(|row| {
        row.key.is_derived() && conditions.contains(&row.key.without_discretisation())
    });
    for line in voxel_check::warnings(&derived) {
        session.warn(line);
    }
}

fn said_of_kept(is_kept: bool) -> &'static str {
    match is_kept {
        true => "  [solved before with the same settings: kept]",
        false => "",
    }
}

/// What is unusual of all rows of a solve alike.
fn warn_of_unusual(settings: &Settings, height_mm: f64, session: &Session) {
    let row = Row {
        key: settings.clone(),
        ..Row::default()
    };
    for caution in cautions::cautions(&row, height_mm) {
        session.warn(caution);
    }
}

/// With grey values where the material asks for them.
fn loaded(dir: &Path, params: &SolveParams) -> Result<SegmentedScan> {
    let mut scan = specimen::load(dir)?;
    if params.needs_grey() {
        scan.add_grey(dir)?;
    }
    Ok(scan)
}

/// Writes the voxel elements of the specimen in `dir`, with materials (at most `bins` moduli), supports and load, to
/// `dir/voxel-fe.inp`.
///
/// # Errors
/// A method or load without such a model, an unwritable file.
pub fn export_inp(dir: &Path, params: &SolveParams, bins: usize, session: &Session) -> Result<()> {
    params.check()?;
    let path = dir.join("voxel-fe.inp");
    if session.dry_run {
        session.say(format!("would write {}", path.display()));
        return Ok(());
    }
    let worst = inp::write(&path, &loaded(dir, params)?.specimen, params, bins)?;
    session.say(binned(&path, worst));
    Ok(())
}

/// Writes the smooth elements of the specimen in `dir` to `dir/geometry-fe.` and the kind's extension.
///
/// # Errors
/// A load without such a model, an unwritable file.
#[doc(hidden)]
pub fn export_smooth(
    dir: &Path,
    kind: Kind,
    params: &SolveParams,
    bins: usize,
    session: &Session,
) -> Result<()> {
    params.check()?;
    let path = dir.join("geometry-fe").with_extension(kind.extension());
    if session.dry_run {
        session.say(format!("would write {}", path.display()));
        return Ok(());
    }
    let worst = tetrahedra::write(&path, kind, &loaded(dir, params)?.specimen, params, bins)?;
    session.say(binned(&path, worst));
    Ok(())
}

/// Adds the specimen's morphometry to the row.
fn mark(row: &mut Row, measured: Option<&Morphometry>) {
    let marks = &mut row.marks;
    marks.tb_th_mm = measured.and_then(|m| Some(m.tb_th.as_ref()?.mean_mm));
    marks.tb_sp_mm = measured.and_then(|m| Some(m.tb_sp.as_ref()?.mean_mm));
    marks.conn_d_per_mm3 = measured.map(|m| m.conn_d_per_mm3);
    marks.da = measured.and_then(|m| Some(m.fabric.as_ref()?.da));
}

/// The row with its sensitivity to the surface and the failure load, where they are known.
fn with_recorded(mut row: Row, recorded: &Recorded) -> Row {
    if let Some(solved) = &mut row.solved {
        solved.threshold_sensitivity = recorded.surface.map(|s| s.sensitivity);
        solved.surface_energy_ratio = recorded.surface.map(|s| s.ratio);
        solved.failure = recorded.failure.as_ref().map(|f| FailureLoad {
            factor: f.factor,
            load_n: f.failure_load_n,
            moment_nmm: f.failure_moment_nmm,
            displacement_mm: f.failure_displacement_mm,
            strain: f.failure_strain,
        });
    }
    if let Some(note) = &recorded.note {
        notes::add(&mut row.marks.note, note);
    }
    row
}

/// The row with what its solve took.
fn metered(mut row: Row, meter: &Meter) -> Row {
    if let Some(solved) = &mut row.solved {
        solved.wall_s = Some(meter.wall_s());
        solved.peak_mib = meter.peak_mib();
    }
    row
}

/// What a row is solved with, in short.
fn name(key: &Settings) -> String {
    match key.boundary {
        Some(boundary) => {
            let method = boundary.method_name(key.structure);
            format!("{} {method}", key.structure.name())
        }
        None => key.structure.name().to_owned(),
    }
}

/// Progress is the share of the error's decades already gained, over all loads.
fn show(bar: &ProgressBar, [load, loads]: [usize; 2], step: CgStep, tolerance: f64) {
    if let Some(error) = step.energy_error.filter(|e| *e > 0.0) {
        let gained = (error.log10() / tolerance.log10()).clamp(0.0, 1.0);
        bar.set_position((1000.0 * (load as f64 + gained) / loads as f64) as u64);
        bar.set_message(match loads {
            1 => format!("iteration {}, error {error:.1e}", step.iteration),
            _ => format!("strain {} of {loads}, error {error:.1e}", load + 1),
        });
    }
}
