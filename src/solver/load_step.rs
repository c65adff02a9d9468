//! Owns Newton's method for one load step of a large body: the tangent's corrections by conjugate gradients, each only as exact as it
//! pays, and a line search where forces overshoot.

use crate::operator::SinglePreconditioner;
use crate::operator::held::Held;
use crate::operator::nonlinear::Incremental;
use crate::par::{CHUNK, dot, each_chunk};
use crate::solver::cg::correction::{self, CorrectionParams, Room};
use crate::solver::newton::NotConverged;

/// When a step is done, and when it is given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepParams {
    /// Squared energy norm of the error, over the work of the step.
    pub tolerance: f64,
    pub max_iterations: usize,
    /// Of conjugate gradients, in all iterations together.
    pub max_cg_iterations: usize,
}

/// Where a step begins, and what the body is held and pushed by at its end.
#[derive(Debug, Clone, Copy)]
pub struct Bounds<'a> {
    pub held: &'a Held,
    /// N; None where there are none.
    pub external: Option<&'a [[f64; 3]]>,
    /// Displacements at the start of the step.
    pub from: &'a [[f64; 3]],
}

/// What a step took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Balanced {
    pub newton_iterations: usize,
    pub cg_iterations: usize,
    /// Looks at the forces.
    pub evaluations: usize,
    /// Squared energy norm of what is left.
    pub left: f64,
}

/// Reduction of the squared energy norm that a correction aims at: a tenth of the error.
const REDUCTION: f64 = 0.01;

/// Slope along a correction, of that at its start, above which it went too far.
const OVERSHOT: f64 = 0.5;

/// Tries of a line search.
const TRIES: usize = 5;

/// Vectors that live from step to step.
pub struct Workspace {
    /// Forces at the displacements found last.
    pub forces: Vec<[f64; 3]>,
    residual: Vec<[f64; 3]>,
    update: Vec<[f64; 3]>,
    room: Room,
}

impl Workspace {
    pub fn new(sites: usize) -> Self {
        let zero = || vec![[0.0; 3]; sites];
        Workspace {
            forces: zero(),
            residual: zero(),
            update: zero(),
            room: Room::new(sites),
        }
    }
}

/// Finds displacements `u` whose forces balance the external ones on the components that are not held, from a guess that meets the
/// supports.
///
/// # Errors
/// Iterations that do not converge.
pub fn balance<B: Incremental>(
    body: &mut B,
    bounds: &Bounds,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &StepParams,
    work: &mut Workspace,
) -> Result<Balanced, NotConverged> {
    let mut done = Balanced::default();
    unbalanced(body, bounds, u, work);
    done.evaluations = 1;
    let mut earlier = f64::INFINITY;
    let mut grown = 0;
    loop {
        let energy = correction::energy(preconditioner, &work.residual, &mut work.room);
        let enough = params.tolerance * work_between(&work.forces, bounds.from, u).abs();
        done.left = energy;
        if energy <= enough {
            return Ok(done);
        }
        grown = if energy > earlier { grown + 1 } else { 0 };
        let spent = done.newton_iterations >= params.max_iterations
            || done.cg_iterations >= params.max_cg_iterations;
        if spent || grown > 2 || !energy.is_finite() {
            return Err(NotConverged::after(energy, false));
        }
        earlier = energy;
        let tangent = body.tangent();
        let how = CorrectionParams {
            reduction: REDUCTION,
            enough: 0.3 * enough,
            max_iterations: params.max_cg_iterations - done.cg_iterations,
        };
        let found = correction::solve(
            &tangent,
            bounds.held,
            preconditioner,
            &work.residual,
            &mut work.update,
            &how,
            &mut work.room,
        );
        drop(tangent);
        if found.iterations == 0 {
            return Err(NotConverged::Singular);
        }
        done.newton_iterations += 1;
        done.cg_iterations += found.iterations;
        done.evaluations += search(body, bounds, u, work);
    }
}

/// `f · (u − from)`.
pub fn work_between(f: &[[f64; 3]], from: &[[f64; 3]], u: &[[f64; 3]]) -> f64 {
    crate::par::sum_chunks(f.len(), |range| {
        let moved = u[range.clone()].iter().zip(&from[range.clone()]);
        let each = f[range].iter().zip(moved);
        each.map(|(f, (u, from))| {
            f[0] * (u[0] - from[0]) + f[1] * (u[1] - from[1]) + f[2] * (u[2] - from[2])
        })
        .sum()
    })
}

/// Adds the update to `u`, or as much of it as the forces let; returns the looks at the forces.
fn search<B: Incremental>(
    body: &mut B,
    bounds: &Bounds,
    u: &mut [[f64; 3]],
    work: &mut Workspace,
) -> usize {
    let start = dot(&work.residual, &work.update);
    let mut share = 1.0;
    add(u, &work.update, share);
    for tries in 1.. {
        unbalanced(body, bounds, u, work);
        let slope = dot(&work.residual, &work.update);
        // A negative slope is beyond the least energy; a positive one, before it, is for Newton's next iteration.
        if slope >= -OVERSHOT * start.abs() || tries == TRIES || !slope.is_finite() {
            return tries;
        }
        let next = share * (start / (start - slope)).clamp(0.1, 0.6);
        add(u, &work.update, next - share);
        share = next;
    }
    unreachable!("the last try returns")
}

fn add(u: &mut [[f64; 3]], update: &[[f64; 3]], share: f64) {
    each_chunk(u, CHUNK, |first, u| {
        for (u, d) in u.iter_mut().zip(&update[first..]) {
            (0..3).for_each(|a| u[a] += share * d[a]);
        }
        [0.0]
    });
}

/// What external forces leave over the body's, in the components that are not held.
fn unbalanced<B: Incremental>(body: &mut B, bounds: &Bounds, u: &[[f64; 3]], work: &mut Workspace) {
    body.forces(u, &mut work.forces);
    let forces = &work.forces;
    each_chunk(&mut work.residual, CHUNK, |first, r| {
        for (i, r) in r.iter_mut().enumerate() {
            let outside = bounds.external.map_or([0.0; 3], |e| e[first + i]);
            *r = std::array::from_fn(|a| outside[a] - forces[first + i][a]);
        }
        [0.0]
    });
    bounds.held.clear(&mut work.residual);
}
