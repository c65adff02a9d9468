//! `bonepd-ct`: from a μCT scan of trabecular bone to its apparent stiffness, with a stated error.
//!
//! Five entries: [`command::segment::segment`] (a scan to its mask), [`command::lattice::lattice`] (lattices of a mask),
//! [`command::solve::solve`] (a mask to its moduli), [`command::report::report`] (solved scans to a page) and [`cohort::cohort`] (a
//! recipe over many scans). [`command::scene::scene`] runs a scene in two dimensions. Settings are plain data with defaults.
//!
//! What these pages show is the library's interface. Modules and items that they hide (`#[doc(hidden)]`) are the parts that the program is
//! made of: public for its command line and its tests only, and free to change in any version.
//!
//! ```
//! use bonepd_ct::command::{segment, solve};
//! use bonepd_ct::machine::session::Session;
//! use bonepd_ct::pipeline::apparent::SolveParams;
//! use bonepd_ct::pipeline::lattice::LatticeParams;
//! use bonepd_ct::pipeline::segment::SegmentParams;
//! use bonepd_ct::result::settings::Method;
//!
//! # fn main() -> bonepd_ct::error::Result<()> {
//! let out = std::env::temp_dir().join(format!("bonepd-ct-{}", std::process::id()));
//! let session = Session { quiet: true, ..Session::default() };
//! let threshold = SegmentParams { otsu: true, ..SegmentParams::default() };
//! let scan = "sample_data/sparse.nii.gz".as_ref();
//! segment::segment(scan, &out, None, &threshold, &session)?;
//! let voxel_fe = SolveParams { method: Method::VoxelFe, young_mpa: 10_000.0, ..SolveParams::default() };
//! let rows = solve::solve(&out, &LatticeParams::default(), &voxel_fe, &session)?;
//! assert!(rows[0].e_app_mpa() > Some(0.0));
//! # std::fs::remove_dir_all(out).ok();
//! # Ok(())
//! # }
//! ```
//!
//! Every failure is an [`error::Error`]. Its kind says what is wrong: a file, a setting (by its key), or a specimen that the request makes no
//! sense for. Each kind has words on what was found and what to do, and where the error of another library is behind it, that error is its
//! `source`. Kinds may be added. A solve that does not converge is no error: its row says so.
//!
//! ```
//! use bonepd_ct::command::info::info;
//! use bonepd_ct::error::Error;
//! use std::error::Error as _;
//!
//! match info("missing.nii.gz".as_ref()) {
//!     Err(Error::File { path, .. }) => println!("another path than {}?", path.display()),
//!     Err(Error::Setting { key, advice, .. }) => println!("{key}: {advice}"),
//!     Err(other) => println!("{other}"),
//!     Ok(scan) => println!("{}", scan.format),
//! }
//! let error = info("missing.nii.gz".as_ref()).expect_err("no such file");
//! let behind = error.source().and_then(|e| e.downcast_ref::<std::io::Error>());
//! assert_eq!(behind.map(|e| e.kind()), Some(std::io::ErrorKind::NotFound));
//! ```
//!
//! Layers, lowest first. A file imports from lower layers only, or from its own folder;
//! `tests/layers.rs` holds the code to it.
//!
//! | layer | module | owns |
//! |---|---|---|
//! | 0 | [`error`], [`par`], [`parts`], [`simd`] | messages to the person at the keyboard; vector sums that repeat on any number of threads; which numbers belong together; eight lanes chosen at run time |
//! | 1 | [`grid`] | indices, voxels, millimetres |
//! | 2 | [`volume`], [`io`] | values on a grid and the segmented specimen; files written whole, tables |
//! | 3 | [`format`](mod@crate::format), [`mask`] | what file formats share: raw voxels, lengths, orientation, calibration; turning and resampling, smoothing, thresholds, volumes of interest, connected components |
//! | 4 | [`image`], [`discretisation`] | scan readers, one format a file; who touches whom, without any moduli: lattices, voxel meshes, points of a plane |
//! | 5 | [`operator`] | the seam: what a solver may know of a model |
//! | 6 | [`physics`] and [`solver`] | energies and forces; algorithms. Neither imports the other |
//! | 7 | [`measure`] and [`result`] | numbers of a mask or a field; what rows of results say together |
//! | 8 | [`pipeline`], [`scene`] and [`report`] | steps from grey values to an apparent modulus; two-dimensional scenes; rows to tables, figures and pages. None imports another |
//! | 9 | [`recipe`], [`draw`], [`machine`] | all steps' settings in one file; pictures of masks and of plane fields; the terminal, the clock and the memory |
//! | 10 | [`record`], [`export`] | results kept on disk; models and fields for other programs |
//! | 11 | [`command`] | one verb of the program each: paths and settings in, files out |
//! | 12 | [`cohort`] | one recipe over many scans, each on its own |

pub mod cohort;
pub mod command;
#[doc(hidden)]
pub mod discretisation;
#[doc(hidden)]
pub mod draw;
pub mod error;
#[doc(hidden)]
pub mod export;
#[doc(hidden)]
pub mod format;
pub mod grid;
#[doc(hidden)]
pub mod image;
#[doc(hidden)]
pub mod io;
pub mod machine;
#[doc(hidden)]
pub mod mask;
#[doc(hidden)]
pub mod measure;
#[doc(hidden)]
pub mod operator;
#[doc(hidden)]
pub mod par;
#[doc(hidden)]
pub mod parts;
#[doc(hidden)]
pub mod physics;
pub mod pipeline;
pub mod recipe;
#[doc(hidden)]
pub mod record;
#[doc(hidden)]
pub mod report;
pub mod result;
#[doc(hidden)]
pub mod scene;
#[doc(hidden)]
pub mod simd;
#[doc(hidden)]
pub mod solver;
pub mod volume;
