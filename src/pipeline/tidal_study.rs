//! How well a tidal or flexion model stands for a cone of haloes: the residual in β and in the image.

use serde::{Deserialize, Serialize};

use super::haloes::line_of_sight_of;
use super::matter::Selection;
use super::rows::RowStore;
use super::sightlines::populate;
use crate::config::Config;
use crate::diagnostics::{EffectiveLineOfSight, MapGrid};
use crate::error::Result;
use crate::imaging::{Psf, Scene, SkyGrid, expose};
use crate::mapping::multiplane::MainLens;
use crate::mapping::tidal::{LineOfSightModel, TidalLens};
use crate::mapping::{Mapping, Order};
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::{Stage, StreamName};
use crate::profile::light::Sersic;
use crate::profile::mass::{Epl, MassModel};

/// Residuals |β_traced − β_model| of one sightline on a grid, arcsec; rays too near the lens centre are not a number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// The noise-free image through haloes and lens.
    pub image: ImageResidual,
}

/// What the models leave of the noise-free image of the configured source (no lens light), pixel by pixel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageResidual {
    /// The grid of the image.
    pub grid: SkyGrid,
    /// Image through the traced cone, e⁻/s.
    pub traced_e_s: Vec<f64>,
    /// (traced − tidal model)/σ, σ² = background² + flux/exposure time.
    pub tidal_over_noise: Vec<f64>,
    /// (traced − flexion model)/σ.
    pub flexion_over_noise: Vec<f64>,
}

impl ImageResidual {
    /// χ² of a difference image: the sum of squares over all pixels, what a fit would gain at most from knowing better.
    pub fn chi_squared(over_noise: &[f64]) -> f64 {
        over_noise.iter().map(|v| v * v).sum()
    }
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
/// As [`populate`] and the profile of the lens; when cancelled.
pub fn tidal_residual(
    config: &Config,
    sightline: u64,
    tidal_only: bool,
    monitor: &dyn Monitor,
) -> Result<TidalResidual> {
    let mut haloes = populate(config, None, sightline, monitor)?;
    if tidal_only {
        haloes.catalogue = haloes.in_tidal_regime(config)?;
    }
    let selection = if tidal_only { Selection::TidalRegime } else { Selection::All };
    let sight = line_of_sight_of(config, &haloes, &haloes.catalogue, selection)?;
    let z_lens = config.line_of_sight.z_lens;
    let axis = |mapping: &dyn Mapping| mapping.map(&[[0.0, 0.0]], Order::Position).beta_arcsec[0];
    let (lens_centre, source_centre) = (axis(&sight.observer_to(z_lens)?), axis(&sight.observer_to_source()));
    let lens = |centre| Epl::new(config.lens.einstein_radius_arcsec, config.lens.slope, [0.0, 0.0], centre);
    let main_lens = MainLens { z: z_lens, profile: MassModel::Epl(lens(lens_centre)?) };
    let theta = config.maps.theta_arcsec();
    let whole = sight.through_lens(&main_lens)?;
    let traced = whole.trace(&theta, Order::Position, monitor)?.beta_arcsec;
    let effective = EffectiveLineOfSight::of(&sight, z_lens)?;
    let model_lens = MassModel::Epl(lens([0.0, 0.0])?);
    let through = |model| TidalLens::new(model, vec![model_lens.clone()]);
    let residual = |model: LineOfSightModel| -> Vec<f64> {
        let mapping = through(model);
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
    let (tidal, flexion) = (through(effective.tidal_model()), through(effective.flexion_model()));
    let image = image_residual(config, (&whole, source_centre), [&tidal, &flexion], monitor)?;
    Ok(TidalResidual {
        sightline,
        number_of_haloes: sight.len(),
        gamma_los: effective.los.gamma,
        grid: config.maps,
        tidal_arcsec: residual(effective.tidal_model()),
        flexion_arcsec: residual(effective.flexion_model()),
        image,
    })
}

/// Images of the round source of the configuration through the cone and through both models, before noise.
fn image_residual(
    config: &Config,
    (traced, source_centre): (&dyn Mapping, [f64; 2]),
    models: [&dyn Mapping; 2],
    monitor: &dyn Monitor,
) -> Result<ImageResidual> {
    let instrument = &config.instrument;
    let grid = SkyGrid::new(config.image.pixels, instrument.pixel_scale_arcsec)?;
    let (fwhm, truncation) = (instrument.psf_fwhm_arcsec, instrument.psf_truncation_sigma);
    let psf = Psf::gaussian(fwhm, truncation, instrument.pixel_scale_arcsec)?;
    let own = &config.source;
    let (flux, radius) = (instrument.flux_e_s(own.magnitude), own.radius_arcsec);
    let image = |mapping: &dyn Mapping, centre: [f64; 2]| -> Result<Vec<f64>> {
        let source = Sersic::with_flux(flux, radius, own.sersic_index, [0.0; 2], centre)?;
        let scene = Scene { mapping, source: &source, lens_light: None };
        let noise = StreamName { seed: config.seed, realisation: 0, stage: Stage::NoiseImage };
        Ok(expose(&scene, grid, instrument, &psf, config.image.pixel_sampling, noise, monitor)?
            .noise_free_e_s)
    };
    let traced_e_s = image(traced, source_centre)?;
    let over_noise = |model: &dyn Mapping| -> Result<Vec<f64>> {
        let modelled = image(model, [0.0; 2])?;
        let noise = instrument.noise();
        Ok(traced_e_s.iter().zip(modelled).map(|(flux, model)| (flux - model) / noise.sigma(*flux)).collect())
    };
    let [tidal, flexion] = models;
    let (tidal_over_noise, flexion_over_noise) = (over_noise(tidal)?, over_noise(flexion)?);
    Ok(ImageResidual { grid, traced_e_s, tidal_over_noise, flexion_over_noise })
}

/// Residuals of `n` sightlines, in order.
///
/// # Errors
/// As [`tidal_residual`].
pub fn tidal_study(
    config: &Config,
    n: u64,
    tidal_only: bool,
    rows: &dyn RowStore<TidalResidual>,
    monitor: &dyn Monitor,
) -> Result<Vec<TidalResidual>> {
    let task = monitor.task("tidal and flexion residuals", Some(n));
    let row = |sightline| {
        task.check()?;
        let one = || tidal_residual(config, sightline, tidal_only, &Uncounted(monitor));
        let row = rows.row(sightline, one);
        task.advance(1);
        row
    };
    (0..n).map(row).collect()
}

/// Root mean square of the numbers among `values`.
pub fn rms(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / count).sqrt()
}
