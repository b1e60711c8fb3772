//! The one error type: what was wrong, where, and what is allowed.

mod domain;

use std::path::{Path, PathBuf};

pub use domain::Domain;

/// Result with haloray's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can go wrong, each with the cure in its text.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number lies outside its domain.
    #[error("{what} is {value}, but must be {allowed}")]
    OutOfRange {
        /// The name of the quantity, with its unit.
        what: String,
        /// The value given.
        value: String,
        /// The values allowed.
        allowed: String,
    },

    /// A relation was asked about a mass definition it was not calibrated for.
    #[error("{relation} is not calibrated for the mass definition {given}; allowed: {allowed}")]
    MassDefinition {
        /// Name of the published relation.
        relation: &'static str,
        /// The definition asked for.
        given: String,
        /// The definitions covered.
        allowed: &'static str,
    },

    /// A table (CSV, HDF5 or FITS) cannot be used.
    #[error("{}: {place}: {problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Line, row or column.
        place: String,
        /// What is wrong and what is allowed.
        problem: String,
    },

    /// A file is not what its name says, or is damaged.
    #[error("{}: {problem}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong and what is allowed.
        problem: String,
    },

    /// The configuration file cannot be used; the text carries line and column.
    #[error("{}: {problem}", path.display())]
    Config {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what is allowed.
        problem: String,
    },

    /// An input file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },

    /// The place for the output cannot be written to at all.
    #[error("cannot write to {}: {source}", path.display())]
    OutputPlace {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },

    /// Writing failed half-way (full disk, lost mount); nothing is left under the final name.
    #[error("writing {} failed: {problem}; nothing was left under that name", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        problem: String,
    },

    /// Whoever watches the work told it to stop.
    #[error("stopped")]
    Cancelled,
}

impl Error {
    /// Shorthand for [`Error::OutOfRange`].
    pub fn out_of_range(what: &str, value: impl ToString, allowed: &str) -> Self {
        Self::OutOfRange { what: what.into(), value: value.to_string(), allowed: allowed.into() }
    }

    /// Shorthand for [`Error::Table`].
    pub fn table(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Table { path: path.into(), place: place.into(), problem: problem.into() }
    }

    /// Shorthand for [`Error::Format`].
    pub fn format(path: &Path, problem: impl Into<String>) -> Self {
        Self::Format { path: path.into(), problem: problem.into() }
    }

    /// Shorthand for [`Error::Write`].
    pub fn write(path: &Path, problem: impl ToString) -> Self {
        Self::Write { path: path.into(), problem: problem.to_string() }
    }

    /// True when the input is to blame (exit code 2), false when the run failed (exit code 1).
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. } | Self::Cancelled)
    }
}

/// Checks that a value is finite and satisfies `condition`, or says what is allowed.
pub fn require(condition: bool, what: &str, value: f64, allowed: &str) -> Result<()> {
    match (condition, value.is_finite()) {
        (true, true) => Ok(()),
        (_, false) if !allowed.contains("finite") => {
            Err(Error::out_of_range(what, value, &format!("a finite number, {allowed}")))
        }
        _ => Err(Error::out_of_range(what, shortest(value), allowed)),
    }
}

/// The shortest decimal that reads back to the same bits: `0.5`, `17`, `6.2e-9`, `1e300`.
pub(crate) fn shortest(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_told_to_be_finite() {
        let message = |value, allowed| require(false, "radius", value, allowed).unwrap_err().to_string();
        assert_eq!(
            message(f64::INFINITY, "positive"),
            "radius is inf, but must be a finite number, positive"
        );
        assert_eq!(message(f64::NAN, "finite"), "radius is NaN, but must be finite");
        assert_eq!(message(-1e300, "positive"), "radius is -1e300, but must be positive");
        assert!(require(true, "radius", f64::INFINITY, "positive").is_err());
    }
}
