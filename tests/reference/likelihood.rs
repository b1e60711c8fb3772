//! Log-likelihoods of a noisy image of Table 1 against lenstronomy's and against brute-force integration of amplitudes.

use std::collections::BTreeMap;

use crate::differences::Differences;
use crate::oracle_table::REQUIRED_HEADERS;
use haloray::imaging::{Psf, SkyGrid};
use haloray::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::{ImageLikelihood, ModelImage, Observation};
use haloray::monitor::Silent;
use serde::Deserialize;
use serde_json::Value;

/// ln L relative to its size: images agree to 1e-14, sums over 2401 pixels lose a few digits.
const LOG_LIKELIHOOD_TOLERANCE: f64 = 1e-8;
/// Amplitudes, relative: those of the same normal equations.
const AMPLITUDE_TOLERANCE: f64 = 1e-8;
/// ln of the marginal likelihood, absolute, for draws of each width about the truth: what Laplace's method leaves of the
/// integral. It grows with the misfit, and is a hundred-thousandth of the ln L that the misfit costs or less.
const MARGINAL_TOLERANCES: [(f64, f64); 3] = [(0.001, 2e-3), (0.1, 4e-2), (1.0, 0.2)];

#[derive(Deserialize)]
struct Case {
    spread: f64,
    values: BTreeMap<String, f64>,
    amplitudes: Vec<f64>,
    lenstronomy: f64,
    marginalised: f64,
}

fn load() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/reference/likelihood.json");
    let whole: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    for key in REQUIRED_HEADERS {
        assert!(whole[key].as_str().is_some_and(|text| !text.is_empty()), "{path} does not state its {key}");
    }
    whole
}

fn cases(whole: &Value) -> Vec<Case> {
    serde_json::from_value(whole["cases"].clone()).unwrap()
}

fn likelihood(whole: &Value, kind: LikelihoodKind) -> ImageLikelihood {
    let number = |key: &str| whole[key].as_f64().unwrap();
    let scale = number("pixel_scale_arcsec");
    let data_e_s: Vec<f64> = serde_json::from_value(whole["image_e_s"].clone()).unwrap();
    let observation = Observation {
        grid: SkyGrid::new(number("pixels") as usize, scale).unwrap(),
        used: vec![true; data_e_s.len()],
        data_e_s,
        background_rms_e_s: number("background_rms_e_s"),
        exposure_s: number("exposure_s"),
        psf: Psf::gaussian(number("psf_fwhm_arcsec"), number("psf_truncation_sigma"), scale).unwrap(),
    };
    let model = CompiledModel::new(&ModelDescription::built_in("simple-minimal").unwrap()).unwrap();
    ImageLikelihood::new(observation, model, kind, &Silent).unwrap()
}

fn images(likelihood: &ImageLikelihood, cases: &[Case]) -> Vec<ModelImage> {
    let of = |case: &Case| {
        let free: Vec<f64> = likelihood.model().free.iter().map(|p| case.values[&p.name]).collect();
        assert_eq!(free.len(), case.values.len(), "the reference has a parameter that the model has not");
        likelihood.image(&free).unwrap()
    };
    cases.iter().map(of).collect()
}

#[test]
fn the_likelihood_for_comparison_is_lenstronomys() {
    let whole = load();
    let cases = cases(&whole);
    let images = images(&likelihood(&whole, LikelihoodKind::Lenstronomy), &cases);
    let pairs = || images.iter().zip(&cases);
    Differences::of("ln L", pairs().map(|(image, case)| image.log_likelihood / case.lenstronomy - 1.0))
        .require_max(LOG_LIKELIHOOD_TOLERANCE);
    let amplitudes = pairs()
        .flat_map(|(image, case)| image.amplitudes.iter().zip(&case.amplitudes).map(|(a, b)| a / b - 1.0));
    Differences::of("amplitudes", amplitudes).require_max(AMPLITUDE_TOLERANCE);
}

#[test]
fn the_default_likelihood_is_the_integral_over_the_amplitudes() {
    let whole = load();
    let cases = cases(&whole);
    let images = images(&likelihood(&whole, LikelihoodKind::Gaussian), &cases);
    for (spread, tolerance) in MARGINAL_TOLERANCES {
        let pairs = || images.iter().zip(&cases).filter(|(_, case)| case.spread == spread);
        assert_eq!(pairs().count(), cases.len() / MARGINAL_TOLERANCES.len(), "draws of spread {spread}");
        let label = format!("ln of the marginal likelihood, spread {spread}");
        Differences::of(&label, pairs().map(|(image, case)| image.log_likelihood - case.marginalised))
            .require_max(tolerance);
    }
}
