//! Tables in and out of files: the extension decides between CSV, HDF5 and FITS.

use std::path::Path;

use super::provenance::Provenance;
use super::table::Table;
use super::{atomic_file, sealed_hdf5, table_csv, table_fits, table_hdf5};
use crate::error::{Error, FileFault, Result};

impl Table {
    /// Reads a table; `.csv`/`.ecsv`, `.h5`/`.hdf5` or `.fits`/`.fit` decides the format, also before `.gz`.
    ///
    /// `group` names the HDF5 group or FITS extension to prefer (`"haloes"`); where it is
    /// missing the only one in the file is taken.
    ///
    /// # Errors
    /// [`Error::Read`], [`Error::File`] or [`Error::Table`], each naming file, place and cure.
    pub fn read(path: &Path, group: &str) -> Result<Self> {
        match Format::of(path)? {
            Format::Csv => table_csv::read(path),
            Format::Hdf5 => table_hdf5::read(path, group),
            Format::Fits => table_fits::read(path, group),
        }
    }

    /// Writes the table atomically, in the format the extension names, with its provenance: inside
    /// HDF5 and FITS, beside a CSV as `NAME.csv.provenance.toml`. Same data, same bytes.
    ///
    /// # Errors
    /// [`Error::File`] for another extension, [`Error::Table`] for a number that is not finite, [`Error::OutputPlace`],
    /// [`Error::Write`].
    pub fn write(&self, path: &Path, group: &str, provenance: &Provenance) -> Result<()> {
        let format = Format::to_write(path)?;
        self.check_finite(path)?;
        match format {
            Format::Csv => table_csv::write(self, path, provenance),
            Format::Hdf5 => {
                sealed_hdf5::write_hdf5_atomically(path, |p| table_hdf5::write(self, p, group, provenance))
            }
            Format::Fits => {
                atomic_file::write_atomically(path, |p| table_fits::write(self, p, group, provenance))
            }
        }
    }

    /// Writes the table as a new HDF5 file into a staging folder, which gives many such files their names at once.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub(in crate::io) fn write_staged_hdf5(
        &self,
        path: &Path,
        group: &str,
        provenance: &Provenance,
    ) -> Result<()> {
        self.check_finite(path)?;
        table_hdf5::write(self, path, group, provenance)
    }

    /// Checks that a table could be written to `path`: known extension, writable place.
    pub fn check_target(path: &Path) -> Result<()> {
        Format::to_write(path)?;
        atomic_file::check_writable(path)
    }
}

/// The formats of a table.
pub(super) enum Format {
    Csv,
    Hdf5,
    Fits,
}

impl Format {
    /// The format to read: what stands before `.gz` counts.
    pub(super) fn of(path: &Path) -> Result<Self> {
        let is_packed = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
        let name = if is_packed { path.with_extension("") } else { path.into() };
        let extension = name.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("csv" | "ecsv") => Ok(Self::Csv),
            Some("h5" | "hdf5") => Ok(Self::Hdf5),
            Some("fits" | "fit") => Ok(Self::Fits),
            _ => Err(Self::unknown(path)),
        }
    }

    /// The format to write: the same without gzip, and without the header of ECSV.
    fn to_write(path: &Path) -> Result<Self> {
        let is_read_only =
            |extension: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(extension));
        if is_read_only("gz") || is_read_only("ecsv") { Err(Self::unknown(path)) } else { Self::of(path) }
    }

    fn unknown(path: &Path) -> Error {
        let is_parquet = path.extension().is_some_and(|own| own.eq_ignore_ascii_case("parquet"));
        let problem = match is_parquet {
            true => {
                "Parquet is not read; write its columns as HDF5 (`pandas.read_parquet`, then `h5py`), one dataset a column"
            }
            false => "the extension does not name a table format; allowed: .csv, .h5, .hdf5, .fits, .fit",
        };
        Error::file(FileFault::UnknownFormat, path, problem)
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::Column;
    use super::*;

    #[test]
    fn other_extensions_are_refused_with_the_list_of_allowed_ones() {
        for name in ["haloes.txt", "haloes", "csv"] {
            let error = Table::read(Path::new(name), "haloes").unwrap_err().to_string();
            assert!(error.starts_with(name) && error.ends_with("allowed: .csv, .h5, .hdf5, .fits, .fit"));
        }
    }

    #[test]
    fn every_format_gives_back_what_it_was_given() {
        let numbers = Column::f64("theta_x_arcsec", Some("arcsec"), vec![0.1 + 0.2, -1e-30]);
        let table = Table::new(vec![numbers, Column::text("label", vec!["a".into(), "b c".into()])]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for (name, files) in [("t.csv", 2), ("t.H5", 3), ("t.hdf5", 4), ("t.fits", 5), ("t.fit", 6)] {
            let path = folder.path().join(name);
            Table::check_target(&path).unwrap();
            table.write(&path, "rays", &Provenance::new(Some(1), "a = 1\n")).unwrap();
            let back = Table::read(&path, "rays").unwrap();
            let values = |table: &Table| table.columns().iter().map(|c| c.values.clone()).collect::<Vec<_>>();
            assert_eq!(values(&back), values(&table), "{name}");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), files, "{name}");
        }
    }
}
