//! Owns scenes of the local continuum, the twin of bond-based peridynamics.

mod params;

pub use params::{ContinuumParams, DensityAt, EnergyLaw};

use crate::error::{Error, Result};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::continuum::{Continuum, Old, Step};
use crate::physics::growth::Weight;
use crate::scene::remodelling::body::{Body, Conditions, Motion};
use crate::scene::remodelling::density::Probes;
use crate::scene::remodelling::loads::Loads;
use crate::scene::remodelling::marcher::{Marcher, Model, Stage};
use crate::scene::setting::{Inputs, Setting};

/// Elements, and where their densities live.
pub struct Local {
    continuum: Continuum,
    density_at: DensityAt,
}

/// The body of a scene, at rest.
pub fn marcher(
    scene: &Setting,
    params: &ContinuumParams,
    inputs: &Inputs,
) -> Result<Marcher<Local>> {
    if scene.layers.is_some() {
        return Err(Error::setting(
            "layers",
            "a continuum has no fictitious layers",
            "prescribe its edges with [[hold]] (a rectangle with nodal = true has points on them)",
        ));
    }
    let material = scene.points(inputs)?;
    let growth = params
        .growth
        .as_ref()
        .map(|g| g.checked(&params.density))
        .transpose()?;
    let density = params.density.initial(&material, inputs)?;
    let weight = Weight {
        reference: params.density.reference,
        exponent: params.density.exponent,
    };
    let model = Continuum::new(&material, params.young, params.law(scene)?, weight, growth);
    require_elements(&model)?;
    let areas: Vec<f64> = (0..model.nodes).map(|p| model.area(p)).collect();
    let probes = Probes::new(&scene.probe, &material, areas)?;
    let at_nodes = params.density_at == DensityAt::Nodes;
    let conditions = Conditions {
        layers: None,
        reach: 0,
        holds: &scene.hold,
        density: density.clone(),
        reference_density: params.density.reference,
        grows: growth.is_some() && at_nodes,
        motion: Motion::PLAIN,
    };
    let body = Body::new(material, conditions)?;
    let own = match params.density_at {
        DensityAt::Nodes => density,
        DensityAt::Gauss => {
            let mean = |c: &[u32; 4]| c.iter().map(|&p| density[p as usize]).sum::<f64>() / 4.0;
            model.elements.iter().flat_map(|c| [mean(c); 4]).collect()
        }
    };
    let loads = Loads::new(scene, &body, &[])?;
    let spacing = model.spacing;
    let model = Local {
        continuum: model,
        density_at: params.density_at,
    };
    Marcher::new(
        body,
        model,
        own,
        probes,
        Some(loads),
        &params.solver,
        spacing,
    )
}

fn require_elements(model: &Continuum) -> Result<()> {
    let bare = (0..model.nodes)
        .filter(|&p| model.around(p).is_empty())
        .count();
    if bare == 0 {
        return Ok(());
    }
    Err(Error::specimen(
        format!("{bare} points of the geometry belong to no square of four neighbouring points"),
        "smooth or thicken the outline by at least one grid.spacing, or set grid.prune = true to drop them",
    ))
}

impl Model for Local {
    type Step<'a> = Step<'a>;

    fn step<'a>(&'a self, of: Stage<'a>) -> Step<'a> {
        Step {
            model: &self.continuum,
            map: of.map,
            given: of.given,
            old: match self.density_at {
                DensityAt::Nodes => Old::Nodes(of.old),
                DensityAt::Gauss => Old::Gauss(of.old.as_chunks().0),
            },
            dt: of.dt,
            load: of.load,
        }
    }

    fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        self.continuum.pattern_from(map, first)
    }

    fn weight(&self) -> &Weight {
        &self.continuum.weight
    }

    /// Of Gauss densities, the mean of the nearest in each element around.
    fn at_points(&self, own: &[f64]) -> Vec<f64> {
        // Gauss point nearest to each corner: they are numbered along x first, corners go round.
        const NEAREST: [usize; 4] = [0, 1, 3, 2];
        let mean = |p: usize| {
            let around = self.continuum.around(p).iter();
            let nearest = around.map(|&(e, c)| own[4 * e as usize + NEAREST[c as usize]]);
            nearest.sum::<f64>() / self.continuum.around(p).len() as f64
        };
        match self.density_at {
            DensityAt::Nodes => own.to_vec(),
            DensityAt::Gauss => (0..self.continuum.nodes).map(mean).collect(),
        }
    }

    fn own_after(&self, values: &[f64], old: &[f64], dt: f64) -> Vec<f64> {
        match self.density_at {
            DensityAt::Nodes => values[..old.len()].to_vec(),
            DensityAt::Gauss => {
                let densities = self
                    .continuum
                    .gauss_densities(values, old.as_chunks().0, dt);
                densities.into_flattened()
            }
        }
    }
}
