//! The figures of the studies of many sightlines and of the shear cut.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::pipeline::{CutRow, DEFINITIONS, ImageResidual, TidalResidual, WhichShear, rms};
use crate::plot::Figure;
use crate::plot::figures::{GridData, ModelResiduals, cut, deviations, tidal_residuals};

/// What the tidal and flexion models leave: the maps of the first sightline and the rms of all.
///
/// # Errors
/// When there is no sightline.
pub fn tidal_residual_figure(config: &Config, rows: &[TidalResidual]) -> Result<Figure> {
    let first = rows.first().ok_or_else(|| Error::out_of_range("number of sightlines", 0, "at least 1"))?;
    let (rays, image) = (&first.grid, &first.image);
    let half_width_arcsec = rays.half_width_arcsec + 0.5 * rays.step_arcsec();
    let of_rays = |values| GridData::square(values, rays.points, half_width_arcsec);
    let of_pixels = |values| GridData::square(values, image.grid.pixels(), image.grid.half_width_arcsec());
    type Pick = fn(&TidalResidual) -> &[f64];
    let residuals = |rays: Pick, image: Pick| ModelResiduals {
        rays: of_rays(rays(first)),
        image: of_pixels(image(first)),
        chi_squared: rows.iter().map(|row| ImageResidual::chi_squared(image(row))).collect(),
        rms_arcsec: rows.iter().map(|row| rms(rays(row))).collect(),
    };
    let models = [
        residuals(|row| &row.tidal_arcsec, |row| &row.image.tidal_over_noise),
        residuals(|row| &row.flexion_arcsec, |row| &row.image.flexion_over_noise),
    ];
    Ok(tidal_residuals(&models, config.lens.einstein_radius_arcsec))
}

/// What the shear cut changes, against the loosest cut of the study.
pub fn cut_figure(rows: &[CutRow]) -> Figure {
    let value = |row: &CutRow, name: &str| row.view.quantities().get(name);
    let last = rows.last();
    let change = |names: &[&str]| -> Vec<f64> {
        let of = |row: &CutRow, last: &CutRow| {
            names.iter().map(|name| (value(row, name) - value(last, name)).powi(2)).sum::<f64>().sqrt()
        };
        rows.iter().map(|row| last.map_or(f64::NAN, |last| of(row, last))).collect()
    };
    let pixels = |row: &CutRow| row.image_over_noise.iter().map(|v| v.abs()).fold(0.0, f64::max);
    let column = |value: &dyn Fn(&CutRow) -> f64| -> Vec<f64> { rows.iter().map(value).collect() };
    let tensors = [
        change(&["kappa_os"]),
        change(&["gamma1_os", "gamma2_os"]),
        change(&["F1_os_per_arcsec", "F2_os_per_arcsec"]),
        change(&["delta_tot"]),
    ];
    let image = [column(&pixels), column(&CutRow::image_chi_squared)];
    cut(
        &column(&|row| row.min_point_shear),
        tensors.each_ref().map(Vec::as_slice),
        image.each_ref().map(Vec::as_slice),
    )
}

/// How far the shears of fits lie from each definition.
pub fn which_shear_figure(rows: &[WhichShear]) -> Figure {
    let sigma = |i: usize| rows.iter().map(|row| row.deviation(i)).collect();
    let sets: Vec<(String, Vec<f64>)> =
        DEFINITIONS.iter().enumerate().map(|(i, name)| (name.replace('_', " "), sigma(i))).collect();
    deviations(&sets)
}
