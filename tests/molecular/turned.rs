//! Crack, material and field turned together against the grid.

use super::{Kept, solved};
use bonepd_ct::physics::continuum_molecular::crack_tip::CrackTip;
use bonepd_ct::physics::continuum_molecular::tensor::PlaneTensor;

const MODULI: [f64; 6] = [1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0];
const K: [f64; 2] = [1.0, 0.4];

fn turned(degrees: f64) -> Kept {
    let (s, c) = degrees.to_radians().sin_cos();
    let text = format!(
        "title = 'crack tip'
        [geometry.disc]
        radius = 1
        [grid]
        spacing = 0.05
        horizon_ratio = 3
        partial_volumes = true
        [physics.continuum-molecular]
        cracks = [[{}, {}, 0, 0]]
        known = [{{ region = {{ outside = [0, 0, 0.825] }}, field = {{ crack-tip = {K:?} }}, angle_deg = {degrees} }}]
        [physics.continuum-molecular.elasticity]
        moduli = {MODULI:?}
        angle_deg = {degrees}",
        -2.0 * c,
        -2.0 * s
    );
    solved(&text).1
}

/// Turned by a right angle they are the same on the grid: displacements turn with them.
#[test]
fn a_crack_tip_may_lie_across_the_grid() {
    let (along, across) = (turned(0.0), turned(90.0));
    let (u, v) = (along.vector("displacement"), across.vector("displacement"));
    let place = |p: [f64; 2]| [(p[0] * 40.0).round() as i64, (p[1] * 40.0).round() as i64];
    for (p, u) in along.positions.iter().zip(u) {
        let turned = place([-p[1], p[0]]);
        let there = across.positions.iter().position(|q| place(*q) == turned);
        let v = v[there.unwrap()];
        assert!(
            (v[0] + u[1]).abs() < 1e-11 && (v[1] - u[0]).abs() < 1e-11,
            "{p:?}: {u:?} {v:?}"
        );
    }
}

/// At any other angle the grid differs, the closed form does not: the error stays that of the grid. (A right angle does not
/// tell which way the material turns.)
#[test]
fn a_crack_tip_may_lie_at_any_angle_to_the_grid() {
    let tip = CrackTip::new(&PlaneTensor::from_moduli(MODULI).unwrap());
    for degrees in [0.0_f64, 30.0, 70.0, -40.0] {
        let kept = turned(degrees);
        let (s, c) = degrees.to_radians().sin_cos();
        let (mut error, mut size) = (0.0, 0.0);
        for (p, u) in kept.positions.iter().zip(kept.vector("displacement")) {
            if p[0].hypot(p[1]) > 0.825 {
                continue;
            }
            let exact = tip.displacement([c * p[0] + s * p[1], c * p[1] - s * p[0]], K);
            let e = [
                c * u[0] + s * u[1] - exact[0],
                c * u[1] - s * u[0] - exact[1],
            ];
            error += e[0] * e[0] + e[1] * e[1];
            size += exact[0] * exact[0] + exact[1] * exact[1];
        }
        let error = f64::sqrt(error / size);
        assert!(error < 0.01, "turned by {degrees}: {error}");
    }
}
