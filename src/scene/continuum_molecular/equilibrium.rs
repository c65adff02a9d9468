//! Owns equilibrium of a body some of whose values are held: which are unknowns, their factorised matrix, its solutions.

use crate::discretisation::plane::Points;
use crate::error::Result;
use crate::operator::Operator;
use crate::operator::reduction::{Reduction, Value};
use crate::physics::continuum_molecular::body::Body;
use crate::solver::direct::DirectLlt;
use crate::solver::direct::dissection::nested_dissection;

/// A factorised body: which of its values are unknowns, and the factor.
pub struct Factorised {
    pub reduction: Reduction,
    pub llt: DirectLlt,
    /// Unknowns in order of elimination.
    pub order: Vec<usize>,
}

/// Factorises Tᵀ(A + diag)T. Points in `last` (all of whose values are free) are eliminated last, in that order.
pub fn factorise<const D: usize>(
    body: &Body<D>,
    points: &Points,
    held: &[Option<f64>],
    extra: &[f64],
    last: &[usize],
) -> Result<Factorised> {
    let values: Vec<Value> = held
        .iter()
        .map(|h| {
            if h.is_some() {
                Value::Held
            } else {
                Value::Free
            }
        })
        .collect();
    let reduction = Reduction::new(&values);
    let mut kept = vec![false; points.len()];
    last.iter().for_each(|&p| kept[p] = true);
    let free = |p: &usize| !kept[*p] && (0..D).any(|d| held[p * D + d].is_none());
    let dissected: Vec<usize> = (0..points.len()).filter(free).collect();
    let positions: Vec<[f64; 2]> = dissected.iter().map(|&p| points.position(p)).collect();
    let width = f64::from(body.family.stencil.reach()) * points.spacing;
    let order = nested_dissection(&positions, width);
    let sites = order
        .iter()
        .map(|&k| dissected[k])
        .chain(last.iter().copied());
    let order: Vec<usize> = sites
        .flat_map(|p| (0..D).map(move |d| p * D + d))
        .filter_map(|value| reduction.unknown(value))
        .collect();
    let a = body.assemble(&reduction, extra);
    let mut llt = DirectLlt::new(&a, &order)?;
    llt.factorize(&a)?;
    Ok(Factorised {
        reduction,
        llt,
        order,
    })
}

impl Factorised {
    /// Tᵀ r for a force `r` on all values.
    pub fn restrict<const D: usize>(&self, r: &[[f64; D]]) -> Vec<f64> {
        (0..self.reduction.unknowns())
            .map(|q| self.reduction.equation(q))
            .map(|v| r[v / D][v % D])
            .collect()
    }

    /// All values from the unknowns and what is held.
    pub fn expand<const D: usize>(&self, q: &[f64], held: &[Option<f64>]) -> Vec<[f64; D]> {
        let value =
            |v: usize| held[v].unwrap_or_else(|| self.reduction.unknown(v).map_or(0.0, |k| q[k]));
        (0..held.len() / D)
            .map(|p| std::array::from_fn(|d| value(p * D + d)))
            .collect()
    }
}

/// Values of the held ones, zero elsewhere.
pub fn lift<const D: usize>(held: &[Option<f64>]) -> Vec<[f64; D]> {
    (0..held.len() / D)
        .map(|p| std::array::from_fn(|d| held[p * D + d].unwrap_or(0.0)))
        .collect()
}

/// Tᵀ(f - A g): the right-hand side for the unknowns.
pub fn right_hand_side<const D: usize>(
    body: &Body<D>,
    factorised: &Factorised,
    held: &[Option<f64>],
    force: &[[f64; D]],
) -> Vec<f64> {
    let mut r = vec![[0.0; D]; body.sites()];
    body.apply(&lift(held), &mut r);
    for (p, r) in r.iter_mut().enumerate() {
        for (d, r) in r.iter_mut().enumerate() {
            *r = force.get(p).map_or(0.0, |f| f[d]) - *r;
        }
    }
    factorised.restrict(&r)
}

/// Equilibrium of A x = f with the held values. Returns all values and the number of unknowns.
pub fn solve<const D: usize>(
    body: &Body<D>,
    points: &Points,
    held: &[Option<f64>],
    force: &[[f64; D]],
) -> Result<(Vec<[f64; D]>, usize)> {
    if held.iter().all(|h| h.is_some()) {
        return Ok((lift(held), 0));
    }
    let mut factorised = factorise(body, points, held, &[], &[])?;
    let mut q = right_hand_side(body, &factorised, held, force);
    factorised.llt.solve(&mut q);
    Ok((factorised.expand(&q, held), q.len()))
}
