//! The density that a fit samples, for samplers of other packages.

use haloray::inference::{LatentLikelihood, Maximum, Top};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Column, numbers};
use crate::errors::input;
use crate::fit::{Observation, Options, Prepared, ThroughHaloes};
use crate::watch::run;

/// ln p of an image's model over latent coordinates, its pixels refined about the maxima that a blind start has found.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct LogPosterior {
    top: Top,
}

/// A maximum for Python: latent coordinates, ln p, metric.
type ModeParts<'py> = (Bound<'py, PyAny>, f64, Bound<'py, PyAny>);

/// What is computed at each point.
type AtPoint<'a> = &'a (dyn Fn(&[f64]) -> Vec<f64> + Sync);

impl LogPosterior {
    /// Numbers of each point, one after the other, on all threads.
    fn of_points<'py>(
        &self,
        py: Python<'py>,
        latent: &Column<'py>,
        at: AtPoint<'_>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let latent = numbers(py, "latent", latent)?;
        if let Some(i) = latent.iter().position(|z| !z.is_finite()) {
            return Err(input(py, &format!("latent[{i}]"), latent[i], "a finite number"));
        }
        let dimension = self.top.likelihood.dimension();
        let found = run(py, None, |_| Ok(latent.par_chunks_exact(dimension).flat_map_iter(at).collect()))?;
        Ok(PyArray1::from_vec(py, found))
    }
}

/// ln N(z; 0, 1) up to a constant, as [`Maximum::log_posterior`] counts it.
fn log_prior(z: &[f64]) -> f64 {
    -0.5 * z.iter().map(|z| z * z).sum::<f64>()
}

#[pymethods]
impl LogPosterior {
    /// Searches the maxima blindly.
    #[new]
    #[pyo3(signature = (observation, form, model, options, haloes=None, progress=None))]
    fn new(
        py: Python<'_>,
        observation: &Observation,
        form: &str,
        model: &str,
        options: Options,
        haloes: ThroughHaloes<'_>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let prepared = Prepared::new(py, observation, (form, model), &options, &haloes)?;
        let observed = observation.observation.clone();
        let top = run(py, progress.as_ref(), |monitor| {
            let task = monitor.task(&prepared.description.name, None);
            let top = Top::find(observed, prepared.compiled()?, &prepared.settings, None, monitor);
            drop(task);
            top.map_err(|error| prepared.in_model(error))
        })?;
        Ok(Self { top })
    }

    /// Names of the latent coordinates' parameters.
    fn names(&self) -> Vec<String> {
        self.top.likelihood.model().free.iter().map(|free| free.name.clone()).collect()
    }

    /// Names of all quantities that follow from them, the parameters first, and their units.
    fn quantities(&self) -> Vec<(String, &'static str)> {
        self.top.likelihood.model().quantities().into_iter().map(|own| (own.name, own.unit)).collect()
    }

    /// Evaluations of the likelihood in the start.
    #[getter]
    fn evaluations(&self) -> u64 {
        self.top.evaluations
    }

    /// (latent, ln p, metric) of every mode, the highest first.
    fn modes<'py>(&self, py: Python<'py>) -> PyResult<Vec<ModeParts<'py>>> {
        let mode = |Maximum { latent, log_posterior, metric }: &Maximum| {
            let square = PyArray1::from_slice(py, metric.as_slice()).reshape([latent.len(); 2])?;
            Ok((PyArray1::from_slice(py, latent).into_any(), *log_posterior, square.into_any()))
        };
        self.top.modes.iter().map(mode).collect()
    }

    /// ln L of each point.
    fn log_likelihood<'py>(
        &self,
        py: Python<'py>,
        latent: Column<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_points(py, &latent, &|z| vec![self.top.likelihood.log_likelihood(z)])
    }

    /// ln p of each point.
    fn log_density<'py>(&self, py: Python<'py>, latent: Column<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_points(py, &latent, &|z| vec![self.top.likelihood.log_likelihood(z) + log_prior(z)])
    }

    /// ln p and its gradient of each point, NaN where ln p is −∞.
    fn gradient<'py>(&self, py: Python<'py>, latent: Column<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_points(py, &latent, &|z| {
            let mut found = vec![0.0; 1 + z.len()];
            let (value, gradient) = found.split_at_mut(1);
            value[0] = self.top.likelihood.log_likelihood_gradient(z, gradient) + log_prior(z);
            let is_zero = value[0] == f64::NEG_INFINITY;
            gradient.iter_mut().zip(z).for_each(|(g, z)| *g = if is_zero { f64::NAN } else { *g - z });
            found
        })
    }

    /// All quantities of each point.
    fn values<'py>(&self, py: Python<'py>, latent: Column<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_points(py, &latent, &|z| self.top.likelihood.model().quantities_at(z))
    }

    /// Latent coordinates of values of the free parameters.
    fn latent<'py>(&self, py: Python<'py>, values: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let model = self.top.likelihood.model();
        for (free, value) in model.free.iter().zip(&values) {
            let [low, high] = free.prior.edges();
            if !(low..=high).contains(value) {
                return Err(input(
                    py,
                    &free.name,
                    value,
                    &format!("from {low} to {high}, where its prior is"),
                ));
            }
        }
        Ok(PyArray1::from_vec(py, model.to_latent(&values)))
    }
}
