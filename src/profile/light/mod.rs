//! Light profiles: surface brightness as a function of source-plane or sky angle.

mod sersic;

pub use sersic::{B_N_SLOPE, LENS_LIGHTS, SOURCES, Sersic, b_n};

/// A surface-brightness distribution.
pub trait LightProfile: Sync {
    /// Surface brightness at an angle, in flux units per arcsec².
    fn surface_brightness(&self, x_arcsec: f64, y_arcsec: f64) -> f64;
}
