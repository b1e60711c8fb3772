//! Tables as HDF5: a named group with one dataset a column, each with its unit; records, as astropy and h5py write them, are read too.

use std::collections::HashMap;
use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File};

use super::astropy_meta;
use super::attribute::AttributeValue;
use super::column::{Column, Values};
use super::hdf5_attributes::{check_not_packed, check_states_no_units, stated_units};
use super::hdf5_objects as objects;
use super::hdf5_reading as reading;
use super::provenance::Provenance;
use super::table::Table;
use crate::error::{Error, FileFault, Result};

/// What astropy appends to a table's name for the dataset that describes its columns.
const ASTROPY_META: &str = ".__table_column_meta__";

/// Reads the group of that name, or the dataset of records; where it is missing, the datasets of the root or the only
/// group or records.
pub(super) fn read(path: &Path, wanted: &str) -> Result<Table> {
    let columns = match find_table(path, &reading::open(path)?, wanted)? {
        TableInHdf5::Records(records, beside) => read_records(path, &records, &beside)?,
        TableInHdf5::Columns(datasets) => read_columns(path, &datasets)?,
    };
    for column in &columns {
        let (rows, wanted) = (column.values.len(), columns[0].values.len());
        if rows != wanted {
            let problem = format!("has {rows} rows, but column {} has {wanted}", columns[0].name);
            return Err(Error::table(path, format!("column {}", column.name), problem));
        }
    }
    Table::from_file(path, columns, Vec::new())
}

/// A table as it lies in a file.
pub(super) enum TableInHdf5 {
    /// One dataset a column.
    Columns(Vec<Dataset>),
    /// Records, and what lies beside them.
    Records(Box<Dataset>, Vec<Dataset>),
}

/// The table of that name in a file, or what [`read`] takes for it.
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
        TableInHdf5::Columns(datasets) => datasets.iter().try_for_each(|d| check_plain(path, d))?,
        TableInHdf5::Records(records, _) => check_plain(path, records)?,
    }
    Ok(found)
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

fn read_columns(path: &Path, datasets: &[Dataset]) -> Result<Vec<Column>> {
    let column = |dataset: &Dataset| {
        let (name, unit) = (dataset.name().to_string(), stated_unit(path, dataset)?);
        Ok(Column { unit, values: reading::read_values(path, dataset)?, name })
    };
    datasets.iter().map(column).collect()
}

/// The one unit that a column states, if it does.
pub(super) fn stated_unit(path: &Path, dataset: &Dataset) -> Result<Option<String>> {
    match stated_units(path, dataset)?.as_slice() {
        [] => Ok(None),
        [unit] => Ok(Some(unit.clone())),
        several => {
            let problem = format!("states several units: {}", several.join(", "));
            Err(Error::table(path, format!("column {}", dataset.name()), problem))
        }
    }
}

/// The fields of records as columns.
fn read_records(path: &Path, dataset: &Dataset, beside: &[Dataset]) -> Result<Vec<Column>> {
    let fields = reading::read_fields(path, dataset)?;
    let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
    let units = record_units(path, dataset, &names, beside)?;
    Ok(fields.into_iter().zip(units).map(|((name, values), unit)| Column { name, unit, values }).collect())
}

/// Units of the fields of records, from astropy's description beside them or an attribute with one a field.
pub(super) fn record_units(
    path: &Path,
    dataset: &Dataset,
    names: &[&str],
    beside: &[Dataset],
) -> Result<Vec<Option<String>>> {
    let mut units: HashMap<String, Option<String>> = HashMap::new();
    let meta = format!("{}{ASTROPY_META}", dataset.name());
    let stated = stated_units(path, dataset)?;
    if let Some(meta) = beside.iter().find(|other| other.name() == meta) {
        let Values::Text(lines) = reading::read_values(path, meta)? else {
            return Err(Error::file(FileFault::Damaged, path, format!("{} holds no text", meta.name())));
        };
        let lines: Vec<&str> = lines.iter().flat_map(|line| line.lines()).collect();
        let described = astropy_meta::column_units(&lines);
        units.extend(described.map_err(|problem| {
            Error::file(FileFault::Damaged, path, format!("{} {problem}", meta.name()))
        })?);
    } else if stated.len() == names.len() {
        units.extend(names.iter().zip(stated).map(|(name, unit)| (name.to_string(), Some(unit))));
    } else if !stated.is_empty() {
        let problem = format!("states {} units for {} columns", stated.len(), names.len());
        return Err(Error::table(path, "attribute unit", problem));
    }
    Ok(names.iter().map(|name| units.remove(*name).flatten()).collect())
}

fn check_plain(path: &Path, dataset: &Dataset) -> Result<()> {
    check_one_dimension(path, dataset)?;
    check_not_packed(path, dataset)
}

fn check_one_dimension(path: &Path, dataset: &Dataset) -> Result<()> {
    if dataset.ndim() == 1 {
        return Ok(());
    }
    let problem = format!("has shape {:?}; a column has one dimension", dataset.shape());
    Err(Error::table(path, format!("column {}", dataset.name()), problem))
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
    fn values_packed_by_rules_of_netcdf_and_units_of_a_whole_group_are_refused() {
        for (attribute, value, is_read) in [
            ("scale_factor", 10.0, false),
            ("scale_factor", 1.0, true),
            ("add_offset", 3.0, false),
            ("add_offset", 0.0, true),
            ("_FillValue", -9999.0, false),
            ("_FillValue", f64::NAN, true),
            ("missing_value", -9999.0, false),
        ] {
            let (_folder, path) = foreign(&[("haloes/z", &[0.5])]);
            let file = hdf5::File::open_rw(&path).unwrap();
            let dataset = file.dataset("haloes/z").unwrap();
            dataset.new_attr::<f64>().create(attribute).unwrap().write_scalar(&value).unwrap();
            drop((dataset, file));
            assert_eq!(read(&path, "haloes").is_ok(), is_read, "{attribute} = {value}");
            if !is_read {
                assert!(
                    fault(&path).contains(&format!("column z: has the attribute {attribute} ({value})")),
                    "{}",
                    fault(&path)
                );
            }
        }
        for (group, attribute) in [("haloes", "units"), ("haloes", "angle_unit"), ("", "Units")] {
            let (_folder, path) = foreign(&[(&format!("{group}/z"), &[0.5])]);
            let file = hdf5::File::open_rw(&path).unwrap();
            let holder = file.group(&format!("/{group}")).unwrap();
            holder.new_attr::<i32>().create(attribute).unwrap().write_scalar(&1).unwrap();
            drop((holder, file));
            let named = format!("/{group} has the attribute {attribute}, but must state units");
            assert!(fault(&path).contains(&named), "{}", fault(&path));
        }
    }

    #[test]
    fn powers_of_h_and_a_of_simulations_are_part_of_a_unit_that_is_not_known() {
        for (attribute, exponent, unit) in [
            ("h_scaling", -1.0, Some("? h^-1 (attribute h_scaling)")),
            ("a-scale exponent", 1.0, Some("? a^1 (attribute a-scale exponent)")),
            ("h-scale-exponent", 0.0, None),
        ] {
            let (_folder, path) = foreign(&[("haloes/m200c_msun", &[1e9])]);
            let file = hdf5::File::open_rw(&path).unwrap();
            let dataset = file.dataset("haloes/m200c_msun").unwrap();
            dataset.new_attr::<f64>().shape(1).create(attribute).unwrap().write(&[exponent]).unwrap();
            drop((dataset, file));
            let table = read(&path, "haloes").unwrap();
            assert_eq!(table.columns()[0].unit.as_deref(), unit);
            assert_eq!(table.in_own_units(&["m200c_msun"]).is_ok(), unit.is_none(), "{attribute}");
        }
    }

    #[test]
    fn logical_values_are_no_numbers() {
        let (_folder, path) = foreign(&[("haloes/z", &[0.5, 0.6])]);
        let file = hdf5::File::open_rw(&path).unwrap();
        file.new_dataset_builder().with_data(&[true, false]).create("haloes/c200c").unwrap();
        file.new_dataset_builder().with_data(&[false, true]).create("haloes/z.mask").unwrap();
        drop(file);
        let table = read(&path, "haloes").unwrap();
        for (name, problem) in [("c200c", "\"true\" is not a number"), ("z", "is masked")] {
            assert!(table.required_f64(name).unwrap_err().to_string().contains(problem), "{name}");
        }
    }

    #[test]
    fn a_unit_that_is_a_number_is_refused() {
        let (_folder, path) = foreign(&[("haloes/z", &[0.5])]);
        let dataset = hdf5::File::open_rw(&path).unwrap().dataset("haloes/z").unwrap();
        dataset.new_attr::<f64>().create("unit").unwrap().write_scalar(&1e10).unwrap();
        drop(dataset);
        assert_eq!(fault(&path), "FILE: the attribute unit is no text, but must be");
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
    fn a_group_of_groups_is_no_table() {
        let (_folder, path) = foreign(&[("a/haloes/z", &[0.5])]);
        assert_eq!(fault(&path), "FILE: /a holds groups, no datasets: haloes");
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
        assert_eq!(
            fault(&path),
            "FILE: /haloes is one dataset of single values; a group with one dataset a column, or records, is wanted"
        );
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
