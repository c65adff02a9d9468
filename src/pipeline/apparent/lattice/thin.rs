//! Owns the choice of a lattice's preconditioner: multigrid, or where its sites have few bonds a factor of its springs.

use crate::discretisation::lattice::sites::Sites;
use crate::operator::SinglePreconditioner;
use crate::operator::held::Held;
use crate::physics::lattice::Lattice;
use crate::physics::lattice::multigrid::Springs;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::direct::fill::{Graph, Order};
use crate::solver::direct::network::NetworkFactor;

/// Share of all bonds of a full site below which, on average, a lattice is thin: struts of one or two sites. The floppy lattices of a core
/// have 0.46, 0.54, 0.63 and 0.72 at 0.12, 0.10, 0.08 and 0.06 mm.
const THIN: f64 = 0.56;

/// Sites below which multigrid is good enough: small lattices have few of the motions that it cannot make.
const LEAST_SITES: usize = 4096;

/// Blocks of nine values in the factor, a site, beyond which multigrid is the better choice: 200 values an unknown.
const MOST_BLOCKS: usize = 66;

/// The order in which a thin lattice's sites are eliminated. None where multigrid is the better choice: few sites, plump structure, or a
/// factor that would be too large, of which nothing is stored.
pub fn factor_order(sites: &Sites) -> Option<Order> {
    let full = sites.len() * sites.frame.structure.stencil().coordination();
    let ends = 2 * sites.bonds();
    let is_thin = sites.len() >= LEAST_SITES && (ends as f64) < THIN * full as f64;
    if !is_thin || u32::try_from(ends).is_err() {
        return None;
    }
    let (mut start, mut others) = (vec![0], Vec::with_capacity(ends));
    start.reserve(sites.len());
    sites.each_row(|site, row| {
        others.extend(row.iter().filter(|&&end| end as usize != site));
        start.push(others.len() as u32);
    });
    // Without memory for the order multigrid takes over.
    Graph { start, others }
        .order(MOST_BLOCKS * sites.len())
        .ok()
        .flatten()
}

/// The springs of a lattice and, where it is thin, the order of their factor.
pub struct ThinOrPlump<'a> {
    springs: Springs<'a>,
    order: Option<Order>,
}

impl<'a> ThinOrPlump<'a> {
    pub fn new(lattice: &'a Lattice) -> Self {
        ThinOrPlump {
            springs: Springs::new(lattice),
            order: factor_order(&lattice.sites),
        }
    }
}

impl Precondition for ThinOrPlump<'_> {
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a {
        let factor = |order| NetworkFactor::new(&self.springs, held, order);
        match self.order.as_ref().and_then(factor) {
            Some(factor) => Chosen::Factor(Box::new(factor)),
            None => Chosen::Multigrid(Box::new(Amg::new(&self.springs, held, params))),
        }
    }
}

enum Chosen<'a> {
    Multigrid(Box<Amg<&'a Springs<'a>>>),
    Factor(Box<NetworkFactor>),
}

impl SinglePreconditioner<3> for Chosen<'_> {
    fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, spare: &mut Vec<[f32; 3]>) {
        match self {
            Chosen::Multigrid(multigrid) => multigrid.apply_single(r, z, spare),
            Chosen::Factor(factor) => factor.apply_single(r, z, spare),
        }
    }
}
