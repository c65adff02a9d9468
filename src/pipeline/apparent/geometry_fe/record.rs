//! Owns what of solved smooth elements is kept on request: fields of their nodes and their middles, the failure load.

use super::GeometryModel;
use crate::error::{Error, Result};
use crate::measure::apparent::EndWork;
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

/// # Errors
/// Fields and numbers that smooth elements do not have.
pub fn check(params: &SolveParams) -> Result<()> {
    let refused = |key: &str, found: &str| {
        let advice = "use --method voxel-fe for that, or leave it out";
        Err(Error::setting(format!("solve.{key}"), found, advice))
    };
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
    pub model: &'a GeometryModel,
    pub params: &'a SolveParams,
    pub solved: &'a Equilibrated<'a>,
    pub work: &'a EndWork,
}

impl Recorder<'_> {
    fn element(&self, e: usize) -> Element {
        let tet = &self.model.model;
        let corners = tet.strains(e, self.solved.u);
        let strain = within(&corners, [0.25; 4]);
        let density_mpa = match self.params.sed {
            Sed::Centre => tet.density_mpa(e, &strain),
            Sed::Mean => tet.mean_density_mpa(e, &corners),
        };
        let young_mpa = self.model.young_mpa * tet.factor(e);
        let [lambda, mu] = tet.lame_mpa(e);
        let trace = strain[0] + strain[1] + strain[2];
        let of_trace = |i: usize| if i < 3 { lambda * trace } else { 0.0 };
        Element {
            volume_mm3: tet.shape(e).volume / tet.factor(e),
            density_mpa,
            effective_strain: (2.0 * density_mpa.max(0.0) / young_mpa).sqrt(),
            stress_mpa: std::array::from_fn(|i| of_trace(i) + 2.0 * mu * strain[i]),
            strain: std::array::from_fn(|i| if i < 3 { strain[i] } else { 2.0 * strain[i] }),
        }
    }

    fn elements<T: Send>(&self, read: impl Fn(&Element) -> T + Sync) -> Vec<T> {
        let all = (0..self.model.model.mesh.elements.len()).into_par_iter();
        all.map(|e| read(&self.element(e))).collect()
    }

    /// By Pistoia's criterion, at all of its volumes.
    pub fn failures(&self) -> Vec<FailureAt> {
        let Some(criterion) = self.params.pistoia else {
            return Vec::new();
        };
        let strains = self.elements(|e| (e.effective_strain as f32, e.volume_mm3 as f32));
        let failures = criterion.failures(strains);
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
        let scalar = |name, read: &(dyn Fn(&Element) -> f64 + Sync)| {
            Some(MeshArray::new(name, 1, self.elements(|e| read(e) as f32)))
        };
        let tensor = |name, read: &(dyn Fn(&Element) -> [f64; 6] + Sync)| {
            let values = self.elements(|e| read(e).map(|v| v as f32));
            Some(MeshArray::new(name, 6, values.concat()))
        };
        match field {
            Field::Sed => scalar("sed_mpa", &|e| e.density_mpa),
            Field::VonMises => scalar("von_mises_mpa", &|e| von_mises(e.stress_mpa)),
            Field::EffectiveStrain => scalar("effective_strain", &|e| e.effective_strain),
            Field::Strain => tensor("strain", &|e| e.strain),
            Field::Stress => tensor("stress_mpa", &|e| e.stress_mpa),
            _ => None,
        }
    }
}

/// Equivalent stress of a stress tensor.
fn von_mises([xx, yy, zz, yz, xz, xy]: [f64; 6]) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (yz * yz + xz * xz + xy * xy)).sqrt()
}
