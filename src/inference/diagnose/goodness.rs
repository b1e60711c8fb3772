//! Whether a model describes the image: the probability of its χ², and the largest residual once smoothed.

use serde::Serialize;
use spec_math::cephes64::{igamc, ndtr};

use crate::inference::likelihood::{ImageLikelihood, ModelImage};

/// Least probability of χ², and of the largest smoothed residual, of a model that is called good.
pub const P_VALUE_LIMIT: f64 = 1e-3;
/// χ² is suspiciously small where the probability of a smaller one falls below this.
const SMALL_LIMIT: f64 = 1e-6;
/// Standard deviation of the Gaussian that smooths residuals, and where it is cut, pixels.
const SMOOTHING_PIXELS: f64 = 1.5;
const REACH_PIXELS: isize = 4;

/// How well the best fit describes the pixels in use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Goodness {
    /// Probability of a χ² at least as large, were the model true.
    pub p_value: f64,
    /// Largest |residual| after smoothing, in its own standard deviations.
    pub largest_residual_sigma: f64,
    /// Where, arcsec.
    pub largest_residual_at_arcsec: [f64; 2],
    /// Probability that any of the pixels in use reaches that, were the model true.
    pub largest_residual_p_value: f64,
    /// True if neither probability is below [`P_VALUE_LIMIT`], χ² not too small for the noise that is stated, and more pixels in use
    /// than numbers are fitted.
    pub good_fit: bool,
}

impl Goodness {
    /// Of a model image.
    pub fn of(likelihood: &ImageLikelihood, image: &ModelImage) -> Self {
        let residuals = likelihood.normalised_residuals(&image.model_e_s);
        let half = 0.5 * likelihood.degrees_of_freedom();
        let p_value = igamc(half, half * likelihood.chi2_reduced(image));
        let grid = likelihood.observation().grid;
        let smoothed = smoothed(&residuals, grid.pixels());
        let size = |value: f64| if value.is_nan() { 0.0 } else { value.abs() };
        let largest = (0..smoothed.len()).max_by(|&a, &b| size(smoothed[a]).total_cmp(&size(smoothed[b])));
        let at = largest.unwrap_or(0);
        let largest_residual_sigma = smoothed.get(at).map_or(0.0, |&value| size(value));
        let trials = likelihood.observation().pixels_in_use() as f64;
        let largest_residual_p_value = (2.0 * trials * ndtr(-largest_residual_sigma)).min(1.0);
        let mut goodness = Self {
            p_value,
            largest_residual_sigma,
            largest_residual_at_arcsec: grid.theta_arcsec()[at],
            largest_residual_p_value,
            good_fit: true,
        };
        // As many numbers as pixels describe any image.
        let tells = likelihood.observation().pixels_in_use() > likelihood.fitted_numbers();
        goodness.good_fit = tells && !goodness.misses_the_image() && !goodness.is_too_close();
        goodness
    }

    fn misses_the_image(&self) -> bool {
        self.p_value < P_VALUE_LIMIT || self.largest_residual_p_value < P_VALUE_LIMIT
    }

    /// χ² smaller than noise of the stated size makes it: no model can be told from a better one then.
    fn is_too_close(&self) -> bool {
        1.0 - self.p_value < SMALL_LIMIT
    }

    /// What is wrong, in words; empty where nothing is.
    pub fn doubts(&self, chi2_reduced: f64) -> Vec<String> {
        let mut doubts = Vec::new();
        if self.misses_the_image() {
            let [x, y] = self.largest_residual_at_arcsec.map(|at| format!("{at:.2}").replace('-', "−"));
            let probability = match self.p_value {
                p if p < P_VALUE_LIMIT => format!("below {P_VALUE_LIMIT}"),
                p => format!("of {p:.3}"),
            };
            doubts.push(format!(
                "the model does not describe the image: χ²/dof {chi2_reduced:.3} has a probability {probability}, and smoothed \
                 residuals reach {:.1} σ at ({x}″, {y}″). Intervals say how well the parameters are known if the \
                 model is true; it is not, so they mean little and may miss the truth by far",
                self.largest_residual_sigma
            ));
        }
        if self.is_too_close() {
            doubts.push(format!(
                "χ²/dof {chi2_reduced:.2e} is too small for noise as large as BKGRMS and EXPTIME say: whether the model describes \
                 the image cannot be told, and intervals are too wide"
            ));
        }
        doubts
    }
}

/// In words, the lights whose flux is negative by more than the noise of the pixels explains.
pub fn negative_lights(likelihood: &ImageLikelihood, image: &ModelImage) -> Vec<String> {
    /// Signal over noise from which a negative flux is no chance.
    const SIGNIFICANT: f64 = 5.0;
    let (observation, noise) = (likelihood.observation(), likelihood.observation().noise());
    let signal_over_noise = |light: &[f64]| {
        let pixels = light.iter().zip(&image.model_e_s).zip(&observation.used).filter(|(_, used)| **used);
        pixels.map(|((own, model), _)| own * own / noise.variance(*model)).sum::<f64>().sqrt()
    };
    let lights = image.amplitudes.iter().zip(&image.lights_e_s).zip(likelihood.model().amplitude_names());
    let negative = lights.filter(|((amplitude, _), _)| **amplitude < 0.0);
    let negative = negative.map(|((_, light), name)| (name, signal_over_noise(light)));
    let warning = |(name, over_noise): (String, f64)| {
        format!(
            "{name} is negative, its flux {over_noise:.0} σ of the noise below zero, and no light is: is the sign of the image right, \
             or its background taken off twice?"
        )
    };
    negative.filter(|(_, over_noise)| *over_noise > SIGNIFICANT).map(warning).collect()
}

/// Residuals smoothed by a Gaussian and divided by the standard deviation that unit noise then has; pixels that are not
/// numbers are left out.
fn smoothed(residuals: &[f64], n: usize) -> Vec<f64> {
    let weight = |d: isize| (-0.5 * (d as f64 / SMOOTHING_PIXELS).powi(2)).exp();
    let weights: Vec<f64> = (-REACH_PIXELS..=REACH_PIXELS).map(weight).collect();
    // Sums over rows, then over columns, of w·r and of w².
    let pass = |values: &[[f64; 2]], step: [isize; 2]| -> Vec<[f64; 2]> {
        let at = |k: usize| {
            let (x, y) = ((k % n) as isize, (k / n) as isize);
            (-REACH_PIXELS..=REACH_PIXELS).zip(&weights).fold([0.0; 2], |[r, v], (d, w)| {
                let (x, y) = (x + d * step[0], y + d * step[1]);
                let inside = (0..n as isize).contains(&x) && (0..n as isize).contains(&y);
                let [value, variance] = if inside { values[y as usize * n + x as usize] } else { [0.0; 2] };
                [r + w * value, v + w * w * variance]
            })
        };
        (0..values.len()).map(at).collect()
    };
    let own: Vec<[f64; 2]> =
        residuals.iter().map(|r| if r.is_finite() { [*r, 1.0] } else { [0.0; 2] }).collect();
    let sums = pass(&pass(&own, [1, 0]), [0, 1]);
    sums.iter()
        .zip(residuals)
        .map(|([r, v], own)| if own.is_finite() { r / v.sqrt() } else { f64::NAN })
        .collect()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::imaging::{Psf, SkyGrid};
    use crate::inference::likelihood::Observation;
    use crate::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
    use crate::monitor::Silent;
    use crate::numerics::random::{Stage, stream};

    fn likelihood(data_e_s: Vec<f64>) -> ImageLikelihood {
        let model = CompiledModel::new(&ModelDescription::built_in("simple-minimal").unwrap()).unwrap();
        let observation = Observation {
            grid: SkyGrid::new(31, 0.15).unwrap(),
            used: vec![true; data_e_s.len()],
            data_e_s,
            background_rms_e_s: 0.01,
            exposure_s: 5400.0,
            psf: Psf::gaussian(0.2, 3.0, 0.15).unwrap(),
        };
        ImageLikelihood::new(observation, model, LikelihoodKind::Gaussian, &Silent).unwrap()
    }

    #[test]
    fn only_a_light_that_is_negative_beyond_the_noise_is_told_of() {
        let positive = likelihood(vec![1.0; 31 * 31]);
        let values = positive.model().at_latent(&vec![0.0; positive.model().free.len()]).0;
        let of = |factor: f64| {
            let light = positive.image(&values).unwrap().model_e_s;
            let of_factor = likelihood(light.iter().map(|value| factor * value).collect());
            negative_lights(&of_factor, &of_factor.image(&values).unwrap())
        };
        assert!(of(1.0).is_empty() && of(-1e-6).is_empty());
        let told = of(-1.0);
        assert!(!told.is_empty() && told[0].contains("is negative, its flux"), "{told:?}");
    }

    #[test]
    fn smoothed_noise_has_unit_variance_beside_masks_and_edges_too() {
        let n = 60;
        let mut rng = stream(3, 0, Stage::NoiseImage, 0);
        let (mut sum, mut count) = (0.0, 0);
        for _ in 0..20 {
            let mut noise: Vec<f64> = StandardNormal.sample_iter(&mut rng).take(n * n).collect();
            noise.iter_mut().step_by(7).for_each(|value| *value = f64::NAN);
            let smooth = smoothed(&noise, n);
            assert!(smooth.iter().zip(&noise).all(|(s, r)| s.is_nan() == r.is_nan()));
            sum += smooth.iter().filter(|s| s.is_finite()).map(|s| s * s).sum::<f64>();
            count += smooth.iter().filter(|s| s.is_finite()).count();
        }
        assert!((sum / count as f64 - 1.0).abs() < 0.05, "{}", sum / count as f64);
    }

    #[test]
    fn neither_a_miss_nor_a_chi_squared_below_the_noise_is_a_good_fit() {
        let of = |p_value, largest_residual_p_value| Goodness {
            p_value,
            largest_residual_sigma: 3.0,
            largest_residual_at_arcsec: [0.5, -1.0],
            largest_residual_p_value,
            good_fit: false,
        };
        assert!(of(0.5, 1.0).doubts(1.0).is_empty());
        for (goodness, word) in [
            (of(1e-4, 1.0), "does not describe the image"),
            (of(0.5, 1e-4), "does not describe the image"),
            (of(1.0, 1.0), "9.00e-6 is too small for noise"),
        ] {
            let doubts = goodness.doubts(9e-6);
            assert!(doubts.len() == 1 && doubts[0].contains(word), "{doubts:?}");
        }
    }

    #[test]
    fn a_chi_squared_far_out_is_improbable() {
        // 1% above one a pixel for 100,000 pixels is 2.2 standard deviations; 5% is 11.
        assert!((igamc(5e4, 5e4 * 1.01) - 0.0127).abs() < 5e-4);
        assert!(igamc(5e4, 5e4 * 1.05) < 1e-25 && igamc(5e4, 5e4 * 0.9) > 1.0 - 1e-12);
    }
}
