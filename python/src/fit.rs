//! Fits: an image and a model to a posterior.

use std::collections::BTreeMap;
use std::path::PathBuf;

use haloray::Error;
use haloray::imaging::{PixelSampling, Psf, SkyGrid};
use haloray::inference::model::{BUILT_IN, CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::sample::{
    EnsembleSliceSettings, NestedSettings, NutsSettings, SamplerSettings, StretchSettings, ValleySettings,
};
use haloray::inference::{DrawStatistics, Fit, FitSettings};
use haloray::io::{Provenance, read_observation};
use haloray::mapping::HaloSight;
use haloray::mapping::tidal::LineOfSightKind;
use haloray::profile::light::Sersic;
use haloray::report::{FitSummary, RunRecord, write_fit};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Column, numbers, square};
use crate::config::toml_of_json;
use crate::errors::{OrRaise, input, redshift};
use crate::run::staged;
use crate::sight::Sight;
use crate::store::{StateFile, fingerprint};
use crate::watch::run;

/// An image to fit, with its noise and PSF.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct Observation {
    pub observation: haloray::inference::Observation,
    z_lens: Option<f64>,
    pixel_sampling: Option<PixelSampling>,
}

type Square<'py> = PyReadonlyArray2<'py, f64>;

/// The pixels of a square image, row-major.
fn pixels<'a>(py: Python<'_>, name: &str, image: &'a Square<'_>) -> PyResult<&'a [f64]> {
    let shape = image.as_array().dim();
    let refused = || input(py, name, format!("of shape {shape:?}"), "square, contiguous and of float64");
    if shape.0 != shape.1 {
        return Err(refused());
    }
    image.as_slice().map_err(|_| refused())
}

#[pymethods]
impl Observation {
    /// Reads a FITS image with its keywords, as the command does.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (observation, keywords) = run(py, None, |_| read_observation(&path))?;
        let (z_lens, pixel_sampling) = (keywords.z_lens, keywords.pixel_sampling);
        Ok(Self { observation, z_lens, pixel_sampling })
    }

    /// An image from arrays; the PSF is a kernel, or a Gaussian of that width.
    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "each has its name in Python")]
    fn of_arrays(
        py: Python<'_>,
        data_e_s: Square<'_>,
        pixel_scale_arcsec: f64,
        background_rms_e_s: f64,
        exposure_s: f64,
        psf_fwhm_arcsec: f64,
        psf_truncation_sigma: f64,
        psf_kernel: Option<(Square<'_>, usize)>,
        mask: Option<Square<'_>>,
        z_lens: Option<f64>,
    ) -> PyResult<Self> {
        let data = pixels(py, "data_e_s", &data_e_s)?;
        let side = data_e_s.as_array().nrows();
        let psf = match &psf_kernel {
            None => Psf::gaussian(psf_fwhm_arcsec, psf_truncation_sigma, pixel_scale_arcsec),
            Some((kernel, oversampling)) => {
                let weights = pixels(py, "psf_kernel", kernel)?;
                let side = kernel.as_array().nrows();
                Psf::kernel(side, side, weights.to_vec(), *oversampling)
            }
        };
        let used = match &mask {
            None => vec![true; data.len()],
            Some(mask) => pixels(py, "mask", mask)?.iter().map(|used| *used != 0.0).collect(),
        };
        let observation = haloray::inference::Observation {
            grid: SkyGrid::new(side, pixel_scale_arcsec).or_raise(py)?,
            data_e_s: data.to_vec(),
            used,
            background_rms_e_s,
            exposure_s,
            psf: psf.or_raise(py)?,
        };
        observation.validate().or_raise(py)?;
        if let Some(z) = z_lens {
            redshift(py, "z_lens", z)?;
        }
        Ok(Self { observation, z_lens, pixel_sampling: None })
    }

    /// Everything, as bytes for a pickle.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = postcard::to_allocvec(&(&self.observation, self.z_lens, self.pixel_sampling));
        let bytes = state.map_err(|e| input(py, "observation", e, "one that can be pickled"))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// From such bytes.
    #[staticmethod]
    fn of_state(py: Python<'_>, state: &[u8]) -> PyResult<Self> {
        let refused = |e: String| input(py, "pickled observation", e, "what this version of haloray pickled");
        let (observation, z_lens, pixel_sampling): (haloray::inference::Observation, _, _) =
            postcard::from_bytes(state).map_err(|e| refused(e.to_string()))?;
        observation.validate().or_raise(py)?;
        Ok(Self { observation, z_lens, pixel_sampling })
    }

    /// The image, (y, x), e⁻/s.
    #[getter]
    fn data_e_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        square(py, self.observation.data_e_s.clone(), self.observation.grid.pixels())
    }

    #[getter]
    fn pixel_scale_arcsec(&self) -> f64 {
        self.observation.grid.pixel_scale_arcsec()
    }
}

/// How to fit, besides image and model.
#[derive(FromPyObject)]
pub struct Options {
    sampler: String,
    seed: u64,
    min_ess: f64,
    profile: Vec<String>,
    max_draws: Option<usize>,
    likelihood: Option<String>,
    pixel_sampling: Option<String>,
    output: Option<PathBuf>,
    overwrite: bool,
    resume: Option<PathBuf>,
}

/// Names of the built-in models, and what each is for.
#[pyfunction]
pub fn models(py: Python<'_>) -> PyResult<Vec<(String, String)>> {
    let about = |name: &str| ModelDescription::built_in(name).map(|model| (name.to_owned(), model.about));
    BUILT_IN.iter().map(|(name, _)| about(name)).collect::<haloray::Result<_>>().or_raise(py)
}

/// The TOML of a built-in model.
#[pyfunction]
pub fn model_text(py: Python<'_>, name: &str) -> PyResult<&'static str> {
    ModelDescription::built_in(name).or_raise(py)?;
    Ok(BUILT_IN.iter().find(|(own, _)| *own == name).map_or("", |(_, text)| text))
}

/// The description of a model: built in, a TOML text, or a dictionary as JSON.
fn description(py: Python<'_>, form: &str, model: &str) -> PyResult<ModelDescription> {
    let text = match form {
        "name" => return ModelDescription::built_in(model).or_raise(py),
        "json" => toml_of_json(model).map_err(|why| input(py, "model", why, "numbers, text and sections"))?,
        _ => model.to_owned(),
    };
    let problem = |e: String| Error::Model { model: "model".into(), problem: e.trim_end().into() };
    ModelDescription::parse(&text).map_err(|e| problem(e.to_string())).or_raise(py)
}

fn settings(
    py: Python<'_>,
    options: &Options,
    likelihood: LikelihoodKind,
    pixel_sampling: PixelSampling,
) -> PyResult<FitSettings> {
    let mut sampler = match options.sampler.as_str() {
        "valley" => SamplerSettings::Valley(ValleySettings::default()),
        "nuts" => SamplerSettings::Nuts(NutsSettings::default()),
        "ensemble-slice" => SamplerSettings::EnsembleSlice(EnsembleSliceSettings::default()),
        "stretch" => SamplerSettings::Stretch(StretchSettings::default()),
        "nested" => SamplerSettings::Nested(NestedSettings::default()),
        other => {
            let allowed = "\"valley\", \"nuts\", \"ensemble-slice\", \"stretch\" or \"nested\"";
            return Err(input(py, "sampler", other, allowed));
        }
    };
    if let Some(most) = options.max_draws {
        if most < 4 {
            return Err(input(py, "max_draws", most, "at least 4"));
        }
        let (block, max, thin) = match &mut sampler {
            SamplerSettings::Nuts(s) => (&mut s.block_draws, &mut s.max_draws, 1),
            SamplerSettings::Valley(s) => (&mut s.block_draws, &mut s.max_draws, 1),
            SamplerSettings::EnsembleSlice(s) => (&mut s.block_steps, &mut s.max_steps, s.thin),
            SamplerSettings::Stretch(s) => (&mut s.block_steps, &mut s.max_steps, s.thin),
            SamplerSettings::Nested(_) => {
                return Err(input(py, "max_draws", most, "left out with sampler \"nested\""));
            }
        };
        *max = most * thin;
        *block = (*block).min(*max);
    }
    Ok(FitSettings { likelihood, pixel_sampling, sampler, min_ess: options.min_ess, seed: options.seed })
}

/// A line of sight, and the redshift of the lens behind it.
pub type ThroughHaloes<'py> = Option<(Bound<'py, Sight>, Option<f64>)>;

/// A model and how to fit it, checked against the image.
pub struct Prepared {
    pub description: ModelDescription,
    pub settings: FitSettings,
    haloes: Option<HaloSight>,
}

impl Prepared {
    /// Of a model in that form; a model of haloes is given them as a line of sight.
    pub fn new(
        py: Python<'_>,
        observation: &Observation,
        (form, model): (&str, &str),
        options: &Options,
        haloes: &ThroughHaloes<'_>,
    ) -> PyResult<Self> {
        let mut description = description(py, form, model)?;
        match options.likelihood.as_deref() {
            None => {}
            Some("gaussian") => description.likelihood = LikelihoodKind::Gaussian,
            Some("lenstronomy") => description.likelihood = LikelihoodKind::Lenstronomy,
            Some(other) => return Err(input(py, "likelihood", other, "\"gaussian\" or \"lenstronomy\"")),
        }
        let sampling = match options.pixel_sampling.as_deref() {
            None => observation.pixel_sampling,
            Some("point") => Some(PixelSampling::Point),
            Some("adaptive") => Some(PixelSampling::Adaptive),
            Some(other) => return Err(input(py, "pixel_sampling", other, "\"point\" or \"adaptive\"")),
        };
        let sampling = description.sampling(sampling);
        description.pixel_sampling = Some(sampling);
        let settings = settings(py, options, description.likelihood, sampling)?;
        let haloes = match (description.line_of_sight.model, haloes) {
            (LineOfSightKind::Haloes, Some((sight, z_lens))) => {
                let missing = || input(py, "z_lens", "missing", "given, or ZLENS in the image");
                let z_lens = z_lens.or(observation.z_lens).ok_or_else(missing)?;
                Some(HaloSight::new(sight.get().sight.clone(), z_lens).or_raise(py)?)
            }
            (LineOfSightKind::Haloes, None) => {
                return Err(input(py, "haloes", "missing", "a line of sight: the model's is made of haloes"));
            }
            (_, Some(_)) => {
                let allowed = "left out unless the model's line_of_sight.model is \"haloes\"";
                return Err(input(py, "haloes", "given", allowed));
            }
            (_, None) => None,
        };
        Ok(Self { description, settings, haloes })
    }

    /// The model, ready to be fitted.
    pub fn compiled(&self) -> haloray::Result<CompiledModel> {
        let model = match &self.haloes {
            None => CompiledModel::new(&self.description),
            Some(haloes) => CompiledModel::through_haloes(&self.description, haloes.clone()),
        };
        model.map_err(|error| self.in_model(error))
    }

    /// An error that says which model it is of.
    pub fn in_model(&self, error: Error) -> Error {
        error.in_model(&self.description.name)
    }
}

/// Fits an image.
#[pyfunction]
#[pyo3(signature = (observation, form, model, options, haloes=None, progress=None))]
pub fn fit<'py>(
    py: Python<'py>,
    observation: &Observation,
    form: &str,
    model: &str,
    options: Options,
    haloes: ThroughHaloes<'py>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let prepared = Prepared::new(py, observation, (form, model), &options, &haloes)?;
    let Prepared { description, settings, haloes: through } = &prepared;
    let toml = toml::to_string_pretty(description).unwrap_or_else(|error| format!("# {error}\n"));
    let same = match &options.resume {
        Some(_) => {
            let image = fingerprint(&observation.observation, through.as_ref());
            format!("{settings:?}\n{toml}\n{image}")
        }
        None => String::new(),
    };
    let observed = observation.observation.clone();
    let (fit, json, complaints) = run(py, progress.as_ref(), |monitor| {
        let model = prepared.compiled()?;
        options.profile.iter().try_for_each(|name| model.place_of_free(name).map(drop))?;
        let names = ["summary.json", "timings.json", "model.toml", "posterior.nc"];
        let staging =
            options.output.as_ref().map(|path| staged(path, &names, options.overwrite)).transpose()?;
        let mut state = StateFile::at(options.resume.clone(), same, monitor);
        let task = monitor.task(&description.name, None);
        let fit = Fit::run(observed, model, *settings, &mut state, monitor);
        let fit = fit.map_err(|error| prepared.in_model(error))?;
        drop(task);
        let profiles = fit.profiles(&options.profile, monitor)?;
        let summary = FitSummary { profiles, ..FitSummary::of(&fit, &description.name, state.seconds()) };
        let json = serde_json::to_string(&summary);
        let json = json.map_err(|e| Error::out_of_range("summary", e, "representable as JSON"))?;
        let mut complaints = Vec::new();
        if let Some(staging) = staging {
            let provenance = Provenance::new(Some(options.seed), toml.clone());
            let call = format!("haloray.fit(observation, \"model.toml\", seed={})", options.seed);
            let record = RunRecord {
                repeat: vec![call],
                ..RunRecord::new("fit", &[], &description.about, &provenance)
            };
            write_fit(&fit, &summary, &[], &staging, "", &provenance, &record)?;
            complaints = staging.complaints();
            staging.commit()?;
        }
        state.remove();
        Ok((fit, json, complaints))
    })?;
    let all = PyDict::new(py);
    all.set_item("summary", json)?;
    all.set_item("complaints", complaints)?;
    all.set_item("model_toml", toml)?;
    set_draws(&all, &fit)?;
    let side = observation.observation.grid.pixels();
    all.set_item("model_e_s", square(py, fit.image.model_e_s.clone(), side)?)?;
    all.set_item("normalised_residuals", square(py, fit.normalised_residuals(), side)?)?;
    let used = observation.observation.data_e_s.iter().zip(&observation.observation.used);
    let data = used.map(|(flux, used)| if *used { *flux } else { f64::NAN }).collect();
    all.set_item("data_e_s", square(py, data, side)?)?;
    all.set_item("pixel_scale_arcsec", observation.observation.grid.pixel_scale_arcsec())?;
    all.set_item("source", source_of(&fit))?;
    Ok(all)
}

/// The first source of the best fit by lenstronomy's names, with its amplitude; nothing for another profile than Sérsic's.
fn source_of(fit: &Fit) -> BTreeMap<&'static str, f64> {
    let model = fit.likelihood.model();
    let value = |name: &'static str| Some((name, model.value_of(&format!("source.{name}"), &fit.best_fit)?));
    let found: Option<BTreeMap<_, _>> = Sersic::PARAMETERS.iter().map(|own| value(own.name)).collect();
    match (found, fit.image.amplitudes.first()) {
        (Some(mut found), Some(amplitude)) => {
            found.insert("amplitude", *amplitude);
            found
        }
        _ => BTreeMap::new(),
    }
}

/// Median and 68% highest-density interval of draws.
#[pyfunction]
pub fn draw_statistics(py: Python<'_>, draws: Column<'_>) -> PyResult<(f64, f64, f64)> {
    let found = DrawStatistics::of(numbers(py, "draws", &draws)?);
    let found = found.ok_or_else(|| input(py, "draws", "none", "at least one finite number"))?;
    Ok((found.median, found.hpd68_low, found.hpd68_high))
}

/// The draws by name, each (chain, draw), and what the sampler noted.
fn set_draws(all: &Bound<'_, PyDict>, fit: &Fit) -> PyResult<()> {
    let py = all.py();
    let array = |draws: &[Vec<f64>]| -> PyResult<Bound<'_, PyAny>> {
        let shape = [draws.len(), draws.first().map_or(0, Vec::len)];
        Ok(PyArray1::from_vec(py, draws.concat()).reshape(shape)?.into_any())
    };
    let posterior = PyDict::new(py);
    for parameter in &fit.parameters {
        posterior.set_item(&parameter.name, array(fit.draws_of(&parameter.name).unwrap_or_default())?)?;
    }
    all.set_item("posterior", posterior)?;
    let chains = &fit.chains;
    let of = |value: &dyn Fn(&haloray::inference::sample::Chain) -> Vec<f64>| -> Vec<Vec<f64>> {
        chains.chains.iter().map(value).collect()
    };
    let stats = PyDict::new(py);
    stats.set_item("lp", array(&of(&|chain| chain.log_density(chains.dimension)))?)?;
    stats.set_item("log_likelihood", array(&of(&|chain| chain.log_likelihood.clone()))?)?;
    all.set_item("sample_stats", stats)
}
