//! Tables as HDF5: a named group with one dataset a column, each with its unit; records, as astropy and h5py write them, are read too.

use std::collections::HashMap;
use std::path::Path;

use hdf5_reader::Dataset;

use super::astropy_meta;
use super::attribute::AttributeValue;
use super::column::{Column, Values};
use super::hdf5_attributes::{check_not_packed, stated_units, units_of_fields};
use super::hdf5_objects as objects;
use super::hdf5_place::{TableInHdf5, check_no_data_frame, find_table, problem_of_shape};
use super::hdf5_reading as reading;
use super::provenance::Provenance;
use super::table::Table;
use crate::error::{Error, FileFault, Result};

/// What astropy appends to a table's name for the dataset that describes its columns.
const ASTROPY_META: &str = ".__table_column_meta__";

/// Reads the group of that name, or the dataset of records; where it is missing, the datasets of the root or the only
/// group or records.
pub(super) fn read(path: &Path, wanted: &str) -> Result<Table> {
    let mut left_out = Vec::new();
    let columns = match find_table(path, &reading::open(path)?, wanted)? {
        TableInHdf5::Records(records, beside) => read_records(path, &records, &beside, &mut left_out)?,
        TableInHdf5::Columns(datasets) => read_columns(path, &datasets, &mut left_out)?,
    };
    for column in &columns {
        let (rows, wanted) = (column.values.len(), columns[0].values.len());
        if rows != wanted {
            let problem = format!("has {rows} rows, but column {} has {wanted}", columns[0].name);
            return Err(Error::table(path, format!("column {}", column.name), problem));
        }
    }
    Table::from_file_without(path, columns, left_out)
}

/// The datasets that can be columns; of the others their names and why not.
fn read_columns(
    path: &Path,
    datasets: &[Dataset],
    left_out: &mut Vec<(String, String)>,
) -> Result<Vec<Column>> {
    let mut columns = Vec::with_capacity(datasets.len());
    for dataset in datasets {
        let name = dataset.name().to_string();
        match problem_of_shape(dataset).or_else(|| reading::problem_of(dataset.dtype())) {
            Some(problem) => left_out.push((name, problem)),
            None => {
                check_not_packed(path, dataset)?;
                let unit = stated_unit(path, dataset)?;
                columns.push(Column { unit, values: reading::read_values(path, dataset)?, name });
            }
        }
    }
    Ok(columns)
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

/// The fields of records that can be columns; of the others their names and why not.
fn read_records(
    path: &Path,
    dataset: &Dataset,
    beside: &[Dataset],
    left_out: &mut Vec<(String, String)>,
) -> Result<Vec<Column>> {
    let fields = reading::read_fields(path, dataset)?;
    let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
    check_no_data_frame(path, names.iter().copied())?;
    let units = record_units(path, dataset, &names, beside)?;
    let mut columns = Vec::with_capacity(fields.len());
    for ((name, values), unit) in fields.into_iter().zip(units) {
        match values {
            Ok(values) => columns.push(Column { name, unit, values }),
            Err(problem) => left_out.push((name, problem)),
        }
    }
    Ok(columns)
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
    for (name, unit) in units_of_fields(path, dataset, names)? {
        let earlier = units.insert(name.clone(), Some(unit.clone())).flatten();
        if let Some(other) = earlier.filter(|earlier| *earlier != unit) {
            return Err(Error::table(
                path,
                format!("column {name}"),
                format!("states several units: {other}, {unit}"),
            ));
        }
    }
    Ok(names.iter().map(|name| units.remove(*name).flatten()).collect())
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
    fn records_may_state_the_unit_of_each_field_apart() {
        #[derive(hdf5::H5Type, Clone)]
        #[repr(C)]
        struct Halo {
            z: f64,
            theta_x_arcsec: f64,
        }
        let text = |text: &str| text.parse::<hdf5::types::VarLenUnicode>().unwrap();
        for (attribute, unit) in [("theta_x_arcsec_unit", Some("deg")), ("mass_units", None)] {
            let (_folder, path) = foreign(&[]);
            let file = hdf5::File::open_rw(&path).unwrap();
            let records = [Halo { z: 0.5, theta_x_arcsec: 1.0 }];
            let dataset = file.new_dataset_builder().with_data(&records).create("haloes").unwrap();
            let created = dataset.new_attr::<hdf5::types::VarLenUnicode>().create(attribute).unwrap();
            created.write_scalar(&text("deg")).unwrap();
            drop((created, dataset, file));
            match unit {
                Some(unit) => {
                    assert_eq!(read(&path, "haloes").unwrap().columns()[1].unit.as_deref(), Some(unit))
                }
                None => {
                    assert!(fault(&path).contains("haloes has the attribute mass_units"), "{}", fault(&path))
                }
            }
        }
    }

    #[test]
    fn datasets_that_are_no_column_are_missed_only_where_they_are_wanted() {
        let (_folder, path) = foreign(&[("haloes/z", &[0.5, 0.6])]);
        let file = hdf5::File::open_rw(&path).unwrap();
        file.new_dataset::<f64>().shape((2, 2)).create("haloes/position").unwrap();
        file.new_dataset::<f64>().create("haloes/c200c").unwrap().write_scalar(&8.0).unwrap();
        drop(file);
        let table = read(&path, "haloes").unwrap();
        assert_eq!(table.column_names(), "z");
        assert!(table.has_column("position") && table.optional_f64("m200c_msun").unwrap().is_none());
        for (name, shape) in [("position", "[2, 2]"), ("c200c", "[]")] {
            let error = table.required_f64(name).unwrap_err().to_string();
            assert!(
                error.contains(&format!("column {name}: has shape {shape}; a column has one")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_data_frame_in_the_layout_of_pandas_is_named() {
        let (_folder, path) = foreign(&[("haloes/axis0", &[0.5]), ("haloes/block0_values", &[1.0, 2.0])]);
        assert!(fault(&path).contains("holds a data frame in the layout of pandas"), "{}", fault(&path));
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
        for name in ["unit", "TUNIT"] {
            let (_folder, path) = foreign(&[("haloes/z", &[0.5])]);
            let dataset = hdf5::File::open_rw(&path).unwrap().dataset("haloes/z").unwrap();
            dataset.new_attr::<f64>().create(name).unwrap().write_scalar(&1e10).unwrap();
            drop(dataset);
            assert_eq!(fault(&path), format!("FILE: the attribute {name} is no text, but must be"));
        }
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
