//! Ensembles of sightlines, any range of them at a time.

use std::ops::Range;
use std::path::PathBuf;

use haloray::Error;
use haloray::ensemble::{
    EnsembleColumn, Level, Plan, SightlineStore, StoredStacks, assemble, run as compute, scalar_columns,
    stacks_of, tidal_columns,
};
use haloray::imaging::Psf;
use haloray::inference::model::ModelDescription;
use haloray::io::{SightlineColumn, SightlineTable, StackRows, StackSpec, TabledLens};
use haloray::mapping::tidal::LineOfSightKind;
use haloray::report::write_ensemble;
use numpy::ndarray::ArrayView3;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::config::Config;
use crate::errors::{OrRaise, input};
use crate::run::{provenance, psf, staged};
use crate::watch::run;

/// What an ensemble is to hold; computes any part of it.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct EnsemblePlan {
    plan: Plan,
    psf: Psf,
}

/// A lens: name, redshifts of lens and source, Einstein radius.
type LensArgument = (String, f64, f64, Option<f64>);

#[pymethods]
impl EnsemblePlan {
    #[new]
    fn new(
        py: Python<'_>,
        config: &Config,
        lenses: Vec<LensArgument>,
        level: &str,
        model: &str,
        smoothing_arcsec: Vec<f64>,
        first_and_number: (u64, u64),
    ) -> PyResult<Self> {
        let config = config.0.clone();
        if let Some(path) = &config.haloes.catalogue {
            return Err(input(
                py,
                "haloes.catalogue",
                path.display(),
                "left out: an ensemble draws its haloes",
            ));
        }
        if config.haloes.lightcone.is_some() {
            let allowed = "left out: `haloray ensemble` reads light cones";
            return Err(input(py, "haloes.lightcone", "given", allowed));
        }
        let level: Level = level.parse().or_raise(py)?;
        let description = ModelDescription::built_in(model).or_raise(py)?;
        if level == Level::Fits && description.line_of_sight.model == LineOfSightKind::Haloes {
            return Err(input(py, "model", model, "one with gamma1_los and gamma2_los"));
        }
        let lens = |(name, z_lens, z_source, einstein_radius_arcsec)| TabledLens {
            name,
            z_lens,
            z_source,
            einstein_radius_arcsec,
        };
        let lenses = lenses.into_iter().map(lens).collect();
        let psf = psf(&config).or_raise(py)?;
        let (first, number) = first_and_number;
        let plan = Plan { config, lenses, level, model: model.into(), smoothing_arcsec, first, number };
        plan.check().or_raise(py)?;
        Ok(Self { plan, psf })
    }

    /// Name, unit and description of the columns seen through all haloes, and of those seen through the haloes in the tidal regime.
    fn columns(&self) -> [Vec<(String, &'static str, String)>; 2] {
        let words = |own: EnsembleColumn| (own.name, own.unit, own.description);
        [scalar_columns(&self.plan), tidal_columns(&self.plan)]
            .map(|all| all.into_iter().map(words).collect())
    }

    /// Group, name, unit, description, shape and step in arcsec of each map or image.
    #[allow(clippy::type_complexity, reason = "a row of a table")]
    fn stacks(&self) -> Vec<(&'static str, String, &'static str, String, [usize; 2], f64)> {
        let words =
            |own: StackSpec| (own.group, own.name, own.unit, own.description, own.shape, own.step_arcsec);
        stacks_of(&self.plan.config, self.plan.level).into_iter().map(words).collect()
    }

    /// Computes sightlines `start..end`, kept in `folder` meanwhile: columns (n, …), maps and images (n, y, x), failures.
    #[pyo3(signature = (start, end, folder, progress=None))]
    fn compute<'py>(
        &self,
        py: Python<'py>,
        start: u64,
        end: u64,
        folder: PathBuf,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (plan, whole) = (&self.plan, self.plan.numbers());
        if start > end || start < whole.start || end > whole.end {
            let allowed = format!("within {}..{}", whole.start, whole.end);
            return Err(input(py, "range of sightlines", format!("{start}..{end}"), &allowed));
        }
        let numbers = start..end;
        let (table, stacks) = run(py, progress.as_ref(), |monitor| {
            let (store, _) = SightlineStore::open(&folder.join("sightlines"), "", numbers.clone())?;
            compute(plan, numbers.clone(), &self.psf, &store, monitor)?;
            let provenance = haloray::io::Provenance::new(Some(plan.config.seed), "");
            let table = assemble(plan, numbers.clone(), &provenance, &store)?;
            let specs = stacks_of(&plan.config, plan.level);
            let stacks = all_pixels(&StoredStacks { store: &store, specs: &specs }, specs.len(), &numbers)?;
            store.remove();
            Ok((table, stacks))
        })?;
        let found = PyDict::new(py);
        found.set_item("all_haloes", columns(py, &table.all_haloes)?)?;
        found.set_item("tidal_haloes", columns(py, &table.tidal_haloes)?)?;
        let specs = stacks_of(&plan.config, plan.level);
        let shaped = |(pixels, spec): (Vec<f32>, &StackSpec)| {
            PyArray1::from_vec(py, pixels).reshape([table.numbers.len(), spec.shape[0], spec.shape[1]])
        };
        let stacks: Vec<_> = stacks.into_iter().zip(&specs).map(shaped).collect::<PyResult<_>>()?;
        found.set_item("stacks", stacks)?;
        found.set_item("failures", table.failures)?;
        Ok(found)
    }

    /// Writes the folder of `haloray ensemble` from everything that was computed; returns complaints.
    #[allow(clippy::too_many_arguments, reason = "each has its name in Python")]
    fn write(
        &self,
        py: Python<'_>,
        all_haloes: PyReadonlyArray2<'_, f64>,
        tidal_haloes: PyReadonlyArray2<'_, f64>,
        stacks: Vec<PyReadonlyArray3<'_, f32>>,
        failures: Vec<(u64, String)>,
        output: PathBuf,
        overwrite: bool,
    ) -> PyResult<Vec<String>> {
        let plan = &self.plan;
        let specs = stacks_of(&plan.config, plan.level);
        let rows = plan.number as usize;
        let table = SightlineTable {
            provenance: provenance(&Config(plan.config.clone()), 0).or_raise(py)?,
            level: plan.level.to_string(),
            model: if plan.level == Level::Fits { plan.model.clone() } else { String::new() },
            inputs: plan.inputs().or_raise(py)?,
            whole: plan.numbers(),
            lenses: plan.lenses.clone(),
            numbers: plan.numbers().collect(),
            all_haloes: filled(py, scalar_columns(plan), &all_haloes, rows)?,
            tidal_haloes: filled(py, tidal_columns(plan), &tidal_haloes, rows)?,
            failures,
        };
        let fits = stacks.len() == specs.len()
            && stacks
                .iter()
                .zip(&specs)
                .all(|(stack, spec)| stack.as_array().dim() == (rows, spec.shape[0], spec.shape[1]));
        if !fits {
            return Err(input(py, "maps and images", "of another shape", "those of the ensemble"));
        }
        let views =
            ArrayStacks { first: plan.first, stacks: stacks.iter().map(|own| own.as_array()).collect() };
        run(py, None, |_| {
            let names = [haloray::report::SIGHTLINES_FILE, "summary.json", "config.toml"];
            let staging = staged(&output, &names, overwrite)?;
            write_ensemble(&table, &specs, &views, &staging)?;
            let complaints = staging.complaints();
            staging.commit()?;
            Ok(complaints)
        })
    }
}

/// Maps and images in memory.
struct ArrayStacks<'a> {
    first: u64,
    stacks: Vec<ArrayView3<'a, f32>>,
}

impl StackRows for ArrayStacks<'_> {
    fn pixels(&self, stack: usize, number: u64) -> haloray::Result<Vec<f32>> {
        let row = (number - self.first) as usize;
        Ok(self.stacks[stack]
            .outer_iter()
            .nth(row)
            .map_or_else(Vec::new, |own| own.iter().copied().collect()))
    }
}

fn all_pixels(rows: &dyn StackRows, stacks: usize, numbers: &Range<u64>) -> Result<Vec<Vec<f32>>, Error> {
    let of = |stack| {
        let mut all = Vec::new();
        numbers.clone().try_for_each(|number| rows.pixels(stack, number).map(|own| all.extend(own)))?;
        Ok(all)
    };
    (0..stacks).map(of).collect()
}

/// The values of columns as an array (columns, n).
fn columns<'py>(py: Python<'py>, all: &[SightlineColumn]) -> PyResult<Bound<'py, PyAny>> {
    let rows = all.first().map_or(0, |column| column.values.len());
    let values: Vec<f64> = all.iter().flat_map(|column| column.values.iter().copied()).collect();
    Ok(PyArray1::from_vec(py, values).reshape([all.len(), rows])?.into_any())
}

fn filled(
    py: Python<'_>,
    columns: Vec<EnsembleColumn>,
    values: &PyReadonlyArray2<'_, f64>,
    rows: usize,
) -> PyResult<Vec<SightlineColumn>> {
    let values = values.as_array();
    if values.dim().0 != columns.len() || (values.dim().0 > 0 && values.dim().1 != rows) {
        let allowed = format!("({}, {rows})", columns.len());
        return Err(input(py, "shape of the columns", format!("{:?}", values.dim()), &allowed));
    }
    let column = |(own, values): (EnsembleColumn, numpy::ndarray::ArrayView1<'_, f64>)| SightlineColumn {
        name: own.name,
        unit: own.unit.into(),
        description: own.description,
        values: values.to_vec(),
    };
    Ok(columns.into_iter().zip(values.outer_iter()).map(column).collect())
}
