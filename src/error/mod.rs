//! The one error type: what was wrong, where, and what is allowed.

mod domain;
mod hint;

use std::path::{Path, PathBuf};

pub use domain::Domain;

/// Result with haloray's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// What a table was to hold, for the hint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableKind {
    /// Haloes.
    Haloes,
    /// Haloes on the sky.
    Lightcone,
    /// Points on the sky.
    Points,
    /// The truths of a catalogue of mocks.
    Truth,
    /// Anything else.
    Other,
}

/// What about a file is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileFault {
    /// Its name or its first bytes are those of another format.
    UnknownFormat,
    /// It ends early or contradicts itself.
    Damaged,
    /// It takes, or declares, more than memory holds.
    TooLarge,
    /// It is sound, but does not hold what is looked for.
    Content,
    /// It is no lens model in JSON.
    LensModel,
    /// It is no image to fit: a keyword or an extension is missing or wrong.
    Observation,
    /// It, or its extension, is no kernel of a point-spread function.
    PsfKernel,
}

/// A line of a text and a place in it, both counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineColumn {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

/// Everything that can go wrong: what was wrong, where, what is allowed; [`hint`](Error::hint) says what helps.
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

    /// An option of the command line lies outside its domain.
    #[error("{option} is {value}, but must be {allowed}")]
    Argument {
        /// The option, `--z-source`.
        option: String,
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

    /// A key of a configuration has a value that cannot be used.
    #[error("{}: {}{}{cause}", path.display(), place(at), key_before(key, cause))]
    Config {
        /// The file, or `preset`.
        path: PathBuf,
        /// Where the value stands, if it stands in the file.
        at: Option<LineColumn>,
        /// The dotted key, where the fault is one key's.
        key: Option<String>,
        /// What is wrong with the value.
        cause: Box<Error>,
    },

    /// A configuration is no TOML, or has unknown keys or wrong types.
    #[error("{}: {}{problem}", path.display(), place(at))]
    Toml {
        /// The file, or `preset`.
        path: PathBuf,
        /// Where.
        at: Option<LineColumn>,
        /// What is wrong and what is allowed.
        problem: String,
    },

    /// No built-in model has this name.
    #[error("the model is {name}, but must be {allowed}")]
    ModelName {
        /// The name given.
        name: String,
        /// The names there are.
        allowed: String,
    },

    /// A model to fit cannot be used.
    #[error("{model}: {problem}")]
    Model {
        /// Its file, or its name if it is built in.
        model: String,
        /// What is wrong, where, and what is allowed.
        problem: String,
    },

    /// A table (CSV, HDF5 or FITS) cannot be used.
    #[error("{}: {place}: {problem}", path.display())]
    Table {
        /// What it was to hold.
        kind: TableKind,
        /// The file.
        path: PathBuf,
        /// Line, row or column.
        place: String,
        /// What is wrong and what is allowed.
        problem: String,
    },

    /// A file can be read but not used.
    #[error("{}: {problem}", path.display())]
    File {
        /// What about the file is at fault.
        fault: FileFault,
        /// The file.
        path: PathBuf,
        /// What is wrong and what is allowed.
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

    /// Standard output takes no more.
    #[error("cannot write to standard output: {source}")]
    StandardOutput {
        /// The system's reason.
        source: std::io::Error,
    },

    /// Whoever watches the work told it to stop.
    #[error("stopped")]
    Cancelled,
}

impl Error {
    /// Shorthand for [`Error::OutOfRange`].
    pub fn out_of_range(what: &str, value: impl ToString, allowed: &str) -> Self {
        Self::OutOfRange { what: what.into(), value: readable(value.to_string()), allowed: allowed.into() }
    }

    /// Shorthand for [`Error::Argument`].
    pub fn argument(option: &str, value: impl ToString, allowed: &str) -> Self {
        Self::Argument { option: option.into(), value: value.to_string(), allowed: allowed.into() }
    }

    /// Shorthand for [`Error::Table`] of a kind that the caller of the reader may add.
    pub fn table(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Self {
        let (path, place, problem) = (path.into(), place.into(), problem.into());
        Self::Table { kind: TableKind::Other, path, place, problem }
    }

    /// Shorthand for [`Error::File`].
    pub fn file(fault: FileFault, path: &Path, problem: impl Into<String>) -> Self {
        Self::File { fault, path: path.into(), problem: problem.into() }
    }

    /// Shorthand for [`Error::Write`].
    pub fn write(path: &Path, problem: impl ToString) -> Self {
        Self::Write { path: path.into(), problem: problem.to_string() }
    }

    /// Shorthand for [`Error::Read`], as a closure for `map_err`.
    pub fn read(path: &Path) -> impl Fn(std::io::Error) -> Self + Copy {
        move |source| Self::Read { path: path.into(), source }
    }

    /// The fault of a table with what the table was to hold.
    pub fn in_table(self, kind: TableKind) -> Self {
        match self {
            Self::Table { path, place, problem, .. } => Self::Table { kind, path, place, problem },
            other => other,
        }
    }

    /// A number outside its domain, or content that is missing, told as the fault of this file.
    pub fn in_file(self, fault: FileFault, path: &Path) -> Self {
        match self {
            Self::OutOfRange { .. } => Self::file(fault, path, self.to_string()),
            Self::File { fault: FileFault::Content, problem, .. } => Self::file(fault, path, problem),
            other => other,
        }
    }

    /// A number outside its domain told as the fault of this model.
    pub fn in_model(self, model: &str) -> Self {
        match self {
            Self::OutOfRange { .. } => Self::Model { model: model.into(), problem: self.to_string() },
            other => other,
        }
    }

    /// The quantity `what` told as the option of the command line that set it.
    pub fn named(self, what: &str, option: &str) -> Self {
        match self {
            Self::OutOfRange { what: own, value, allowed } if own == what => {
                Self::Argument { option: option.into(), value, allowed }
            }
            other => other,
        }
    }

    /// Puts the final name of a file in place of the temporary one under which it is written.
    pub fn at_path(mut self, final_path: &Path) -> Self {
        if let Self::Write { path, .. } | Self::Table { path, .. } | Self::File { path, .. } = &mut self {
            *path = final_path.into();
        }
        self
    }

    /// True when the input is to blame (exit code 2), false when the run failed (exit code 1).
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Write { .. } | Self::StandardOutput { .. } | Self::Cancelled)
    }
}

/// `line 3, column 8: `, or nothing.
fn place(at: &Option<LineColumn>) -> String {
    at.map_or_else(String::new, |at| format!("line {}, column {}: ", at.line, at.column))
}

/// The key before a cause that does not name it.
fn key_before(key: &Option<String>, cause: &Error) -> String {
    match (key, cause) {
        (Some(key), Error::MassDefinition { .. }) => format!("{key}: "),
        _ => String::new(),
    }
}

/// The same number with an exponent, where a text is one with very many digits.
fn readable(value: String) -> String {
    /// The longest number that is read at a glance; the shortest form of an f64 has at most 17 digits.
    const LONGEST: usize = 25;
    match value.parse::<f64>() {
        Ok(number) if value.len() > LONGEST => shortest(number),
        _ => value,
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
    fn numbers_of_very_many_digits_are_told_with_an_exponent() {
        let text = |value: f64| Error::out_of_range("x", value, "less").to_string();
        assert_eq!(text(-1e200), "x is -1e200, but must be less");
        assert_eq!(text(1.234_567_890_123_456_7e-5), "x is 0.000012345678901234568, but must be less");
        assert_eq!(Error::out_of_range("x", "a name of very many letters", "short").to_string().len(), 51);
    }
}
