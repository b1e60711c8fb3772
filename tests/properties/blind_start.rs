//! Blind starts of composite lenses that hold climbs up, or whose pixels are integrated: they must end no lower than a climb
//! from the truth.

use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::{
    FitSettings, ImageLikelihood, Observation, StartSearch, Top, climb_from, find_start,
};
use haloray::mock::{MockImage, MockSystem, Protocol};
use haloray::monitor::Silent;

/// Seed of the catalogue of docs/CATALOGUE.md.
const SEED: u64 = 1;

/// The image of a system, its model and the truth in the model's latent coordinates.
fn imaged(seed: u64, number: u64, sampling: PixelSampling) -> (Observation, CompiledModel, Vec<f64>) {
    let camera = Instrument::default();
    let system = MockSystem::draw(&Protocol::paper(), seed, number, camera.pixel_scale_arcsec).unwrap();
    let psf = Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)
        .unwrap();
    let exposure = MockImage::expose(&system, &camera, &psf, sampling, seed).unwrap().exposure;
    let observation = Observation::of_camera(exposure.grid, exposure.noisy_e_s, &camera, psf);
    let model = CompiledModel::new(&ModelDescription::built_in("comprehensive").unwrap()).unwrap();
    let truths = system.truths();
    let truth_of = |name: &str| truths.iter().find(|(known, _)| *known == name).unwrap().1;
    let truth = model.free.iter().map(|p| p.prior.to_latent(truth_of(&p.name))).collect();
    (observation, model, truth)
}

fn starts_as_high_as_from_the_truth(number: u64) {
    let (observation, model, truth) = imaged(SEED, number, PixelSampling::Point);
    let likelihood = ImageLikelihood::new(observation, model, LikelihoodKind::Gaussian, &Silent).unwrap();
    let from_truth = climb_from(&likelihood, truth, &Silent).unwrap().log_posterior;
    let blind = find_start(&likelihood, SEED, &Silent).unwrap().log_posterior;
    assert!(
        blind > from_truth - 1.0,
        "system {number}: {blind} from a blind start, {from_truth} from the truth"
    );
}

#[test]
fn a_lens_light_of_steep_core_and_high_signal() {
    // Its brightest pixel has 250,000 times the background's noise; climbs under that noise alone end at χ² of 10 a pixel.
    starts_as_high_as_from_the_truth(48);
}

#[test]
fn a_source_that_is_missed_under_more_noise() {
    // Climbs that begin with more noise all end at χ² of 19 a pixel.
    starts_as_high_as_from_the_truth(4);
}

#[test]
fn a_maximum_that_is_hardly_worse_than_noise() {
    // Two guesses of the first round end at χ² of 1.14 a pixel, four deviations above one; the highest maximum has 0.98.
    starts_as_high_as_from_the_truth(39);
}

#[test]
fn integrated_pixels_whose_centres_miss_the_image() {
    // While centres stand for pixels χ² is 5 at best, and ten rounds were spent on it.
    let settings = FitSettings { seed: 301, ..FitSettings::default() };
    let (observation, model, truth) = imaged(settings.seed, 0, PixelSampling::Adaptive);
    let likelihood =
        ImageLikelihood::new(observation.clone(), model.clone(), settings.likelihood, &Silent).unwrap();
    let (mut search, mut rounds) = (StartSearch::default(), 0);
    while !search.is_done() {
        search.advance(&likelihood, (PixelSampling::Adaptive, settings.seed), &Silent).unwrap();
        rounds += 1;
    }
    assert!(rounds <= 5, "{rounds} rounds, the power law's included");
    let top = |from| Top::find(observation.clone(), model.clone(), &settings, from, &Silent).unwrap();
    let [blind, from_truth] = [None, Some(truth)].map(|from| top(from).maximum().log_posterior);
    assert!(blind > from_truth - 1.0, "{blind} from a blind start, {from_truth} from the truth");
}
