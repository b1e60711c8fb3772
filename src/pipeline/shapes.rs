//! Shapes of lens and source.

use rand::RngExt;

use crate::config::Config;
use crate::numerics::random::{Stage, stream};

/// Ellipticities of lens and source, as configured or drawn from the seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensAndSource {
    /// (e1, e2) of the main lens.
    pub lens_ellipticity: [f64; 2],
    /// (e1, e2) of the source.
    pub source_ellipticity: [f64; 2],
}

impl LensAndSource {
    /// Takes the configured ellipticities; those left out are drawn with axis ratio uniform in (0.7, 1) and
    /// random orientation (the paper draws them at random and does not say how).
    pub fn resolve(config: &Config, realisation: u64) -> Self {
        let mut rng = stream(config.seed, realisation, Stage::LensAndSource, 0);
        let mut draw = || {
            let q = 0.7 + 0.3 * rng.random::<f64>();
            let (sin, cos) = (2.0 * std::f64::consts::PI * rng.random::<f64>()).sin_cos();
            let e = (1.0 - q) / (1.0 + q);
            [e * cos, e * sin]
        };
        let (lens, source) = (draw(), draw());
        let given = |e1: Option<f64>, e2: Option<f64>| Some([e1?, e2?]);
        Self {
            lens_ellipticity: given(config.lens.e1, config.lens.e2).unwrap_or(lens),
            source_ellipticity: given(config.source.e1, config.source.e2).unwrap_or(source),
        }
    }
}
