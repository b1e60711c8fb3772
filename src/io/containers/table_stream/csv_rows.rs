//! Rows of a CSV file, one after the other, as people, pandas, spreadsheets and astropy write them.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use csv::ByteRecord;
use flate2::read::MultiGzDecoder;

use super::super::column::no_number;
use super::super::csv_dialect::{self, Ecsv};
use super::super::table_csv::check_names;
use super::title::{BATCH_ROWS, ColumnTitle};
use crate::error::{Error, FileFault, Result};

/// The rows that have not been read.
pub(super) struct CsvRows {
    records: csv::Reader<Box<dyn BufRead + Send>>,
    width: usize,
}

impl CsvRows {
    /// Reads up to the header.
    pub(super) fn open(path: &Path) -> Result<(Vec<ColumnTitle>, Self)> {
        let unknown = |problem: &str| Error::file(FileFault::UnknownFormat, path, problem);
        let mut lines = opened(path)?;
        let (mut before, mut line_number) = (String::new(), 0);
        let header = loop {
            let mut line = Vec::new();
            if lines.read_until(b'\n', &mut line).map_err(Error::read(path))? == 0 {
                return Err(unknown(
                    "is empty or holds comments only; a header line with the column names is wanted",
                ));
            }
            line_number += 1;
            let line = String::from_utf8(line).map_err(|_| unknown("is not a CSV file: not UTF-8 text"))?;
            let line = line.trim_start_matches('\u{feff}').to_string();
            let is_dialect = line_number == 1 && csv_dialect::states_separator(&line);
            if !is_dialect && !is_left_out(line.as_bytes()) {
                break line;
            }
            before += line.trim_start();
        };
        let ecsv = Ecsv::of(path, &before)?;
        let separator = ecsv.as_ref().map_or_else(|| csv_dialect::separator(&header), |ecsv| ecsv.separator);
        let reader = || {
            let mut builder = csv::ReaderBuilder::new();
            builder
                .has_headers(false)
                .flexible(true)
                .delimiter(separator)
                .comment(Some(b'#'))
                .trim(csv::Trim::All);
            builder
        };
        let mut names: Vec<String> = Vec::new();
        if let Some(record) = reader().from_reader(header.as_bytes()).records().next() {
            let record = record.map_err(|error| unknown(&format!("is not a CSV file: {error}")))?;
            names = record.iter().map(String::from).collect();
        }
        check_names(path, line_number, &names)?;
        let unit = |name: &String| ecsv.as_ref().and_then(|ecsv| ecsv.units.get(name).cloned().flatten());
        let titles = names.iter().map(|name| ColumnTitle { name: name.clone(), unit: unit(name) }).collect();
        Ok((titles, Self { records: reader().from_reader(lines), width: names.len() }))
    }

    /// The next rows.
    pub(super) fn next_rows(
        &mut self,
        path: &Path,
        first_row: u64,
        wanted: &[usize],
        names: &[&str],
    ) -> Result<Vec<Vec<f64>>> {
        let mut columns = vec![Vec::with_capacity(BATCH_ROWS as usize); wanted.len()];
        let (mut record, mut row) = (ByteRecord::new(), first_row);
        while row < first_row + BATCH_ROWS {
            let is_there = self.records.read_byte_record(&mut record).map_err(|error| {
                Error::file(
                    FileFault::Damaged,
                    path,
                    format!("cannot be read on from {}: {error}", place_of(path, row)),
                )
            })?;
            if !is_there {
                break;
            }
            let is_blank = record.iter().all(<[u8]>::is_empty) && (record.len() != 1 || self.width != 1);
            if is_blank || record.get(0).is_some_and(|first| first.starts_with(b"#")) {
                continue;
            }
            if record.len() < self.width || record.iter().skip(self.width).any(|field| !field.is_empty()) {
                let problem = format!("has {} fields, but the header has {}", record.len(), self.width);
                return Err(Error::table(path, place_of(path, row), problem));
            }
            for ((column, &i), name) in columns.iter_mut().zip(wanted).zip(names) {
                let field = record.get(i).unwrap_or_default();
                column.push(number(field).ok_or_else(|| {
                    let place = format!("{}, column {name}", place_of(path, row));
                    Error::table(path, place, no_number(&String::from_utf8_lossy(field)))
                })?);
            }
            row += 1;
        }
        Ok(columns)
    }
}

/// An empty field is a value that is missing.
fn number(field: &[u8]) -> Option<f64> {
    if field.is_empty() {
        return Some(f64::NAN);
    }
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// The file from its beginning, unpacked if it is gzip's.
fn opened(path: &Path) -> Result<Box<dyn BufRead + Send>> {
    const BUFFER_BYTES: usize = 1 << 20;
    let file = super::super::input_file::open(path)?;
    let mut file = BufReader::with_capacity(BUFFER_BYTES, file);
    let is_packed = file.fill_buf().map_err(Error::read(path))?.starts_with(&[0x1f, 0x8b]);
    let plain: Box<dyn Read + Send> = match is_packed {
        true => Box::new(MultiGzDecoder::new(file)),
        false => return Ok(Box::new(file)),
    };
    Ok(Box::new(BufReader::with_capacity(BUFFER_BYTES, plain)))
}

/// Comments, blank lines and rows of nothing but separators.
fn is_left_out(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.is_empty() || line.starts_with(b"#") || line.iter().all(|byte| b",;\t ".contains(byte))
}

/// The line in which a row stands, counted anew: it is asked for where something is wrong.
pub(super) fn place_of(path: &Path, row: u64) -> String {
    let (mut line_number, mut rows) = (0_u64, 0_u64);
    if let Ok(mut lines) = opened(path) {
        let mut line = Vec::new();
        while lines.read_until(b'\n', &mut line).is_ok_and(|bytes| bytes > 0) {
            line_number += 1;
            let text = line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&line);
            // The first line that counts is the header.
            rows += u64::from(!is_left_out(text));
            if rows == row + 2 {
                return format!("line {line_number}");
            }
            line.clear();
        }
    }
    format!("row {}", row + 1)
}
