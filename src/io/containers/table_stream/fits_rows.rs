//! Rows of a FITS binary table, read one after the other.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use fitskit::{BinColumn, BinTable, Header, HeaderValue};
use flate2::read::MultiGzDecoder;

use super::super::column::Values;
use super::super::fits_file::{self as fits, BLOCK_BYTES};
use super::super::fits_header::{CARD_BYTES, declared_bytes, parsed_header};
use super::super::fits_units::column_units;
use super::super::table_fits::decode;
use super::title::ColumnTitle;
use crate::error::{Error, FileFault, Result};

/// The rows that have not been read.
pub(super) struct FitsRows {
    file: Box<dyn Read + Send>,
    columns: Vec<BinColumn>,
    /// Where each column begins in a row.
    offsets: Vec<usize>,
    nulls: Vec<Option<i64>>,
    row_bytes: usize,
}

impl FitsRows {
    /// Reads up to the rows of the binary table of that name; where none has it, of the only one.
    pub(super) fn open(path: &Path, group: &str) -> Result<(Vec<ColumnTitle>, u64, Self)> {
        let mut names = Vec::new();
        let is_named = |header: &Header| {
            names.push(header.get_string("EXTNAME").unwrap_or("(unnamed)").to_owned());
            fits::is_named(header, group)
        };
        let place = match place_of(path, is_named)? {
            Some(place) => Some(place),
            None if names.len() > 1 => {
                let problem = format!("holds no table {group}; the tables are {}", names.join(", "));
                return Err(Error::file(FileFault::Content, path, problem));
            }
            None => place_of(path, |_| true)?,
        };
        let Some((header, file)) = place else {
            return Err(Error::file(FileFault::Content, path, "holds no binary table"));
        };
        let damaged = |problem: String| Error::file(FileFault::Damaged, path, problem);
        let natural = |name: &str| {
            let value = header.get_int(name).and_then(|value| u64::try_from(value).ok());
            value.ok_or_else(|| damaged(format!("{name} is missing, or no natural number")))
        };
        let (row_bytes, row_count) = (natural("NAXIS1")? as usize, natural("NAXIS2")?);
        // fitskit decodes whole tables: one without rows has the same columns.
        let mut without_rows = header.clone();
        for name in ["NAXIS2", "PCOUNT"] {
            without_rows.set(name, HeaderValue::Integer(0), None);
        }
        let table = BinTable::from_header_and_data(&without_rows, &[]).map_err(|e| damaged(e.to_string()))?;
        let mut offsets = Vec::with_capacity(table.columns.len());
        let mut width = 0_usize;
        for column in &table.columns {
            offsets.push(width);
            width = width.saturating_add(column.format.byte_size());
        }
        if width != row_bytes || width == 0 {
            return Err(damaged(format!("the columns take {width} bytes a row, but NAXIS1 is {row_bytes}")));
        }
        let units = column_units(path, &header, &table.columns)?;
        let title = |(column, unit): (&BinColumn, _)| ColumnTitle { name: column.name.trim().into(), unit };
        let titles = table.columns.iter().zip(units).map(title).collect();
        let nulls = (1..=table.columns.len()).map(|i| header.get_int(&format!("TNULL{i}"))).collect();
        Ok((titles, row_count, Self { file, columns: table.columns, offsets, nulls, row_bytes }))
    }

    /// So many rows more.
    pub(super) fn next_rows(&mut self, path: &Path, rows: u64, wanted: &[usize]) -> Result<Vec<Vec<f64>>> {
        let mut bytes = Vec::new();
        let length = rows * self.row_bytes as u64;
        self.file.by_ref().take(length).read_to_end(&mut bytes).map_err(Error::read(path))?;
        if (bytes.len() as u64) < length {
            let problem = "the file is truncated: rows of the table are missing";
            return Err(Error::file(FileFault::Damaged, path, problem));
        }
        let column = |&i: &usize| {
            let (column, start) = (&self.columns[i], self.offsets[i]);
            let end = start + column.format.byte_size();
            let cells = bytes.chunks_exact(self.row_bytes).map(|row| &row[start..end]);
            let fault =
                |problem: String| Error::table(path, format!("column {}", column.name.trim()), problem);
            match decode(column, self.nulls[i], cells).map_err(fault)? {
                Values::F64(values) => Ok(values),
                Values::Text(_) => Err(fault("holds text; numbers are wanted".into())),
            }
        };
        wanted.iter().map(column).collect()
    }
}

/// Header of the first binary table that is wanted, and the file from its first row on.
fn place_of(
    path: &Path,
    mut is_wanted: impl FnMut(&Header) -> bool,
) -> Result<Option<(Header, Box<dyn Read + Send>)>> {
    let mut file = BufReader::with_capacity(1 << 20, super::super::input_file::open(path)?);
    let is_packed = file.fill_buf().map_err(Error::read(path))?.starts_with(&[0x1f, 0x8b]);
    let mut file: Box<dyn Read + Send> =
        if is_packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
    for index in 0.. {
        let damaged =
            |problem: String| Error::file(FileFault::Damaged, path, format!("HDU {index}: {problem}"));
        let Some(header) = next_header(path, &mut file, index)? else { return Ok(None) };
        let header = parsed_header(&header).map_err(damaged)?;
        if header.get_string("XTENSION") == Some("BINTABLE") && is_wanted(&header) {
            return Ok(Some((header, file)));
        }
        let bytes = u64::try_from(declared_bytes(&header).map_err(damaged)?).unwrap_or(u64::MAX);
        let padded = bytes.checked_next_multiple_of(BLOCK_BYTES as u64).unwrap_or(u64::MAX);
        std::io::copy(&mut file.by_ref().take(padded), &mut std::io::sink()).map_err(Error::read(path))?;
    }
    Ok(None)
}

/// The bytes of the next header, whole blocks; none at the end of the file.
fn next_header(path: &Path, file: &mut dyn Read, index: usize) -> Result<Option<Vec<u8>>> {
    /// Blocks of a header that may be one.
    const BLOCKS_MAX: usize = 4096;
    let mut header = Vec::new();
    for _ in 0..BLOCKS_MAX {
        let before = header.len();
        file.take(BLOCK_BYTES as u64).read_to_end(&mut header).map_err(Error::read(path))?;
        if index == 0 && before == 0 && !header.starts_with(b"SIMPLE  =") {
            let problem = "is not a FITS file: it does not begin with SIMPLE";
            return Err(Error::file(FileFault::UnknownFormat, path, problem));
        }
        if header.len() < before + BLOCK_BYTES {
            let is_end = header[..].trim_ascii().is_empty();
            let problem = format!("HDU {index}: the file is truncated");
            return if is_end { Ok(None) } else { Err(Error::file(FileFault::Damaged, path, problem)) };
        }
        if header[before..].chunks_exact(CARD_BYTES).any(|card| card.trim_ascii_end() == b"END") {
            return Ok(Some(header));
        }
    }
    Err(Error::file(FileFault::Damaged, path, format!("HDU {index}: a header without END")))
}
