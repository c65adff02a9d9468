//! Owns geometry-based finite elements as a discretisation: ten-node tetrahedra inside the smooth surface of the bone.

mod cost;
mod mesh;
mod nodes;
mod record;
mod sensitivity;
mod size;
mod surface;
pub mod topology;

use crate::discretisation::tetrahedra::surface::Surface;
use crate::error::{Error, Result};
use crate::measure::apparent::EndWork;
use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision};
use crate::physics::tet10::Tet10;
use crate::pipeline::apparent::discretisation::precondition::{InTwoLevels, Precondition};
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, Displacements, EndSites, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::ends::supports;
use crate::pipeline::apparent::fields::{Equilibrated, Recorded};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::failure;
use crate::result::details::Details;
use crate::result::settings::{CellType, Method, Settings};
use crate::solver::amg::AmgParams;
use crate::solver::cg::NoGoal;
use crate::volume::Specimen;
use mesh::Report;
use nodes::Grips;
use record::Recorder;
use surface::Source;

/// Smooth elements between grips, or joined to the faces where unit strains are the load.
pub struct GeometryModel {
    model: Tet10,
    surface: Surface,
    source: Source,
    grips: Grips,
    motion: EndMotion,
    report: Report,
    /// Of the mean element.
    young_mpa: f64,
    poisson: f64,
    params: SolveParams,
}

impl GeometryModel {
    /// The mesh with its stiffness.
    pub fn elements(&self) -> &Tet10 {
        &self.model
    }

    /// Modulus for a factor of 1, in MPa.
    pub fn young_mpa(&self) -> f64 {
        self.young_mpa
    }

    /// Poisson's ratio of the tissue.
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// What the motion of the ends holds, and the displacements that it starts from, in mm.
    pub fn end_motion(&self) -> (Held, Displacements) {
        (
            supports::held(self, &self.motion, self.params.load),
            supports::start(self, &self.motion),
        )
    }

    /// Distance of the innermost gripped places, and displacement of one grip against the other.
    pub fn gauge_and_displacement_mm(&self) -> [f64; 2] {
        [
            self.motion.loaded.gauge_mm,
            self.motion.loaded.displacement_mm,
        ]
    }

    /// The end whose grip holds a place.
    pub fn grip_of(&self, at_mm: [f64; 3]) -> Option<End> {
        self.grips.end(at_mm)
    }

    fn ends(&self) -> EndSites<'_> {
        EndSites {
            motion: self.motion,
            planes_mm: [self.grips.low_mm, self.grips.high_mm],
            each: Box::new(move |visit| supports::each_end_node(self, visit)),
        }
    }
}

impl Discretisation for GeometryModel {
    /// Size and tissue of the elements stand in the settings of the solve.
    type Case = ();

    fn label(_: &(), specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        Settings {
            method: Method::GeometryFe,
            structure: CellType::Tet10,
            boundary: None,
            lp_mm: size::of(specimen, params),
            elements: Some(Source::of(specimen, params).elements()),
            registration_mm: None,
            ..key
        }
    }

    fn cost(_: &(), params: &SolveParams, known: Known) -> Result<Cost> {
        Ok(cost::of(params, known))
    }

    fn build(_: &(), prepared: Prepared, params: &SolveParams) -> Result<Self> {
        let Prepared { specimen, tissue } = prepared;
        refuse_settings(tissue, params)?;
        size::check(specimen, params)?;
        let grips = Grips::of(specimen, params)?;
        let source = Source::of(specimen, params);
        let surface = surface::of(specimen, source);
        let (mesh, report) = mesh::of(specimen, &surface, &grips, params)?;
        let (young_mpa, poisson, factor) = match tissue {
            Tissue::Uniform(solid) => (solid.young_mpa, solid.poisson, None),
            Tissue::Mixed(mixed) => {
                let factor = mesh::factors(&mesh, specimen, &mixed.factor);
                (mixed.mean_mpa, mixed.poissons[0], Some(factor))
            }
        };
        let gauge_mm = grips.high_mm - grips.low_mm;
        Ok(GeometryModel {
            model: Tet10::new(mesh, young_mpa, poisson, factor),
            source,
            surface,
            grips,
            motion: EndMotion::of(specimen, params, gauge_mm),
            report,
            young_mpa,
            poisson,
            params: params.clone(),
        })
    }

    fn system(
        &self,
        loads: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>> {
        let mesh = &self.model.mesh;
        let cell_mm = mesh.cell_mm;
        System {
            operator: &self.model,
            coarsen: InTwoLevels(&self.model),
            multigrid: AmgParams {
                box_mm: [BOX * cell_mm; 3],
                ..AmgParams::new([cell_mm; 3])
            },
            goal: None::<NoGoal>,
            held: match loads {
                LoadSet::Ends => self.end_motion().0,
                LoadSet::UnitStrains(numbers) => {
                    supports::held_faces(self, self.params.conditions, numbers[0])
                }
            },
            start: Box::new(move |load| match loads {
                LoadSet::Ends => supports::start(self, &self.motion),
                LoadSet::UnitStrains(_) => supports::affine(self, mesh.size_mm, load),
            }),
            ends: self.ends(),
            by_label: None,
            load_steps: None,
            sites: mesh.elements.len(),
            dropped: self.report.loaded.dropped_elements,
            volume_mm3: self.report.volume_mm3,
            places: None,
        }
    }

    fn assess(&self, solved: &Equilibrated) -> Moduli {
        let (grips, loaded, info) = (&self.grips, &self.motion.loaded, solved.info);
        // Σ x_i f_i is the volume integral of the stress: positions are a displacement field of the elements.
        let nodes = || self.model.mesh.nodes_mm.iter().zip(solved.force);
        let upper = nodes().filter(|(at, _)| grips.end(**at) == Some(End::Upper));
        let reaction: f64 = upper.map(|(_, f)| f[grips.axis]).sum();
        let virial: f64 = nodes()
            .map(|(at, f)| grips.along(*at) * f[grips.axis])
            .sum();
        let from_energy_mpa = loaded.from_energy(info.energy);
        Moduli {
            e_app_mpa: from_energy_mpa,
            from_energy_mpa,
            from_reaction_mpa: loaded.from_reaction(reaction),
            from_stress_mpa: loaded.from_virial(loaded.gauge_mm * virial),
            algebraic_error_mpa: info.energy_error / info.energy * from_energy_mpa,
        }
    }

    fn fields(
        &self,
        _: Prepared,
        params: &SolveParams,
        solved: &Equilibrated,
        work: &EndWork,
    ) -> Result<Recorded> {
        let (model, surface) = (&self.model, &self.surface);
        let recorder = Recorder::new(self, params, solved, work);
        let table = recorder.failures();
        Ok(Recorded {
            surface: sensitivity::of(model, surface, self.source != Source::Mask, solved.u),
            note: Some(self.report.words(self.source)),
            euler: Some(self.report.euler),
            mesh: recorder.fields(),
            failure: failure::chosen(&table, params),
            details: Details {
                failure: table,
                ..Details::default()
            },
            ..Recorded::default()
        })
    }
}

/// Edge of multigrid's boxes over that of a cell: 16 corners a box. Three cells took a third more iterations.
const BOX: f64 = 2.0;

/// # Errors
/// Always: these elements do not have what `solve.key` asks for.
fn refused(key: &str, found: &str) -> Result<()> {
    let advice = "use --method voxel-fe for that, or leave it out";
    Err(Error::setting(format!("solve.{key}"), found, advice))
}

/// What these elements do not offer.
fn refuse_settings(tissue: &Tissue, params: &SolveParams) -> Result<()> {
    if params.refine > 1 || params.coarsen > 1 {
        return Err(Error::setting(
            "solve.refine",
            "elements of geometry-fe have no whole number of voxels",
            "give their size: --element-mm MM",
        ));
    }
    if params.mechanisms {
        return refused("mechanisms", "geometry-fe counts no mechanisms");
    }
    record::check(params)?;
    match tissue {
        Tissue::Mixed(mixed) if mixed.poissons.len() > 1 => refused(
            "material",
            "elements of geometry-fe have one Poisson's ratio",
        ),
        _ => Ok(()),
    }
}
