//! Lens models under lenstronomy's names.

use std::collections::BTreeMap;

use haloray::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use haloray::cosmology::Background;
use haloray::diagnostics::{CriticalCurves, PointImages, SkyWindow};
use haloray::io::{LensModelFile, LensModelParts, LensOfFile, LensRedshifts, kind_name, lens_model_names};
use haloray::mapping::Order;
use haloray::mapping::tidal::TidalLens;
use haloray::monitor::{Monitor, Silent};
use haloray::profile::mass::{MassProfile, einstein_radius_arcsec};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{Column, order, pairs, points, trace};
use crate::errors::{OrRaise, input, redshift};
use crate::watch::run;

/// A list of profiles, and where their planes are; the numbers come with every call.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct Lens {
    names: Vec<String>,
    redshifts: LensRedshifts,
    background: Background,
}

/// Rays that are traced on the calling thread: the way to others would take longer.
const FEW: usize = 48;

#[pymethods]
impl Lens {
    #[new]
    fn new(
        py: Python<'_>,
        names: Vec<String>,
        z_lens: Option<f64>,
        z_source: Option<f64>,
        lens_redshift_list: Option<Vec<f64>>,
        cosmology: (f64, f64),
    ) -> PyResult<Self> {
        let background = Background::new(cosmology.0, cosmology.1).or_raise(py)?;
        let known = lens_model_names();
        let unknown: Vec<&str> =
            names.iter().map(String::as_str).filter(|own| !known.contains(own)).collect();
        if !unknown.is_empty() {
            return Err(input(
                py,
                "lens_model_list",
                unknown.join(", "),
                &format!("among {}", known.join(", ")),
            ));
        }
        for (name, z) in [("z_lens", z_lens), ("z_source", z_source)] {
            z.map_or(Ok(()), |z| redshift(py, name, z))?;
        }
        let redshifts = match (lens_redshift_list, z_lens, z_source) {
            (Some(lenses), _, Some(source)) => LensRedshifts::ManyPlanes { lenses, source },
            (Some(_), _, None) => {
                return Err(input(py, "z_source", "missing", "given with lens_redshift_list"));
            }
            (None, Some(lens), Some(source)) => LensRedshifts::OnePlane { lens, source },
            _ => LensRedshifts::Unknown,
        };
        Ok(Self { names, redshifts, background })
    }

    /// β of one ray.
    fn ray(
        &self,
        py: Python<'_>,
        x: f64,
        y: f64,
        kwargs: &Bound<'_, PyAny>,
        only: Option<Vec<usize>>,
    ) -> PyResult<(f64, f64)> {
        for (name, value) in [("x", x), ("y", y)] {
            if !value.is_finite() {
                return Err(input(py, name, value, "a finite number"));
            }
        }
        let lens = self.build(py, kwargs, only)?.lens;
        let [x, y] = lens.mapping().map(&[[x, y]], Order::Position).beta_arcsec[0];
        Ok((x, y))
    }

    /// β and derivatives of rays.
    fn trace<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        kwargs: &Bound<'py, PyAny>,
        only: Option<Vec<usize>>,
        order_number: u8,
    ) -> PyResult<Bound<'py, PyAny>> {
        let order = order(py, order_number)?;
        let [x, y] = points(py, ["x", "y"], [&x, &y])?;
        let lens = self.build(py, kwargs, only)?.lens;
        let traced = few_or_many(py, x.len(), |monitor| trace(lens.mapping(), [x, y], order, monitor))?;
        traced.into_python(py, order)
    }

    /// Lensing potential of the profiles of one plane, arcsec².
    fn potential<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        kwargs: &Bound<'py, PyAny>,
        only: Option<Vec<usize>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let [x, y] = points(py, ["x", "y"], [&x, &y])?;
        let lens = self.one_plane(py, kwargs, only, "the potential")?;
        let at = |i: usize| lens.lenses.iter().map(|own| own.potential(x[i], y[i])).sum::<f64>();
        let potential = few_or_many(py, x.len(), |monitor| by_chunks(x.len(), monitor, at))?;
        Ok(PyArray1::from_vec(py, potential))
    }

    /// Fermat potential of rays of one plane, arcsec²: of a source at `source`, or of each ray's own.
    fn fermat_potential<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        kwargs: &Bound<'py, PyAny>,
        source: Option<(Column<'py>, Column<'py>)>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let [x, y] = points(py, ["x_image", "y_image"], [&x, &y])?;
        let beta = match &source {
            None => None,
            Some((x, y)) => Some(points(py, ["x_source", "y_source"], [x, y])?),
        };
        if let Some(beta) = beta.filter(|beta| beta[0].len() != x.len()) {
            let allowed = format!("that of x_image ({})", x.len());
            return Err(input(py, "length of x_source", beta[0].len(), &allowed));
        }
        let lens = self.one_plane(py, kwargs, None, "the Fermat potential")?;
        let at = |i: usize| {
            let theta = [x[i], y[i]];
            let of_source = beta.and_then(|beta| lens.fermat_arcsec2(theta, [beta[0][i], beta[1][i]]));
            of_source.unwrap_or_else(|| lens.ray_fermat_arcsec2(theta))
        };
        let fermat = few_or_many(py, x.len(), |monitor| by_chunks(x.len(), monitor, at))?;
        Ok(PyArray1::from_vec(py, fermat))
    }

    /// Arrival-time delays in days.
    fn delay_days<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        kwargs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let [x, y] = points(py, ["x_image", "y_image"], [&x, &y])?;
        if self.redshifts == LensRedshifts::Unknown {
            return Err(input(py, "z_lens and z_source", "missing", "given: delays need distances"));
        }
        let lens = self.build(py, kwargs, None)?.lens;
        let theta: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
        let delays = run(py, None, |_| Ok(lens.mapping().delay_days(&theta)))?;
        Ok(PyArray1::from_vec(py, delays))
    }

    /// Days that one arcsec² of Fermat potential is for a lens plane at `z_lens`: χ_d χ_s/(χ_s − χ_d)/c.
    fn days_per_arcsec2(&self, py: Python<'_>, z_lens: Option<f64>) -> PyResult<f64> {
        let missing = || input(py, "z_lens and z_source", "missing", "given: delays need distances");
        let (lens, source) = match (&self.redshifts, z_lens) {
            (
                LensRedshifts::OnePlane { source, .. } | LensRedshifts::ManyPlanes { source, .. },
                Some(lens),
            ) => (lens, *source),
            _ => return Err(missing()),
        };
        if !(lens > 0.0 && lens < source) {
            return Err(input(py, "z_lens", lens, &format!("above 0 and below z_source = {source}")));
        }
        let [lens, source] = [lens, source].map(|z| self.background.comoving_distance_mpc(z));
        Ok(lens * source / (source - lens) * MPC_OVER_C_DAYS * ARCSEC_RAD * ARCSEC_RAD)
    }

    /// All images of a point source.
    fn point_images<'py>(
        &self,
        py: Python<'py>,
        source: (f64, f64),
        kwargs: &Bound<'py, PyAny>,
        half_width_arcsec: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        for (name, value) in [("x_source", source.0), ("y_source", source.1)] {
            if !value.is_finite() {
                return Err(input(py, name, value, "a finite number"));
            }
        }
        let lens = self.build(py, kwargs, None)?.lens;
        let window = SkyWindow::about_axis(half_width_arcsec, lens.lens_centres_arcsec()).or_raise(py)?;
        let found =
            run(py, None, |monitor| PointImages::of(lens.mapping(), &window, [source.0, source.1], monitor))?;
        let images = &found.images;
        let all = PyDict::new(py);
        let theta: Vec<[f64; 2]> = images.iter().map(|image| image.theta_arcsec).collect();
        let jacobian: Vec<f64> = images.iter().flat_map(|image| image.jacobian).collect();
        all.set_item("theta_arcsec", pairs(py, &theta)?)?;
        all.set_item("jacobian", PyArray1::from_vec(py, jacobian).reshape([images.len(), 2, 2])?)?;
        all.set_item(
            "magnification",
            PyArray1::from_iter(py, images.iter().map(|image| image.magnification())),
        )?;
        all.set_item("delay_days", PyArray1::from_iter(py, images.iter().map(|image| image.delay_days)))?;
        let kinds = images.iter().map(|image| kind_name(image.kind()));
        all.set_item("kind", PyList::new(py, kinds.collect::<Vec<_>>())?)?;
        all.set_item("is_complete", found.is_complete())?;
        all.set_item("doubt", found.doubt())?;
        Ok(all)
    }

    /// Critical curves and caustics, largest first: dictionaries of kind, closed, theta_arcsec and beta_arcsec.
    fn critical_curves<'py>(
        &self,
        py: Python<'py>,
        kwargs: &Bound<'py, PyAny>,
        half_width_arcsec: f64,
    ) -> PyResult<Bound<'py, PyList>> {
        let lens = self.build(py, kwargs, None)?.lens;
        let window = SkyWindow::about_axis(half_width_arcsec, lens.lens_centres_arcsec()).or_raise(py)?;
        let found = run(py, None, |monitor| CriticalCurves::of(lens.mapping(), &window, monitor))?;
        let all = PyList::empty(py);
        for curve in &found.curves {
            let own = PyDict::new(py);
            own.set_item("kind", curve.kind.name())?;
            own.set_item("closed", curve.closed)?;
            own.set_item("theta_arcsec", pairs(py, &curve.theta_arcsec)?)?;
            own.set_item("beta_arcsec", pairs(py, &curve.beta_arcsec)?)?;
            own.set_item("area_arcsec2", curve.area_arcsec2())?;
            all.append(own)?;
        }
        Ok(all)
    }

    /// Radius of the circle of mean convergence one about `centre`, arcsec.
    fn einstein_radius(
        &self,
        py: Python<'_>,
        kwargs: &Bound<'_, PyAny>,
        centre: Option<(f64, f64)>,
    ) -> PyResult<Option<f64>> {
        let lens = self.one_plane(py, kwargs, None, "the Einstein radius")?;
        let own = lens.lenses.iter().find_map(|own| own.centre_arcsec()).unwrap_or_default();
        let centre = centre.map_or(own, |(x, y)| [x, y]);
        if !centre.iter().all(|c| c.is_finite()) {
            return Err(input(py, "centre", format!("{centre:?}"), "two finite numbers"));
        }
        run(py, None, |_| Ok(einstein_radius_arcsec(&lens.lenses, centre)))
    }

    /// Where results differ from lenstronomy's on purpose.
    fn warnings(&self, py: Python<'_>, kwargs: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
        Ok(self.build(py, kwargs, None)?.warnings)
    }
}

impl Lens {
    /// The lens of these numbers; `only` are places among the profiles, a model of the line of sight not counted.
    fn build(
        &self,
        py: Python<'_>,
        kwargs: &Bound<'_, PyAny>,
        only: Option<Vec<usize>>,
    ) -> PyResult<LensModelFile> {
        let numbers = self.numbers(py, kwargs)?;
        let Some(only) = only else {
            let parts = LensModelParts { lens_model_list: &self.names, kwargs_lens: &numbers };
            return parts.build(&self.redshifts, &self.background).or_raise(py);
        };
        if matches!(self.redshifts, LensRedshifts::ManyPlanes { .. }) {
            return Err(input(py, "k", format!("{only:?}"), "left out with many lens planes"));
        }
        let is_profile = |name: &String| !name.starts_with("LOS");
        let profiles = self.names.iter().filter(|name| is_profile(name)).count();
        if let Some(beyond) = only.iter().find(|k| **k >= profiles) {
            return Err(input(py, "k", beyond, &format!("below {profiles}, the number of profiles")));
        }
        let mut count = 0;
        let (names, numbers): (Vec<String>, Vec<_>) = self
            .names
            .iter()
            .cloned()
            .zip(numbers)
            .filter(|(name, _)| {
                count += usize::from(is_profile(name));
                !is_profile(name) || only.contains(&(count - 1))
            })
            .unzip();
        let parts = LensModelParts { lens_model_list: &names, kwargs_lens: &numbers };
        parts.build(&self.redshifts, &self.background).or_raise(py)
    }

    fn one_plane(
        &self,
        py: Python<'_>,
        kwargs: &Bound<'_, PyAny>,
        only: Option<Vec<usize>>,
        what: &str,
    ) -> PyResult<TidalLens> {
        match self.build(py, kwargs, only)?.lens {
            LensOfFile::OnePlane(lens) => Ok(*lens),
            LensOfFile::ManyPlanes(_) => {
                Err(input(py, what, "that of many planes", "asked of one lens plane"))
            }
        }
    }

    /// The keyword arguments of every model as numbers.
    fn numbers(&self, py: Python<'_>, kwargs: &Bound<'_, PyAny>) -> PyResult<Vec<BTreeMap<String, f64>>> {
        let refused = |what: String, value: String, allowed: &str| Err(input(py, &what, value, allowed));
        let Ok(models) = kwargs.try_iter() else {
            return refused("kwargs".into(), kwargs.repr()?.to_string(), "a list of dictionaries");
        };
        let mut all = Vec::with_capacity(self.names.len());
        for (i, model) in models.enumerate() {
            let model = model?;
            let name = self.names.get(i).map_or("a model", String::as_str);
            let place = format!("of {name} (number {} of the list)", i + 1);
            let Ok(model) = model.cast::<PyDict>() else {
                return refused(format!("arguments {place}"), model.repr()?.to_string(), "a dictionary");
            };
            let mut numbers = BTreeMap::new();
            for (key, value) in model {
                let key: String = key.extract()?;
                let Ok(number) = value.extract::<f64>() else {
                    return refused(format!("{key} {place}"), value.repr()?.to_string(), "a number");
                };
                numbers.insert(key, number);
            }
            all.push(numbers);
        }
        Ok(all)
    }
}

/// The unit of an argument of a model, `arcsec`, `1/arcsec`, `rad` or empty; none for a name that the model does not have.
#[pyfunction]
pub fn lens_argument_unit(model: &str, argument: &str) -> Option<&'static str> {
    haloray::io::lens_argument_unit(model, argument)
}

/// A value for each of `n` points, side by side; the wish to stop is heard on the way.
fn by_chunks(n: usize, monitor: &dyn Monitor, at: impl Fn(usize) -> f64 + Sync) -> haloray::Result<Vec<f64>> {
    use rayon::prelude::*;
    if n <= FEW {
        return Ok((0..n).map(at).collect());
    }
    let checked = |i: usize| {
        if i.is_multiple_of(256) {
            monitor.check()?;
        }
        Ok(at(i))
    };
    (0..n).into_par_iter().map(checked).collect()
}

/// Few points at once and here, many on the pool.
fn few_or_many<T: Send>(
    py: Python<'_>,
    points: usize,
    work: impl FnOnce(&dyn Monitor) -> haloray::Result<T> + Send,
) -> PyResult<T> {
    if points <= FEW { work(&Silent).or_raise(py) } else { run(py, None, work) }
}
