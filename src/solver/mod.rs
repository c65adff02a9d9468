//! Algorithms that see an operator, never the physics behind it.

pub mod amg;
pub mod anderson;
pub mod cg;
pub mod chord;
pub mod direct;
pub mod lanczos;
pub mod load_step;
pub mod nested;
pub mod newton;
