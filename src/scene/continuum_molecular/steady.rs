//! Owns solutions of elastic bodies without cracks that grow, and what all solutions report.

pub mod coupled;
pub mod difference;
mod section;

use super::Molecular;
use super::equilibrium::solve;
use super::setup::{Conductor, Setup};
use super::solid::Solid;
use crate::error::Result;
use crate::scene::frame::{Field, Frame, Observer, Summary, Values};
use crate::scene::setting::Setting;
use difference::{DIFFERENCE, Difference, at_points, difference};
use section::sections;

/// Nodal forces of `load`: totals spread evenly over their regions, per unit thickness.
pub fn loads<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    names: [&[&str]; D],
    t: f64,
) -> Result<Vec<[f64; D]>> {
    let mut force = vec![[0.0; D]; setup.points.len()];
    for (k, load) in scene.load.iter().enumerate() {
        load.value.check(&format!("load[{k}].value"))?;
        let Some(d) = names
            .iter()
            .position(|n| n.contains(&load.component.as_str()))
        else {
            continue;
        };
        let chosen = load.region.select(
            &setup.points,
            setup.points.len(),
            &format!("load[{k}].region"),
        )?;
        let share = load.value.at(t) / (chosen.len() as f64 * model.thickness);
        chosen.into_iter().for_each(|p| force[p][d] += share);
    }
    Ok(force)
}

/// Displacements as a field.
pub fn displacement<const D: usize>(x: &[[f64; D]], scale: f64) -> Field {
    Field {
        name: "displacement",
        values: Values::Vector(x.iter().map(|u| [scale * u[0], scale * u[1]]).collect()),
    }
}

/// Static equilibrium.
pub fn deform<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    mut solid: Solid<D>,
    conductor: Option<Conductor>,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    observer.start(&setup.points, 1)?;
    let names: [&[&str]; D] = std::array::from_fn(|d| super::solid::DISPLACEMENT[d]);
    let t = scene.time.as_ref().map_or(1.0, |time| time.end);
    let heat = coupled::warm(scene, model, setup, &mut solid, conductor.as_ref())?;
    let mut force = loads(scene, model, setup, names, t)?;
    if let Some(thermal) = &solid.thermal {
        let pushed = thermal.forces(&solid.body, &setup.bonds, &solid.moduli, setup.cell);
        for (f, extra) in force.iter_mut().zip(pushed) {
            f.iter_mut().zip(extra).for_each(|(f, e)| *f += e);
        }
    }
    let (x, unknowns) = solve(&solid.body, &setup.points, &solid.held, &force)?;
    let energy = energy_density(&solid, setup, &x);
    let total = model.thickness * setup.cell * energy.iter().sum::<f64>();
    let mut numbers = vec![("energy".to_owned(), total)];
    let middle = full_point(setup);
    if let Some(middle) = middle {
        numbers.push(("energy_density_inside".into(), energy[middle]));
    }
    if let Some([e11, e22, shear]) = strain_of(model) {
        let [a11, a22, a12] = match (&solid.thermal, middle) {
            (Some(t), Some(p)) => t.expansion.map(|a| a * t.rise[p]),
            _ => [0.0; 3],
        };
        let exact = solid
            .tensor
            .energy_density([e11 - a11, e22 - a22, shear - 2.0 * a12]);
        numbers.push(("energy_density_local".into(), exact));
    }
    let mut fields = vec![displacement(&x, 1.0)];
    if let Some(known) = setup.known_field::<D>(model, Some(&solid.tensor)) {
        let held = |p: usize| (0..D).all(|d| solid.held[p * D + d].is_some());
        let difference = difference(&x, &known, held, 2);
        numbers.extend(difference.iter().flat_map(Difference::numbers));
        fields.push(scalar(DIFFERENCE, at_points(difference, x.len())));
    }
    if D == 3 {
        fields.push(scalar("rotation", x.iter().map(|u| u[2]).collect()));
    }
    let [s11, s22, s12] = stress(&solid, setup, &x);
    fields.push(scalar("energy", energy));
    fields.push(scalar("stress_xx", s11));
    fields.push(scalar("stress_yy", s22));
    fields.push(scalar("stress_xy", s12));
    let sections = sections(&solid, setup, &x);
    let component = |of: &[[f64; 2]], i: usize| of.iter().map(|t| t[i]).collect();
    fields.push(scalar("section_xx", component(&sections.normal_x, 0)));
    fields.push(scalar("section_yy", component(&sections.normal_y, 1)));
    fields.push(scalar("section_xy", component(&sections.normal_y, 0)));
    let current = coupled::sense(scene, model, setup, (&solid, &x), conductor.as_ref())?;
    let mut stored = solid.body.bond_values();
    for added in [heat, current] {
        numbers.extend(added.numbers);
        fields.extend(added.fields);
        stored += added.bond_values;
    }
    observer.frame(&Frame {
        time: t,
        numbers: numbers.clone(),
        fields,
    })?;
    Ok(summary(setup, unknowns, stored, 1, numbers))
}

/// The strain of a body held at one everywhere.
fn strain_of(model: &Molecular) -> Option<[f64; 3]> {
    model.known.iter().find_map(|k| match k.field {
        super::KnownField::Strain(e) => Some(e),
        _ => None,
    })
}

/// A point with a full family, the nearest to the middle of the list.
fn full_point(setup: &Setup) -> Option<usize> {
    let n = setup.points.len();
    let full = |p: &usize| setup.family.range(*p).len() == setup.bonds.len();
    (0..n).map(|k| (n / 2 + k) % n).find(full)
}

/// W at each point (eq. 11), of what strains the bonds beyond their thermal strain.
fn energy_density<const D: usize>(solid: &Solid<D>, setup: &Setup, x: &[[f64; D]]) -> Vec<f64> {
    let density = |p: usize| {
        solid
            .body
            .row(p)
            .map(|(q, kind, factor)| {
                let b = &setup.bonds[kind];
                let w = b.energy(&solid.moduli[kind], &solid.strained(x, p, q, b));
                0.5 * factor * w * b.volume_mm2
            })
            .sum()
    };
    (0..setup.points.len()).map(density).collect()
}

/// Stress from bond forces, σ = ½ Σ f ⊗ ξ α Δv (symmetric part): the mean over all sections through a point of the
/// traction of eq. 83.
pub fn stress<const D: usize>(solid: &Solid<D>, setup: &Setup, x: &[[f64; D]]) -> [Vec<f64>; 3] {
    let at = |p: usize| {
        let mut s = [0.0; 3];
        for (q, kind, factor) in solid.body.row(p) {
            let (b, k) = (&setup.bonds[kind], &solid.moduli[kind]);
            let d = solid.strained(x, p, q, b);
            let weight = 0.5 * factor * b.volume_mm2 * b.length_mm;
            let (axial, lateral) = (weight * k.axial * d.stretch, weight * k.shear * d.shear);
            let [nx, ny] = b.n;
            let f = [axial * nx - lateral * ny, axial * ny + lateral * nx];
            s[0] += f[0] * nx;
            s[1] += f[1] * ny;
            s[2] += 0.5 * (f[0] * ny + f[1] * nx);
        }
        s
    };
    let all: Vec<[f64; 3]> = (0..setup.points.len()).map(at).collect();
    [0, 1, 2].map(|i| all.iter().map(|s| s[i]).collect())
}

pub fn scalar(name: &'static str, values: Vec<f64>) -> Field {
    Field {
        name,
        values: Values::Scalar(values),
    }
}

/// `bond_values` says how many values are stored to tell bonds apart.
pub fn summary(
    setup: &Setup,
    unknowns: usize,
    bond_values: usize,
    steps: usize,
    mut numbers: Vec<(String, f64)>,
) -> Summary {
    numbers.push(("bond_values".into(), bond_values as f64));
    Summary {
        points: setup.points.len(),
        unknowns,
        bonds: setup.bond_count(),
        steps,
        converged: true,
        step_statistics: None,
        numbers,
        stopped: None,
    }
}
