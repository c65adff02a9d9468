//! `bonepd_ct._native`: the program and its entries for Python. Settings come in and numbers go out as JSON, voxels as arrays of
//! shape `(nz, ny, nx)`; `python/bonepd_ct/` makes of them what users see.

mod arrays;
mod call;
#[path = "../../src/cli/mod.rs"]
mod cli;
mod cohort;
mod one_scan;
mod settings;

use pyo3::prelude::*;

/// The module that `bonepd_ct` imports.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::cohort::run;
    #[pymodule_export]
    use super::one_scan::{segment, solve};
    use super::*;
    use std::ffi::OsString;

    /// The version of the program.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// The command line: words in (the program's name is the first), exit code out.
    #[pyfunction]
    fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
        bonepd_ct::machine::host::give_freed_memory_back();
        py.detach(|| super::cli::program(words))
    }
}
