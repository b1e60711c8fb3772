//! Seeded pixel noise: background plus shot noise, both normal.

use rand_distr::{Distribution, StandardNormal};

use crate::numerics::random::{Stage, stream};

/// Adds N(0, σ_bg²) + N(0, max(f, 0)/t) to every pixel f of a convolved, noise-free image in e⁻/s.
pub fn add_noise(
    image_e_s: &[f64],
    background_rms_e_s: f64,
    exposure_s: f64,
    seed: u64,
    realisation: u64,
    stage: Stage,
) -> Vec<f64> {
    let mut rng = stream(seed, realisation, stage, 0);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    image_e_s
        .iter()
        .map(|&f| f + background_rms_e_s * normal() + (f.max(0.0) / exposure_s).sqrt() * normal())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_has_the_stated_variance() {
        // 10⁵ pixels: the sample variance scatters by √(2/N) = 0.45%; allowed 5 of that.
        for flux in [0.0, 0.5, -0.3] {
            let noisy = add_noise(&vec![flux; 100_000], 0.0059, 5400.0, 3, 0, Stage::NoiseImage);
            let variance = noisy.iter().map(|v| (v - flux).powi(2)).sum::<f64>() / 1e5;
            let want = 0.0059_f64.powi(2) + flux.max(0.0) / 5400.0;
            assert!((variance / want - 1.0).abs() < 0.0225, "{flux}: {}", variance / want);
        }
    }
}
