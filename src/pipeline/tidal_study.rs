//! How well a tidal or flexion model stands for a cone of haloes: the residual in β over the image.

use super::haloes::populate;
use super::progress::{Progress, Silent};
use super::view::line_of_sight;
use crate::config::Config;
use crate::diagnostics::{EffectiveLineOfSight, HaloTidal, MapGrid};
use crate::error::Result;
use crate::mapping::multiplane::MainLens;
use crate::mapping::tidal::{LineOfSightModel, TidalLens};
use crate::mapping::{Mapping, Order};
use crate::profile::mass::{Epl, MassModel};

/// Residuals |β_traced − β_model| of one sightline on a grid, arcsec; rays too near the lens centre are not a number.
#[derive(Debug, Clone, PartialEq)]
pub struct TidalResidual {
    /// Number of the sightline (realisation of the seed).
    pub sightline: u64,
    /// Haloes traced.
    pub number_of_haloes: usize,
    /// Shear on the axis, γ_LOS.
    pub gamma_los: nalgebra::Complex<f64>,
    /// The grid.
    pub grid: MapGrid,
    /// Residual of the full tidal model.
    pub tidal_arcsec: Vec<f64>,
    /// Residual of the flexion model.
    pub flexion_arcsec: Vec<f64>,
}

/// Rays within this fraction of the Einstein radius are left out: the deflection of a steep lens diverges there,
/// and no image of the source is seen there.
const INNER_RADIUS_OVER_EINSTEIN_RADIUS: f64 = 0.4;

/// Traces sightline `sightline` of the configuration with its main lens and compares with its effective models.
///
/// The models know the od, os, ds tensors (and flexions) of the axis ray, nothing is fitted: both sides measure θ and
/// β from the axis ray, so no translation or source transformation is needed. `tidal_only` leaves out the haloes of
/// Δ_h at or above the threshold.
///
/// # Errors
/// As [`populate`] and the profile of the lens.
pub fn tidal_residual(config: &Config, sightline: u64, tidal_only: bool) -> Result<TidalResidual> {
    let mut haloes = populate(config, None, sightline, &Silent)?;
    if tidal_only {
        let within = HaloTidal::of(&haloes.catalogue, config.diagnostics.theta_e_arcsec)?
            .within(config.diagnostics.delta_threshold);
        haloes.catalogue = haloes.catalogue.select(&within);
    }
    let sight = line_of_sight(config, &haloes, &haloes.catalogue)?;
    let z_lens = config.line_of_sight.z_lens;
    let axis = |mapping: &dyn Mapping| mapping.map(&[[0.0, 0.0]], Order::Position).beta_arcsec[0];
    let (lens_centre, source_centre) = (axis(&sight.observer_to(z_lens)?), axis(&sight.observer_to_source()));
    let lens = |centre| Epl::new(config.lens.einstein_radius_arcsec, config.lens.slope, [0.0, 0.0], centre);
    let main_lens = MainLens { z: z_lens, profile: MassModel::Epl(lens(lens_centre)?) };
    let theta = config.maps.theta_arcsec();
    let traced = sight.through_lens(&main_lens)?.map(&theta, Order::Position).beta_arcsec;
    let effective = EffectiveLineOfSight::of(&sight, z_lens)?;
    let model_lens = MassModel::Epl(lens([0.0, 0.0])?);
    let residual = |model: LineOfSightModel| -> Vec<f64> {
        let mapping =
            TidalLens { model, lenses: vec![model_lens.clone()], time_delay_distance_mpc: f64::NAN };
        let inner = INNER_RADIUS_OVER_EINSTEIN_RADIUS * config.lens.einstein_radius_arcsec;
        let beta = mapping.map(&theta, Order::Position).beta_arcsec;
        (0..theta.len())
            .map(|i| {
                let difference = |c: usize| traced[i][c] - source_centre[c] - beta[i][c];
                let seen = theta[i][0].hypot(theta[i][1]) >= inner;
                if seen { difference(0).hypot(difference(1)) } else { f64::NAN }
            })
            .collect()
    };
    Ok(TidalResidual {
        sightline,
        number_of_haloes: sight.len(),
        gamma_los: effective.los.gamma,
        grid: config.maps,
        tidal_arcsec: residual(effective.tidal_model()),
        flexion_arcsec: residual(effective.flexion_model()),
    })
}

/// Residuals of `n` sightlines, in order.
///
/// # Errors
/// As [`tidal_residual`].
pub fn tidal_study(
    config: &Config,
    n: u64,
    tidal_only: bool,
    progress: &dyn Progress,
) -> Result<Vec<TidalResidual>> {
    progress.begin("tidal and flexion residuals", Some(n));
    let rows = (0..n)
        .map(|sightline| {
            let row = tidal_residual(config, sightline, tidal_only);
            progress.advance(1);
            row
        })
        .collect();
    progress.end();
    rows
}

/// Root mean square of the numbers among `values`.
pub fn rms(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / count).sqrt()
}
