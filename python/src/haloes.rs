//! Halo catalogues: columns that numpy sees where they lie, and the draw that makes them.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use haloray::config::SheetModel;
use haloray::cosmology::Background;
use haloray::diagnostics::HaloTidal;
use haloray::halo::{HaloCatalogue, HaloMasses, doubts};
use haloray::io::{Provenance, SHEET_COLUMN, read_haloes, read_line_of_sight, write_haloes};
use haloray::pipeline;
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, numbers};
use crate::config::{Config, parameters, reference_name, sheets_name};
use crate::errors::{OrRaise, input, redshift};
use crate::watch::run;

/// Haloes that nothing changes any more; arrays may lie on them.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct Catalogue {
    pub haloes: Arc<HaloCatalogue>,
}

/// The columns of haloray, in the order of its tables.
const COLUMNS: [&str; 9] = [
    "z",
    "chi_cmpc",
    "theta_x_arcsec",
    "theta_y_arcsec",
    "r_s_arcsec",
    "alpha_rs_arcsec",
    "r_trunc_arcsec",
    "m200c_msun",
    "c200c",
];

impl Catalogue {
    pub fn new(haloes: HaloCatalogue) -> Self {
        Self { haloes: Arc::new(haloes) }
    }

    fn numbers(&self, name: &str) -> Option<&Vec<f64>> {
        let own = &self.haloes;
        match name {
            "z" => Some(&own.z),
            "chi_cmpc" => Some(&own.chi_cmpc),
            "theta_x_arcsec" => Some(&own.theta_x_arcsec),
            "theta_y_arcsec" => Some(&own.theta_y_arcsec),
            "r_s_arcsec" => Some(&own.r_s_arcsec),
            "alpha_rs_arcsec" => Some(&own.alpha_rs_arcsec),
            "r_trunc_arcsec" => own.r_trunc_arcsec.as_ref(),
            "m200c_msun" => own.m200c_msun.as_ref(),
            "c200c" => own.c200c.as_ref(),
            other => own.extra.iter().find(|(name, _)| name == other).map(|(_, values)| values),
        }
    }
}

#[pymethods]
impl Catalogue {
    /// Builds a catalogue from columns by name; `pairs` of the other names are a user's own.
    #[staticmethod]
    fn of_columns(
        py: Python<'_>,
        z_source: f64,
        cosmology: (f64, f64),
        columns: BTreeMap<String, Column<'_>>,
        text_columns: BTreeMap<String, Vec<String>>,
    ) -> PyResult<Self> {
        redshift(py, "z_source", z_source)?;
        let background = Background::new(cosmology.0, cosmology.1).or_raise(py)?;
        let optional = |name: &str| -> PyResult<Option<Vec<f64>>> {
            columns.get(name).map(|column| Ok(numbers(py, name, column)?.to_vec())).transpose()
        };
        let required = |name: &str| {
            let missing = || input(py, &format!("column {name}"), "missing", "given");
            optional(name)?.ok_or_else(missing)
        };
        let by_angles = columns.contains_key("r_s_arcsec") || columns.contains_key("alpha_rs_arcsec");
        let masses = match by_angles {
            true => HaloMasses::Angles {
                r_s_arcsec: required("r_s_arcsec")?,
                alpha_rs_arcsec: required("alpha_rs_arcsec")?,
            },
            false => HaloMasses::Physical { m200c_msun: required("m200c_msun")?, c200c: required("c200c")? },
        };
        let theta = [required("theta_x_arcsec")?, required("theta_y_arcsec")?];
        let (z, truncations) = (required("z")?, optional("r_trunc_arcsec")?);
        let built = HaloCatalogue::new(z_source, &background, z, theta, masses);
        let mut haloes = built.map_err(haloray::Error::from).or_raise(py)?;
        let rows = haloes.len();
        let own_length = |name: &str, length: usize| match length == rows {
            true => Ok(()),
            false => {
                Err(input(py, &format!("length of column {name}"), length, &format!("{rows}, as that of z")))
            }
        };
        if let Some(row) = truncations.iter().flatten().position(|r| r.is_nan() || *r <= 0.0) {
            let what = format!("r_trunc_arcsec of halo {}", row + 1);
            return Err(input(
                py,
                &what,
                truncations.iter().flatten().nth(row).copied().unwrap_or(f64::NAN),
                "positive, infinite without truncation",
            ));
        }
        haloes.r_trunc_arcsec = truncations;
        if by_angles {
            (haloes.m200c_msun, haloes.c200c) = (optional("m200c_msun")?, optional("c200c")?);
        }
        for (name, column) in &columns {
            own_length(name, column.as_array().len())?;
            if !COLUMNS.contains(&name.as_str()) {
                haloes.extra.push((name.clone(), numbers(py, name, column)?.to_vec()));
            }
        }
        for (name, column) in text_columns {
            own_length(&name, column.len())?;
            haloes.extra_text.push((name, column));
        }
        if let (true, Some(median)) = (by_angles, haloes.angles_against_masses()) {
            let what = "median of alpha_rs_arcsec over that of m200c_msun and c200c";
            let allowed = format!(
                "1: the angles were reduced to another source than one at z = {z_source}, or in another cosmology; leave \
                 out either r_s_arcsec, alpha_rs_arcsec or m200c_msun, c200c"
            );
            return Err(input(py, what, format!("{median:.4}"), &allowed));
        }
        Ok(Self::new(haloes))
    }

    /// Reads a halo table; with the sheets and the reference that it was made for, where it says so.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        z_source: f64,
        cosmology: (f64, f64),
    ) -> PyResult<(Self, Option<(&'static str, &'static str)>)> {
        redshift(py, "z_source", z_source)?;
        let background = Background::new(cosmology.0, cosmology.1).or_raise(py)?;
        let (haloes, made_for) =
            run(py, None, |_| Ok((read_haloes(&path, z_source, &background)?, read_line_of_sight(&path))))?;
        let made_for = made_for
            .map(|los| (sheets_name(los.sheets, los.is_beside_axis()), reference_name(los.reference)));
        Ok((Self::new(haloes), made_for))
    }

    /// Writes the table: .csv, .h5 or .fits.
    fn write(&self, py: Python<'_>, path: PathBuf, seed: Option<u64>, config_toml: String) -> PyResult<()> {
        let provenance = Provenance::new(seed, config_toml);
        run(py, None, |_| write_haloes(&self.haloes, &path, &provenance))
    }

    /// Number of haloes.
    fn __len__(&self) -> usize {
        self.haloes.len()
    }

    #[getter]
    fn z_source(&self) -> f64 {
        self.haloes.z_source()
    }

    /// (H0 in km/s/Mpc, Ωm).
    #[getter]
    fn cosmology(&self) -> (f64, f64) {
        parameters(self.haloes.background())
    }

    /// Names of the columns of numbers.
    fn names(&self) -> Vec<String> {
        let known = COLUMNS.iter().filter(|name| self.numbers(name).is_some()).map(|name| name.to_string());
        known.chain(self.haloes.extra.iter().map(|(name, _)| name.clone())).collect()
    }

    /// What of the haloes looks as if something else were meant, in words.
    fn doubts(&self) -> Vec<String> {
        doubts(&self.haloes)
    }

    /// The columns of text.
    fn text_columns(&self) -> BTreeMap<String, Vec<String>> {
        self.haloes.extra_text.iter().cloned().collect()
    }

    /// A column of numbers: a read-only array on this catalogue's memory.
    fn column<'py>(slf: Bound<'py, Self>, name: &str) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let Some(values) = slf.get().numbers(name) else { return Ok(None) };
        let view = ArrayView1::from(values.as_slice());
        #[allow(unsafe_code, reason = "numpy reads memory that is not its own")]
        // SAFETY: the array keeps the catalogue alive, whose columns nothing moves or changes; it is made read-only at once.
        let array = unsafe { PyArray1::borrow_from_array(&view, slf.clone().into_any()) };
        Ok(Some((*array.readwrite().make_nonwriteable()).clone()))
    }

    /// The haloes at these places, in that order.
    fn at(&self, places: Vec<usize>) -> Self {
        Self::new(self.haloes.at(&places))
    }

    /// κ, γ1, γ2, |F|, |G| and Δ that each halo causes alone on the axis.
    fn effects<'py>(&self, py: Python<'py>, theta_e_arcsec: f64) -> PyResult<Bound<'py, PyDict>> {
        if !(theta_e_arcsec > 0.0 && theta_e_arcsec.is_finite()) {
            return Err(input(py, "theta_e_arcsec", theta_e_arcsec, "positive and finite"));
        }
        let all = run(py, None, |_| HaloTidal::along(&self.haloes, theta_e_arcsec, |_| [0.0; 2]))?;
        let columns = PyDict::new(py);
        columns.set_item("gamma1", PyArray1::from_iter(py, all.gamma.iter().map(|g| g.re)))?;
        columns.set_item("gamma2", PyArray1::from_iter(py, all.gamma.iter().map(|g| g.im)))?;
        columns.set_item("abs_f", PyArray1::from_iter(py, all.f_per_arcsec.iter().map(|f| f.norm())))?;
        columns.set_item("abs_g", PyArray1::from_iter(py, all.g_per_arcsec.iter().map(|g| g.norm())))?;
        columns.set_item("kappa", PyArray1::from_vec(py, all.kappa))?;
        columns.set_item("delta", PyArray1::from_vec(py, all.delta))?;
        Ok(columns)
    }
}

/// Draws the haloes of a configuration, or takes those of `imported`; mean-density sheets are a column of their own.
#[pyfunction]
#[pyo3(signature = (config, imported=None, sightline=0, progress=None))]
pub fn populate(
    py: Python<'_>,
    config: &Config,
    imported: Option<&Catalogue>,
    sightline: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Catalogue> {
    let (config, imported) = (&config.0, imported.map(|own| (*own.haloes).clone()));
    let haloes = run(py, progress.as_ref(), |monitor| {
        let imported = match (&imported, &config.haloes.catalogue) {
            (None, Some(path)) => Some(read_haloes(path, config.line_of_sight.z_source, &config.cosmology)?),
            _ => imported,
        };
        let drawn = pipeline::populate(config, imported, sightline, monitor)?;
        with_sheets(config, drawn)
    })?;
    Ok(Catalogue::new(haloes))
}

/// The catalogue, with the sheets that only its population can tell.
fn with_sheets(config: &haloray::config::Config, drawn: pipeline::Haloes) -> haloray::Result<HaloCatalogue> {
    if config.line_of_sight.sheets != SheetModel::MeanDensity {
        return Ok(drawn.catalogue);
    }
    let sheets = pipeline::sheets_of(config, &drawn, &drawn.catalogue, pipeline::Selection::All)?;
    let mut haloes = drawn.catalogue;
    if let haloray::mapping::multiplane::Sheets::Expected(kappa) = sheets {
        haloes.extra.push((SHEET_COLUMN.into(), kappa));
    }
    Ok(haloes)
}
