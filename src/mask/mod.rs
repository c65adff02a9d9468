//! From grey values to bone: other grids, smoothing, thresholds, volumes of interest, connected components.

pub mod components;
pub mod deblur;
pub mod ends;
pub mod gaussian;
pub mod regrid;
pub mod resample;
pub mod rotate;
pub mod runs;
pub mod threshold;
pub mod unmeasured;
pub mod upsample;
pub mod usable;
pub mod voi;
