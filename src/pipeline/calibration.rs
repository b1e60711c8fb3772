//! Simulation-based calibration: systems drawn from a prior, seen with noise, fitted under that same prior.
//!
//! If likelihood, sampler and convergence test are right, the rank of the truth among independent draws of its
//! posterior is uniform for every parameter (Talts et al. 2018, arXiv:1804.06788). The images come from the simulator
//! of [`crate::imaging`], not from the forward model of the fit.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use statrs::function::gamma::gamma_ur;

use super::one_core_each::one_core_each;
use super::rows::RowStore;
use crate::error::{Error, Result};
use crate::imaging::{Instrument, PixelSampling, Psf, Scene, SkyGrid, expose};
use crate::inference::model::{CompiledModel, ModelDescription};
use crate::inference::sample::SamplerSettings;
use crate::inference::{Fit, FitSettings, LatentLikelihood, NoStore, Observation};
use crate::mapping::tidal::TidalLens;
use crate::monitor::{Monitor, Silent, Uncounted};
use crate::numerics::random::{Stage, StreamName, stream};

/// A model with proper priors to draw systems from, and the size of their images: 0.2″ pixels, so that hundreds of fits take
/// minutes; noise, gain and sky are those of HST.
#[derive(Debug, Clone)]
pub struct Calibration {
    description: ModelDescription,
    model: CompiledModel,
    pixels: usize,
}

/// The models that are built in: name, file and usual pixels a side.
const BUILT_IN: [(&str, &str, usize); 2] = [
    ("calibration", include_str!("../../data/models/calibration.toml"), 17),
    ("comprehensive", include_str!("../../data/models/calibration-comprehensive.toml"), 31),
];
/// Draws among which the truth is ranked: few enough to be nearly independent in a converged fit.
pub const RANKED_DRAWS: usize = 99;
/// Bins of the rank histograms: each holds as many of the ranks 0–99.
pub const RANK_BINS: usize = 20;

const PIXEL_SCALE_ARCSEC: f64 = 0.2;
const PSF_FWHM_ARCSEC: f64 = 0.2;

/// One system and its fit; entries follow the parameters of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationFit {
    /// Parameters the image was made with.
    pub truths: Vec<f64>,
    /// Means of the posterior.
    pub means: Vec<f64>,
    /// Standard deviations of the posterior.
    pub standard_deviations: Vec<f64>,
    /// Number of the [`RANKED_DRAWS`] below the truth.
    pub ranks: Vec<usize>,
    /// Whether the 68% interval holds the truth.
    pub covered: Vec<bool>,
    /// R-hat and effective sizes in order.
    pub is_converged: bool,
    /// Largest R-hat.
    pub worst_r_hat: f64,
    /// Smallest effective number of draws.
    pub worst_ess: f64,
    /// Divergent trajectories.
    pub divergences: usize,
    /// Whether the best fit describes the image.
    pub is_good_fit: bool,
    /// By how much ln p of the highest maximum lies above that at the truth: never below but for a wrong maximum.
    pub ln_p_above_truth: f64,
}

impl CalibrationFit {
    /// True where the fit ended on a maximum lower than the truth itself, by more than one.
    pub fn is_on_a_wrong_maximum(&self) -> bool {
        self.ln_p_above_truth < -1.0
    }
}

/// What all fits say of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterCalibration {
    /// `gamma1_los`, `lens.theta_E`, ….
    pub name: String,
    /// Number of ranks in each of [`RANK_BINS`] equal bins.
    pub rank_counts: Vec<usize>,
    /// χ² of these counts against equal ones.
    pub chi2: f64,
    /// Probability of a larger χ² for uniform ranks.
    pub p_value: f64,
    /// Fraction of the 68% intervals that hold the truth.
    pub coverage: f64,
    /// Mean of (posterior mean − truth)/standard deviation.
    pub mean_pull: f64,
    /// Median of the posterior's standard deviation, in the parameter's unit.
    pub median_standard_deviation: f64,
}

impl Calibration {
    /// Systems of a description, seen with `pixels` pixels a side, 17 when left out.
    ///
    /// # Errors
    /// As [`CompiledModel::new`]; several sources or lens lights; lights without a prior of their amplitude that is positive.
    pub fn new(description: ModelDescription, pixels: Option<usize>) -> Result<Self> {
        /// Deviations of an amplitude above which its prior lies.
        const POSITIVE: f64 = 5.0;
        for (part, count, allowed) in [
            ("[[source]]", description.source.len(), 1..=1),
            ("[[lens_light]]", description.lens_light.len(), 0..=1),
        ] {
            if !allowed.contains(&count) {
                let allowed = format!("at most {} in a calibration", allowed.end());
                return Err(Error::out_of_range(&format!("number of {part}"), count, &allowed));
            }
        }
        for light in description.source.iter().chain(&description.lens_light) {
            if !light.amplitude.is_some_and(|[mean, sd]| mean >= POSITIVE * sd) {
                let given = light.amplitude.map_or("none".into(), |[mean, sd]| format!("[{mean}, {sd}]"));
                let allowed = "[mean, sd] with mean ≥ 5 sd: systems are drawn from it";
                return Err(Error::out_of_range("amplitude of a light", given, allowed));
            }
        }
        let model = CompiledModel::new(&description)?;
        Ok(Self { description, model, pixels: pixels.unwrap_or(BUILT_IN[0].2) })
    }

    /// The informative model of that name, `calibration` (an elliptical power law around Table 1, 17 pixels a side) or
    /// `comprehensive` (stars and dark halo as mock systems have them, 31 pixels); `None` for other names.
    pub fn built_in(name: &str, pixels: Option<usize>) -> Option<Result<Self>> {
        let (_, text, usual) = BUILT_IN.iter().find(|(own, ..)| *own == name)?;
        let description = ModelDescription::parse(text);
        let description =
            description.map_err(|e| Error::out_of_range("the calibration model", name, &e.to_string()));
        Some(description.and_then(|description| Self::new(description, pixels.or(Some(*usual)))))
    }

    /// What is drawn and fitted.
    pub fn model(&self) -> &CompiledModel {
        &self.model
    }

    /// Its description.
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// Pixels a side of the images.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Draws `number` systems and fits them from a blind start, but for those that `rows` has; the same for any number of threads.
    ///
    /// # Errors
    /// Settings of the sampler out of their domain; images whose fit finds no start.
    pub fn run(
        &self,
        number: usize,
        seed: u64,
        sampler: SamplerSettings,
        rows: &dyn RowStore<CalibrationFit>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<CalibrationFit>> {
        let settings = FitSettings {
            likelihood: self.description.likelihood,
            pixel_sampling: PixelSampling::Point,
            sampler,
            seed,
            ..FitSettings::default()
        };
        let quiet = &Uncounted(monitor);
        let task = monitor.task("fits", Some(number as u64));
        one_core_each(number as u64, |i| {
            task.check()?;
            let row = rows.row(i, || {
                let (truths, observation, seed) = self.system(seed, i)?;
                let settings = FitSettings { seed, ..settings };
                let fit = Fit::run(observation, self.model.clone(), settings, &mut NoStore, quiet)?;
                compare(&fit, truths)
            });
            task.advance(1);
            row
        })
    }

    /// Parameters from the prior, the image with its noise, and a seed for the fit.
    fn system(&self, seed: u64, number: u64) -> Result<(Vec<f64>, Observation, u64)> {
        let mut rng = stream(seed, number, Stage::LensAndSource, 0);
        let latent: Vec<f64> = self.model.free.iter().map(|_| StandardNormal.sample(&mut rng)).collect();
        let (truths, _) = self.model.at_latent(&latent);
        let (line_of_sight, lenses, lights) = self.model.parts(&truths)?;
        let mut bright = Vec::new();
        for (light, [mean, sd]) in lights.into_iter().zip(&self.model.amplitude_priors) {
            bright.push(light.of_amplitude(mean + sd * rng.sample::<f64, _>(StandardNormal))?);
        }
        let mapping = TidalLens::new(line_of_sight, lenses);
        let scene = Scene { mapping: &mapping, source: &bright[0], lens_light: bright.get(1) };
        let camera = Instrument {
            pixel_scale_arcsec: PIXEL_SCALE_ARCSEC,
            psf_fwhm_arcsec: PSF_FWHM_ARCSEC,
            ..Instrument::default()
        };
        let grid = SkyGrid::new(self.pixels, camera.pixel_scale_arcsec)?;
        let psf =
            Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)?;
        let noise = StreamName { seed, realisation: number, stage: Stage::NoiseImage };
        let exposure = expose(&scene, grid, &camera, &psf, PixelSampling::Point, noise, &Silent)?;
        let observation = Observation::of_camera(grid, exposure.noisy_e_s, &camera, psf);
        Ok((truths, observation, rng.random()))
    }
}

fn compare(fit: &Fit, truths: Vec<f64>) -> Result<CalibrationFit> {
    let latent = fit.likelihood.model().to_latent(&truths);
    let at_truth = fit.likelihood.log_likelihood(&latent) - 0.5 * latent.iter().map(|z| z * z).sum::<f64>();
    let parameters = &fit.parameters[..truths.len()];
    let rank = |(name, truth): (&str, &f64)| {
        let draws = fit.draws_of(name).unwrap_or_default().concat();
        // The middles of as many equal parts of all chains one after the other.
        let at = |i: usize| draws[(2 * i + 1) * draws.len() / (2 * RANKED_DRAWS)];
        (0..RANKED_DRAWS).filter(|i| at(*i) < *truth).count()
    };
    let pairs = || parameters.iter().zip(&truths);
    Ok(CalibrationFit {
        means: parameters.iter().map(|p| p.mean).collect(),
        standard_deviations: parameters.iter().map(|p| p.standard_deviation).collect(),
        ranks: pairs().map(|(p, truth)| rank((&p.name, truth))).collect(),
        covered: pairs().map(|(p, truth)| (p.hpd68_low..=p.hpd68_high).contains(truth)).collect(),
        is_converged: fit.status.is_converged,
        worst_r_hat: fit.status.worst.r_hat,
        worst_ess: fit.status.worst.ess_bulk.min(fit.status.worst.ess_tail),
        divergences: fit.status.divergences,
        is_good_fit: fit.goodness.good_fit,
        ln_p_above_truth: fit.maximum.log_posterior - at_truth,
        truths,
    })
}

/// Rank histogram, its χ² and the coverage of every parameter.
pub fn calibration_of(names: &[String], fits: &[CalibrationFit]) -> Vec<ParameterCalibration> {
    let number = fits.len() as f64;
    let of = |(i, name): (usize, &String)| {
        let mut rank_counts = vec![0; RANK_BINS];
        for fit in fits {
            rank_counts[fit.ranks[i] * RANK_BINS / (RANKED_DRAWS + 1)] += 1;
        }
        let expected = number / RANK_BINS as f64;
        let chi2: f64 = rank_counts.iter().map(|n| (*n as f64 - expected).powi(2) / expected).sum();
        let pull = |fit: &CalibrationFit| (fit.means[i] - fit.truths[i]) / fit.standard_deviations[i];
        let mut widths: Vec<f64> = fits.iter().map(|fit| fit.standard_deviations[i]).collect();
        widths.sort_by(f64::total_cmp);
        ParameterCalibration {
            name: name.clone(),
            rank_counts,
            chi2,
            // statrs refuses χ² = 0.
            p_value: if chi2 > 0.0 { gamma_ur(0.5 * (RANK_BINS - 1) as f64, 0.5 * chi2) } else { 1.0 },
            coverage: fits.iter().filter(|fit| fit.covered[i]).count() as f64 / number,
            mean_pull: fits.iter().map(pull).sum::<f64>() / number,
            median_standard_deviation: widths.get(fits.len() / 2).copied().unwrap_or(f64::NAN),
        }
    };
    names.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{ImageLikelihood, climb_from, find_start};
    use crate::monitor::Silent;

    fn fit(rank: usize) -> CalibrationFit {
        CalibrationFit {
            truths: vec![0.0],
            means: vec![1.0],
            standard_deviations: vec![2.0],
            ranks: vec![rank],
            covered: vec![rank.is_multiple_of(2)],
            is_converged: true,
            worst_r_hat: 1.0,
            worst_ess: 500.0,
            divergences: 0,
            is_good_fit: true,
            ln_p_above_truth: 10.0,
        }
    }

    #[test]
    fn a_blind_start_finds_a_system_far_from_the_medians() {
        // Shear, ellipticity and source position are two deviations from the medians; guesses near these all end at χ² of 6.5
        // a pixel.
        let calibration = Calibration::built_in("calibration", None).unwrap().unwrap();
        let (truths, observation, seed) = calibration.system(2, 112).unwrap();
        assert_found(calibration, observation, &truths, seed);
    }

    #[test]
    fn a_ring_of_which_the_corners_alone_show_a_piece_is_found() {
        // Its Einstein radius is 4″, the image reaches to 3.1″: an unlensed disc under the lens light has a χ² of 6.1.
        let calibration = Calibration::built_in("comprehensive", None).unwrap().unwrap();
        let (truths, observation, seed) = calibration.system(2, 11).unwrap();
        assert_found(calibration, observation, &truths, seed);
    }

    /// A blind start ends as high as a climb from the truth.
    fn assert_found(calibration: Calibration, observation: Observation, truths: &[f64], seed: u64) {
        let (model, likelihood) = (calibration.model, calibration.description.likelihood);
        let truth = model.to_latent(truths);
        let likelihood = ImageLikelihood::new(observation, model, likelihood, &Silent).unwrap();
        let from_truth = climb_from(&likelihood, truth, &Silent).unwrap().log_posterior;
        let blind = find_start(&likelihood, seed, &Silent).unwrap().log_posterior;
        assert!(blind > from_truth - 1.0, "{blind} from a blind start, {from_truth} from the truth");
    }

    #[test]
    fn uniform_ranks_pass_and_others_do_not() {
        let of = |ranks: &[usize]| {
            let fits: Vec<CalibrationFit> = ranks.iter().map(|rank| fit(*rank)).collect();
            calibration_of(&["x".into()], &fits).remove(0)
        };
        let uniform = of(&(0..200).map(|i| i % 100).collect::<Vec<_>>());
        assert_eq!((uniform.chi2, uniform.p_value, uniform.coverage), (0.0, 1.0, 0.5));
        assert_eq!(uniform.mean_pull, 0.5);
        // 30 of 200 in the lowest bin in place of 10: χ² = 50.0 with 19 degrees of freedom (scipy's chi2.sf).
        let low = of(&(0..200).map(|i| if i < 30 { 0 } else { 5 + i % 95 }).collect::<Vec<_>>());
        assert!((low.p_value - 1.310612e-04).abs() < 1e-8, "{low:?}");
        assert!(of(&[99; 200]).p_value < 1e-100);
    }

    #[test]
    fn systems_are_those_of_the_prior() {
        let calibration = Calibration::built_in("calibration", None).unwrap().unwrap();
        let systems: Vec<_> = (0..100).map(|i| calibration.system(1, i).unwrap()).collect();
        let radius = |truths: &[f64]| calibration.model.value_of("lens.theta_E", truths).unwrap();
        let radii: Vec<f64> = systems.iter().map(|(truths, ..)| radius(truths)).collect();
        let mean = radii.iter().sum::<f64>() / 100.0;
        assert!((mean - 1.2).abs() < 4.0 * 0.05 / 10.0, "{mean}");
        assert!(systems[0].2 != systems[1].2 && systems[0].1.data_e_s != systems[1].1.data_e_s);
    }

    #[test]
    fn composite_systems_show_arcs_and_the_light_of_the_lens() {
        let calibration = Calibration::built_in("comprehensive", None).unwrap().unwrap();
        assert_eq!(calibration.model.lights(), 2);
        let noise = Instrument::default().noise();
        for i in 0..20 {
            let (truths, observation, _) = calibration.system(1, i).unwrap();
            let side = calibration.pixels;
            assert_eq!(
                (truths.len(), observation.data_e_s.len()),
                (calibration.model.free.len(), side * side)
            );
            let bright =
                observation.data_e_s.iter().filter(|flux| **flux > 10.0 * noise.sigma(**flux)).count();
            assert!(bright > side, "system {i}: {bright} pixels above ten sigma");
        }
    }

    #[test]
    fn a_prior_to_draw_from_is_asked_for() {
        let flat = ModelDescription::built_in("comprehensive").unwrap();
        let error = Calibration::new(flat, None).unwrap_err().to_string();
        assert!(error.contains("amplitude") && error.contains("drawn"), "{error}");
        let mut two = ModelDescription::parse(BUILT_IN[0].1).unwrap();
        two.source.push(two.source[0].clone());
        let error = Calibration::new(two, None).unwrap_err().to_string();
        assert!(error.contains("[[source]]"), "{error}");
    }
}
