//! Algorithms that see an operator, never the physics behind it.

pub mod amg;
pub mod anderson;
pub mod cg;
pub mod chord;
pub mod direct;
pub mod estimate;
pub mod fallback;
pub mod inertia;
pub mod jacobi;
pub mod lanczos;
pub mod mixed;
pub mod newton;
pub mod rough;
pub mod zone;
