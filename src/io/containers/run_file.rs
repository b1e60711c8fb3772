//! The one HDF5 file of a run as it is written: named arrays with units and descriptions, and its provenance.

use std::path::{Path, PathBuf};

use hdf5::{File, Location};

use super::attribute::AttributeValue;
use super::hdf5_objects as objects;
use super::provenance::Provenance;
use super::table::refuse_non_finite;
use crate::error::{Error, Result};

/// An HDF5 file of results, being written; [`RunFileReader`](super::RunFileReader) reads it back.
///
/// Groups are paths (`"maps/shear"`) and are created on first use. The bytes depend only on what
/// is written and its order, never on the time. Use it inside [`Staging`](super::Staging) or
/// [`write_atomically`](super::write_atomically), and end writing with [`close`](Self::close).
#[derive(Debug)]
pub struct RunFile {
    path: PathBuf,
    file: File,
}

impl RunFile {
    /// Creates the file, replacing a former one, and stores the provenance in its root.
    ///
    /// # Errors
    /// [`Error::Write`], as from every writing method here.
    pub fn create(path: &Path, provenance: &Provenance) -> Result<Self> {
        let file = objects::create(path)?;
        objects::write_provenance(path, &file, provenance)?;
        Ok(Self { path: path.into(), file })
    }

    /// Flushes everything to the file and closes it.
    pub fn close(self) -> Result<()> {
        objects::close(&self.path, self.file)
    }

    /// Creates a group, unless it is there.
    pub fn group(&self, name: &str) -> Result<()> {
        objects::group_or_new(&self.path, &self.file, name).map(drop)
    }

    /// Writes a list of finite numbers; `unit` is empty for pure numbers.
    ///
    /// # Errors
    /// [`Error::Table`] with row and name for a number that is not finite, also from [`Self::write_2d`].
    pub fn write_1d(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        unit: &str,
        description: &str,
    ) -> Result<()> {
        self.write_array(group, name, data, &[data.len()], unit, description)
    }

    /// Writes a map, row-major with `shape` = (ny, nx).
    pub fn write_2d(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        shape: (usize, usize),
        unit: &str,
        description: &str,
    ) -> Result<()> {
        self.write_array(group, name, data, &[shape.0, shape.1], unit, description)
    }

    fn write_array(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        shape: &[usize],
        unit: &str,
        description: &str,
    ) -> Result<()> {
        refuse_non_finite(&self.path, &format!("{group}/{name}"), data)?;
        self.write_with_gaps(group, name, data, shape, unit, description)
    }

    /// Writes numbers of any shape, rows first, among which there may be gaps: a user's own, what is not used, what is undefined.
    pub fn write_with_gaps(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        shape: &[usize],
        unit: &str,
        description: &str,
    ) -> Result<()> {
        let group = objects::group_or_new(&self.path, &self.file, group)?;
        let dataset = objects::write_f64(&self.path, &group, name, data, shape)?;
        objects::write_attribute(&self.path, &dataset, "unit", &unit.into())?;
        objects::write_attribute(&self.path, &dataset, "description", &description.into())
    }

    /// Writes a list of texts (parameter names, model names).
    pub fn write_text(&self, group: &str, name: &str, text: &[String], description: &str) -> Result<()> {
        let group = objects::group_or_new(&self.path, &self.file, group)?;
        let dataset = objects::write_text(&self.path, &group, name, text)?;
        objects::write_attribute(&self.path, &dataset, "description", &description.into())
    }

    /// Attaches a value to the group or dataset at `object` (`"/"` for the file itself).
    pub fn attribute(&self, object: &str, name: &str, value: impl Into<AttributeValue>) -> Result<()> {
        let place = self.locate(object).map_err(|error| Error::write(&self.path, error))?;
        objects::write_attribute(&self.path, &place, name, &value.into())
    }

    fn locate(&self, object: &str) -> std::result::Result<Location, String> {
        let full = rooted(object);
        if let Ok(group) = self.file.group(&full) {
            return Ok(Location::clone(&group));
        }
        let dataset = self.file.dataset(&full).map_err(|_| format!("holds no {object}"))?;
        Ok(Location::clone(&dataset))
    }
}

/// The path of an object from the root on.
pub(super) fn rooted(name: &str) -> String {
    format!("/{}", name.trim_matches('/'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_folder_or_a_second_dataset_of_that_name_fails_to_write() {
        let folder = tempfile::tempdir().unwrap();
        let provenance = Provenance::new(None, "");
        let error = RunFile::create(&folder.path().join("missing/run.h5"), &provenance).unwrap_err();
        assert!(!error.is_bad_input());
        let run = RunFile::create(&folder.path().join("run.h5"), &provenance).unwrap();
        run.write_1d("rays", "x", &[1.0], "", "").unwrap();
        let error = run.write_1d("rays", "y", &[2.0, f64::INFINITY], "", "").unwrap_err().to_string();
        assert!(
            error.ends_with("row 2, column rays/y: the result is inf, no finite number; nothing is written"),
            "{error}"
        );
        run.write_with_gaps("rays", "z", &[f64::NAN], &[1], "", "").unwrap();
        let error = run.write_1d("rays", "x", &[2.0], "", "").unwrap_err().to_string();
        assert!(error.contains("dataset x exists already in /rays"), "{error}");
    }
}
