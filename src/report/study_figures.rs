//! The figures of the studies of many sightlines and of the shear cut.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::pipeline::{CutRow, ImageResidual, TidalResidual, rms};
use crate::plot::Figure;
use crate::plot::figures::{CutData, GridData, TidalResidualsData, cut, tidal_residuals};

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
    let chi_squared = |pick: &dyn Fn(&TidalResidual) -> &[f64]| -> Vec<f64> {
        rows.iter().map(|row| ImageResidual::chi_squared(pick(row))).collect()
    };
    Ok(tidal_residuals(&TidalResidualsData {
        tidal: of_rays(&first.tidal_arcsec),
        flexion: of_rays(&first.flexion_arcsec),
        tidal_image: of_pixels(&image.tidal_over_noise),
        flexion_image: of_pixels(&image.flexion_over_noise),
        tidal_chi_squared: &chi_squared(&|row| &row.image.tidal_over_noise),
        flexion_chi_squared: &chi_squared(&|row| &row.image.flexion_over_noise),
        tidal_rms_arcsec: &rows.iter().map(|row| rms(&row.tidal_arcsec)).collect::<Vec<_>>(),
        flexion_rms_arcsec: &rows.iter().map(|row| rms(&row.flexion_arcsec)).collect::<Vec<_>>(),
        einstein_radius_arcsec: config.lens.einstein_radius_arcsec,
    }))
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
    cut(&CutData {
        min_point_shear: &rows.iter().map(|row| row.min_point_shear).collect::<Vec<_>>(),
        kappa: &change(&["kappa_os"]),
        gamma: &change(&["gamma1_os", "gamma2_os"]),
        f_per_arcsec: &change(&["F1_os_per_arcsec", "F2_os_per_arcsec"]),
        delta: &change(&["delta_tot"]),
        image_largest: &rows.iter().map(pixels).collect::<Vec<_>>(),
        image_chi_squared: &rows.iter().map(CutRow::image_chi_squared).collect::<Vec<_>>(),
    })
}
