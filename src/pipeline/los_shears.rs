//! Which γ_LOS? The axis ray's, averages along the ring and over the image's light, and those of the nearest models.

use nalgebra::Matrix2;

use super::shapes::LensAndSource;
use crate::config::Config;
use crate::diagnostics::{BestModel, EffectiveLineOfSight, Tidal, WeightedRays};
use crate::error::Result;
use crate::imaging::Exposure;
use crate::mapping::multiplane::{Beam, LineOfSight, MainLens};
use crate::mapping::tidal::los_jacobian;
use crate::mapping::{Mapping, Order};
use crate::monitor::Monitor;
use crate::profile::light::{LightProfile, Sersic};
use crate::profile::mass::MassProfile;

/// Tensors averaged over beams, and A_LOS = A_odᵀ A_ds⁻¹ A_os of the averages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamAverage {
    /// Observer to lens.
    pub od: Tidal,
    /// Observer to source.
    pub os: Tidal,
    /// Lens to source.
    pub ds: Tidal,
    /// A_LOS.
    pub los: Tidal,
}

impl BeamAverage {
    /// The plain average; `None` of no beams, or where A_ds is singular.
    pub fn of(beams: &[Beam]) -> Option<Self> {
        let mean = |of: fn(&Beam) -> &[f64; 4]| {
            let sum = beams.iter().fold([0.0; 4], |sum, b| std::array::from_fn(|c| sum[c] + of(b)[c]));
            let [xx, xy, yx, yy] = sum.map(|a| a / beams.len() as f64);
            Tidal::of_jacobian(&Matrix2::new(xx, xy, yx, yy))
        };
        let (od, os, ds) = (mean(|b| &b.od), mean(|b| &b.os), mean(|b| &b.ds));
        let los = los_jacobian(&od, &os, &ds).filter(|_| !beams.is_empty())?;
        Some(Self { od, os, ds, los: Tidal::of_jacobian(&los) })
    }
}

/// The shear of the line of sight by other definitions than that of the axis ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LosShears {
    /// Averaged along the beam of the Einstein ring: rays at θ_E that the lens turns towards the axis at the source.
    pub ring: Option<BeamAverage>,
    /// Averaged over the image's light, along rays as the lens bends them; none of an image without signal.
    pub light: Option<BeamAverage>,
    /// The minimal model nearest to the traced mapping where the image has signal.
    pub best_tidal: Option<BestModel>,
    /// The flexion-minimal model nearest to it.
    pub best_flexion: Option<BestModel>,
}

/// The names of the definitions, in their order in every output.
pub const DEFINITIONS: [&str; 5] = ["axis", "ring", "light", "best_tidal", "best_flexion"];

impl LosShears {
    /// (γ_od, A_LOS) by the definitions of [`DEFINITIONS`], the axis ray's as given.
    pub fn all(&self, axis: &EffectiveLineOfSight) -> [Option<(Tidal, Tidal)>; 5] {
        let average = |beams: Option<BeamAverage>| beams.map(|b| (b.od, b.los));
        let best = |model: Option<BestModel>| model.map(|m| (m.od, m.los));
        [
            Some((axis.od.tidal, axis.los)),
            average(self.ring),
            average(self.light),
            best(self.best_tidal),
            best(self.best_flexion),
        ]
    }
}

impl BeamAverage {
    /// What stands for the average where only its names count.
    pub fn nothing() -> Self {
        Self { od: Tidal::NONE, os: Tidal::NONE, ds: Tidal::NONE, los: Tidal::NONE }
    }
}

/// What is needed to measure them: the lens, its light, and the image through `whole`, haloes and lens.
pub(super) struct Seen<'a> {
    pub shapes: &'a LensAndSource,
    pub lens: &'a MainLens,
    pub lens_light: Option<&'a Sersic>,
    pub whole: &'a dyn Mapping,
    pub exposure: &'a Exposure,
}

impl LosShears {
    /// No definition but the axis ray's.
    pub const NONE: Self = Self { ring: None, light: None, best_tidal: None, best_flexion: None };

    /// All definitions there are, for their names.
    pub fn nothing() -> Self {
        let best = BestModel { od: Tidal::NONE, los: Tidal::NONE, residual_arcsec: 0.0 };
        let beams = Some(BeamAverage::nothing());
        Self { ring: beams, light: beams, best_tidal: Some(best), best_flexion: Some(best) }
    }

    /// Measures all definitions for one image.
    pub(super) fn measure(
        config: &Config,
        sight: &LineOfSight,
        axis: &EffectiveLineOfSight,
        ring: Option<BeamAverage>,
        seen: &Seen,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let z_lens = config.line_of_sight.z_lens;
        let (theta, weights) = signal(config, seen);
        let some = evenly_weighted(&theta, &weights);
        let light = sight.beams(z_lens, &some, |[x, y]| seen.lens.profile.deflection(x, y))?;
        let [best_tidal, best_flexion] = nearest(config, axis, (&theta, &weights), seen, monitor)?;
        Ok(Self { ring, light: BeamAverage::of(&light), best_tidal, best_flexion })
    }
}

impl LosShears {
    /// Measures all definitions of a strictly tidal line of sight: `tensors` wherever a ray passes.
    pub(super) fn of_tensors(
        config: &Config,
        axis: &EffectiveLineOfSight,
        tensors: BeamAverage,
        seen: &Seen,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let (theta, weights) = signal(config, seen);
        let [best_tidal, best_flexion] = nearest(config, axis, (&theta, &weights), seen, monitor)?;
        let light = (!theta.is_empty()).then_some(tensors);
        Ok(Self { ring: Some(tensors), light, best_tidal, best_flexion })
    }
}

/// The tidal and flexion models nearest to what is seen over the pixels `theta` of signal over noise `weights`.
fn nearest(
    config: &Config,
    axis: &EffectiveLineOfSight,
    (theta, weights): (&[[f64; 2]], &[f64]),
    seen: &Seen,
    monitor: &dyn Monitor,
) -> Result<[Option<BestModel>; 2]> {
    /// Pixels that are enough for the nearest models; more take every other, third … pixel.
    const PIXELS: usize = 400;
    /// Rays that are to determine up to 29 numbers.
    const FEWEST: usize = 30;
    let every = theta.len().div_ceil(PIXELS).max(1);
    let theta: Vec<[f64; 2]> = theta.iter().copied().step_by(every).collect();
    let weights: Vec<f64> = weights.iter().copied().step_by(every).collect();
    let beta = seen.whole.trace(&theta, Order::Position, monitor)?.beta_arcsec;
    let rays = WeightedRays { theta_arcsec: &theta, beta_arcsec: &beta, weights: &weights };
    let [e1, e2] = seen.shapes.lens_ellipticity;
    let lens = [config.lens.einstein_radius_arcsec, config.lens.slope, e1, e2, 0.0, 0.0];
    if theta.len() < FEWEST || config.lens.einstein_radius_arcsec == 0.0 {
        return Ok([None; 2]);
    }
    Ok(BestModel::tidal_and_flexion(&rays, (&axis.od.tidal, &axis.los), lens)?.map(Some))
}

/// Pixels where the source outshines the noise, and by how much.
fn signal(config: &Config, seen: &Seen) -> (Vec<[f64; 2]>, Vec<f64>) {
    /// Within this fraction of the Einstein radius no image of the source is seen.
    const INNER: f64 = 0.3;
    let grid = &seen.exposure.grid;
    let (noise, pixel) = (config.instrument.noise(), grid.pixel_scale_arcsec().powi(2));
    let pixels = grid.theta_arcsec().into_iter().zip(&seen.exposure.noise_free_e_s);
    let of = |(theta, flux): ([f64; 2], &f64)| {
        let lens_light = seen.lens_light.map_or(0.0, |light| light.surface_brightness(theta[0], theta[1]));
        let over_noise = (flux - pixel * lens_light) / noise.sigma(*flux);
        let seen = theta[0].hypot(theta[1]) >= INNER * config.lens.einstein_radius_arcsec;
        (seen && over_noise > 1.0).then_some((theta, over_noise))
    };
    pixels.filter_map(of).unzip()
}

/// Of weighted directions as many as stand for them with equal weights.
fn evenly_weighted(theta: &[[f64; 2]], weights: &[f64]) -> Vec<[f64; 2]> {
    /// What the ray loop carries at once.
    const RAYS: usize = 48;
    let step = weights.iter().sum::<f64>() / RAYS as f64;
    let (mut chosen, mut sum) = (Vec::with_capacity(RAYS), 0.0);
    for (theta, weight) in theta.iter().zip(weights) {
        sum += weight;
        while chosen.len() < RAYS && (chosen.len() as f64 + 0.5) * step < sum {
            chosen.push(*theta);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_weights_stand_for_unequal_ones() {
        let theta = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
        let chosen = evenly_weighted(&theta, &[1.0, 2.0, 1.0]);
        let count = |x: f64| chosen.iter().filter(|theta| theta[0] == x).count();
        assert_eq!([count(0.0), count(1.0), count(2.0)], [12, 24, 12]);
        assert!(evenly_weighted(&[], &[]).is_empty());
    }
}
