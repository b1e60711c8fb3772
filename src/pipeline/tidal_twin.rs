//! The strictly tidal twin of a view: the same lens, source and noise behind nothing but the tensors of its axis ray.

use super::los_shears::{BeamAverage, LosShears, Seen};
use super::shapes::LensAndSource;
use super::view::{lens_light, light};
use crate::config::Config;
use crate::diagnostics::EffectiveLineOfSight;
use crate::error::Result;
use crate::imaging::{Exposure, Psf, Scene, SkyGrid, expose};
use crate::mapping::multiplane::MainLens;
use crate::mapping::tidal::{LineOfSightModel, TidalLens};
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::{Stage, StreamName};
use crate::profile::mass::{Epl, MassModel};

/// What is seen through the full tidal model of an axis ray.
#[derive(Debug, Clone, PartialEq)]
pub struct TidalTwin {
    /// The image; its noise is that of the view, from the same random numbers.
    pub exposure: Exposure,
    /// γ_LOS by definition: the tensors are the same everywhere, and the nearest models find them up to their convention κ = 0.
    pub los_shears: LosShears,
}

/// The lens of the configuration in a tidal line of sight, everything measured from the axis ray.
///
/// # Errors
/// When the lens cannot be built from the configuration.
pub(super) fn tidal_lens(
    config: &Config,
    shapes: &LensAndSource,
    model: LineOfSightModel,
) -> Result<TidalLens> {
    let (radius, slope) = (config.lens.einstein_radius_arcsec, config.lens.slope);
    let lens = MassModel::Epl(Epl::new(radius, slope, shapes.lens_ellipticity, [0.0; 2])?);
    let time_delay_distance_mpc = Some(time_delay_distance_mpc(config));
    Ok(TidalLens { time_delay_distance_mpc, ..TidalLens::new(model, vec![lens]) })
}

/// χ_d χ_s/(χ_s − χ_d), comoving.
pub(super) fn time_delay_distance_mpc(config: &Config) -> f64 {
    let los = &config.line_of_sight;
    let [lens, source] = [los.z_lens, los.z_source].map(|z| config.cosmology.comoving_distance_mpc(z));
    lens * source / (source - lens)
}

impl TidalTwin {
    /// Looks through the tensors of `axis` at the lens and source of the configuration.
    ///
    /// # Errors
    /// When lens or source cannot be built from the configuration; when cancelled.
    pub fn of(
        config: &Config,
        shapes: &LensAndSource,
        axis: &EffectiveLineOfSight,
        psf: &Psf,
        noise: (u64, Stage),
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let whole = tidal_lens(config, shapes, axis.tidal_model())?;
        let source = light(config, &config.source, shapes.source_ellipticity, [0.0; 2])?;
        let lens_light = lens_light(config, shapes)?;
        let grid = SkyGrid::new(config.image.pixels, config.instrument.pixel_scale_arcsec)?;
        let scene = Scene { mapping: &whole, source: &source, lens_light: lens_light.as_ref() };
        let stream = StreamName { seed: config.seed, realisation: noise.0, stage: noise.1 };
        let sampling = config.image.pixel_sampling;
        let exposure = expose(&scene, grid, &config.instrument, psf, sampling, stream, monitor)?;
        let tensors = BeamAverage { od: axis.od.tidal, os: axis.os.tidal, ds: axis.ds.tidal, los: axis.los };
        let lens = MainLens { z: config.line_of_sight.z_lens, profile: whole.lenses[0].clone() };
        let lens_light = lens_light.as_ref();
        let seen = Seen { shapes, lens: &lens, lens_light, whole: &whole, exposure: &exposure };
        let los_shears = LosShears::of_tensors(config, axis, tensors, &seen, &Uncounted(monitor))?;
        Ok(Self { exposure, los_shears })
    }
}
