//! The one HDF5 file of a run: named arrays with units and descriptions, and its provenance.

use std::path::{Path, PathBuf};

use hdf5::{Dataset, File, Location};

use super::attribute::AttributeValue;
use super::hdf5_objects as objects;
use super::provenance::Provenance;
use super::table::Values;
use crate::error::{Error, FileFault, Result};

/// An HDF5 file of results, being written or read back.
///
/// Groups are paths (`"maps/shear"`) and are created on first use. The bytes depend only on what
/// is written and its order, never on the time. Use it inside [`Staging`](super::Staging) or
/// [`write_atomically`](super::write_atomically), and end writing with [`close`](Self::close).
#[derive(Debug)]
pub struct RunFile {
    path: PathBuf,
    file: File,
}

impl RunFile {
    /// Creates the file, replacing a former one, and stores the provenance in its root.
    ///
    /// # Errors
    /// [`Error::Write`], as from every writing method here.
    pub fn create(path: &Path, provenance: &Provenance) -> Result<Self> {
        let file = objects::create(path)?;
        objects::write_provenance(path, &file, provenance)?;
        Ok(Self { path: path.into(), file })
    }

    /// Opens a file for reading.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`], as from every reading method here.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.into(), file: objects::open(path)? })
    }

    /// Flushes everything to the file and closes it.
    pub fn close(self) -> Result<()> {
        objects::close(&self.path, self.file)
    }

    /// Creates a group, unless it is there.
    pub fn group(&self, name: &str) -> Result<()> {
        objects::group_or_new(&self.path, &self.file, name).map(drop)
    }

    /// Writes a list of numbers; `unit` is empty for pure numbers.
    pub fn write_1d(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        unit: &str,
        description: &str,
    ) -> Result<()> {
        self.write_array(group, name, data, &[data.len()], unit, description)
    }

    /// Writes a map, row-major with `shape` = (ny, nx).
    pub fn write_2d(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        shape: (usize, usize),
        unit: &str,
        description: &str,
    ) -> Result<()> {
        self.write_array(group, name, data, &[shape.0, shape.1], unit, description)
    }

    fn write_array(
        &self,
        group: &str,
        name: &str,
        data: &[f64],
        shape: &[usize],
        unit: &str,
        description: &str,
    ) -> Result<()> {
        let group = objects::group_or_new(&self.path, &self.file, group)?;
        let dataset = objects::write_f64(&self.path, &group, name, data, shape)?;
        objects::write_attribute(&self.path, &dataset, "unit", &unit.into())?;
        objects::write_attribute(&self.path, &dataset, "description", &description.into())
    }

    /// Writes a list of texts (parameter names, model names).
    pub fn write_text(&self, group: &str, name: &str, text: &[String], description: &str) -> Result<()> {
        let group = objects::group_or_new(&self.path, &self.file, group)?;
        let dataset = objects::write_text(&self.path, &group, name, text)?;
        objects::write_attribute(&self.path, &dataset, "description", &description.into())
    }

    /// Attaches a value to the group or dataset at `object` (`"/"` for the file itself).
    pub fn attribute(&self, object: &str, name: &str, value: impl Into<AttributeValue>) -> Result<()> {
        let place = self.locate(object).map_err(|error| Error::write(&self.path, error))?;
        objects::write_attribute(&self.path, &place, name, &value.into())
    }

    /// Names of the datasets and groups in a group, in the order of creation.
    pub fn names(&self, group: &str) -> Result<Vec<String>> {
        let group = self.file.group(&rooted(group)).map_err(|_| self.missing("group", group))?;
        objects::member_names(&self.path, &group)
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
        match objects::read_values(&self.path, &dataset)? {
            Values::Text(text) => Ok(text),
            Values::F64(_) => Err(Error::file(
                FileFault::Content,
                &self.path,
                format!("{} holds numbers, not text", dataset.name()),
            )),
        }
    }

    /// Reads the value attached to `object` under that name.
    pub fn read_attribute(&self, object: &str, name: &str) -> Result<AttributeValue> {
        let place =
            self.locate(object).map_err(|problem| Error::file(FileFault::Content, &self.path, problem))?;
        let value = objects::read_attribute(&self.path, &place, name)?;
        value.ok_or_else(|| {
            Error::file(FileFault::Content, &self.path, format!("{object} has no attribute {name}"))
        })
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
        let seed = match objects::read_attribute(&self.path, &self.file, "seed")? {
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
        <[usize; N]>::try_from(shape.as_slice()).map_err(|_| {
            let problem = format!("{} has shape {shape:?}, but must have {N} dimensions", dataset.name());
            Error::file(FileFault::Content, &self.path, problem)
        })
    }

    fn numbers(&self, dataset: &Dataset) -> Result<Vec<f64>> {
        match objects::read_values(&self.path, dataset)? {
            Values::F64(values) => Ok(values),
            Values::Text(_) => Err(Error::file(
                FileFault::Content,
                &self.path,
                format!("{} holds text, not numbers", dataset.name()),
            )),
        }
    }

    fn locate(&self, object: &str) -> std::result::Result<Location, String> {
        let full = rooted(object);
        if let Ok(group) = self.file.group(&full) {
            return Ok(Location::clone(&group));
        }
        let dataset = self.file.dataset(&full).map_err(|_| format!("holds no {object}"))?;
        Ok(Location::clone(&dataset))
    }

    fn missing(&self, what: &str, name: &str) -> Error {
        let root = self.file.group("/").ok();
        let present = root.and_then(|root| objects::member_names(&self.path, &root).ok()).unwrap_or_default();
        Error::file(
            FileFault::Content,
            &self.path,
            format!("holds no {what} {name}; at its root are: {}", present.join(", ")),
        )
    }
}

/// The path of an object from the root on.
fn rooted(name: &str) -> String {
    format!("/{}", name.trim_matches('/'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const MAP: [f64; 6] = [0.1, -0.2, f64::NAN, 4e-300, 5.0, 6.0];

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
        let run = RunFile::open(&path).unwrap();
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
        let run = RunFile::open(&path).unwrap();
        let text = |result: Result<()>| result.unwrap_err().to_string();
        let missing = text(run.read_1d("maps", "kappa").map(drop));
        assert!(missing.ends_with("holds no dataset /maps/kappa; at its root are: maps, rays, fit, empty"));
        let shape = text(run.read_1d("maps/shear", "gamma1").map(drop));
        assert!(
            shape.ends_with("/maps/shear/gamma1 has shape [2, 3], but must have 1 dimensions"),
            "{shape}"
        );
        assert!(text(run.read_1d("fit", "parameter").map(drop)).ends_with("holds text, not numbers"));
        assert!(text(run.read_attribute("maps", "seed").map(drop)).ends_with("maps has no attribute seed"));
    }

    #[test]
    fn a_missing_folder_or_a_second_dataset_of_that_name_fails_to_write() {
        let folder = tempfile::tempdir().unwrap();
        let provenance = Provenance::new(None, "");
        let error = RunFile::create(&folder.path().join("missing/run.h5"), &provenance).unwrap_err();
        assert!(!error.is_bad_input());
        let run = RunFile::create(&folder.path().join("run.h5"), &provenance).unwrap();
        run.write_1d("rays", "x", &[1.0], "", "").unwrap();
        let error = run.write_1d("rays", "x", &[2.0], "", "").unwrap_err().to_string();
        assert!(error.contains("dataset x exists already in /rays"), "{error}");
    }
}
