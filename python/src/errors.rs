//! haloray's errors as the exceptions of `haloray._errors`.

use std::io::ErrorKind;

use haloray::Error;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The exception of an error, with its hint; a file's fault also has `errno` and `filename`.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    if matches!(error, Error::Cancelled) {
        return PyKeyboardInterrupt::new_err(());
    }
    let built = (|| -> PyResult<Bound<'_, PyAny>> {
        let own = class(py, error)?.call1((error.to_string(),))?;
        // The hint of a number outside its domain is about the command's configuration.
        if !matches!(error, Error::OutOfRange { .. } | Error::Argument { .. }) {
            own.setattr("hint", error.hint())?;
        }
        if let Error::Read { path, source } | Error::OutputPlace { path, source } = error {
            own.setattr("errno", source.raw_os_error())?;
            own.setattr("filename", path)?;
        }
        Ok(own)
    })();
    built.map_or_else(|failed| failed, PyErr::from_value)
}

fn class<'py>(py: Python<'py>, error: &Error) -> PyResult<Bound<'py, PyType>> {
    let name = match error {
        Error::Read { source, .. } | Error::OutputPlace { source, .. }
            if source.kind() == ErrorKind::NotFound =>
        {
            "MissingFileError"
        }
        Error::Read { .. } | Error::OutputPlace { .. } | Error::Write { .. } => "FileError",
        _ => "InputError",
    };
    Ok(py.import("haloray._errors")?.getattr(name)?.cast_into()?)
}

/// An `InputError` with these words.
pub fn input(py: Python<'_>, what: &str, value: impl ToString, allowed: &str) -> PyErr {
    exception(py, &Error::out_of_range(what, value, allowed))
}

/// Refuses what is no redshift of a lens or source.
pub fn redshift(py: Python<'_>, name: &str, z: f64) -> PyResult<()> {
    match z > 0.0 && z.is_finite() {
        true => Ok(()),
        false => Err(input(py, name, z, "a finite number above 0")),
    }
}

/// haloray's result as Python's.
pub trait OrRaise<T> {
    /// The value, or the exception raised.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for haloray::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}
