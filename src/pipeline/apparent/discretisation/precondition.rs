//! Owns the choice of preconditioner for an operator: multigrid on the operator itself, or a smoother on elements of higher order
//! and multigrid on those of lower order inside them.

use crate::operator::SinglePreconditioner;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::operator::nested::Nested;
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::nested::TwoLevel;

/// What a preconditioner can be made of.
pub trait Precondition {
    /// The preconditioner, which leaves held unknowns alone.
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a;
}

impl<C: Coarsen> Precondition for C {
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a {
        Amg::new(self, held, params)
    }
}

/// An operator whose elements hold others of lower order.
pub struct InTwoLevels<'m, O>(pub &'m O);

impl<O: Nested> Precondition for InTwoLevels<'_, O> {
    fn precondition<'a>(
        &'a self,
        held: &Held,
        params: &AmgParams,
    ) -> impl SinglePreconditioner<3> + 'a {
        TwoLevel::new(self.0, held, params)
    }
}
