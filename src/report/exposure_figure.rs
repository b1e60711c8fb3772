//! The figure of one exposure.

use super::curve_figure::lay_over;
use crate::diagnostics::CriticalCurves;
use crate::imaging::Exposure;
use crate::plot::figures::{GridData, image_pair};
use crate::plot::{Colour, Figure};

/// One exposure with and without noise, and critical curves and caustics over it where there are any.
pub fn exposure_figure(
    exposure: &Exposure,
    background_rms_e_s: f64,
    curves: Option<&CriticalCurves>,
) -> Figure {
    let sky = exposure.grid;
    let grid = |values| GridData::square(values, sky.pixels(), sky.half_width_arcsec());
    let (noise_free, noisy) = (grid(&exposure.noise_free_e_s), grid(&exposure.noisy_e_s));
    let mut figure = image_pair(noise_free, noisy, background_rms_e_s);
    if let Some(curves) = curves {
        figure.panels.iter_mut().for_each(|panel| lay_over(panel, curves, Colour::WHITE));
    }
    figure
}
