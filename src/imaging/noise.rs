//! The noise of pixels: background plus shot noise, both normal.

use rand_distr::{Distribution, StandardNormal};

use crate::numerics::random::{StreamName, stream};
use crate::numerics::real::Real;

/// The noise of every pixel of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the background per pixel, e⁻/s.
    pub background_rms_e_s: f64,
    /// Exposure time in s.
    pub exposure_s: f64,
}

impl Noise {
    /// σ² + max(f, 0)/t of a pixel of flux f, e⁻/s.
    #[inline(always)]
    pub fn variance<R: Real>(self, flux_e_s: R) -> R {
        flux_e_s.max(0.0) * (1.0 / self.exposure_s) + self.background_rms_e_s * self.background_rms_e_s
    }

    /// Standard deviation of a pixel.
    pub fn sigma(self, flux_e_s: f64) -> f64 {
        self.variance(flux_e_s).sqrt()
    }

    /// Adds N(0, σ²) + N(0, max(f, 0)/t) to every pixel f of a convolved, noise-free image in e⁻/s, by the random numbers of
    /// that stream.
    pub fn added_to(
        self,
        image_e_s: &[f64],
        StreamName { seed, realisation, stage }: StreamName,
    ) -> Vec<f64> {
        let mut rng = stream(seed, realisation, stage, 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let shot = |flux: f64| (flux.max(0.0) / self.exposure_s).sqrt();
        image_e_s.iter().map(|&f| f + self.background_rms_e_s * normal() + shot(f) * normal()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::Stage;

    #[test]
    fn the_noise_has_the_stated_variance() {
        // 10⁵ pixels: the sample variance scatters by √(2/N) = 0.45%; allowed 5 of that.
        let noise = Noise { background_rms_e_s: 0.0059, exposure_s: 5400.0 };
        for flux in [0.0, 0.5, -0.3] {
            let noisy = noise.added_to(
                &vec![flux; 100_000],
                StreamName { seed: 3, realisation: 0, stage: Stage::NoiseImage },
            );
            let variance = noisy.iter().map(|v| (v - flux).powi(2)).sum::<f64>() / 1e5;
            let want = 0.0059_f64.powi(2) + flux.max(0.0) / 5400.0;
            assert!((noise.variance(flux) / want - 1.0).abs() < 1e-15);
            assert!((variance / want - 1.0).abs() < 0.0225, "{flux}: {}", variance / want);
        }
    }
}
