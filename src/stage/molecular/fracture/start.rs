//! Owns what fracture starts from: the load at one, and the body before anything is broken.

use super::{Front, Ledger};
use crate::error::{Error, Result};
use crate::physics::anisotropic::toughness::critical_energy;
use crate::stage::molecular::crack::Crack;
use crate::stage::molecular::setup::Setup;
use crate::stage::molecular::solid::{DISPLACEMENT, Solid};
use crate::stage::molecular::window::Window;
use crate::stage::molecular::{Fracture, Molecular};
use crate::stage::scene::Scene;

/// What is held at load one. Refuses holds that do not grow in proportion to time.
pub fn unit_load<const D: usize>(
    scene: &Scene,
    model: &Molecular,
    setup: &Setup,
    solid: &Solid<D>,
    end: f64,
) -> Result<Vec<Option<f64>>> {
    let mut without = model.clone();
    without.known.clear();
    let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
    let full = setup.held(scene, &without, names, end, None)?;
    let half = setup.held(scene, &without, names, 0.5 * end, None)?;
    let proportional = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (b - 0.5 * a).abs() <= 1e-9 * a.abs(),
        _ => true,
    };
    if !full.iter().zip(&half).all(proportional)
        || !scene.load.iter().all(|l| is_electric(&l.component))
    {
        return Err(Error::setting(
            "hold.value",
            "fracture follows displacements that grow in proportion to time, found another load",
            "use value = { times = [0, end], values = [0, largest] }, or 0",
        ));
    }
    let known = |v: usize| full[v].map(|f| f / end).or(solid.held[v]);
    Ok((0..full.len()).map(known).collect())
}

fn is_electric(component: &str) -> bool {
    component == "potential" || component == "temperature"
}

impl<'a, const D: usize> Front<'a, D> {
    /// The body at rest, and a window about the bonds that will break first.
    pub fn new(
        scene: &'a Scene,
        model: &'a Molecular,
        params: &'a Fracture,
        solid: Solid<D>,
        setup: &'a Setup,
    ) -> Result<Self> {
        let angle = model
            .elasticity
            .as_ref()
            .map_or(0.0, |e| e.angle_deg)
            .to_radians();
        let law = critical_energy(
            params.energy[0],
            params.energy[1],
            setup.horizon(),
            params.exponent,
            params.frequency,
            angle,
        )?;
        let n = setup.points.len();
        let mut sound: Vec<bool> = (0..n)
            .map(|p| (0..D).any(|d| solid.held[p * D + d].is_some()))
            .collect();
        for region in &params.unbreakable {
            let chosen = region.select(&setup.points, n, "fracture.unbreakable")?;
            chosen.into_iter().for_each(|p| sound[p] = true);
        }
        let mut stop = vec![false; n];
        if let Some(region) = &params.stop {
            let chosen = region.select(&setup.points, n, "fracture.stop")?;
            chosen.into_iter().for_each(|p| stop[p] = true);
        }
        let conductor = match &model.conduction {
            Some(conduction) => Some(setup.conductor(model, conduction)?.0),
            None => None,
        };
        let (window, x) = Window::new(&solid.body, setup, &solid.held, &[])?;
        let mut front = Front {
            critical: setup.bonds.iter().map(|b| law.at(b.psi())).collect(),
            broken: vec![false; setup.family.len()],
            order: Vec::new(),
            before_window: 0,
            scene,
            model,
            params,
            setup,
            solid,
            sound,
            crack: Crack::new(params.tip, stop),
            conductor,
            window,
            bonds: Vec::new(),
            x,
            far: 0.0,
            stale: false,
            step: 1,
            events: 0,
            lambda: 0.0,
            recorded: 0.0,
            ledger: Ledger::default(),
            peak: 0.0,
            worst_balance: 0.0,
            solves: 0,
            iterations: 0,
            windows: 0,
            potential_drop: 0.0,
            potential_unknowns: 0,
        };
        front.move_window()?;
        Ok(front)
    }
}
