//! Configurations: a preset with a file, a text or a dictionary laid over it.

use std::path::{Path, PathBuf};

use haloray::Error;
use haloray::config::{self, Draw, Preset, SheetModel};
use haloray::cosmology::Background;
use haloray::mapping::multiplane::{Accuracy, Reference};
use pyo3::prelude::*;

use crate::errors::{OrRaise, input};

/// What errors call a configuration that is no file.
const UNNAMED: &str = "configuration";

/// An error of a dictionary's text, which its user never saw, with the key in place of line and column.
fn by_key(error: Error, text: &str) -> Error {
    match error {
        Error::Toml { at: Some(at), problem, .. } => {
            let section = text.lines().take(at.line).filter_map(|line| line.strip_prefix('[')).last();
            let section = section.map_or(String::new(), |name| name.replace(']', "."));
            let line = text.lines().nth(at.line - 1).unwrap_or_default();
            let place = match line.split_once('=') {
                Some((key, _)) => format!("{UNNAMED}: {section}{}", key.trim()),
                None => format!("{UNNAMED}: {}", section.trim_end_matches('.')),
            };
            Error::Toml { path: place.into(), at: None, problem }
        }
        Error::Config { path, key, cause, .. } => Error::Config { path, at: None, key, cause },
        other => other,
    }
}

/// A resolved configuration: every key has its value.
#[pyclass(frozen, eq, module = "haloray._haloray")]
#[derive(PartialEq)]
pub struct Config(pub config::Config);

fn preset(py: Python<'_>, name: &str) -> PyResult<Preset> {
    match name {
        "paper" => Ok(Preset::Paper),
        "consistent" => Ok(Preset::Consistent),
        other => Err(input(py, "preset", other, "\"paper\" or \"consistent\"")),
    }
}

#[pymethods]
impl Config {
    /// A preset, overlaid with a TOML file.
    #[staticmethod]
    fn of_file(py: Python<'_>, preset_name: &str, path: Option<PathBuf>) -> PyResult<Self> {
        Ok(Self(config::load(preset(py, preset_name)?, path.as_deref()).or_raise(py)?))
    }

    /// A preset, overlaid with a TOML text.
    #[staticmethod]
    fn of_text(py: Python<'_>, preset_name: &str, text: &str) -> PyResult<Self> {
        Ok(Self(config::resolve(preset(py, preset_name)?, Path::new(UNNAMED), text, "").or_raise(py)?))
    }

    /// A preset, overlaid with a dictionary written as JSON.
    #[staticmethod]
    fn of_json(py: Python<'_>, preset_name: &str, json: &str) -> PyResult<Self> {
        let text = toml_of_json(json).map_err(|why| input(py, UNNAMED, why, "numbers, text and sections"))?;
        let resolved = config::resolve(preset(py, preset_name)?, Path::new(UNNAMED), &text, "");
        Ok(Self(resolved.map_err(|error| by_key(error, &text)).or_raise(py)?))
    }

    /// A text that holds every key, such as `toml`.
    #[staticmethod]
    fn of_complete_text(py: Python<'_>, text: &str) -> PyResult<Self> {
        let config: config::Config =
            toml::from_str(text).map_err(|why| input(py, UNNAMED, why, "complete"))?;
        config.validate().or_raise(py)?;
        Ok(Self(config))
    }

    /// The same with another seed, draw or accuracy.
    #[pyo3(signature = (seed=None, draw=None, accuracy_arcsec=None))]
    fn with_options(
        &self,
        py: Python<'_>,
        seed: Option<u64>,
        draw: Option<&str>,
        accuracy_arcsec: Option<AccuracyArgument>,
    ) -> PyResult<Self> {
        let mut config = self.0.clone();
        config.seed = seed.unwrap_or(config.seed);
        config.haloes.draw = match draw {
            None => config.haloes.draw,
            Some("direct") => Draw::Direct,
            Some("brute-force") => Draw::BruteForce,
            Some(other) => return Err(input(py, "draw", other, "\"direct\" or \"brute-force\"")),
        };
        if let Some(accuracy) = accuracy_arcsec {
            config.line_of_sight.accuracy_arcsec = accuracy.resolve(py)?;
        }
        if i64::try_from(config.seed).is_err() {
            return Err(input(py, "seed", config.seed, &format!("a whole number from 0 to {}", i64::MAX)));
        }
        Ok(Self(config))
    }

    /// Every key as TOML.
    #[getter]
    fn toml(&self, py: Python<'_>) -> PyResult<String> {
        self.text().or_raise(py)
    }

    /// A number of a section.
    fn number(&self, py: Python<'_>, section: &str, key: &str) -> PyResult<f64> {
        let table: toml::Table = toml::from_str(&self.text().or_raise(py)?)
            .map_err(|why| input(py, UNNAMED, why, "representable as TOML"))?;
        let value = table.get(section).and_then(|own| own.get(key));
        let number = value.and_then(|own| own.as_float().or(own.as_integer().map(|n| n as f64)));
        number
            .ok_or_else(|| input(py, &format!("{section}.{key}"), "missing", "a number of the configuration"))
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Standard deviation of the background per pixel, e⁻/s.
    #[getter]
    fn background_rms_e_s(&self) -> f64 {
        self.0.instrument.background_rms_e_s()
    }

    #[getter]
    fn z_lens(&self) -> f64 {
        self.0.line_of_sight.z_lens
    }

    #[getter]
    fn z_source(&self) -> f64 {
        self.0.line_of_sight.z_source
    }

    /// (H0 in km/s/Mpc, Ωm).
    #[getter]
    fn cosmology(&self) -> (f64, f64) {
        parameters(&self.0.cosmology)
    }

    /// The name of the sheets that `LineOfSight` is to take.
    #[getter]
    fn sheets(&self) -> &'static str {
        let los = &self.0.line_of_sight;
        sheets_name(los.sheets, los.is_beside_axis())
    }

    #[getter]
    fn reference(&self) -> &'static str {
        reference_name(self.0.line_of_sight.reference)
    }

    /// The largest error of a ray in arcsec; none where all rays are exact.
    #[getter]
    fn accuracy_arcsec(&self) -> Option<f64> {
        match self.0.line_of_sight.accuracy_arcsec {
            Accuracy::WithinArcsec(arcsec) => Some(arcsec),
            Accuracy::Exact(_) => None,
        }
    }
}

impl Config {
    /// Every key as TOML.
    pub fn text(&self) -> haloray::Result<String> {
        toml::to_string(&self.0).map_err(|e| Error::out_of_range(UNNAMED, e, "representable as TOML"))
    }
}

/// `"exact"` or a number of arcsec.
#[derive(FromPyObject)]
pub enum AccuracyArgument {
    Arcsec(f64),
    Word(String),
}

impl AccuracyArgument {
    pub fn resolve(self, py: Python<'_>) -> PyResult<Accuracy> {
        let accuracy = match self {
            Self::Word(word) if word == "exact" => Accuracy::EXACT,
            Self::Word(word) => {
                return Err(input(py, "accuracy_arcsec", word, "\"exact\" or a positive number of arcsec"));
            }
            Self::Arcsec(arcsec) => Accuracy::WithinArcsec(arcsec),
        };
        accuracy.validate("accuracy_arcsec").or_raise(py)?;
        Ok(accuracy)
    }
}

/// (H0 in km/s/Mpc, Ωm) of a cosmology.
pub fn parameters(background: &Background) -> (f64, f64) {
    (background.h0_km_s_mpc(), background.omega_m())
}

/// The name of a model of sheets.
pub fn sheets_name(sheets: SheetModel, is_beside_axis: bool) -> &'static str {
    match sheets {
        SheetModel::OnAxis if is_beside_axis => "on-ray",
        SheetModel::OnAxis => "on-axis",
        SheetModel::None => "none",
        SheetModel::MeanDensity => "mean-density",
    }
}

/// The name of a reference.
pub fn reference_name(reference: Reference) -> &'static str {
    match reference {
        Reference::Bent => "bent",
        Reference::Straight => "straight",
    }
}

/// A JSON object as TOML.
pub fn toml_of_json(json: &str) -> Result<String, String> {
    let value: serde_json::Value = serde_json::from_str(json).map_err(|error| error.to_string())?;
    toml::to_string(&value).map_err(|error| error.to_string())
}
