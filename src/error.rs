//! Owns what can go wrong, worded for the person at the keyboard: where, what was found, what to do.

use std::path::{Path, PathBuf};

/// Between what was found and what to do about it.
pub const ADVICE: &str = "\n  what to do: ";

/// Every failure the library reports. All of them end a command with exit code 2; a solve that did not converge is
/// a marked result, not an error.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder that cannot be read, understood or written.
    #[error("{}: {found}{}{advice}", path.display(), ADVICE)]
    File {
        path: PathBuf,
        found: String,
        advice: String,
    },
    /// A setting (flag, recipe key or parameter) with an unusable value.
    #[error("{key}: {found}{}{advice}", ADVICE)]
    Setting {
        key: String,
        found: String,
        advice: String,
    },
    /// A specimen or scene for which the request makes no sense.
    #[error("{found}{}{advice}", ADVICE)]
    Specimen { found: String, advice: String },
}

pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// `found` says what was expected and what was there; `advice` what to do.
    pub fn file(
        path: impl AsRef<Path>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Error::File {
            path: path.as_ref().to_path_buf(),
            found: found.into(),
            advice: advice.into(),
        }
    }

    pub fn setting(
        key: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Error::Setting {
            key: key.into(),
            found: found.into(),
            advice: advice.into(),
        }
    }

    pub fn specimen(found: impl Into<String>, advice: impl Into<String>) -> Self {
        Error::Specimen {
            found: found.into(),
            advice: advice.into(),
        }
    }
}
