//! Owns conjugate gradients for a correction `A x = b` in single precision: what Newton's method asks for, which makes up for
//! rounding in its next iteration.

use crate::operator::held::Held;
use crate::operator::{MixedPrecision, SinglePreconditioner};
use crate::par::{CHUNK, each_chunk};
use crate::solver::cg::single::{Single, advance, combine, dot, image, narrow};

/// When to stop: at a part of the start's squared energy norm, `rᵀz`, or at a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionParams {
    pub reduction: f64,
    pub enough: f64,
    pub max_iterations: usize,
}

/// What a correction came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corrected {
    pub iterations: usize,
    /// `rᵀz` of the right-hand side and what is left of it: squared energies of the error, by the preconditioner.
    pub start: f64,
    pub left: f64,
    /// True where a direction had no stiffness, or a number was none: what was found until then is kept.
    pub broke_down: bool,
}

/// Room for the vectors, made once.
pub struct Room {
    r: Single,
    p: Single,
    z: Single,
    spare: Single,
}

impl Room {
    pub fn new(sites: usize) -> Self {
        let zero = || vec![[0.0; 3]; sites];
        Room {
            r: zero(),
            p: zero(),
            z: zero(),
            spare: zero(),
        }
    }
}

/// `bᵀ M⁻¹ b` of a right-hand side `b`, which is zero in held components: its squared energy. 0 where it is nothing.
pub fn energy(
    preconditioner: &impl SinglePreconditioner<3>,
    b: &[[f64; 3]],
    room: &mut Room,
) -> f64 {
    let unit = norm(b);
    if unit == 0.0 {
        return 0.0;
    }
    scaled(b, unit, &mut room.r);
    preconditioner.apply_single(&room.r, &mut room.z, &mut room.spare);
    unit * unit * dot(&room.r, &room.z)
}

/// Solves for `x` from zero; `b` is zero in held components, and so is `x`. [`energy`] of the same `b` was asked for last.
pub fn solve(
    operator: &impl MixedPrecision,
    held: &Held,
    preconditioner: &impl SinglePreconditioner<3>,
    b: &[[f64; 3]],
    x: &mut [[f64; 3]],
    params: &CorrectionParams,
    room: &mut Room,
) -> Corrected {
    let unit = norm(b);
    let scale = unit * unit;
    x.fill([0.0; 3]);
    let Room { r, p, z, spare } = room;
    let start = scale * dot(r, z);
    let mut done = Corrected {
        iterations: 0,
        start,
        left: start,
        broke_down: !(start > 0.0 && start.is_finite()),
    };
    let enough = (params.reduction * start).max(params.enough);
    let (mut rz, mut rz_before) = (start / scale, 1.0);
    while !done.broke_down && done.left > enough && done.iterations < params.max_iterations {
        let beta = if done.iterations == 0 {
            0.0
        } else {
            rz / rz_before
        };
        combine(p, z, beta as f32);
        let curvature = image(operator, held, p, z);
        if !(curvature > 0.0 && curvature.is_finite()) {
            done.broke_down = true;
            break;
        }
        let alpha = rz / curvature;
        advance(x, r, p, z, alpha, unit);
        preconditioner.apply_single(r, z, spare);
        rz_before = rz;
        rz = dot(r, z);
        done.iterations += 1;
        done.left = scale * rz;
        done.broke_down = !(rz >= 0.0 && rz.is_finite());
    }
    done
}

fn norm(b: &[[f64; 3]]) -> f64 {
    crate::par::dot(b, b).sqrt()
}

/// `r = b / unit`.
fn scaled(b: &[[f64; 3]], unit: f64, r: &mut [[f32; 3]]) {
    each_chunk(r, CHUNK, |first, r| {
        for (r, b) in r.iter_mut().zip(&b[first..]) {
            *r = b.map(|v| narrow(v / unit));
        }
        [0.0]
    });
}
