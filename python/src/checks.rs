//! What only this side of the border can check of the other.

use std::hint::black_box;
use std::time::Instant;

use haloray::mapping::multiplane::{Accuracy, Field, LineOfSight, Sheets};
use haloray::mapping::{Mapping, Order};
use pyo3::prelude::*;

use crate::arrays::{Column, points};
use crate::haloes::Catalogue;
use crate::watch::run;

/// Names of the elementary functions in use here that are not haloray's own, bit by bit.
///
/// A shared library could be given those of the C library that the interpreter has loaded before it.
#[pyfunction]
pub fn foreign_functions() -> Vec<&'static str> {
    type Function = fn(f64) -> f64;
    let functions: [(&str, Function, Function); 10] = [
        ("exp", |x| (40.0 * x).exp(), |x| libm::exp(40.0 * x)),
        ("expm1", f64::exp_m1, libm::expm1),
        ("log", f64::ln, libm::log),
        ("log10", f64::log10, libm::log10),
        ("log1p", f64::ln_1p, libm::log1p),
        ("pow", |x| x.powf(black_box(3.7)), |x| libm::pow(x, 3.7)),
        ("sin", |x| (9.0 * x).sin(), |x| libm::sin(9.0 * x)),
        ("cos", |x| (9.0 * x).sin_cos().1, |x| libm::cos(9.0 * x)),
        ("atan2", |y| y.atan2(black_box(0.3)), |y| libm::atan2(y, 0.3)),
        ("tanh", f64::tanh, libm::tanh),
    ];
    let differs = |in_use: Function, own: Function| {
        let mut points = (1..20_000).map(|i| black_box(f64::from(i) * 4.9e-5));
        points.any(|x| in_use(x).to_bits() != own(x).to_bits())
    };
    functions.iter().filter(|(_, in_use, own)| differs(*in_use, *own)).map(|(name, ..)| *name).collect()
}

/// Seconds from columns in memory to β in memory on this side alone: what `tests/benches/adaptive.rs` times.
#[pyfunction]
pub fn seconds_of_rays(py: Python<'_>, haloes: &Catalogue, x: Column<'_>, y: Column<'_>) -> PyResult<f64> {
    let [x, y] = points(py, ["x_arcsec", "y_arcsec"], [&x, &y])?;
    let theta: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
    run(py, None, |monitor| {
        let start = Instant::now();
        let sight = LineOfSight::new(&haloes.haloes, &Sheets::OnAxis)?;
        let mapping =
            sight.observer_to_source().adaptive(Accuracy::default(), Field::around(&theta), theta.len());
        black_box(mapping.trace(&theta, Order::Position, monitor)?);
        Ok(start.elapsed().as_secs_f64())
    })
}
