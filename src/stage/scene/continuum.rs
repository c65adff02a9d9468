//! Owns scenes of the local continuum, the twin of bond-based peridynamics.

use crate::error::{Error, Result};
use crate::physics::bond_based::micromodulus_discrete;
use crate::physics::continuum::{Continuum, Old, Step};
use crate::physics::growth::Weight;
use crate::physics::hyperelastic::Energy;
use crate::solve::newton::NotConverged;
use crate::stage::scene::body::{Body, Conditions, NUDGE, axis_of, nudge, rate_of};
use crate::stage::scene::density::{DensityParams, GrowthParams, Probes};
use crate::stage::scene::frame::{Frame, Observer, Summary};
use crate::stage::scene::march::{Advance, Marching, march};
use crate::stage::scene::solver::{Equilibrium, SolverParams};
use crate::stage::scene::{Inputs, Scene};
use serde::{Deserialize, Serialize};

/// `[physics.continuum]`: bilinear quadrilaterals whose nodes are the points of the grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContinuumParams {
    /// Young's modulus at the reference density.
    pub young: f64,
    /// For St. Venant-Kirchhoff; bonds have 1/3.
    #[serde(default = "third")]
    pub poisson: f64,
    #[serde(default)]
    pub energy: EnergyLaw,
    /// Where densities live.
    #[serde(default)]
    pub density_at: DensityAt,
    #[serde(default)]
    pub density: DensityParams,
    /// Absent: densities stay.
    #[serde(default)]
    pub growth: Option<GrowthParams>,
    #[serde(default)]
    pub solver: SolverParams,
}

fn third() -> f64 {
    1.0 / 3.0
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum EnergyLaw {
    #[default]
    StVenantKirchhoff,
    /// The local limit of peridynamics: harmonic bonds in all directions.
    IsotropicBonds,
    /// The local limit at fixed δ/Δ: harmonic bonds along the grid's stencil.
    StencilBonds,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum DensityAt {
    #[default]
    Nodes,
    Gauss,
}

/// Runs the scene.
pub fn run(
    scene: &Scene,
    params: &ContinuumParams,
    inputs: &Inputs,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let mut model = Local::new(scene, params, inputs)?;
    let Some(time) = &scene.time else {
        return Err(Error::setting(
            "time",
            "missing",
            "give [time] end and step",
        ));
    };
    let mut summary = Summary {
        points: model.body.material,
        unknowns: model.body.map.unknowns(),
        ..Summary::default()
    };
    observer.start(&model.body.points, (time.end / time.step).round() as usize)?;
    march(&mut model, time, &scene.output, observer, &mut summary)?;
    Ok(summary)
}

struct Local {
    body: Body,
    model: Continuum,
    solver: Equilibrium,
    probes: Probes,
    loads: Loads,
    /// Unknowns now, and how far they moved in the step before (per unit of time).
    q: Vec<f64>,
    rate: Option<Vec<f64>>,
    values: Vec<f64>,
    old: Old,
}

/// Forces by time.
struct Loads(Vec<(crate::stage::scene::conditions::Schedule, Vec<usize>)>);

impl Loads {
    fn new(scene: &Scene, body: &Body) -> Result<Self> {
        let one = |(k, load): (usize, &crate::stage::scene::conditions::Load)| {
            load.value.check(&format!("load[{k}].value"))?;
            let axis = axis_of(&load.component, &format!("load[{k}].component"))?;
            let chosen =
                load.region
                    .select(&body.points, body.material, &format!("load[{k}].region"))?;
            Ok((
                load.value.clone(),
                chosen.iter().map(|&p| body.placement(p, axis)).collect(),
            ))
        };
        Ok(Loads(
            scene
                .load
                .iter()
                .enumerate()
                .map(one)
                .collect::<Result<_>>()?,
        ))
    }

    /// Force on each value at time `t`.
    fn at(&self, t: f64, values: usize) -> Vec<f64> {
        if self.0.is_empty() {
            return Vec::new();
        }
        let mut force = vec![0.0; values];
        for (schedule, places) in &self.0 {
            let share = schedule.at(t) / places.len() as f64;
            places.iter().for_each(|&v| force[v] += share);
        }
        force
    }
}

impl Local {
    fn new(scene: &Scene, params: &ContinuumParams, inputs: &Inputs) -> Result<Self> {
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
        let probes = Probes::weighted(&scene.probe, &material, areas)?;
        let at_nodes = params.density_at == DensityAt::Nodes;
        let conditions = Conditions {
            layers: None,
            reach: 0,
            holds: &scene.hold,
            density: density.clone(),
            reference_density: params.density.reference,
            grows: growth.is_some() && at_nodes,
        };
        let body = Body::new(material, conditions)?;
        let old = match params.density_at {
            DensityAt::Nodes => Old::Nodes(density),
            DensityAt::Gauss => {
                let mean = |c: &[u32; 4]| c.iter().map(|&p| density[p as usize]).sum::<f64>() / 4.0;
                Old::Gauss(model.elements.iter().map(|c| [mean(c); 4]).collect())
            }
        };
        let local = body.map.unknowns_before(model.nodes);
        let solver = Equilibrium::new(
            &params.solver,
            || model.pattern_from(&body.map, 0),
            || model.pattern_from(&body.map, local),
            &body.unknown_positions(local),
            model.spacing,
        )?;
        let loads = Loads::new(scene, &body)?;
        let q = body.start();
        let mut values = vec![0.0; body.map.values()];
        body.map.expand(&q, &body.given(0.0), &mut values);
        Ok(Local {
            body,
            model,
            solver,
            probes,
            loads,
            q,
            rate: None,
            values,
            old,
        })
    }

    /// Densities at the nodes: of Gauss densities, the mean of the nearest in each element around.
    fn at_nodes(&self) -> Vec<f64> {
        // Gauss point nearest to each corner: they are numbered along x first, corners go round.
        const NEAREST: [usize; 4] = [0, 1, 3, 2];
        match &self.old {
            Old::Nodes(_) => self.values[..self.model.nodes].to_vec(),
            Old::Gauss(gauss) => (0..self.model.nodes)
                .map(|p| {
                    let around = self.model.around(p);
                    let sum: f64 = around
                        .iter()
                        .map(|&(e, c)| gauss[e as usize][NEAREST[c as usize]])
                        .sum();
                    sum / around.len() as f64
                })
                .collect(),
        }
    }
}

impl ContinuumParams {
    fn law(&self, scene: &Scene) -> Result<Energy> {
        let usable =
            self.young > 0.0 && self.young.is_finite() && (-0.99..=0.99).contains(&self.poisson);
        if !usable {
            return Err(Error::setting(
                "physics.continuum.young",
                format!("found young = {}, poisson = {}", self.young, self.poisson),
                "give a positive modulus and a plane-stress Poisson's ratio between -0.99 and 0.99",
            ));
        }
        Ok(match self.energy {
            EnergyLaw::StVenantKirchhoff => Energy::plane_stress(self.young, self.poisson),
            EnergyLaw::IsotropicBonds => Energy::isotropic_bonds(self.young),
            EnergyLaw::StencilBonds => {
                let stencil = scene.stencil()?;
                let quarter =
                    0.25 * micromodulus_discrete(self.young, &stencil) * stencil.spacing.powi(2);
                let bond = |b: &crate::topology::family::Bond| {
                    (b.xi.map(|v| v / b.length), quarter * b.length * b.share)
                };
                Energy::Bonds(stencil.bonds.iter().map(bond).collect())
            }
        })
    }
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

impl Marching for Local {
    fn advance(&mut self, before: f64, now: f64) -> std::result::Result<Advance, NotConverged> {
        let given = self.body.given(now);
        let held = self.body.given(before);
        let load = self.loads.at(now, given.len());
        let loads_move = load != self.loads.at(before, given.len());
        let nudged = nudge(&held, &given);
        let step = |given| Step {
            model: &self.model,
            map: &self.body.map,
            given,
            old: &self.old,
            dt: now - before,
            load: &load,
        };
        let mut q = self.q.clone();
        let moved = given != held;
        if moved {
            self.solver
                .predict(&step(&held), &step(&nudged), NUDGE, &mut q)?;
        }
        let steady = !moved && !loads_move;
        let rate = self
            .rate
            .as_deref()
            .filter(|_| steady)
            .map(|r| (r, now - before));
        let advance = self.solver.solve(&step(&given), &mut q, rate)?;
        // What a change of supports or loads moved does not go on.
        self.rate = steady.then(|| rate_of(&self.q, &q, now - before));
        self.q = q;
        self.body.map.expand(&self.q, &given, &mut self.values);
        self.old = match &self.old {
            Old::Nodes(_) => Old::Nodes(self.values[..self.model.nodes].to_vec()),
            Old::Gauss(gauss) => Old::Gauss(self.model.gauss_densities(
                &self.values,
                gauss,
                now - before,
            )),
        };
        Ok(advance)
    }

    fn corners(&self) -> Vec<f64> {
        let loads = self.loads.0.iter().flat_map(|(s, _)| s.corners()).copied();
        self.body.corners().into_iter().chain(loads).collect()
    }

    fn densities(&self) -> Vec<f64> {
        let reference = self.model.weight.reference;
        self.at_nodes()
            .iter()
            .map(|rho| (rho - reference) / reference)
            .collect()
    }

    fn frame(&self, t: f64, with_fields: bool) -> Frame {
        let change = self.densities();
        self.probes
            .frame(t, &self.body, &self.values, change, with_fields)
    }
}
