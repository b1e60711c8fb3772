//! A line of sight: rays through haloes between any two redshifts, tensors on the axis, maps.

use std::collections::BTreeMap;

use haloray::diagnostics::{Distortion, EffectiveLineOfSight, MapGrid, Tidal, TidalMaps};
use haloray::io::SHEET_COLUMN;
use haloray::mapping::Mapping;
use haloray::mapping::multiplane::{
    Accuracy, AdaptiveSegment, Field, LineOfSight, MainLens, Reference, Segment, Sheets,
};
use haloray::mapping::tidal::{Flexion, LineOfSightModel};
use haloray::profile::registry;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, order, points, square, trace};
use crate::config::AccuracyArgument;
use crate::errors::{OrRaise, input};
use crate::haloes::Catalogue;
use crate::watch::run;

/// Haloes sorted into planes.
#[pyclass(frozen, module = "haloray._haloray")]
pub struct Sight {
    pub sight: LineOfSight,
    z_source: f64,
}

/// A main lens on the way: its redshift, the name of its profile, and the profile's arguments.
type LensArgument = (f64, String, BTreeMap<String, f64>);

/// From where to where rays go, through what, and how accurately.
#[derive(FromPyObject)]
pub struct Way {
    z_from: Option<f64>,
    z_to: Option<f64>,
    lens: Option<LensArgument>,
    accuracy_arcsec: AccuracyArgument,
}

#[pymethods]
impl Sight {
    #[new]
    fn new(py: Python<'_>, haloes: &Catalogue, sheets: &str, reference: &str) -> PyResult<Self> {
        let own = &haloes.haloes;
        let sheets = match sheets {
            "on-axis" => Sheets::OnAxis,
            "on-ray" => Sheets::OnRay,
            "none" => Sheets::None,
            "mean-density" => {
                let column = own.extra.iter().find(|(name, _)| name == SHEET_COLUMN);
                let allowed = "of haloes that were drawn for it, which hold a column sheet_kappa";
                let missing = || input(py, "sheets", "mean-density", allowed);
                Sheets::Expected(column.ok_or_else(missing)?.1.clone())
            }
            other => {
                let allowed = "\"on-axis\", \"on-ray\", \"none\" or \"mean-density\"";
                return Err(input(py, "sheets", other, allowed));
            }
        };
        let reference = match reference {
            "bent" => Reference::Bent,
            "straight" => Reference::Straight,
            other => return Err(input(py, "reference", other, "\"bent\" or \"straight\"")),
        };
        let sight = run(py, None, |_| LineOfSight::along(reference, own, &sheets))?;
        Ok(Self { sight, z_source: own.z_source() })
    }

    /// Number of planes.
    fn __len__(&self) -> usize {
        self.sight.len()
    }

    /// Convergence that all sheets take away.
    fn sheet_convergence(&self) -> f64 {
        self.sight.sheet_convergence()
    }

    /// β and derivatives of rays, and how accurate they are.
    #[pyo3(signature = (x, y, way, order_number, progress=None))]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        way: Way,
        order_number: u8,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let order = order(py, order_number)?;
        let [x, y] = points(py, ["x_arcsec", "y_arcsec"], [&x, &y])?;
        let segment = self.segment(py, &way)?;
        let accuracy = way.accuracy_arcsec.resolve(py)?;
        let traced = run(py, progress.as_ref(), |monitor| {
            let _task = monitor.task("trace rays", Some(x.len() as u64));
            let mapping = segment.adaptive(accuracy, around(x, y), x.len());
            trace(&mapping, [x, y], order, monitor)
        })?;
        traced.into_python(py, order)
    }

    /// Arrival-time delays in days against the straight path to the same β.
    fn delay_days<'py>(
        &self,
        py: Python<'py>,
        x: Column<'py>,
        y: Column<'py>,
        way: Way,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let [x, y] = points(py, ["x_arcsec", "y_arcsec"], [&x, &y])?;
        let segment = self.segment(py, &way)?;
        let delays = run(py, None, |monitor| {
            /// Planes that are met by the rays of a chunk, between which the wish to stop is heard.
            const KICKS: usize = 400_000;
            let chunk = (KICKS / self.sight.len().max(1)).clamp(8, 4096);
            let mut all = Vec::with_capacity(x.len());
            for (x, y) in x.chunks(chunk).zip(y.chunks(chunk)) {
                monitor.check()?;
                let theta: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
                all.extend(segment.delay_days(&theta));
            }
            Ok(all)
        })?;
        Ok(PyArray1::from_vec(py, delays))
    }

    /// od, os, ds and LOS tensors and flexions on the axis, by lenstronomy's names.
    fn effective<'py>(&self, py: Python<'py>, z_lens: f64) -> PyResult<Bound<'py, PyDict>> {
        let effective = run(py, None, |_| EffectiveLineOfSight::of(&self.sight, z_lens))?;
        let all = PyDict::new(py);
        for (place, Distortion { tidal, .. }) in
            [("od", &effective.od), ("os", &effective.os), ("ds", &effective.ds)]
        {
            set_tidal(&all, place, tidal)?;
        }
        set_tidal(&all, "los", &effective.los)?;
        set_tidal(&all, "los_linear", &effective.los_linear)?;
        set_flexion(&all, "od", &effective.od.flexion())?;
        set_flexion(&all, "os", &effective.os.flexion())?;
        set_flexion(&all, "ds", &effective.ds.flexion())?;
        set_flexion(&all, "1ds", &effective.flexion_1ds)?;
        set_flexion(&all, "2ds", &effective.flexion_2ds)?;
        if let Some(LineOfSightModel::Flexion(minimal)) = effective.flexion_model().minimal() {
            set_tidal(&all, "los_flexion", &minimal.os)?;
            set_flexion(&all, "los", &minimal.flexion_os)?;
            set_flexion(&all, "1los", &minimal.flexion_1ds)?;
        }
        Ok(all)
    }

    /// Maps of κ, γ, ω, |F|, |G| and Δ, each (y, x), and the coordinate of their nodes.
    #[pyo3(signature = (points, half_width_arcsec, way, progress=None))]
    fn maps<'py>(
        &self,
        py: Python<'py>,
        points: usize,
        half_width_arcsec: f64,
        way: Way,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if !(2..=4096).contains(&points) {
            return Err(input(py, "points", points, "from 2 to 4096"));
        }
        if !(half_width_arcsec > 0.0 && half_width_arcsec.is_finite()) {
            return Err(input(py, "half_width_arcsec", half_width_arcsec, "positive and finite"));
        }
        let segment = self.segment(py, &way)?;
        let accuracy = way.accuracy_arcsec.resolve(py)?;
        let grid = MapGrid { points, half_width_arcsec };
        let maps = run(py, progress.as_ref(), |monitor| {
            let rays = points * points;
            let _task = monitor.task("maps of the distortions", Some(rays as u64));
            TidalMaps::of(&over_square(&segment, accuracy, half_width_arcsec, rays), grid, monitor)
        })?;
        let all = PyDict::new(py);
        for (name, unit, values) in maps.columns() {
            all.set_item(name, (unit, square(py, values.to_vec(), points)?))?;
        }
        let node = |i: usize| -half_width_arcsec + grid.step_arcsec() * i as f64;
        all.set_item("theta_arcsec", PyArray1::from_iter(py, (0..points).map(node)))?;
        Ok(all)
    }
}

impl Sight {
    fn segment(&self, py: Python<'_>, way: &Way) -> PyResult<Segment> {
        let Some((z, name, arguments)) = &way.lens else {
            let segment = match (way.z_from, way.z_to) {
                (None, None) => Ok(self.sight.observer_to_source()),
                (None, Some(to)) if to == self.z_source => Ok(self.sight.observer_to_source()),
                (None, Some(to)) => self.sight.observer_to(to),
                (Some(from), to) => self.sight.between(from, to.unwrap_or(self.z_source)),
            };
            return segment.or_raise(py);
        };
        if way.z_from.is_some() || way.z_to.is_some() {
            return Err(input(
                py,
                "lens",
                name,
                "left out between redshifts: it stands between observer and source",
            ));
        }
        let profile = registry::mass(name).or_raise(py)?;
        let known: Vec<&str> = profile.arguments().map(|own| own.name).collect();
        if let Some(given) = arguments.keys().find(|given| !known.contains(&given.as_str())) {
            let allowed = format!("one of {}", known.join(", "));
            return Err(input(py, &format!("argument of {name}"), given, &allowed));
        }
        for own in profile.arguments().filter(|own| own.default.is_none()) {
            if !arguments.contains_key(own.name) {
                return Err(input(py, &format!("argument {} of {name}", own.name), "missing", "a number"));
            }
        }
        let value =
            |own: &registry::Parameter| arguments.get(own.name).copied().or(own.default).unwrap_or(0.0);
        let profile = profile.build(value).or_raise(py)?;
        self.sight.through_lens(&MainLens { z: *z, profile }).or_raise(py)
    }
}

/// The smallest rectangle around the rays, as [`Field::around`] has it.
fn around(x: &[f64], y: &[f64]) -> Option<Field> {
    let ends = |column: &[f64]| {
        column.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
    };
    let [x, y] = [ends(x), ends(y)];
    Field::around(&[[x[0], y[0]], [x[1], y[1]]])
}

/// The segment as accurate as asked for, for rays out to `half_width_arcsec`.
fn over_square(
    segment: &Segment,
    accuracy: Accuracy,
    half_width_arcsec: f64,
    rays: usize,
) -> AdaptiveSegment {
    let field = Field { centre_arcsec: [0.0; 2], half_arcsec: [half_width_arcsec; 2] };
    segment.adaptive(accuracy, Some(field), rays)
}

fn set_tidal(all: &Bound<'_, PyDict>, place: &str, tidal: &Tidal) -> PyResult<()> {
    all.set_item(format!("kappa_{place}"), tidal.kappa)?;
    all.set_item(format!("gamma1_{place}"), tidal.gamma.re)?;
    all.set_item(format!("gamma2_{place}"), tidal.gamma.im)?;
    all.set_item(format!("omega_{place}"), tidal.omega)
}

fn set_flexion(all: &Bound<'_, PyDict>, place: &str, flexion: &Flexion) -> PyResult<()> {
    for (name, value) in
        [("F1", flexion.f.re), ("F2", flexion.f.im), ("G1", flexion.g.re), ("G2", flexion.g.im)]
    {
        all.set_item(format!("{name}_{place}"), value)?;
    }
    Ok(())
}
