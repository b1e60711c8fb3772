//! A table that is read once, from its first row to its last.

use std::path::{Path, PathBuf};

use super::super::table_file::Format;
use super::super::unit;
use super::csv_rows::{self, CsvRows};
use super::fits_rows::FitsRows;
use super::hdf5_rows::Hdf5Rows;
use super::title::{BATCH_ROWS, ColumnTitle};
use crate::error::{Error, Result};

/// Rows of the chosen columns, in their order; a value that is missing is no number.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Number of the first row, from 0.
    pub first_row: u64,
    /// The columns.
    pub columns: Vec<Vec<f64>>,
}

/// A table (CSV, HDF5, FITS) that is read once from its first row to its last.
pub struct TableStream {
    path: PathBuf,
    titles: Vec<ColumnTitle>,
    row_count: Option<u64>,
    next_row: u64,
    rows: Rows,
}

enum Rows {
    Csv(CsvRows),
    Fits(FitsRows),
    Hdf5(Hdf5Rows),
}

impl TableStream {
    /// Opens a table; its extension decides the format and `group` names the HDF5 group or FITS extension to prefer, as for
    /// [`Table::read`](super::super::Table::read).
    ///
    /// # Errors
    /// As there; HDF5 that is packed as a whole (`.h5.gz`).
    pub fn open(path: &Path, group: &str) -> Result<Self> {
        let (titles, row_count, rows) = match Format::of(path)? {
            Format::Csv => {
                let (titles, rows) = CsvRows::open(path)?;
                (titles, None, Rows::Csv(rows))
            }
            Format::Fits => {
                let (titles, count, rows) = FitsRows::open(path, group)?;
                (titles, Some(count), Rows::Fits(rows))
            }
            Format::Hdf5 => {
                let (titles, count, rows) = Hdf5Rows::open(path, group)?;
                (titles, Some(count), Rows::Hdf5(rows))
            }
        };
        Ok(Self { path: path.into(), titles, row_count, next_row: 0, rows })
    }

    /// Its columns.
    pub fn titles(&self) -> &[ColumnTitle] {
        &self.titles
    }

    /// How many rows it has, where the file says so before it is read.
    pub fn row_count(&self) -> Option<u64> {
        self.row_count
    }

    /// The next rows of the columns of these numbers, from 0; none after the last.
    ///
    /// # Errors
    /// A value that is no number, with its place; a file that is damaged.
    pub fn next_batch(&mut self, wanted: &[usize]) -> Result<Option<Batch>> {
        let first_row = self.next_row;
        let left = self.row_count.map_or(BATCH_ROWS, |count| count.saturating_sub(first_row));
        if left == 0 {
            return Ok(None);
        }
        let names: Vec<&str> = wanted.iter().map(|&i| self.titles[i].name.as_str()).collect();
        let columns = match &mut self.rows {
            Rows::Csv(rows) => rows.next_rows(&self.path, first_row, wanted, &names)?,
            Rows::Fits(rows) => rows.next_rows(&self.path, left.min(BATCH_ROWS), wanted)?,
            Rows::Hdf5(rows) => rows.rows(&self.path, first_row, left, wanted)?,
        };
        let length = columns.first().map_or(0, Vec::len) as u64;
        self.next_row += length;
        Ok((length > 0).then_some(Batch { first_row, columns }))
    }

    /// What is wrong with a value of the table.
    pub fn fault_in_row(&self, row: u64, column: &str, problem: impl Into<String>) -> Error {
        let place = match &self.rows {
            Rows::Csv(_) => csv_rows::place_of(&self.path, row),
            _ => format!("row {}", row + 1),
        };
        Error::table(&self.path, format!("{place}, column {column}"), problem)
    }
}

/// What numbers of a stated unit are multiplied by to be degrees; what is allowed otherwise.
pub(crate) fn degrees_in(stated: &str) -> std::result::Result<f64, String> {
    unit::factor("_arcsec", stated).map(|arcsec| arcsec / 3600.0)
}

#[cfg(test)]
mod tests {
    use super::super::super::column::Column;
    use super::super::super::fits_file;
    use super::super::super::provenance::Provenance;
    use super::super::super::table::Table;
    use super::*;

    fn all(path: &Path, wanted: &[usize]) -> Result<Vec<Vec<f64>>> {
        let mut stream = TableStream::open(path, "haloes")?;
        let mut columns = vec![Vec::new(); wanted.len()];
        while let Some(batch) = stream.next_batch(wanted)? {
            assert_eq!(batch.first_row as usize, columns[0].len());
            columns.iter_mut().zip(batch.columns).for_each(|(all, more)| all.extend(more));
        }
        assert!(stream.row_count().is_none_or(|count| count as usize == columns[0].len()));
        Ok(columns)
    }

    #[test]
    fn every_format_streams_what_it_was_given() {
        let rows = BATCH_ROWS as usize + 7;
        let z: Vec<f64> = (0..rows).map(|i| i as f64 * 0.1).collect();
        let mass: Vec<f64> =
            (0..rows).map(|i| if i == 5 { f64::NAN } else { 1e12 / (1.0 + i as f64) }).collect();
        let note = vec!["a".to_string(); rows];
        let columns = vec![
            Column::f64("z", None, z.clone()),
            Column::text("note", note),
            Column::f64("m", Some("Msun/h"), mass.clone()),
        ];
        let table = Table::new(columns).unwrap().with_gaps_in(["m"].into_iter());
        let folder = tempfile::tempdir().unwrap();
        for name in ["t.csv", "t.h5", "t.fits"] {
            let path = folder.path().join(name);
            table.write(&path, "haloes", &Provenance::new(None, "")).unwrap();
            let stream = TableStream::open(&path, "haloes").unwrap();
            assert_eq!(stream.titles()[2].name, "m");
            assert_eq!(stream.titles()[2].unit.as_deref(), (name != "t.csv").then_some("Msun/h"), "{name}");
            let found = all(&path, &[2, 0]).unwrap();
            assert!(found[1] == z, "{name}");
            assert!(
                found[0]
                    .iter()
                    .zip(&mass)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
            );
            let text = all(&path, &[1]).unwrap_err().to_string();
            assert!(text.contains("column note") && text.contains("number"), "{text}");
        }
    }

    #[test]
    fn lines_of_a_csv_are_those_of_an_editor() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let text = "\u{feff}# made by hand\nz , m\n\n  # more\n0.5,\n 0.6 ,1e12\n# and more\nabc,3\n";
        std::fs::write(&path, text).unwrap();
        let found = all(&path, &[0]).unwrap_err().to_string();
        assert!(found.ends_with("line 8, column z: \"abc\" is not a number"), "{found}");
        std::fs::write(&path, text.replace("abc", "0.7")).unwrap();
        let found = all(&path, &[0, 1]).unwrap();
        assert_eq!(found[0], [0.5, 0.6, 0.7]);
        assert!(found[1][0].is_nan() && found[1][1..] == [1e12, 3.0]);
        std::fs::write(&path, "z,m\n0.5,1\n0.6\n").unwrap();
        let found = all(&path, &[0]).unwrap_err().to_string();
        assert!(found.ends_with("line 3: has 1 fields, but the header has 2"), "{found}");
    }

    #[test]
    fn the_line_by_which_spreadsheets_state_the_separator_is_no_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, "\u{feff}sep=;\r\nz;m\r\n0.5;1\r\n").unwrap();
        assert_eq!(all(&path, &[0, 1]).unwrap(), [[0.5], [1.0]]);
        let table = Table::read(&path, "haloes").unwrap();
        assert_eq!((table.column_names().as_str(), table.required_f64("m").unwrap()), ("z, m", &[1.0][..]));
    }

    #[test]
    fn of_several_fits_tables_the_named_one_is_taken_and_no_other_guessed() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, groups: [&str; 2]| {
            let path = folder.path().join(name);
            let own = |(i, group): (usize, &str)| {
                let part = folder.path().join(format!("{i}.fits"));
                let table = Table::new(vec![Column::f64("z", None, vec![i as f64])]).unwrap();
                table.write(&part, group, &Provenance::new(None, "")).unwrap();
                fits_file::read(&part).unwrap()
            };
            let units = groups.into_iter().enumerate().map(own);
            let units = units.enumerate().flat_map(|(i, units)| units.into_iter().skip(usize::from(i > 0)));
            fits_file::write(&path, units.collect()).unwrap();
            path
        };
        assert_eq!(all(&file("named.fits", ["other", "haloes"]), &[0]).unwrap(), [[1.0]]);
        let error = TableStream::open(&file("two.fits", ["a", "b"]), "haloes").map(drop).unwrap_err();
        assert!(error.to_string().contains("holds no table haloes; the tables are A, B"), "{error}");
    }

    #[test]
    fn what_cannot_be_streamed_says_so() {
        let folder = tempfile::tempdir().unwrap();
        for (name, content, wanted) in [
            ("t.h5", &b"z,m\n1,2\n"[..], "is not an HDF5 file"),
            ("t.h5.gz", b"\x1f\x8b", "unpack it first"),
            ("t.fits", b"z,m\n", "is not a FITS file"),
            ("t.parquet", b"PAR1", "Parquet"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, content).unwrap();
            let found = TableStream::open(&path, "haloes").map(drop).unwrap_err();
            assert!(found.is_bad_input() && found.to_string().contains(wanted), "{found}");
        }
    }
}
