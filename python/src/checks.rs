//! What only this side of the border can check of the other.

use std::hint::black_box;

use pyo3::prelude::*;

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
