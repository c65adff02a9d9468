//! Owns the choice of a lattice's preconditioner: multigrid, or where its sites have few bonds a factor of its springs.

use crate::operator::SinglePreconditioner;
use crate::operator::held::Held;
use crate::physics::lattice::Lattice;
use crate::physics::lattice::multigrid::Springs;
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::direct::network::NetworkFactor;

/// Share of all bonds of a full site below which, on average, a lattice is thin: struts of one or two sites. The floppy lattices of a core
/// have 0.46, 0.54, 0.63 and 0.72 at 0.12, 0.10, 0.08 and 0.06 mm.
const THIN: f64 = 0.56;

/// Sites below which multigrid is good enough: small lattices have few of the motions that it cannot make.
const LEAST_SITES: usize = 4096;

/// The springs of a lattice and, where it is thin, their factor.
pub struct ThinOrPlump<'a> {
    springs: Springs<'a>,
    is_thin: bool,
}

impl<'a> ThinOrPlump<'a> {
    pub fn new(lattice: &'a Lattice) -> Self {
        let sites = &lattice.sites;
        let full = sites.len() * sites.frame.structure.stencil().coordination();
        let is_thin =
            sites.len() >= LEAST_SITES && 2.0 * (sites.bonds() as f64) < THIN * full as f64;
        ThinOrPlump {
            springs: Springs::new(lattice),
            is_thin,
        }
    }
}

impl Precondition for ThinOrPlump<'_> {
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a {
        let factor = self
            .is_thin
            .then(|| NetworkFactor::new(&self.springs, held))
            .flatten();
        match factor {
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
