//! The one HDF5 file of a run as it is read back.

use std::path::{Path, PathBuf};

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Hdf5File};

use super::attribute::AttributeValue;
use super::column::Values;
use super::hdf5_reading as reading;
use super::provenance::Provenance;
use super::run_file::rooted;
use crate::error::{Error, FileFault, Result};

/// An HDF5 file of results, open for reading.
pub struct RunFileReader {
    path: PathBuf,
    file: Hdf5File,
}

impl RunFileReader {
    /// Opens a file for reading.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`], as from every method here.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.into(), file: reading::open(path)? })
    }

    /// Names of the groups and of the datasets in a group, each in the order of creation.
    pub fn names(&self, group: &str) -> Result<Vec<String>> {
        let group = self.file.group(&rooted(group)).map_err(|_| self.missing("group", group))?;
        self.names_in(&group)
    }

    fn names_in(&self, group: &Group) -> Result<Vec<String>> {
        let names = group.member_names().map_err(|error| reading::damaged(&self.path, &error))?;
        Ok([names.0, names.1].concat())
    }

    /// Reads a list of numbers.
    pub fn read_1d(&self, group: &str, name: &str) -> Result<Vec<f64>> {
        let dataset = self.dataset(group, name)?;
        self.dimensions::<1>(&dataset)?;
        self.numbers(&dataset)
    }

    /// Reads a map, row-major, with its shape (ny, nx).
    pub fn read_2d(&self, group: &str, name: &str) -> Result<(Vec<f64>, (usize, usize))> {
        let dataset = self.dataset(group, name)?;
        let [ny, nx] = self.dimensions(&dataset)?;
        Ok((self.numbers(&dataset)?, (ny, nx)))
    }

    /// Reads a list of texts.
    pub fn read_text(&self, group: &str, name: &str) -> Result<Vec<String>> {
        let dataset = self.dataset(group, name)?;
        match reading::read_values(&self.path, &dataset)? {
            Values::Text(text) => Ok(text),
            Values::F64(_) => Err(Error::file(
                FileFault::Content,
                &self.path,
                format!("{} holds numbers, not text", dataset.name()),
            )),
        }
    }

    /// Reads the value attached to the group or dataset at `object` (`"/"` for the file itself) under that name.
    pub fn read_attribute(&self, object: &str, name: &str) -> Result<AttributeValue> {
        let found = self.attributes(object)?.into_iter().find(|attribute| attribute.name == name);
        let attribute = found.ok_or_else(|| {
            Error::file(FileFault::Content, &self.path, format!("{object} has no attribute {name}"))
        })?;
        reading::attribute_value(&self.path, &attribute)
    }

    /// Names and values of all that is attached to the group or dataset at `object`, in the order of the names.
    pub fn read_attributes(&self, object: &str) -> Result<Vec<(String, AttributeValue)>> {
        let mut attributes = self.attributes(object)?;
        attributes.sort_by(|a, b| a.name.cmp(&b.name));
        let value = |own: &Attribute| Ok((own.name.clone(), reading::attribute_value(&self.path, own)?));
        attributes.iter().map(value).collect()
    }

    fn attributes(&self, object: &str) -> Result<Vec<Attribute>> {
        let full = rooted(object);
        match self.file.group(&full) {
            Ok(group) => group.attributes().map_err(|error| reading::damaged(&self.path, &error)),
            Err(_) => self
                .file
                .dataset(&full)
                .map(|dataset| dataset.attributes())
                .map_err(|_| Error::file(FileFault::Content, &self.path, format!("holds no {object}"))),
        }
    }

    /// The provenance stored when the file was created.
    pub fn provenance(&self) -> Result<Provenance> {
        let text = |name: &str| match self.read_attribute("/", name)? {
            AttributeValue::Text(text) => Ok(text),
            other => Err(Error::file(
                FileFault::Content,
                &self.path,
                format!("attribute {name} is {other:?}, but must be text"),
            )),
        };
        let has_seed = self.attributes("/")?.iter().any(|attribute| attribute.name == "seed");
        let seed = match has_seed.then(|| self.read_attribute("/", "seed")).transpose()? {
            Some(AttributeValue::U64(seed)) => Some(seed),
            _ => None,
        };
        Ok(Provenance {
            version: text("haloray_version")?,
            git_revision: text("git_revision")?,
            seed,
            config_toml: text("config_toml")?,
        })
    }

    fn dataset(&self, group: &str, name: &str) -> Result<Dataset> {
        let full = format!("{}/{name}", rooted(group).trim_end_matches('/'));
        self.file.dataset(&full).map_err(|_| self.missing("dataset", &full))
    }

    fn dimensions<const N: usize>(&self, dataset: &Dataset) -> Result<[usize; N]> {
        let shape = dataset.shape();
        let lengths: Vec<usize> = shape.iter().map(|&length| length as usize).collect();
        <[usize; N]>::try_from(lengths.as_slice()).map_err(|_| {
            let problem = format!("{} has shape {shape:?}, but must have {N} dimensions", dataset.name());
            Error::file(FileFault::Content, &self.path, problem)
        })
    }

    fn numbers(&self, dataset: &Dataset) -> Result<Vec<f64>> {
        match reading::read_values(&self.path, dataset)? {
            Values::F64(values) => Ok(values),
            Values::Text(_) => Err(Error::file(
                FileFault::Content,
                &self.path,
                format!("{} holds text, not numbers", dataset.name()),
            )),
        }
    }

    fn missing(&self, what: &str, name: &str) -> Error {
        let root = self.file.root_group().ok();
        let present = root.and_then(|root| self.names_in(&root).ok()).unwrap_or_default();
        Error::file(
            FileFault::Content,
            &self.path,
            format!("holds no {what} {name}; at its root are: {}", present.join(", ")),
        )
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::RunFile;
    use super::*;

    const MAP: [f64; 6] = [0.1, -0.2, -4e300, 4e-300, 5.0, 6.0];

    fn write_sample(path: &Path) {
        let run = RunFile::create(path, &Provenance::new(Some(9), "a = 1\n")).unwrap();
        run.write_2d("maps/shear", "gamma1", &MAP, (2, 3), "", "first component of the shear").unwrap();
        run.write_1d("rays", "beta_x_arcsec", &[1.0, 2.0], "arcsec", "source position").unwrap();
        run.write_text("fit", "parameter", &["γ1".into(), "θE".into()], "names").unwrap();
        run.attribute("maps", "theta_e_arcsec", 1.5).unwrap();
        run.attribute("rays/beta_x_arcsec", "order", 2_i64).unwrap();
        run.attribute("/", "model", "minimal").unwrap();
        run.group("empty").unwrap();
        run.close().unwrap();
    }

    #[test]
    fn what_was_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        write_sample(&path);
        let run = RunFileReader::open(&path).unwrap();
        let (map, shape) = run.read_2d("maps/shear", "gamma1").unwrap();
        assert_eq!(shape, (2, 3));
        assert!(map.iter().zip(MAP).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(run.read_1d("/rays/", "beta_x_arcsec").unwrap(), [1.0, 2.0]);
        assert_eq!(run.read_text("fit", "parameter").unwrap(), ["γ1", "θE"]);
        assert_eq!(run.read_attribute("maps", "theta_e_arcsec").unwrap(), 1.5.into());
        assert_eq!(run.read_attribute("rays/beta_x_arcsec", "order").unwrap(), 2_i64.into());
        assert_eq!(run.read_attribute("rays/beta_x_arcsec", "unit").unwrap(), "arcsec".into());
        assert_eq!(run.read_attribute("/", "model").unwrap(), "minimal".into());
        assert_eq!(run.provenance().unwrap(), Provenance::new(Some(9), "a = 1\n"));
        assert_eq!(run.names("").unwrap(), ["maps", "rays", "fit", "empty"]);
    }

    #[test]
    fn the_same_results_give_the_same_bytes_later() {
        let folder = tempfile::tempdir().unwrap();
        let paths = [folder.path().join("a.h5"), folder.path().join("b.h5")];
        write_sample(&paths[0]);
        std::thread::sleep(Duration::from_millis(1100)); // HDF5 times count whole seconds
        write_sample(&paths[1]);
        assert!(std::fs::read(&paths[0]).unwrap() == std::fs::read(&paths[1]).unwrap());
    }

    #[test]
    fn what_is_missing_or_of_another_shape_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        write_sample(&path);
        let run = RunFileReader::open(&path).unwrap();
        let text = |result: Result<()>| result.unwrap_err().to_string();
        let missing = text(run.read_1d("maps", "kappa").map(drop));
        assert!(missing.ends_with("holds no dataset /maps/kappa; at its root are: maps, rays, fit, empty"));
        let shape = text(run.read_1d("maps/shear", "gamma1").map(drop));
        assert!(shape.ends_with("gamma1 has shape [2, 3], but must have 1 dimensions"), "{shape}");
        assert!(text(run.read_1d("fit", "parameter").map(drop)).ends_with("holds text, not numbers"));
        assert!(text(run.read_attribute("maps", "seed").map(drop)).ends_with("maps has no attribute seed"));
    }
}
