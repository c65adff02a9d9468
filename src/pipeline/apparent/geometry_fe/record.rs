//! Owns what of solved smooth elements is kept on request: fields of their nodes and their middles, the failure load.

use super::{GeometryModel, refused};
use crate::error::Result;
use crate::measure::apparent::EndWork;
use crate::physics::hex8::fields::von_mises;
use crate::physics::tet10::strain::within;
use crate::pipeline::apparent::fields::{Equilibrated, Field, MeshArray, MeshFields};
use crate::pipeline::apparent::params::{Sed, SolveParams};
use crate::pipeline::apparent::voxel_fe::failure;
use crate::result::details::FailureAt;
use rayon::prelude::*;

/// Fields that smooth elements have.
const OFFERED: [Field; 6] = [
    Field::Displacement,
    Field::Sed,
    Field::VonMises,
    Field::Strain,
    Field::Stress,
    Field::EffectiveStrain,
];

/// What one element stores and bears at its middle. Tensors are in the order 11, 22, 33, 23, 13, 12; shears are engineering shears.
struct Element {
    volume_mm3: f64,
    density_mpa: f64,
    effective_strain: f64,
    strain: [f64; 6],
    stress_mpa: [f64; 6],
}

impl Element {
    fn of(model: &GeometryModel, sed: Sed, e: usize, u: &[[f64; 3]]) -> Element {
        let tet = &model.model;
        let corners = tet.strains(e, u);
        let strain = within(&corners, [0.25; 4]);
        let density_mpa = match sed {
            Sed::Centre => tet.density_mpa(e, &strain),
            Sed::Mean => tet.mean_density_mpa(e, &corners),
        };
        let young_mpa = model.young_mpa * tet.factor(e);
        let [lambda, mu] = tet.lame_mpa(e);
        let trace = strain[0] + strain[1] + strain[2];
        let of_trace = |i: usize| if i < 3 { lambda * trace } else { 0.0 };
        Element {
            volume_mm3: tet.volume_mm3(e),
            density_mpa,
            effective_strain: (2.0 * density_mpa.max(0.0) / young_mpa).sqrt(),
            stress_mpa: std::array::from_fn(|i| of_trace(i) + 2.0 * mu * strain[i]),
            strain: std::array::from_fn(|i| if i < 3 { strain[i] } else { 2.0 * strain[i] }),
        }
    }
}

/// # Errors
/// Fields and numbers that smooth elements do not have.
pub fn check(params: &SolveParams) -> Result<()> {
    if params.statistics {
        return refused(
            "statistics",
            "geometry-fe has no statistics of tissue and no sections",
        );
    }
    if !params.failure_labels.is_empty() {
        return refused(
            "failure_labels",
            "elements of geometry-fe have no labels to choose",
        );
    }
    match params.fields.iter().find(|f| !OFFERED.contains(f)) {
        Some(_) => refused(
            "fields",
            "geometry-fe has the fields displacement, sed, von-mises, strain, stress and effective-strain only",
        ),
        None => Ok(()),
    }
}

/// A solved model, to be read as the settings ask.
pub struct Recorder<'a> {
    model: &'a GeometryModel,
    params: &'a SolveParams,
    solved: &'a Equilibrated<'a>,
    work: &'a EndWork,
    /// Empty where the settings ask for nothing of elements.
    elements: Vec<Element>,
}

impl<'a> Recorder<'a> {
    pub fn new(
        model: &'a GeometryModel,
        params: &'a SolveParams,
        solved: &'a Equilibrated<'a>,
        work: &'a EndWork,
    ) -> Self {
        let of_elements = |field: &Field| *field != Field::Displacement;
        let is_asked = params.pistoia.is_some() || params.fields.iter().any(of_elements);
        let count = if is_asked {
            model.model.mesh.elements.len()
        } else {
            0
        };
        let all = (0..count).into_par_iter();
        Recorder {
            elements: all
                .map(|e| Element::of(model, params.sed, e, solved.u))
                .collect(),
            model,
            params,
            solved,
            work,
        }
    }

    /// By Pistoia's criterion, at all of its volumes.
    pub fn failures(&self) -> Vec<FailureAt> {
        let Some(criterion) = self.params.pistoia else {
            return Vec::new();
        };
        let strains = self.elements.iter();
        let strains = strains.map(|e| (e.effective_strain as f32, e.volume_mm3 as f32));
        let failures = criterion.failures(strains.collect());
        let at = |f| failure::at(f, self.params, &self.model.motion, self.work);
        failures.iter().map(at).collect()
    }

    /// None where the settings ask for none.
    pub fn fields(&self) -> Option<MeshFields> {
        let mesh = &self.model.model.mesh;
        let asked = &self.params.fields;
        if asked.is_empty() {
            return None;
        }
        let of_nodes = (asked.contains(&Field::Displacement)).then(|| {
            let u = self.solved.u.iter().flatten();
            MeshArray::new("displacement_mm", 3, u.map(|u| *u as f32).collect())
        });
        Some(MeshFields {
            nodes_mm: mesh.nodes_mm.clone(),
            elements: mesh.elements.clone(),
            of_nodes: of_nodes.into_iter().collect(),
            of_elements: asked.iter().filter_map(|f| self.of_elements(*f)).collect(),
        })
    }

    fn of_elements(&self, field: Field) -> Option<MeshArray> {
        let elements = || self.elements.iter();
        let scalar = |name, read: fn(&Element) -> f64| {
            let values = elements().map(|e| read(e) as f32);
            Some(MeshArray::new(name, 1, values.collect()))
        };
        let tensor = |name, read: fn(&Element) -> [f64; 6]| {
            let values = elements().flat_map(|e| read(e).map(|v| v as f32));
            Some(MeshArray::new(name, 6, values.collect()))
        };
        match field {
            Field::Sed => scalar("sed_mpa", |e| e.density_mpa),
            Field::VonMises => scalar("von_mises_mpa", |e| von_mises(e.stress_mpa)),
            Field::EffectiveStrain => scalar("effective_strain", |e| e.effective_strain),
            Field::Strain => tensor("strain", |e| e.strain),
            Field::Stress => tensor("stress_mpa", |e| e.stress_mpa),
            _ => None,
        }
    }
}
