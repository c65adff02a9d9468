//! Owns voxel finite elements as a discretisation: one brick per voxel, or finer or coarser ones.

pub mod bricks;
pub mod cost;
pub mod failure;
mod family;
mod labels;
pub mod nodes;
pub mod plastic;
mod principal;
mod record;
mod sections;
mod spread;
mod threshold;
mod tissue_spread;

use crate::discretisation::voxels::Planes;
use crate::error::Result;
use crate::mask::resample;
use crate::measure::apparent::EndWork;
use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision};
use crate::par::sum_chunks;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, EndSites, Known, LabelSupports, LoadSet, LoadSteps, Places, Prepared,
    System,
};
use crate::pipeline::apparent::ends::by_label::{self, ByLabel};
use crate::pipeline::apparent::ends::label_image::LabelMap;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::ends::supports::{self, Nodes};
use crate::pipeline::apparent::ends::uneven::Uneven;
use crate::pipeline::apparent::fields::{Equilibrated, Recorded};
use crate::pipeline::apparent::params::{Conditions, Load, SolveParams};
use crate::pipeline::apparent::resolution;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::apparent::stiffness::groups;
use crate::pipeline::apparent::voxel_fe::bricks::{Bricks, Keep};
use crate::pipeline::apparent::voxel_fe::family::Family;
use crate::pipeline::apparent::voxel_fe::labels::Labels;
use crate::pipeline::apparent::voxel_fe::nodes::{Gripped, along, grid_places};
use crate::pipeline::apparent::voxel_fe::record::Recorder;
use crate::result::settings::{CellType, Method, Motion, Settings};
use crate::solver::amg::AmgParams;
use crate::solver::cg::NoGoal;
use crate::volume::Specimen;
use std::sync::Arc;

/// Voxel elements between grips, or joined to the faces where unit strains are the load.
pub struct VoxelModel {
    bricks: Arc<Bricks>,
    family: Family,
    /// What shaped the elements: the settings without the load.
    shaped_by: SolveParams,
    grips: Planes,
    motion: EndMotion,
    /// Values of a labelled scan, by voxel.
    labels: Option<Labels>,
    params: SolveParams,
    /// What is on labels in place of ends.
    by_label: Option<ByLabel>,
    /// What is gripped of ends that are not plane.
    uneven: Option<Uneven>,
    /// The specimen at its elements' resolution, where that is another mask than the scan's.
    resolved: Option<Specimen>,
}

impl VoxelModel {
    /// The model of these elements of a specimen.
    ///
    /// # Errors
    /// Grips that meet.
    pub fn of(bricks: Bricks, specimen: &Specimen, params: &SolveParams) -> Result<Self> {
        VoxelModel::in_family(Family::alone(Arc::new(bricks)), specimen, params)
    }

    fn in_family(family: Family, specimen: &Specimen, params: &SolveParams) -> Result<Self> {
        let bricks = Arc::clone(family.bricks());
        let grip_mm = match params.load.motion() {
            None => 0.0,
            Some(_) => params.grip_mm,
        };
        let grid = bricks.mesh().grid;
        let grips = Planes::within(&grid, params.axis, grip_mm)?;
        let gauge_mm = (grips.high - grips.low) as f64 * grid.spacing_mm[params.axis.index()];
        Ok(VoxelModel {
            bricks,
            family,
            shaped_by: family::shaping(params),
            grips,
            motion: EndMotion::of(specimen, params, gauge_mm),
            labels: Labels::of(specimen, params)?,
            params: params.clone(),
            by_label: None,
            uneven: None,
            resolved: None,
        })
    }

    /// The model whose supports and loads are on labels.
    fn on_labels(prepared: Prepared, params: &SolveParams) -> Result<Self> {
        let map = LabelMap::of(prepared.specimen, params)?;
        let loaded = by_label::loaded(params);
        let keep = Keep::AtLabels(&map, &loaded);
        let resolved = resolution::resolved(prepared.specimen, params)?;
        let mut model = match &resolved {
            None => VoxelModel::of(
                Bricks::new(prepared, params, keep)?,
                prepared.specimen,
                params,
            )?,
            Some(specimen) => {
                let own = resolution::one_element_a_voxel(params);
                let finer = Prepared {
                    specimen,
                    ..prepared
                };
                VoxelModel::of(Bricks::new(finer, &own, keep)?, specimen, &own)?
            }
        };
        model.by_label = Some(ByLabel::of(model.bricks.mesh(), &map, params)?);
        model.resolved = resolved;
        Ok(model)
    }

    /// The model between plane ends, or with faces.
    fn between_planes(prepared: Prepared, params: &SolveParams) -> Result<Self> {
        let keep = Keep::under(params.load);
        let Some(resolved) = resolution::resolved(prepared.specimen, params)? else {
            let bricks = Bricks::new(prepared, params, keep)?;
            return VoxelModel::of(bricks, prepared.specimen, params);
        };
        let own = resolution::one_element_a_voxel(params);
        let specimen = &resolved;
        let bricks = Bricks::new(
            Prepared {
                specimen,
                ..prepared
            },
            &own,
            keep,
        )?;
        let model = VoxelModel::of(bricks, specimen, &own)?;
        Ok(VoxelModel {
            resolved: Some(resolved),
            ..model
        })
    }

    /// The model between ends that are gripped where bone is seen from the end planes.
    fn between_uneven_ends(prepared: Prepared, params: &SolveParams) -> Result<Self> {
        let resolved = resolution::resolved(prepared.specimen, params)?;
        let own = match &resolved {
            Some(_) => resolution::one_element_a_voxel(params),
            None => params.clone(),
        };
        let specimen = resolved.as_ref().unwrap_or(prepared.specimen);
        let (bone, depth) = (&specimen.bone, params.ends_depth_mm);
        let uneven = Uneven::of(bone, params.axis, depth, own.refine)?;
        let finer = Prepared {
            specimen,
            ..prepared
        };
        let bricks = Bricks::new(finer, &own, Keep::Between(&uneven))?;
        let mut model = VoxelModel::of(bricks, specimen, &own)?;
        model.uneven = Some(uneven);
        model.resolved = resolved;
        Ok(model)
    }

    /// Force of the supports on the upper end, along an axis.
    fn upper_force(&self, force: &[[f64; 3]], axis: usize) -> f64 {
        let mut sum = 0.0;
        self.gripped().each(|node, at| {
            if at.end == Some(End::Upper) {
                sum += force[node][axis];
            }
        });
        sum
    }

    /// Two coarse cycles halve the iterations on bricks.
    fn multigrid(&self) -> AmgParams {
        AmgParams {
            cycles: 2,
            ..AmgParams::new(self.bricks.mesh().grid.spacing_mm)
        }
    }

    /// What a unit strain holds.
    fn faces_held(&self, load: usize) -> Held {
        supports::held_faces(&self.gripped(), self.params.conditions, load)
    }

    fn gripped(&self) -> Gripped<'_> {
        Gripped {
            mesh: self.bricks.mesh(),
            grips: self.grips,
            uneven: self.uneven.as_ref(),
        }
    }

    fn ends(&self) -> EndSites<'_> {
        let (nodes, grips) = (self.gripped(), self.grips);
        let h = nodes.mesh.grid.spacing_mm[grips.axis.index()];
        EndSites {
            motion: self.motion,
            planes_mm: [grips.low, grips.high].map(|plane| plane as f64 * h),
            each: Box::new(move |visit| supports::each_end_node(&nodes, visit)),
        }
    }

    fn load_steps(&self) -> LoadSteps<'_> {
        Box::new(|prepared, held, elastic, kept| self.yielded(prepared.tissue, held, elastic, kept))
    }
}

impl Discretisation for VoxelModel {
    /// Size and tissue of the elements stand in the settings of the solve.
    type Case = ();

    /// The size of the elements: the mean edge where edges differ. Blocks of voxels that do not fill a side are shortened to it.
    fn label(_: &(), specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        let [x, y, z] = resample::block_edges_mm(specimen.bone.grid, params.coarsen);
        let edge = if x == y && y == z {
            x
        } else {
            (x * y * z).cbrt()
        };
        Settings {
            method: Method::VoxelFe,
            structure: CellType::Hex8,
            boundary: None,
            lp_mm: edge / params.refine as f64,
            elements: Some(resolution::elements(specimen, params)),
            registration_mm: None,
            ..key
        }
    }

    fn cost(_: &(), params: &SolveParams, known: Known) -> Result<Cost> {
        Ok(cost::of(params, known))
    }

    fn count(_: &(), prepared: Prepared, params: &SolveParams) -> Result<(f64, Option<Self>)> {
        Ok((cost::counted(prepared.specimen, params), None))
    }

    fn build(_: &(), prepared: Prepared, params: &SolveParams) -> Result<Self> {
        let mut model = match params.load {
            Load::Labels => VoxelModel::on_labels(prepared, params),
            _ if params.ends_depth_mm > 0.0 => VoxelModel::between_uneven_ends(prepared, params),
            _ => VoxelModel::between_planes(prepared, params),
        }?;
        model.shaped_by = family::shaping(params);
        if params.load == Load::Stiffness && params.conditions != Conditions::Kinematic {
            let supports = groups(params.conditions).iter();
            let supports = supports.map(|loads| model.faces_held(loads[0])).collect();
            model.family.expect(supports);
        }
        if params.plasticity.is_some() {
            // Load steps follow the elastic solution.
            model.keep();
        }
        Ok(model)
    }

    fn keep(&mut self) {
        self.family.keep();
    }

    fn under(self, prepared: Prepared, params: &SolveParams) -> Result<Option<Self>> {
        let between_ends = |load: Load| {
            load.motion()
                .is_some_and(|motion| motion != Motion::ByLabel)
        };
        let same = between_ends(self.params.load)
            && between_ends(params.load)
            && self.shaped_by == family::shaping(params);
        if !same {
            return Ok(None);
        }
        let (own, specimen) = match &self.resolved {
            Some(resolved) => (resolution::one_element_a_voxel(params), resolved),
            None => (params.clone(), prepared.specimen),
        };
        let model = VoxelModel::in_family(self.family, specimen, &own)?;
        Ok(Some(VoxelModel {
            shaped_by: self.shaped_by,
            uneven: self.uneven,
            resolved: self.resolved,
            ..model
        }))
    }

    fn system(
        &self,
        loads: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>> {
        let (mesh, nodes, motion) = (self.bricks.mesh(), self.gripped(), &self.motion);
        System {
            operator: &*self.bricks,
            coarsen: &self.family,
            multigrid: self.multigrid(),
            goal: None::<NoGoal>,
            held: match (loads, &self.by_label) {
                (LoadSet::Ends, Some(labels)) => labels.hold(nodes.padding()),
                (LoadSet::Ends, None) => supports::held(&nodes, motion, self.params.load),
                (LoadSet::UnitStrains(numbers), _) => self.faces_held(numbers[0]),
            },
            start: Box::new(move |load| match (loads, &self.by_label) {
                (LoadSet::Ends, Some(labels)) => labels.start(),
                (LoadSet::Ends, None) => supports::start(&nodes, motion),
                (LoadSet::UnitStrains(_), _) => supports::affine(&nodes, mesh.grid.size_mm(), load),
            }),
            ends: self.ends(),
            by_label: self.by_label.as_ref().map(|by| LabelSupports { by, mesh }),
            load_steps: self.params.plasticity.as_ref().map(|_| self.load_steps()),
            sites: mesh.elements,
            dropped: mesh.dropped,
            volume_mm3: mesh.elements as f64 * mesh.grid.voxel_mm3(),
            places: self.params.mechanisms.then(|| Places {
                at: grid_places(mesh),
                reach: 1,
            }),
        }
    }

    fn assess(&self, solved: &Equilibrated) -> Moduli {
        let (mesh, grips, loaded) = (self.bricks.mesh(), self.grips, &self.motion.loaded);
        let (axis, force, info) = (grips.axis.index(), solved.force, solved.info);
        // Σ x_i f_i is the volume integral of the stress, exactly, since positions are a displacement field of the
        // elements; clamped to the gauge, it is the integral between the innermost gripped planes.
        let sum = |weight: &(dyn Fn(usize) -> f64 + Sync)| {
            sum_chunks(mesh.segments.len(), |range| {
                let part = |s: usize| {
                    let segment = &mesh.segments[s];
                    let nodes = segment.nodes().enumerate();
                    nodes
                        .map(|(i, node)| {
                            let x = if axis == 0 { i } else { 0 };
                            weight(segment.at[axis] as usize + x) * force[node][axis]
                        })
                        .sum::<f64>()
                };
                range.map(part).sum()
            })
        };
        let reaction = match self.uneven {
            None => sum(&|plane| if plane >= grips.high { 1.0 } else { 0.0 }),
            Some(_) => self.upper_force(force, axis),
        };
        // Forces of uneven ends act at many heights: no volume lies between them.
        let virial = match self.uneven {
            None => loaded.gauge_mm * sum(&|plane| along(grips, plane)),
            Some(_) => f64::NAN,
        };
        let from_energy_mpa = loaded.from_energy(info.energy);
        Moduli {
            e_app_mpa: from_energy_mpa,
            from_energy_mpa,
            from_reaction_mpa: loaded.from_reaction(reaction),
            from_stress_mpa: loaded.from_virial(virial),
            algebraic_error_mpa: info.energy_error / info.energy * from_energy_mpa,
        }
    }

    fn fields(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        solved: &Equilibrated,
        work: &EndWork,
    ) -> Result<Recorded> {
        let (params, own) = match &self.resolved {
            None => (params, prepared),
            Some(specimen) => (
                &self.params,
                Prepared {
                    specimen,
                    ..prepared
                },
            ),
        };
        let recorder = Recorder::new(self, own, params, solved, work);
        let scan = self.resolved.as_ref().map(|_| &prepared.specimen.bone);
        Ok(recorder.record(scan))
    }
}
