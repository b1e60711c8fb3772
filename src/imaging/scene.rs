//! What is seen through a mapping: lensed source and unlensed lens light.

use crate::mapping::{Mapping, Order};
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
    /// Surface brightness in the directions θ, flux per arcsec²; lensing conserves it.
    pub fn surface_brightness(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let rays = self.mapping.map(theta_arcsec, Order::Position);
        theta_arcsec
            .iter()
            .zip(&rays.beta_arcsec)
            .map(|(theta, beta)| {
                self.source.surface_brightness(beta[0], beta[1])
                    + self.lens_light.map_or(0.0, |light| light.surface_brightness(theta[0], theta[1]))
            })
            .collect()
    }
}
