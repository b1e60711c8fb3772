//! Images that are easier to climb on than the one that there is.
//!
//! A steep lens light or source that is seen at a signal-to-noise of thousands holds a climb at the first bright pixel that it
//! happens to meet. Three kinds of images let it go.

use crate::inference::likelihood::ImageLikelihood;

/// Noise as bright as all but these fractions of the pixels: the brightest are seen alone.
const NOISE_ABOVE: [f64; 2] = [0.99, 0.9];
/// An exposure so short that all but this fraction of the pixels are seen at less than these signal-to-noise ratios: all are
/// seen, none of them sharply.
const SHORT_EXPOSURES: (f64, [f64; 2]) = (0.99, [5.0, 25.0]);
/// These fractions of the pixels, the faintest: all that is smooth is seen as sharply as it is.
const FAINT_PIXELS: [f64; 3] = [0.9, 0.98, 0.995];

/// The images of one kind, the easiest first, another kind in each of three rounds.
pub(super) fn of_round(likelihood: &ImageLikelihood, round: u64) -> Vec<ImageLikelihood> {
    match round % 3 {
        0 => NOISE_ABOVE.map(|part| likelihood.with_noise_of_at_least(brightest(likelihood, part))).to_vec(),
        1 => short_exposures(likelihood),
        _ => faint_pixels(likelihood),
    }
}

fn short_exposures(likelihood: &ImageLikelihood) -> Vec<ImageLikelihood> {
    let (part, ratios) = SHORT_EXPOSURES;
    let flux = brightest(likelihood, part);
    ratios.map(|ratio| likelihood.with_exposure_of_at_most(ratio * ratio / flux)).to_vec()
}

/// Without the brightest tenth of the pixels, then with ever more of them.
pub(super) fn faint_pixels(likelihood: &ImageLikelihood) -> Vec<ImageLikelihood> {
    FAINT_PIXELS.map(|part| likelihood.without_pixels_above(brightest(likelihood, part))).to_vec()
}

/// The flux that this fraction of the pixels does not reach, 0 if it is negative.
fn brightest(likelihood: &ImageLikelihood, fraction: f64) -> f64 {
    let observation = likelihood.observation();
    let used = observation.data_e_s.iter().zip(&observation.used).filter(|(_, used)| **used);
    let mut fluxes: Vec<f64> = used.map(|(flux, _)| *flux).collect();
    fluxes.sort_by(f64::total_cmp);
    fluxes.get((fraction * fluxes.len() as f64) as usize).copied().unwrap_or(0.0).max(0.0)
}
