//! What is seen through a mapping: lensed source and unlensed lens light.

use crate::error::Result;
use crate::mapping::{Mapping, Order};
use crate::monitor::Monitor;
use crate::profile::light::{LightProfile, Sersic};

/// Light in front of and behind a mapping.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Where each direction comes from.
    pub mapping: &'a dyn Mapping,
    /// Source light, in the source plane.
    pub source: &'a Sersic,
    /// Light of the lens galaxy, on the sky.
    pub lens_light: Option<&'a Sersic>,
}

impl Scene<'_> {
    /// Surface brightness seen in direction θ when the ray comes from β, flux per arcsec²; lensing conserves it.
    pub fn brightness(&self, theta_arcsec: [f64; 2], beta_arcsec: [f64; 2]) -> f64 {
        let [x, y] = theta_arcsec;
        self.source.surface_brightness(beta_arcsec[0], beta_arcsec[1])
            + self.lens_light.map_or(0.0, |light| light.surface_brightness(x, y))
    }

    /// Surface brightness in the directions θ, flux per arcsec².
    ///
    /// # Errors
    /// When `monitor`, which is told of every ray, cancels.
    pub fn surface_brightness(&self, theta_arcsec: &[[f64; 2]], monitor: &dyn Monitor) -> Result<Vec<f64>> {
        let rays = self.mapping.trace(theta_arcsec, Order::Position, monitor)?;
        let pairs = theta_arcsec.iter().zip(rays.beta_arcsec);
        Ok(pairs.map(|(theta, beta)| self.brightness(*theta, beta)).collect())
    }
}
