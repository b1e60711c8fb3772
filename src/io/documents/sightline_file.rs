//! The table of an ensemble as netCDF-4 in HDF5, one row a sightline, which xarray opens:
//! `xr.open_dataset("sightlines.h5", group="sightlines")`.

use std::ops::Range;
use std::path::{Path, PathBuf};

use hdf5_reader::{Hdf5File, SliceInfo, SliceInfoElem};

use super::lens_table::{TabledLens, lens_columns};
use crate::error::{Error, FileFault, Result};
use crate::io::containers::{
    AttributeValue, Provenance, RunFileReader, Values, hdf5_objects as objects, hdf5_reading as reading,
    netcdf_objects as netcdf,
};

/// Group of what is seen through all haloes.
pub const SIGHTLINES_GROUP: &str = "sightlines";
/// Group of what is seen through the haloes in the tidal regime alone, with the same names.
pub const TIDAL_GROUP: &str = "tidal_haloes";
/// The one dimension of all columns.
const SIGHTLINE: &str = "sightline";
const FAILURES: &str = "failures";
const LENSES: &str = "lenses";

/// One quantity of every sightline; not a number where a sightline does not have it.
#[derive(Debug, Clone, PartialEq)]
pub struct SightlineColumn {
    /// Name, as in `summary.json` of a run.
    pub name: String,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// What it is, in words.
    pub description: String,
    /// A value a row.
    pub values: Vec<f64>,
}

/// Everything in the table of an ensemble but its maps and images.
#[derive(Debug, Clone, PartialEq)]
pub struct SightlineTable {
    /// Version, seed and configuration.
    pub provenance: Provenance,
    /// How much was computed.
    pub level: String,
    /// The model of the fits; empty without.
    pub model: String,
    /// What is in the files that the configuration names, as hashes; empty where it names none.
    pub inputs: String,
    /// The numbers of all sightlines of the ensemble, of which this table may hold a part.
    pub whole: Range<u64>,
    /// Lenses, if there is a table of them.
    pub lenses: Vec<TabledLens>,
    /// The number of each row, ascending.
    pub numbers: Vec<u64>,
    /// Seen through all haloes.
    pub all_haloes: Vec<SightlineColumn>,
    /// Seen through the haloes in the tidal regime; none where no images were made.
    pub tidal_haloes: Vec<SightlineColumn>,
    /// Sightlines that failed, and why.
    pub failures: Vec<(u64, String)>,
}

/// A map or an image of every sightline.
#[derive(Debug, Clone, PartialEq)]
pub struct StackSpec {
    /// Group of its file.
    pub group: &'static str,
    /// Name in the group.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// What it is, in words.
    pub description: String,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Distance of nodes or pixels.
    pub step_arcsec: f64,
}

/// Where the maps and images come from, row by row: not all fit into memory.
pub trait StackRows {
    /// Map or image `stack` of that sightline, row-major; not numbers where it failed.
    ///
    /// # Errors
    /// When it cannot be read.
    fn pixels(&self, stack: usize, number: u64) -> Result<Vec<f32>>;
}

impl SightlineTable {
    /// The column of that name seen through all haloes.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.all_haloes.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// Writes the table and its stacks; the same bytes for the same content.
    ///
    /// # Errors
    /// [`Error::Write`], and those of `rows`.
    pub fn write(&self, path: &Path, stacks: &[StackSpec], rows: &dyn StackRows) -> Result<()> {
        let file = objects::create(path)?;
        objects::write_provenance(path, &file, &self.provenance)?;
        let whole = [("first", self.whole.start), ("number", self.whole.end - self.whole.start)];
        for (name, text) in [("level", &self.level), ("model", &self.model), ("inputs", &self.inputs)] {
            objects::write_attribute(path, &file, name, &text.as_str().into())?;
        }
        for (name, value) in whole {
            objects::write_attribute(path, &file, name, &AttributeValue::U64(value))?;
        }
        let text16 = netcdf::text16(path)?;
        let coordinates: Vec<i64> = self.numbers.iter().map(|&number| number as i64).collect();
        let group_of = |name: &str| {
            let group = objects::group_or_new(path, &file, name)?;
            netcdf::write_coordinates(path, &group, &text16, SIGHTLINE, &coordinates, 0)?;
            Ok::<_, Error>(group)
        };
        for (name, columns) in
            [(SIGHTLINES_GROUP, &self.all_haloes), (TIDAL_GROUP, &self.tidal_haloes)].into_iter()
        {
            if columns.is_empty() {
                continue;
            }
            let group = group_of(name)?;
            for column in columns {
                let dimensions = [(SIGHTLINE, self.numbers.len())];
                let dataset =
                    netcdf::write_variable(path, &group, &column.name, &column.values, &dimensions)?;
                for (attribute, text) in [("units", &column.unit), ("long_name", &column.description)] {
                    objects::write_attribute(path, &dataset, attribute, &text.as_str().into())?;
                }
            }
        }
        let mut begun: Vec<&str> = Vec::new();
        for (number, stack) in stacks.iter().enumerate() {
            let group = if begun.contains(&stack.group) {
                objects::group_or_new(path, &file, stack.group)?
            } else {
                begun.push(stack.group);
                let group = group_of(stack.group)?;
                for (dimension, length, id) in [("y", stack.shape[0], 1), ("x", stack.shape[1], 2)] {
                    let places: Vec<f64> = places_arcsec(length, stack.step_arcsec);
                    netcdf::write_coordinates(path, &group, &text16, dimension, &places, id)?;
                }
                group
            };
            let [ny, nx] = stack.shape;
            let dimensions = [(SIGHTLINE, self.numbers.len()), ("y", ny), ("x", nx)];
            let dataset = netcdf::create_stack(path, &group, &stack.name, &dimensions)?;
            let unit = stack.unit;
            for (attribute, text) in [("units", unit), ("long_name", stack.description.as_str())] {
                objects::write_attribute(path, &dataset, attribute, &text.into())?;
            }
            for (row, &sightline) in self.numbers.iter().enumerate() {
                netcdf::write_layer(path, &dataset, row, &rows.pixels(number, sightline)?, stack.shape)?;
            }
        }
        if !self.failures.is_empty() {
            let group = objects::group_or_new(path, &file, FAILURES)?;
            let numbers: Vec<f64> = self.failures.iter().map(|(number, _)| *number as f64).collect();
            let reasons: Vec<String> = self.failures.iter().map(|(_, reason)| reason.clone()).collect();
            objects::write_f64(path, &group, SIGHTLINE, &numbers, &[numbers.len()])?;
            objects::write_text(path, &group, "reason", &reasons)?;
        }
        if !self.lenses.is_empty() {
            let group = objects::group_or_new(path, &file, LENSES)?;
            for column in lens_columns(&self.lenses) {
                match &column.values {
                    Values::F64(values) => {
                        objects::write_f64(path, &group, &column.name, values, &[values.len()])?
                    }
                    Values::Text(values) => objects::write_text(path, &group, &column.name, values)?,
                };
            }
        }
        objects::close(path, file)
    }

    /// Reads a table.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`] for what is no table of an ensemble.
    pub fn read(path: &Path) -> Result<Self> {
        let file = RunFileReader::open(path)?;
        let text = |name: &str| match file.read_attribute("/", name)? {
            AttributeValue::Text(text) => Ok(text),
            other => Err(not_of_an_ensemble(path, &format!("its attribute {name} is {other:?}"))),
        };
        let count = |name: &str| match file.read_attribute("/", name)? {
            AttributeValue::U64(value) => Ok(value),
            other => Err(not_of_an_ensemble(path, &format!("its attribute {name} is {other:?}"))),
        };
        let groups = file.names("")?;
        let has = |name: &str| groups.iter().any(|group| group == name);
        let whole = |value: f64| value as u64;
        let columns = |group: &str| -> Result<Vec<SightlineColumn>> {
            let names = if has(group) { file.names(group)? } else { Vec::new() };
            let of = |name: &String| -> Result<SightlineColumn> {
                let told = |what: &str| match file.read_attribute(&format!("{group}/{name}"), what)? {
                    AttributeValue::Text(text) => Ok::<_, Error>(text),
                    _ => Ok(String::new()),
                };
                let values = file.read_1d(group, name)?;
                let (unit, description) = (told("units")?, told("long_name")?);
                Ok(SightlineColumn { name: name.clone(), unit, description, values })
            };
            names.iter().filter(|name| *name != SIGHTLINE).map(of).collect()
        };
        let failures = if has(FAILURES) {
            let numbers = file.read_1d(FAILURES, SIGHTLINE)?;
            numbers.into_iter().map(whole).zip(file.read_text(FAILURES, "reason")?).collect()
        } else {
            Vec::new()
        };
        let lenses = if has(LENSES) { lenses_of(&file)? } else { Vec::new() };
        let first = count("first")?;
        Ok(Self {
            provenance: file.provenance()?,
            level: text("level")?,
            model: text("model")?,
            inputs: text("inputs").unwrap_or_default(),
            whole: first..first.saturating_add(count("number")?),
            lenses,
            numbers: file.read_1d(SIGHTLINES_GROUP, SIGHTLINE)?.into_iter().map(whole).collect(),
            all_haloes: columns(SIGHTLINES_GROUP)?,
            tidal_haloes: columns(TIDAL_GROUP)?,
            failures,
        })
    }
}

/// Places of nodes or middles of pixels about the axis.
fn places_arcsec(length: usize, step_arcsec: f64) -> Vec<f64> {
    (0..length).map(|i| (i as f64 - 0.5 * (length as f64 - 1.0)) * step_arcsec).collect()
}

fn not_of_an_ensemble(path: &Path, problem: &str) -> Error {
    Error::file(FileFault::Content, path, format!("is no table of an ensemble: {problem}"))
}

fn lenses_of(file: &RunFileReader) -> Result<Vec<TabledLens>> {
    let number = |name: &str| file.read_1d(LENSES, name);
    let (z_lens, z_source) = (number("z_lens")?, number("z_source")?);
    let radius = number("einstein_radius_arcsec")?;
    let names = file.read_text(LENSES, "name")?;
    let rows = names.into_iter().zip(z_lens).zip(z_source).zip(radius);
    Ok(rows
        .map(|(((name, z_lens), z_source), radius)| TabledLens {
            name,
            z_lens,
            z_source,
            einstein_radius_arcsec: Some(radius).filter(|radius| radius.is_finite()),
        })
        .collect())
}

/// The maps and images of a saved table, read layer by layer.
pub struct SavedStacks {
    path: PathBuf,
    file: Hdf5File,
    specs: Vec<StackSpec>,
    numbers: Vec<u64>,
}

impl SavedStacks {
    /// Opens those of the table at `path`, which has rows of these numbers.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`].
    pub fn open(path: &Path, specs: Vec<StackSpec>, numbers: Vec<u64>) -> Result<Self> {
        Ok(Self { path: path.into(), file: reading::open(path)?, specs, numbers })
    }
}

impl StackRows for SavedStacks {
    fn pixels(&self, stack: usize, number: u64) -> Result<Vec<f32>> {
        let spec = &self.specs[stack];
        let problem = |text: String| Error::file(FileFault::Content, &self.path, text);
        let row = self.numbers.binary_search(&number);
        let row = row.map_err(|_| problem(format!("has no sightline {number}")))? as u64;
        let name = format!("/{}/{}", spec.group, spec.name);
        let dataset = self.file.dataset(&name).map_err(|_| problem(format!("has no {name}")))?;
        let all = |length: usize| SliceInfoElem::Slice { start: 0, end: length as u64, step: 1 };
        let selections = vec![SliceInfoElem::Index(row), all(spec.shape[0]), all(spec.shape[1])];
        let read = dataset.read_slice::<f32>(&SliceInfo { selections });
        Ok(read.map_err(|error| reading::damaged(&self.path, &error))?.iter().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rows;

    impl StackRows for Rows {
        fn pixels(&self, stack: usize, number: u64) -> Result<Vec<f32>> {
            Ok((0..6).map(|i| (100 * stack + i) as f32 + number as f32).collect())
        }
    }

    fn table() -> SightlineTable {
        let column = |name: &str, values: [f64; 3]| SightlineColumn {
            name: name.into(),
            unit: "arcsec^-1".into(),
            description: "γ of a kind".into(),
            values: values.into(),
        };
        SightlineTable {
            provenance: Provenance::new(Some(4), "seed = 4\n"),
            level: "images".into(),
            model: String::new(),
            inputs: "17:0123456789abcdef".into(),
            whole: 3..20,
            lenses: vec![TabledLens {
                name: "b".into(),
                z_lens: 0.5,
                z_source: 1.5,
                einstein_radius_arcsec: None,
            }],
            numbers: vec![5, 6, 9],
            all_haloes: vec![
                column("gamma1_los", [0.1, f64::MIN_POSITIVE, 3.0]),
                column("a", [1.0, 2.0, 4.0]),
            ],
            tidal_haloes: vec![column("gamma1_los", [-0.1, 0.0, 1.0])],
            failures: vec![(6, "singular".into())],
        }
    }

    fn stacks() -> Vec<StackSpec> {
        let stack = |name: &str| StackSpec {
            group: "maps",
            name: name.into(),
            unit: "",
            description: "a map".into(),
            shape: [2, 3],
            step_arcsec: 0.5,
        };
        vec![stack("kappa"), stack("delta")]
    }

    #[test]
    fn a_table_and_its_stacks_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sightlines.h5");
        table().write(&path, &stacks(), &Rows).unwrap();
        assert_eq!(SightlineTable::read(&path).unwrap(), table());
        let saved = SavedStacks::open(&path, stacks(), table().numbers).unwrap();
        for stack in 0..2 {
            for number in [5, 6, 9] {
                assert_eq!(saved.pixels(stack, number).unwrap(), Rows.pixels(stack, number).unwrap());
            }
        }
        assert!(saved.pixels(0, 7).unwrap_err().to_string().contains("no sightline 7"));
        // The same through the C library.
        let file = hdf5::File::open(&path).unwrap();
        let map = file.dataset("maps/delta").unwrap();
        assert_eq!((map.shape(), map.read_raw::<f32>().unwrap()[6]), (vec![3, 2, 3], 106.0));
        assert_eq!(file.dataset("maps/x").unwrap().read_raw::<f64>().unwrap(), [-0.5, 0.0, 0.5]);
        assert_eq!(file.dataset("sightlines/sightline").unwrap().read_raw::<i64>().unwrap(), [5, 6, 9]);
    }

    #[test]
    fn the_same_table_gives_the_same_bytes_and_another_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.h5", "b.h5"].map(|name| folder.path().join(name));
        for path in [&a, &b] {
            table().write(path, &stacks(), &Rows).unwrap();
        }
        assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
        let other = folder.path().join("other.h5");
        crate::io::RunFile::create(&other, &Provenance::new(None, "")).unwrap().close().unwrap();
        assert!(SightlineTable::read(&other).unwrap_err().is_bad_input());
    }
}
