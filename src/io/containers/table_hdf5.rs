//! Tables as HDF5: a named group with one dataset a column, each with its unit.

use std::path::Path;

use hdf5::{Dataset, Group};

use super::attribute::AttributeValue;
use super::hdf5_objects as objects;
use super::provenance::Provenance;
use super::table::{Column, Table, Values};
use crate::error::{Error, FileFault, Result};

/// Reads the group of that name; where it is missing, the datasets of the root or the only group.
pub(super) fn read(path: &Path, group_name: &str) -> Result<Table> {
    let file = objects::open(path)?;
    let group = choose_group(path, &file, group_name)?;
    let mut columns: Vec<Column> = Vec::new();
    for name in objects::member_names(path, &group)? {
        let Ok(dataset) = group.dataset(&name) else { continue };
        columns.push(read_column(path, name, &dataset)?);
    }
    for column in &columns {
        let (rows, wanted) = (column.values.len(), columns[0].values.len());
        if rows != wanted {
            let problem = format!("has {rows} rows, but column {} has {wanted}", columns[0].name);
            return Err(Error::table(path, format!("column {}", column.name), problem));
        }
    }
    Table::from_file(path, columns, Vec::new())
}

fn choose_group(path: &Path, file: &hdf5::File, wanted: &str) -> Result<Group> {
    let damaged = |error: hdf5::Error| objects::damaged(path, &error);
    let root = file.group("/").map_err(damaged)?;
    let names = objects::member_names(path, &root)?;
    if let Ok(group) = root.group(wanted) {
        return Ok(group);
    }
    if root.dataset(wanted).is_ok() {
        let problem = format!("/{wanted} is one dataset; a group with one dataset a column is wanted");
        return Err(Error::file(FileFault::Content, path, problem));
    }
    let groups: Vec<&String> = names.iter().filter(|name| root.group(name).is_ok()).collect();
    let has_datasets = names.iter().any(|name| root.dataset(name).is_ok());
    match (has_datasets, groups.as_slice()) {
        (true, _) => Ok(root),
        (false, [only]) => root.group(only).map_err(damaged),
        (false, []) => {
            Err(Error::file(FileFault::Content, path, format!("holds no group /{wanted} and no datasets")))
        }
        (false, several) => {
            let list: Vec<String> = several.iter().map(|name| format!("/{name}")).collect();
            Err(Error::file(
                FileFault::Content,
                path,
                format!("holds no group /{wanted}; the groups are {}", list.join(", ")),
            ))
        }
    }
}

fn read_column(path: &Path, name: String, dataset: &Dataset) -> Result<Column> {
    if dataset.ndim() != 1 {
        let problem = format!("has shape {:?}; a column has one dimension", dataset.shape());
        return Err(Error::table(path, format!("column {name}"), problem));
    }
    let unit = match objects::read_attribute(path, dataset, "unit")? {
        Some(AttributeValue::Text(unit)) if !unit.is_empty() => Some(unit),
        _ => None,
    };
    let values = objects::read_values(path, dataset)?;
    Ok(Column { name, unit, values })
}

/// Writes the table into a new file at `path`.
pub(super) fn write(table: &Table, path: &Path, group_name: &str, provenance: &Provenance) -> Result<()> {
    let file = objects::create(path)?;
    objects::write_provenance(path, &file, provenance)?;
    let group = objects::group_or_new(path, &file, group_name)?;
    for column in table.columns() {
        let dataset = match &column.values {
            Values::F64(values) => objects::write_f64(path, &group, &column.name, values, &[values.len()])?,
            Values::Text(values) => objects::write_text(path, &group, &column.name, values)?,
        };
        if let Some(unit) = &column.unit {
            objects::write_attribute(path, &dataset, "unit", &AttributeValue::Text(unit.clone()))?;
        }
    }
    drop(group);
    objects::close(path, file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn sample() -> Table {
        Table::new(vec![
            Column::f64("z", None, vec![0.5, 0.1 + 0.2]),
            Column::f64("theta_x_arcsec", Some("arcsec"), vec![-1e-300, 3e5]),
            Column::text("a_label", vec!["halo γ".into(), String::new()]),
        ])
        .unwrap()
    }

    fn provenance() -> Provenance {
        Provenance::new(Some(u64::MAX), "key = 1\n")
    }

    /// A file with the given datasets, written without haloray's own writer.
    fn foreign(datasets: &[(&str, &[f64])]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("foreign.h5");
        let file = hdf5::File::create(&path).unwrap();
        for (name, values) in datasets {
            if let Some((group, _)) = name.rsplit_once('/') {
                let _ = file.create_group(group);
            }
            file.new_dataset_builder().with_data(*values).create(*name).unwrap();
        }
        (folder, path)
    }

    fn fault(path: &Path) -> String {
        let error = read(path, "haloes").unwrap_err();
        assert!(error.is_bad_input(), "{error:?}");
        error.to_string().replace(path.to_str().unwrap(), "FILE")
    }

    #[test]
    fn a_table_survives_with_order_units_and_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        write(&sample(), &path, "haloes", &provenance()).unwrap();
        assert_eq!(read(&path, "haloes").unwrap().columns(), sample().columns());
        assert_eq!(read(&path, "points").unwrap().columns(), sample().columns(), "the only group is taken");
    }

    #[test]
    fn the_same_table_gives_the_same_bytes_later() {
        let folder = tempfile::tempdir().unwrap();
        let paths = [folder.path().join("a.h5"), folder.path().join("b.h5")];
        write(&sample(), &paths[0], "haloes", &provenance()).unwrap();
        std::thread::sleep(Duration::from_millis(1100)); // HDF5 times count whole seconds
        write(&sample(), &paths[1], "haloes", &provenance()).unwrap();
        assert!(std::fs::read(&paths[0]).unwrap() == std::fs::read(&paths[1]).unwrap());
    }

    #[test]
    fn a_name_that_hdf5_would_take_for_a_path_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let table = Table::new(vec![Column::f64("flux/noise", None, vec![1.0])]).unwrap();
        let error = write(&table, &folder.path().join("t.h5"), "haloes", &provenance()).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains("column flux/noise"), "{error}");
    }

    #[test]
    fn root_datasets_serve_where_the_group_is_missing() {
        let (_folder, path) = foreign(&[("z", &[0.5]), ("x", &[1.0])]);
        assert_eq!(read(&path, "haloes").unwrap().required_f64("x").unwrap(), [1.0]);
    }

    #[test]
    fn several_groups_without_the_wanted_one_are_listed() {
        let (_folder, path) = foreign(&[("maps/z", &[0.5]), ("rays/z", &[1.0])]);
        assert_eq!(fault(&path), "FILE: holds no group /haloes; the groups are /maps, /rays");
    }

    #[test]
    fn columns_of_unequal_length_and_empty_tables_are_refused() {
        let (_folder, path) = foreign(&[("haloes/z", &[0.5, 0.6]), ("haloes/x", &[1.0])]);
        assert_eq!(fault(&path), "FILE: column z: has 2 rows, but column x has 1");
        let (_folder, path) = foreign(&[("haloes/z", &[])]);
        assert_eq!(fault(&path), "FILE: table: has no rows");
        let (_folder, path) = foreign(&[]);
        assert_eq!(fault(&path), "FILE: holds no group /haloes and no datasets");
        let (_folder, path) = foreign(&[("haloes", &[1.0])]);
        assert_eq!(fault(&path), "FILE: /haloes is one dataset; a group with one dataset a column is wanted");
    }

    #[test]
    fn files_that_are_no_hdf5_say_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        write(&sample(), &path, "haloes", &provenance()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for (content, expected) in [
            (&bytes[..bytes.len() / 2], "FILE: is truncated: the end of the HDF5 file is missing"),
            (b"z,x\n1,2\n", "FILE: is not an HDF5 file"),
            (b"", "FILE: is empty, not an HDF5 file"),
        ] {
            std::fs::write(&path, content).unwrap();
            assert_eq!(fault(&path), expected);
        }
        assert!(matches!(read(folder.path(), "haloes").unwrap_err(), Error::Read { .. }));
        assert!(matches!(read(&folder.path().join("no.h5"), "haloes").unwrap_err(), Error::Read { .. }));
    }
}
