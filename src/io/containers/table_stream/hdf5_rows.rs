//! Rows of an HDF5 table: slices of its datasets, or of its one dataset of records.

use std::path::Path;

use hdf5_reader::{CompoundField, Dataset, Datatype, SliceInfo, SliceInfoElem};
use rayon::prelude::*;

use super::super::hdf5_attributes::check_not_packed;
use super::super::hdf5_place::{TableInHdf5, find_table, problem_of_shape};
use super::super::hdf5_reading as reading;
use super::super::table_hdf5::{record_units, stated_unit};
use super::hdf5_number::{Number, Record, number, number_bytes};
use super::title::{BATCH_ROWS, ColumnTitle};
use crate::error::{Error, FileFault, Result};

/// Where the rows are.
pub(super) enum Hdf5Rows {
    Columns(Vec<Dataset>),
    Records(Box<Dataset>, Vec<CompoundField>),
}

impl Hdf5Rows {
    pub(super) fn open(path: &Path, group: &str) -> Result<(Vec<ColumnTitle>, u64, Self)> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz")) {
            let problem = "is packed as a whole and cannot be read in parts; unpack it first";
            return Err(Error::file(FileFault::Content, path, problem));
        }
        let file = reading::open_in_parts(path)?;
        let (titles, rows) = match find_table(path, &file, group)? {
            TableInHdf5::Records(dataset, beside) => {
                let Datatype::Compound { fields, .. } = dataset.dtype() else {
                    return Err(Error::file(FileFault::Damaged, path, "holds records without fields"));
                };
                let fields = fields.clone();
                let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
                let units = record_units(path, &dataset, &names, &beside)?;
                let title =
                    |(name, unit): (&&str, Option<String>)| ColumnTitle { name: (*name).into(), unit };
                let titles: Vec<ColumnTitle> = names.iter().zip(units).map(title).collect();
                (titles, Self::Records(dataset, fields))
            }
            TableInHdf5::Columns(mut datasets) => {
                datasets.retain(|dataset| problem_of_shape(dataset).is_none());
                datasets.iter().try_for_each(|dataset| check_not_packed(path, dataset))?;
                let title = |dataset: &Dataset| {
                    let unit = stated_unit(path, dataset)?;
                    Ok(ColumnTitle { name: dataset.name().into(), unit })
                };
                (datasets.iter().map(title).collect::<Result<_>>()?, Self::Columns(datasets))
            }
        };
        let count = rows.row_count(path)?;
        Ok((titles, count, rows))
    }

    fn row_count(&self, path: &Path) -> Result<u64> {
        let length = |dataset: &Dataset| dataset.shape().first().copied().unwrap_or(0);
        match self {
            Self::Records(dataset, _) => Ok(length(dataset)),
            Self::Columns(datasets) => {
                let count = datasets.first().map_or(0, length);
                match datasets.iter().find(|dataset| length(dataset) != count) {
                    None => Ok(count),
                    Some(other) => {
                        let (rows, first) = (length(other), datasets[0].name());
                        let problem = format!("has {rows} rows, but column {first} has {count}");
                        Err(Error::table(path, format!("column {}", other.name()), problem))
                    }
                }
            }
        }
    }

    /// At most `left` rows from `first` on, whole chunks of the file where it has such.
    pub(super) fn rows(&self, path: &Path, first: u64, left: u64, wanted: &[usize]) -> Result<Vec<Vec<f64>>> {
        let datasets: Vec<&Dataset> = match self {
            Self::Records(dataset, _) => vec![dataset.as_ref()],
            Self::Columns(datasets) => wanted.iter().map(|&i| &datasets[i]).collect(),
        };
        let chunk = |dataset: &&Dataset| dataset.chunks()?.first().map(|length| u64::from(*length));
        let chunk = datasets.iter().filter_map(chunk).max().unwrap_or(1).max(1);
        let batch = BATCH_ROWS.next_multiple_of(chunk).max(chunk);
        let end = ((first / batch + 1) * batch).min(first + left);
        let slice = SliceInfo { selections: vec![SliceInfoElem::Slice { start: first, end, step: 1 }] };
        match self {
            Self::Columns(_) => datasets.par_iter().map(|dataset| numbers(path, dataset, &slice)).collect(),
            Self::Records(dataset, fields) => {
                let records = dataset.read_slice::<Record>(&slice).map_err(|e| reading::damaged(path, &e))?;
                let records: Vec<&Record> = records.iter().collect();
                wanted.par_iter().map(|&i| field(path, &records, &fields[i])).collect()
            }
        }
    }
}

fn numbers(path: &Path, dataset: &Dataset, slice: &SliceInfo) -> Result<Vec<f64>> {
    if number_bytes(dataset.dtype()).is_none() {
        return Err(no_numbers(path, dataset.name()));
    }
    let values = dataset.read_slice::<Number>(slice).map_err(|error| reading::damaged(path, &error))?;
    Ok(values.iter().map(|number| number.0).collect())
}

fn field(path: &Path, records: &[&Record], field: &CompoundField) -> Result<Vec<f64>> {
    let start = field.byte_offset as usize;
    let size = number_bytes(&field.datatype).ok_or_else(|| no_numbers(path, &field.name))?;
    let value = |record: &&Record| {
        let cell = record.0.get(start..start.saturating_add(size))?;
        number(cell, &field.datatype)
    };
    let values: Option<Vec<f64>> = records.iter().map(value).collect();
    values.ok_or_else(|| {
        Error::table(path, format!("column {}", field.name), "lies outside the records of the dataset")
    })
}

fn no_numbers(path: &Path, column: &str) -> Error {
    Error::table(
        path,
        format!("column {column}"),
        "holds no numbers of up to 8 bytes, one a row; such are wanted",
    )
}
