//! Bodies that yield against closed forms.

use super::bodies::{Body, Field, assert_balanced, asymmetric, mesh, von_mises};
use bonepd_ct::discretisation::voxels::VoxelMesh;
use bonepd_ct::physics::plasticity::Elastic;
use bonepd_ct::pipeline::apparent::discretisation::steps::{History, Outcome};

#[test]
fn a_bar_flows_at_its_yield_stress() {
    for (strain, law, expected) in [
        (-0.02, von_mises(68.0, 0.0), 68.0),
        (0.02, asymmetric(50.0, 75.0), 50.0),
        (-0.02, asymmetric(50.0, 75.0), 75.0),
    ] {
        let bar = Body::block(mesh([4, 3, 5], 0.02, |_| true), strain, false);
        let (outcome, history) = bar.load(law, &Body::stepping(8));
        assert_eq!(outcome, Outcome::Done);
        let last = bar.stress(history.steps.last().unwrap(), strain).abs();
        assert!((last / expected - 1.0).abs() < 1e-6, "{law:?}: {last}");
        assert_balanced(&history.steps);
    }
}

/// Sides held: yield where the difference of the stresses is σ_y, then the slope is the bulk modulus.
#[test]
fn a_confined_bar_goes_on_with_its_bulk_modulus() {
    let n = [4, 4, 4];
    let strain = -0.03;
    let mut bar = Body::new(mesh(n, 0.02, |_| true), |at, c| at[c] == 0 || at[c] == n[c]);
    for node in 0..bar.mesh.len() {
        bar.ends[node][2] = strain * bar.mesh.position(node)[2];
    }
    let (_, history) = bar.load(von_mises(68.0, 0.0), &Body::stepping(6));
    let elastic = Elastic::of(bar.young, bar.poisson);
    let last = bar.stress(history.steps.last().unwrap(), strain);
    let expected = elastic.bulk_mpa * strain - 2.0 / 3.0 * 68.0;
    assert!((last / expected - 1.0).abs() < 1e-6, "{last} {expected}");
    assert_balanced(&history.steps);
}

#[test]
fn a_hardening_bar_has_the_slope_of_its_tissue() {
    let strain = 0.02;
    let bar = Body::block(mesh([3, 3, 4], 0.02, |_| true), strain, false);
    let (_, history) = bar.load(von_mises(68.0, 500.0), &Body::stepping(10));
    let stress = |k: usize| bar.stress(&history.steps[k], strain);
    let slope = (stress(9) - stress(5)) / (0.4 * strain);
    assert!(
        (slope / (1e4 * 500.0 / 10_500.0) - 1.0).abs() < 1e-5,
        "{slope}"
    );
}

/// The cantilever of Faim's manual: 100 × 0.5 × 10 mm, perfect at 120 MPa, F_y = 10 N.
fn cantilever(force_n: f64) -> (Outcome, History, Body) {
    let n = [200, 1, 20];
    let mut body = Body::new(mesh(n, 0.5, |_| true), |at, c| {
        at[0] == 0 && (c != 1 || at[2] == 0 && at[1] == 0)
    });
    (body.young, body.poisson) = (200_000.0, 0.3);
    let mut forces = vec![[0.0; 3]; body.mesh.len()];
    for (node, f) in forces.iter_mut().enumerate() {
        let at = body.mesh.indices(node);
        if body.mesh.around[node] != 0 && at[0] == 200 {
            let inner = at[2] != 0 && at[2] != 20;
            f[2] = force_n / 40.0 * if inner { 1.0 } else { 0.5 };
        }
    }
    body.forces = Some(forces);
    let mut how = Body::stepping(14);
    // Under forces the balance of the energies is off by the root of this.
    how.params.tolerance = 1e-13;
    let (outcome, history) = body.load(von_mises(120.0, 0.0), &how);
    (outcome, history, body)
}

fn tip_mm(body: &Body, history: &History) -> f64 {
    let face = |node: &usize| body.mesh.around[*node] != 0 && body.mesh.indices(*node)[0] == 200;
    let nodes: Vec<usize> = (0..body.mesh.len()).filter(face).collect();
    nodes.iter().map(|node| history.u[*node][2]).sum::<f64>() / nodes.len() as f64
}

/// Beam theory, or Faim's own value, whichever is nearer: within 1 %.
#[test]
fn a_cantilever_bends_as_beam_theory_says() {
    for (force_n, theory, faim) in [(10.0, 0.4, 0.4020), (14.0, 0.6188, 0.6149)] {
        let (outcome, history, body) = cantilever(force_n);
        assert_eq!(outcome, Outcome::Done, "{force_n} N");
        let tip = tip_mm(&body, &history);
        println!("{force_n} N: tip {tip} mm");
        let off = [theory, faim].map(|e: f64| (tip / e - 1.0).abs());
        assert!(off[0].min(off[1]) < 0.01, "{force_n} N: {tip} mm");
        assert_balanced(&history.steps);
    }
}

/// 15 N is the collapse load `σ_y b h² / (4 L)` of beam theory: there the tip moves without bound, by 0.889 mm as the hinge forms. Here the
/// clamp also holds the root's height, which makes its surroundings stronger: the hinge forms some millimetres from it, the arm is shorter, and
/// 15 N are borne with a tip between the 14 N value and that; Faim has 0.756 mm.
#[test]
fn a_cantilever_still_bears_the_collapse_load_of_beam_theory() {
    let (outcome, history, body) = cantilever(15.0);
    assert_eq!(outcome, Outcome::Done);
    let tip = tip_mm(&body, &history);
    println!("15 N: tip {tip} mm");
    assert!((0.7..0.889).contains(&tip), "{tip}");
}

/// One eighth of a thick sphere under inner pressure, outer radius twice the inner, `wall` voxels between them.
struct Sphere {
    body: Body,
    inner: f64,
    outer: f64,
}

const FLOW_MPA: f64 = 68.0;

impl Sphere {
    /// Under 1 MPa.
    fn new(wall: usize) -> Sphere {
        let (inner, outer) = (wall as f64, 2.0 * wall as f64);
        let radius = |p: [usize; 3]| {
            let squares = p.map(|v| (v as f64 + 0.5).powi(2));
            squares.iter().sum::<f64>().sqrt()
        };
        let inside = |p: [usize; 3]| radius(p) > inner && radius(p) < outer;
        let n = 2 * wall;
        let mut body = Body::new(mesh([n; 3], 1.0, inside), |at, axis| at[axis] == 0);
        body.forces = Some(inner_pressure(&body.mesh, 1.0, |p| radius(p) <= inner));
        Sphere { body, inner, outer }
    }

    fn load(&mut self, pressure: f64, steps: u32) -> History {
        let forces = self.body.forces.as_mut().unwrap();
        forces.iter_mut().flatten().for_each(|f| *f *= pressure);
        let mut how = Body::stepping(steps);
        // Under forces the balance of the energies is off by the root of this.
        how.params.tolerance = 1e-13;
        let (outcome, history) = self.body.load(von_mises(FLOW_MPA, 0.0), &how);
        assert_eq!(outcome, Outcome::Done);
        let forces = self.body.forces.as_mut().unwrap();
        forces.iter_mut().flatten().for_each(|f| *f /= pressure);
        history
    }

    /// Mean of the outer staircase's nodes, each at its own radius: radial displacement over `expected`, less 1.
    fn off(&self, history: &History, expected: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for node in 0..self.body.mesh.len() {
            let x = self.body.mesh.position(node);
            let r = x.iter().map(|v| v * v).sum::<f64>().sqrt();
            if self.body.mesh.around[node] != 0 && r > self.outer - 1.0 {
                let u = history.u[node];
                sum += (0..3).map(|i| u[i] * x[i] / r).sum::<f64>() / expected(r);
                count += 1.0;
            }
        }
        sum / count - 1.0
    }

    /// Errors of the outer displacement: elastic, and with the plastic front in the middle of the wall.
    fn errors(wall: usize) -> [f64; 2] {
        let mut sphere = Sphere::new(wall);
        let (a, b) = (sphere.inner, sphere.outer);
        let (young, nu) = (sphere.body.young, sphere.body.poisson);
        let c = 0.5 * (a + b);
        let rest = sphere.load(1.0, 1);
        let elastic = |r: f64| {
            let scale = a.powi(3) / (young * (b.powi(3) - a.powi(3)));
            scale * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b.powi(3) / (2.0 * r * r))
        };
        // Beyond the front.
        let flowing = |r: f64| {
            let swell = 2.0 * (1.0 - 2.0 * nu) * r / (3.0 * b.powi(3));
            FLOW_MPA * c.powi(3) / young * (swell + (1.0 + nu) / (3.0 * r * r))
        };
        let surface = FLOW_MPA * (1.0 - nu) * c.powi(3) / (young * b * b);
        assert!((flowing(b) / surface - 1.0).abs() < 1e-12);
        let pressure = 2.0 * FLOW_MPA * ((c / a).ln() + (1.0 - (c / b).powi(3)) / 3.0);
        let end = sphere.load(pressure, 6);
        assert_balanced(&end.steps);
        let errors = [sphere.off(&rest, elastic), sphere.off(&end, flowing)];
        println!(
            "sphere, {wall} voxels of wall: elastic {:+.4}, flowing {:+.4}",
            errors[0], errors[1]
        );
        errors
    }
}

/// A thick sphere of perfect tissue under inner pressure (Hill 1950, ch. V): with the plastic front at `c` the pressure is
/// `2 σ_y (ln(c/a) + (1 − c³/b³)/3)` and the outer surface moves by `σ_y (1 − ν) c³ / (E b²)`.
#[test]
fn a_thick_sphere_under_pressure_flows_as_the_closed_form_says() {
    let [coarse, fine] = [8, 16].map(Sphere::errors);
    assert!(
        fine[1].abs() < 0.05,
        "outer displacement off by {}",
        fine[1]
    );
    // The staircase's steps of the surfaces are smaller.
    assert!(fine[1].abs() < coarse[1].abs(), "{coarse:?} {fine:?}");
    assert!(fine[0].abs() < coarse[0].abs(), "{coarse:?} {fine:?}");
}

#[test]
#[ignore = "needs a minute"]
fn a_sphere_of_24_voxels_of_wall_is_nearer() {
    let [coarse, fine] = [16, 24].map(Sphere::errors);
    assert!(fine[1].abs() < coarse[1].abs(), "{coarse:?} {fine:?}");
}

/// Pressure on the faces of elements that border the cavity, a quarter to each of a face's corners.
fn inner_pressure(mesh: &VoxelMesh, pressure: f64, cavity: impl Fn([usize; 3]) -> bool) -> Field {
    let mut forces = vec![[0.0; 3]; mesh.len()];
    let numbers: std::collections::HashMap<[u32; 3], usize> = (0..mesh.len())
        .filter(|&i| mesh.around[i] != 0)
        .map(|i| (mesh.indices(i), i))
        .collect();
    for (node, element) in mesh.low_corner_elements().enumerate() {
        if element.is_none() {
            continue;
        }
        let at = mesh.indices(node).map(|v| v as usize);
        for axis in 0..3 {
            let mut below = at;
            if at[axis] == 0 {
                continue;
            }
            below[axis] -= 1;
            if !cavity(below) {
                continue;
            }
            for k in 0..4 {
                let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut corner = at.map(|v| v as u32);
                corner[p] += k & 1;
                corner[q] += k >> 1;
                forces[numbers[&corner]][axis] += 0.25 * pressure;
            }
        }
    }
    forces
}
