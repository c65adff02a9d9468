//! Bone remodelling: reference values of an independent prototype, orders of convergence, and what is refused.

mod boundaries;
mod costs;
mod figures;
mod forces;
mod horizons;
mod limits;
mod local;
mod shear;
mod square;
mod tangent;
