//! `bonepd-ct`: from a μCT scan of trabecular bone to its apparent stiffness, with a stated error.
//!
//! Layers, lowest first. A file imports from lower layers only, or from its own folder;
//! `tests/layers.rs` holds the code to it.
//!
//! | layer | module | owns |
//! |---|---|---|
//! | 0 | [`error`], [`par`], [`simd`] | what is told to the person at the keyboard; vector sums that repeat on any number of threads; eight lanes chosen at run time |
//! | 1 | [`grid`] | indices, voxels, millimetres |
//! | 2 | [`volume`] | values on a grid; the segmented specimen |
//! | 3 | [`mask`] | turning and resampling, smoothing, thresholds, volumes of interest, connected components |
//! | 4 | [`topology`] | who touches whom: lattice sites, voxel meshes, families of points |
//! | 5 | [`operator`] | the seam: what a solver may know of a model |
//! | 6 | [`physics`] and [`solve`] | energies and forces; algorithms. Neither imports the other |
//! | 7 | [`measure`] | numbers drawn from a solution or a mask, as plain records |
//! | 8 | [`stage`] | one step of the pipeline each: parameters in, plain result out |
//! | 9 | [`recipe`] | all stages' parameters in one file |
//! | 10 | [`io`] | files: one format a file |
//! | 11 | [`run`] | recipes on real scans: disk, clock, resuming, isolation of failures |

pub mod error;
pub mod grid;
pub mod io;
pub mod mask;
pub mod measure;
pub mod operator;
pub mod par;
pub mod physics;
pub mod recipe;
pub mod run;
pub mod simd;
pub mod solve;
pub mod stage;
pub mod topology;
pub mod volume;
