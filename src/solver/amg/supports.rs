//! Owns multigrid for several supports of one body: what lies away from where they differ is made once.
//!
//! The sum `PᵀAP` goes over the sites of the finest level. A site's share depends on what is held within two couplings of it, so the
//! shares of all others are the same under every support, and so are the aggregates. What follows is the multigrid that each would have
//! alone with these aggregates: symmetric, positive, and as good.

use super::fine::{Body, Fine, Grouped};
use super::galerkin::{self, Part, Which};
use super::{Amg, AmgParams, smoothing};
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use rayon::prelude::*;
use std::sync::Arc;

/// Sites per task.
const CHUNK: usize = 2048;

/// What multigrid has in common under several supports.
pub struct Common<O> {
    operator: O,
    params: AmgParams,
    grouped: Arc<Grouped>,
    /// Couplings from the next site where supports differ, 4 at most.
    away: Vec<u8>,
    /// Shares of the sites with two or more between.
    same: Vec<Part>,
}

impl<O: Coarsen + Clone> Common<O> {
    /// `supports`: what is held in each, at least one.
    pub fn new(operator: O, supports: &[Held], params: &AmgParams) -> Self {
        // A site is grouped where any support leaves it free.
        let always: Vec<u8> = (0..operator.sites())
            .map(|site| {
                supports
                    .iter()
                    .fold(u8::MAX, |bits, held| bits & held.0[site])
            })
            .collect();
        let away = away(&operator, supports);
        let (fine, _) = Fine::new(operator.clone(), &Held(always), params.box_mm);
        let omega = smoothing(&fine, params.degrees[0]).omega;
        let same = galerkin::parts(&fine, omega, &Same(&away));
        Common {
            operator,
            params: *params,
            grouped: Arc::clone(fine.grouped()),
            away,
            same,
        }
    }

    /// Multigrid under one of the supports.
    pub fn under(&self, held: &Held) -> Amg<O> {
        let (fine, bodies): (_, Vec<Body>) =
            Fine::regrouped(self.operator.clone(), held, &self.grouped);
        let how = smoothing(&fine, self.params.degrees[0]);
        let own = galerkin::parts(&fine, how.omega, &Own(&self.away));
        let all: Vec<&Part> = self.same.iter().chain(&own).collect();
        let matrix = galerkin::merge(all, Some(&bodies));
        drop(own);
        Amg::of(fine, bodies, how, matrix, &self.params)
    }
}

/// Sites whose share is the same under all supports.
struct Same<'a>(&'a [u8]);

impl Which for Same<'_> {
    fn is_summed(&self, site: usize) -> bool {
        self.0[site] > 2
    }

    fn is_next(&self, site: usize) -> bool {
        self.0[site] > 1
    }
}

/// Sites whose share is each support's own.
struct Own<'a>(&'a [u8]);

impl Which for Own<'_> {
    fn is_summed(&self, site: usize) -> bool {
        self.0[site] <= 2
    }

    fn is_next(&self, site: usize) -> bool {
        self.0[site] <= 3
    }
}

/// Couplings between each site and the next where supports differ, 4 where there are more than 3.
fn away(operator: &impl Coarsen, supports: &[Held]) -> Vec<u8> {
    let differs = |site: usize| {
        let mut bits = supports.iter().map(|held| held.0[site]);
        let first = bits.next();
        bits.any(|other| Some(other) != first)
    };
    let mut away: Vec<u8> = (0..operator.sites())
        .map(|site| if differs(site) { 0 } else { 4 })
        .collect();
    for ring in 1..4 {
        let before = away.clone();
        away.par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(c, away)| {
                let start = c * CHUNK;
                operator.each_row(start..start + away.len(), &mut |site, columns, _| {
                    let is_next = columns.iter().any(|&j| before[j as usize] == ring - 1);
                    let own = &mut away[site - start];
                    if *own == 4 && is_next {
                        *own = ring;
                    }
                });
            });
    }
    away
}
