//! Owns what can go wrong, worded for the person at the keyboard: where, what was found, what to do.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The error of a library that is behind one of this crate's, for callers that want its kind; its words stand in the message.
pub type Source = Arc<dyn std::error::Error + Send + Sync>;

/// Between what was found and what to do about it.
pub const ADVICE: &str = "\n  what to do: ";

/// Every failure the library reports. All of them end a command with exit code 2; a solve that did not converge is
/// a marked result, not an error.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder that cannot be read, understood or written.
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was expected and what was there.
        found: String,
        /// What to do.
        advice: String,
        /// The error of another library behind this one, if any.
        source: Option<Source>,
    },
    /// A setting (flag, recipe key or parameter) with an unusable value.
    Setting {
        /// The key, as in a recipe.
        key: String,
        /// What is wrong with its value.
        found: String,
        /// What to do.
        advice: String,
        /// The error of another library behind this one, if any.
        source: Option<Source>,
    },
    /// A specimen or scene for which the request makes no sense.
    Specimen {
        /// What does not fit.
        found: String,
        /// What to do.
        advice: String,
        /// The error of another library behind this one, if any.
        source: Option<Source>,
    },
}

/// A result with this crate's error.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::File {
                path,
                found,
                advice,
                ..
            } => write!(f, "{}: {found}{ADVICE}{advice}", path.display()),
            Error::Setting {
                key, found, advice, ..
            } => write!(f, "{key}: {found}{ADVICE}{advice}"),
            Error::Specimen { found, advice, .. } => write!(f, "{found}{ADVICE}{advice}"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        let (Error::File { source, .. }
        | Error::Setting { source, .. }
        | Error::Specimen { source, .. }) = self;
        source.as_ref().map(|cause| &**cause as _)
    }
}

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
            source: None,
        }
    }

    /// `key` as in a recipe; `found` says what is wrong with its value; `advice` what to do.
    pub fn setting(
        key: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Error::Setting {
            key: key.into(),
            found: found.into(),
            advice: advice.into(),
            source: None,
        }
    }

    /// `found` says what of the specimen does not fit the request; `advice` what to do.
    pub fn specimen(found: impl Into<String>, advice: impl Into<String>) -> Self {
        Error::Specimen {
            found: found.into(),
            advice: advice.into(),
            source: None,
        }
    }

    /// The same with the error that is behind it.
    #[must_use]
    pub fn caused_by(mut self, cause: impl std::error::Error + Send + Sync + 'static) -> Self {
        let (Error::File { source, .. }
        | Error::Setting { source, .. }
        | Error::Specimen { source, .. }) = &mut self;
        *source = Some(Arc::new(cause));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error as _;

    #[test]
    fn the_cause_is_kept_beside_the_words() {
        let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
        let error = Error::file("a.nii", "cannot be read", "check the path");
        assert!(error.source().is_none());
        let error = error.caused_by(missing);
        let cause = error
            .source()
            .and_then(|e| e.downcast_ref::<std::io::Error>());
        assert_eq!(cause.unwrap().kind(), std::io::ErrorKind::NotFound);
        assert_eq!(
            error.to_string(),
            "a.nii: cannot be read\n  what to do: check the path"
        );
    }
}
