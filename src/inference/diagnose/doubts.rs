//! What speaks against an image, its noise, its mask or the priors before anything is fitted.

use rand_distr::{Distribution, StandardNormal};

use crate::inference::likelihood::{ImageLikelihood, Observation};
use crate::numerics::random::{Stage, stream};

/// Scatter of neighbouring pixels against that of the noise beyond which one of them is wrong.
const SCATTER_LIMIT: f64 = 3.0;
/// Differences of neighbours below which nothing is said of their scatter.
const DIFFERENCES_MIN: usize = 40;
/// Pixels that stand out of the noise by this many standard deviations show something.
const SHOWS_SIGMA: f64 = 5.0;
/// Such pixels below which nothing is said of a mask, and the share of them outside it in one that is not inverted.
const SHOWING_MIN: usize = 10;
const SHOWING_USED: f64 = 0.1;
/// Parameter sets drawn from the priors to see where their light falls, and how near a pixel that counts.
const DRAWS: u64 = 24;
const NEAR_PIXELS: usize = 2;
/// Share of its own brightest pixel that the model must reach there in one of them.
const REACHED: f64 = 0.02;

/// Doubts in words: pixels against numbers to fit, BKGRMS against the scatter of the pixels, MASK against where the light is, priors against the brightest
/// pixels.
pub fn doubts(likelihood: &ImageLikelihood) -> Vec<String> {
    let observation = likelihood.observation();
    [number_doubt(likelihood), noise_doubt(observation), mask_doubt(observation), light_doubt(likelihood)]
        .into_iter()
        .flatten()
        .collect()
}

fn number_doubt(likelihood: &ImageLikelihood) -> Option<String> {
    let (pixels, numbers) = (likelihood.observation().pixels_in_use(), likelihood.fitted_numbers());
    (pixels <= numbers).then(|| {
        format!("{pixels} pixels are in use and {numbers} numbers are fitted: whether the model describes the image cannot be told")
    })
}

/// The noise that BKGRMS and EXPTIME give a pixel of that flux.
fn sigma(observation: &Observation, value_e_s: f64) -> f64 {
    observation.noise().variance(value_e_s).sqrt()
}

/// Second differences d(i−1) − 2d(i) + d(i+1) along rows feel no slope; those of the fainter half feel little light.
fn noise_doubt(observation: &Observation) -> Option<String> {
    let n = observation.grid.pixels();
    let (data, used) = (&observation.data_e_s, &observation.used);
    let middles = (0..n * n).filter(|k| (1..n.saturating_sub(1)).contains(&(k % n)));
    let mut triples: Vec<(f64, f64)> = middles
        .filter(|&k| used[k - 1] && used[k] && used[k + 1])
        .map(|k| {
            let mean = (data[k - 1] + data[k] + data[k + 1]) / 3.0;
            let difference = (data[k - 1] - 2.0 * data[k] + data[k + 1]) / 6.0_f64.sqrt();
            (mean, difference / sigma(observation, mean))
        })
        .collect();
    triples.sort_by(|a, b| a.0.total_cmp(&b.0));
    triples.truncate(triples.len().div_ceil(2));
    if triples.len() < DIFFERENCES_MIN {
        return None;
    }
    let mut sizes: Vec<f64> = triples.iter().map(|(_, difference)| difference.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    /// Median of |x| for a normal x of unit variance.
    const MEDIAN: f64 = 0.674_49;
    let ratio = sizes[sizes.len() / 2] / MEDIAN;
    let words = match ratio {
        r if r > SCATTER_LIMIT => format!("{r:.3} times as much"),
        r if r < 1.0 / SCATTER_LIMIT => format!("{r:.3} of that"),
        _ => return None,
    };
    Some(format!(
        "neighbouring pixels of the fainter half scatter by {words} as BKGRMS = {} e⁻/s and EXPTIME = {} s say: one of these, or \
         the unit of the pixels, is not what the fit takes it for",
        observation.background_rms_e_s, observation.exposure_s
    ))
}

/// Means of 3 × 3 pixels in standard deviations of such a mean, pixels without a number left out.
fn three_by_three(observation: &Observation, counts: impl Fn(usize) -> bool) -> Vec<f64> {
    let n = observation.grid.pixels();
    let around = |k: usize| {
        let (x, y) = (k % n, k / n);
        let columns = x.saturating_sub(1)..(x + 2).min(n);
        (y.saturating_sub(1)..(y + 2).min(n)).flat_map(move |row| columns.clone().map(move |c| row * n + c))
    };
    let mean = |k: usize| {
        let own: Vec<f64> = around(k)
            .filter(|&i| counts(i) && observation.data_e_s[i].is_finite())
            .map(|i| observation.data_e_s[i])
            .collect();
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        mean / sigma(observation, mean) * (own.len() as f64).sqrt()
    };
    (0..n * n).map(|k| if counts(k) { mean(k) } else { f64::NAN }).collect()
}

fn mask_doubt(observation: &Observation) -> Option<String> {
    let masked = observation.used.iter().filter(|used| !**used).count();
    let shows = |used: bool| {
        let means = three_by_three(observation, |k| observation.used[k] == used);
        means.iter().filter(|mean| **mean > SHOWS_SIGMA).count()
    };
    if masked == 0 {
        return None;
    }
    let (inside, outside) = (shows(true), shows(false));
    let is_inverted = outside >= SHOWING_MIN && (inside as f64) < SHOWING_USED * (inside + outside) as f64;
    is_inverted.then(|| {
        format!(
            "of the pixels that stand out of the noise, {outside} are masked and {inside} are used: MASK looks inverted (1 = use \
             the pixel)"
        )
    })
}

fn light_doubt(likelihood: &ImageLikelihood) -> Option<String> {
    let observation = likelihood.observation();
    let n = observation.grid.pixels();
    let means = three_by_three(observation, |k| observation.used[k]);
    let value = |k: usize| if means[k].is_nan() { f64::NEG_INFINITY } else { means[k] };
    let brightest = (0..n * n).max_by(|&a, &b| value(a).total_cmp(&value(b)))?;
    if value(brightest) < SHOWS_SIGMA {
        return None;
    }
    let (x, y) = (brightest % n, brightest / n);
    let columns = x.saturating_sub(NEAR_PIXELS)..(x + NEAR_PIXELS + 1).min(n);
    let near: Vec<usize> = (y.saturating_sub(NEAR_PIXELS)..(y + NEAR_PIXELS + 1).min(n))
        .flat_map(|row| columns.clone().map(move |column| row * n + column))
        .collect();
    let model = likelihood.model();
    let mut rng = stream(0, 0, Stage::Start, u64::MAX);
    let reaches = (0..DRAWS).filter_map(|draw| {
        let latent = model
            .free
            .iter()
            .map(|_| StandardNormal.sample(&mut rng))
            .map(|z: f64| if draw == 0 { 0.0 } else { z });
        let latent: Vec<f64> = latent.collect();
        let image = likelihood.image(&model.at_latent(&latent).0)?;
        let flux = |k: usize| image.model_e_s[k].abs();
        let peak = (0..n * n).map(flux).fold(f64::MIN_POSITIVE, f64::max);
        Some(near.iter().map(|&k| flux(k)).fold(0.0, f64::max) / peak)
    });
    let reached = reaches.fold(f64::NAN, f64::max);
    let [x, y] = observation.grid.theta_arcsec()[brightest];
    (reached < REACHED).then(|| {
        format!(
            "no light of the model comes near the brightest pixels, at ({x:.2}″, {y:.2}″), for any of {DRAWS} parameter sets \
             drawn from the priors: are centres and scale those of the image, or is there light that the model lacks?"
        )
    })
}
