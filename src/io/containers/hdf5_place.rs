//! Which group or dataset of an HDF5 file is the table.

use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File};

use super::hdf5_attributes::{check_not_packed, check_states_no_units};
use super::hdf5_reading as reading;
use crate::error::{Error, FileFault, Result};

/// A table as it lies in a file.
pub(super) enum TableInHdf5 {
    /// One dataset a column; a dataset of another shape is none.
    Columns(Vec<Dataset>),
    /// Records, and what lies beside them.
    Records(Box<Dataset>, Vec<Dataset>),
}

/// The table of that name in a file, or what stands for it: where it is missing, the datasets of the root or the only
/// group or records.
pub(super) fn find_table(path: &Path, file: &Hdf5File, wanted: &str) -> Result<TableInHdf5> {
    let root = file.root_group().map_err(|error| reading::damaged(path, &error))?;
    let (groups, datasets) = reading::members(path, &root)?;
    let found = match choose(path, wanted, &groups, &datasets)? {
        Place::Records(records) => TableInHdf5::Records(Box::new(records.clone()), datasets),
        Place::Root => {
            check_states_no_units(path, &root)?;
            TableInHdf5::Columns(datasets)
        }
        Place::Group(group) => {
            check_states_no_units(path, group)?;
            let (groups, members) = reading::members(path, group)?;
            match members.as_slice() {
                [] if !groups.is_empty() => {
                    let names: Vec<&str> = groups.iter().map(Group::name).collect();
                    let problem =
                        format!("/{} holds groups, no datasets: {}", group.name(), names.join(", "));
                    return Err(Error::file(FileFault::Content, path, problem));
                }
                // PyTables keeps a table so.
                [only] if is_records(only) => TableInHdf5::Records(Box::new(only.clone()), members),
                _ => TableInHdf5::Columns(members),
            }
        }
    };
    match &found {
        TableInHdf5::Columns(datasets) => check_no_data_frame(path, datasets.iter().map(Dataset::name))?,
        TableInHdf5::Records(records, _) => {
            if let Some(problem) = problem_of_shape(records) {
                return Err(Error::table(path, format!("column {}", records.name()), problem));
            }
            check_not_packed(path, records)?;
        }
    }
    Ok(found)
}

/// Refuses what pandas makes of a data frame: its columns lie as rows of common arrays.
pub(super) fn check_no_data_frame<'a>(path: &Path, mut names: impl Iterator<Item = &'a str>) -> Result<()> {
    if names.any(|name| name == "block0_values" || name.starts_with("values_block_")) {
        let problem = "holds a data frame in the layout of pandas; write it with to_csv, or as records: \
                       file.create_dataset(\"haloes\", data=frame.to_records(index=False)) of h5py";
        return Err(Error::file(FileFault::Content, path, problem));
    }
    Ok(())
}

/// Why a dataset is no column, if its shape is none of a column.
pub(super) fn problem_of_shape(dataset: &Dataset) -> Option<String> {
    (dataset.ndim() != 1).then(|| format!("has shape {:?}; a column has one dimension", dataset.shape()))
}

/// Where in a file the table is.
enum Place<'a> {
    Group(&'a Group),
    Records(&'a Dataset),
    Root,
}

fn choose<'a>(path: &Path, wanted: &str, groups: &'a [Group], datasets: &'a [Dataset]) -> Result<Place<'a>> {
    if let Some(group) = groups.iter().find(|group| group.name() == wanted) {
        return Ok(Place::Group(group));
    }
    let records: Vec<&Dataset> = datasets.iter().filter(|dataset| is_records(dataset)).collect();
    let fault = |problem: String| Err(Error::file(FileFault::Content, path, problem));
    match datasets.iter().find(|dataset| dataset.name() == wanted) {
        Some(dataset) if is_records(dataset) => return Ok(Place::Records(dataset)),
        Some(_) => {
            return fault(format!(
                "/{wanted} is one dataset of single values; a group with one dataset a column, or records, is wanted"
            ));
        }
        None => {}
    }
    match (records.as_slice(), groups, datasets) {
        ([only], ..) => Ok(Place::Records(only)),
        ([], _, [_, ..]) => Ok(Place::Root),
        ([], [only], []) => Ok(Place::Group(only)),
        ([], [], []) => fault(format!("holds no group /{wanted} and no datasets")),
        ([], several, []) => {
            let list: Vec<String> = several.iter().map(|group| format!("/{}", group.name())).collect();
            fault(format!("holds no group /{wanted}; the groups are {}", list.join(", ")))
        }
        (several, ..) => {
            let list: Vec<String> = several.iter().map(|dataset| format!("/{}", dataset.name())).collect();
            fault(format!("holds no table /{wanted}; the tables are {}", list.join(", ")))
        }
    }
}

fn is_records(dataset: &Dataset) -> bool {
    matches!(dataset.dtype(), Datatype::Compound { .. })
}
