//! Lattices in a segmented volume: where sites sit, which exist, and what they are bonded to.

pub mod connected;
pub mod marks;
pub mod neighbours;
pub mod placement;
pub mod sites;
pub mod stencil;
pub mod tissue;
