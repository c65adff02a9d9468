//! Owns conduction of heat and of charge: steady, transient, and through a body whose bonds break.

use super::equilibrium::{Factorised, factorise, right_hand_side, solve};
use super::path::{CONDUCTED, STEADY, drop, isolated};
use super::setup::{Conductor, Setup};
use super::steady::difference::{DIFFERENCE, Difference, at_points, difference};
use super::steady::{loads, scalar, summary};
use super::{KnownField, Molecular, Steady, Transient};
use crate::error::{Error, Result};
use crate::operator::Operator;
use crate::physics::continuum_molecular::body::Body;
use crate::scene::conditions::Time;
use crate::scene::frame::{Field, Frame, Observer, Summary, Values};
use crate::scene::setting::Setting;

/// Steady conduction.
pub fn steady(
    scene: &Setting,
    model: &Molecular,
    steady: &Steady,
    (body, k): Conductor,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    observer.start(&setup.points, 1)?;
    let held = setup.held(scene, model, CONDUCTED, STEADY, None)?;
    let force = loads(scene, model, setup, CONDUCTED, STEADY)?;
    let (x, unknowns) = solve(&body, &setup.points, &held, &force)?;
    let frame = conducted(model, steady, setup, (&body, &k), &held, &x)?;
    observer.frame(&frame)?;
    let stored = body.bond_values();
    Ok(summary(setup, unknowns, stored, 1, frame.numbers))
}

/// Transient conduction.
pub fn transient(
    scene: &Setting,
    model: &Molecular,
    params: &Transient,
    (body, k): Conductor,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let time = marching(scene)?;
    let mut solver = TimeStepper::new(scene, model, setup, body, params.capacity, time.step)?;
    let start = vec![params.initial; setup.points.len()];
    solver.run(scene, model, setup, &k, start, observer)
}

/// # Errors
/// A scene without time.
fn marching(scene: &Setting) -> Result<&Time> {
    let advice = "add [time] with end and step";
    let missing = || Error::setting("time", "a transient scene without time", advice);
    scene.time.as_ref().ok_or_else(missing)
}

/// Numbers and fields of a temperature or potential.
fn conducted(
    model: &Molecular,
    steady: &Steady,
    setup: &Setup,
    (body, k): (&Body<1>, &[f64]),
    held: &[Option<f64>],
    x: &[[f64; 1]],
) -> Result<Frame> {
    let values: Vec<f64> = x.iter().map(|v| v[0]).collect();
    let largest = values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
    let mut numbers = vec![("largest".to_owned(), largest)];
    let flux = flux(setup, body, k, &values);
    let mut fields = fluxes(&values, &flux);
    if let Some(known) = setup.known_field::<1>(model, None) {
        let is_held = |p: usize| held[p].is_some();
        let of_temperature = difference(x, &known, is_held, 1);
        numbers.extend(of_temperature.iter().flat_map(Difference::numbers));
        fields.push(scalar(DIFFERENCE, at_points(of_temperature, x.len())));
        let exact = known_flux(model, steady, setup)?;
        if let Some(difference) = difference(&flux, &exact, is_held, 2) {
            numbers.push(("relative_difference_of_flux".into(), difference.relative));
        }
    }
    if let Some(probes) = steady.probes {
        numbers.push(("potential_drop".into(), drop(setup, probes, &values)));
    }
    Ok(Frame {
        time: STEADY,
        numbers,
        fields,
    })
}

/// A temperature with its flux.
fn fluxes(temperature: &[f64], flux: &[[f64; 2]]) -> Vec<Field> {
    vec![
        scalar("temperature", temperature.to_vec()),
        Field {
            name: "flux",
            values: Values::Vector(flux.to_vec()),
        },
        scalar("flux_size", flux.iter().map(|q| q[0].hypot(q[1])).collect()),
    ]
}

/// -K ∇T of the known polynomial (eqs. 171, 172).
fn known_flux(model: &Molecular, steady: &Steady, setup: &Setup) -> Result<Vec<[f64; 2]>> {
    let Some(KnownField::Polynomial(terms)) = model.one_known().map(|k| &k.field) else {
        return Ok(vec![[0.0; 2]; setup.points.len()]);
    };
    let [[k11, k12], [_, k22]] = *steady.conduction.tensor()?.k();
    let slope = |n: f64, x: f64| if n == 0.0 { 0.0 } else { n * x.powf(n - 1.0) };
    let at = |p: usize| {
        let [x, y] = setup.points.position(p);
        let (dx, dy) = terms.iter().fold((0.0, 0.0), |(dx, dy), [a, b, c]| {
            let (along_x, along_y) = (slope(*a, x) * y.powf(*b), slope(*b, y) * x.powf(*a));
            (dx + c * along_x, dy + c * along_y)
        });
        [-(k11 * dx + k12 * dy), -(k12 * dx + k22 * dy)]
    };
    Ok((0..setup.points.len()).map(at).collect())
}

/// Heat flux from the bonds to warmer points only, each counted in full (eq. 170 with its sign).
pub fn flux(setup: &Setup, body: &Body<1>, k: &[f64], t: &[f64]) -> Vec<[f64; 2]> {
    let at = |p: usize| {
        let mut q = [0.0; 2];
        for (other, kind, factor) in body.row(p).filter(|(other, _, _)| t[*other] > t[p]) {
            let b = &setup.bonds[kind];
            let share = factor * k[kind] * (t[other] - t[p]) / b.length_mm * b.volume_mm2;
            q[0] -= share * b.n[0];
            q[1] -= share * b.n[1];
        }
        q
    };
    (0..t.len()).map(at).collect()
}

/// Transient conduction by the trapezoidal rule: (C/Δt + A/2) ΔT = -A T - A ΔT_held/2 + f. It keeps a jump swinging from
/// step to step, so each of the first steps is two halves by the implicit Euler rule, which damps it and has the same
/// matrix, (2C/Δt + A) ΔT = -A T - A ΔT_held + f; the order stays two (R. Rannacher, Numer. Math. 43 (1984) 309-327).
pub struct TimeStepper {
    body: Body<1>,
    factorised: Factorised,
    step: f64,
    done: usize,
}

/// Steps by the implicit Euler rule.
const DAMPED: usize = 2;

impl TimeStepper {
    pub fn new(
        scene: &Setting,
        model: &Molecular,
        setup: &Setup,
        mut body: Body<1>,
        capacity: f64,
        step: f64,
    ) -> Result<Self> {
        let held = setup.held(scene, model, CONDUCTED, 0.0, None)?;
        // Half the conductances stand in the matrix of a step; the operator itself keeps them whole.
        let halved = |b: &crate::physics::continuum_molecular::bond::Blocks<1>| {
            crate::physics::continuum_molecular::bond::Blocks {
                own: [[0.5 * b.own[0][0]]],
                cross: [[0.5 * b.cross[0][0]]],
            }
        };
        let whole = body.blocks.clone();
        body.blocks = whole.iter().map(halved).collect();
        let extra = vec![capacity * setup.cell / step; setup.points.len()];
        let factorised = factorise(&body, &setup.points, &held, &extra, &[])?;
        body.blocks = whole;
        Ok(TimeStepper {
            body,
            factorised,
            step,
            done: 0,
        })
    }

    /// One step from `t` to `t + step`, `x` in place.
    pub fn advance(
        &mut self,
        x: &mut [[f64; 1]],
        before: &[Option<f64>],
        after: &[Option<f64>],
        force: &[[f64; 1]],
    ) {
        let change = |share: f64| -> Vec<Option<f64>> {
            let both = before.iter().zip(after);
            both.map(|(a, b)| b.map(|b| share * (b - a.unwrap_or(0.0))))
                .collect()
        };
        if self.done < DAMPED {
            let half = change(0.5);
            self.solve(x, &half, 1.0, force);
            self.solve(x, &half, 1.0, force);
        } else {
            self.solve(x, &change(1.0), 0.5, force);
        }
        self.done += 1;
    }

    /// Adds (C/Δt + A/2)⁻¹ (f - A (T + θ ΔT_held)), times a half for θ = 1.
    fn solve(
        &mut self,
        x: &mut [[f64; 1]],
        change: &[Option<f64>],
        theta: f64,
        force: &[[f64; 1]],
    ) {
        let mut r = vec![[0.0]; x.len()];
        let at: Vec<[f64; 1]> = x
            .iter()
            .zip(change)
            .map(|(x, c)| [x[0] + theta * c.unwrap_or(0.0)])
            .collect();
        self.body.apply(&at, &mut r);
        for (p, r) in r.iter_mut().enumerate() {
            r[0] = (force.get(p).map_or(0.0, |f| f[0]) - r[0]) * 0.5 / theta;
        }
        let mut q = self.factorised.restrict(&r);
        self.factorised.llt.solve(&mut q);
        let dx: Vec<[f64; 1]> = self.factorised.expand(&q, change);
        x.iter_mut().zip(dx).for_each(|(x, d)| x[0] += d[0]);
    }

    fn run(
        &mut self,
        scene: &Setting,
        model: &Molecular,
        setup: &Setup,
        k: &[f64],
        start: Vec<f64>,
        observer: &mut dyn Observer,
    ) -> Result<Summary> {
        let steps = marching(scene)?.steps()? as usize;
        observer.start(&setup.points, steps)?;
        let mut held = setup.held(scene, model, CONDUCTED, 0.0, None)?;
        let mut x: Vec<[f64; 1]> = start
            .iter()
            .zip(&held)
            .map(|(s, h)| [h.unwrap_or(*s)])
            .collect();
        let mut numbers = Vec::new();
        for step in 1..=steps {
            let t = self.step * step as f64;
            let next = setup.held(scene, model, CONDUCTED, t, None)?;
            let force = loads(scene, model, setup, CONDUCTED, t - 0.5 * self.step)?;
            self.advance(&mut x, &held, &next, &force);
            held = next;
            let values: Vec<f64> = x.iter().map(|v| v[0]).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let largest = values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
            numbers = vec![("mean".to_owned(), mean), ("largest".into(), largest)];
            let mut frame = Frame {
                time: t,
                numbers: numbers.clone(),
                fields: Vec::new(),
            };
            if step == steps || scene.output.due(t - self.step, t) {
                frame.fields = fluxes(&values, &flux(setup, &self.body, k, &values));
            }
            observer.frame(&frame)?;
        }
        Ok(summary(
            setup,
            self.factorised.reduction.unknowns(),
            self.body.bond_values(),
            steps,
            numbers,
        ))
    }
}

/// The potential at time `t` of a body whose broken bonds no longer conduct, per unit thickness, and the number of its
/// unknowns. Not a number where a current has no path.
pub fn potential(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    body: &Body<1>,
    broken: &[bool],
    t: f64,
) -> Result<(Vec<f64>, usize)> {
    let held = setup.held(scene, model, CONDUCTED, t, None)?;
    let force = loads(scene, model, setup, CONDUCTED, t)?;
    let isolated = isolated(&setup.family, broken, &held, &force);
    let mut factorised = factorise(body, &setup.points, &held, &[], &[])?;
    let mut q = right_hand_side(body, &factorised, &held, &force);
    factorised.llt.solve(&mut q);
    let x: Vec<[f64; 1]> = factorised.expand(&q, &held);
    let value = |(x, isolated): (&[f64; 1], bool)| if isolated { f64::NAN } else { x[0] };
    Ok((x.iter().zip(isolated).map(value).collect(), q.len()))
}
