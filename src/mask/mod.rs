//! From grey values to bone: smoothing, thresholds, volumes of interest, connected components.

pub mod components;
pub mod gaussian;
pub mod resample;
pub mod threshold;
pub mod voi;
