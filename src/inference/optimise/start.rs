//! A start for the samplers from priors and data alone: many rough guesses, Levenberg–Marquardt from each, the best kept.

use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::climb::{Maximum, climb, to_the_top};
use crate::error::{Error, Result};
use crate::inference::likelihood::{
    CountedLikelihood, Counter, ImageLikelihood, LatentLikelihood, Observation,
};
use crate::inference::model::{FreeParameter, Part};
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};
use crate::profile::mass::mean_convergence;
use crate::profile::registry::{Guess, Role};

/// Einstein radii tried in a round of guesses, and random shapes for each.
const RADII: u64 = 10;
const SHAPES: u64 = 3;
/// Rough guesses of a round that are followed with everything free, and the best of those, which are followed to the end.
const FREED: usize = 12;
const FINALISTS: usize = 4;
/// Fractions of the pixels that are fainter than the noise which the stages before the final one take for granted.
const NOISE_ABOVE: [f64; 2] = [0.99, 0.9];
/// Iterations of each stage of a rough search, and of later ones but the last.
const ROUGH_ITERATIONS: usize = 12;
const MIDDLE_ITERATIONS: usize = 40;
/// Rounds of guesses after which the best is taken whatever it is, and those after which it is taken if it was found twice
/// although it leaves more than noise, but not a χ² per degree of freedom above the last number.
const MOST_ROUNDS: u64 = 10;
const ROUNDS_OF_MISFIT: u64 = 3;
const GROSS_MISFIT: f64 = 2.0;
/// Maxima whose ln p differ by less are the same.
const SAME: f64 = 1.0;
/// Spread of the guesses for what the image says nothing about beforehand, in latent standard deviations, and that in rounds
/// after [`ROUNDS_OF_MISFIT`].
const GUESS_SPREAD: f64 = 0.25;
const LATE_SPREAD: f64 = 1.0;

/// A search for the posterior's highest maximum, between two rounds of guesses.
///
/// Sizes are guessed from the image: Einstein radii from 3 pixels to its edge in logarithmic steps, source radii as a
/// quarter of them, lens light as wide as half of the light; the line of sight is empty at first. Everything else is
/// guessed around its prior median, in later rounds all over its prior. Rounds of guesses go on until the highest maximum has
/// been reached from two of them; at least three rounds where its χ² is above what noise leaves, ten where it is far above.
///
/// A steep lens light or source that is seen at a signal-to-noise of thousands holds a climb at the first bright pixel that
/// it happens to meet. In every other round, the first among them, climbs therefore begin as if the noise were as bright as
/// all but the brightest hundredth of the pixels, then as all but the brightest tenth, and end with the noise there is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StartSearch {
    rounds: u64,
    /// The finalists of all rounds, the highest first.
    finals: Vec<Maximum>,
    evaluations: u64,
}

impl StartSearch {
    /// The highest maximum so far.
    pub fn best(&self) -> Option<&Maximum> {
        self.finals.first()
    }

    /// Evaluations of the likelihood so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Whether the highest maximum is taken for the posterior's own.
    pub fn is_done(&self, likelihood: &ImageLikelihood) -> bool {
        let [first, second, ..] = self.finals.as_slice() else { return self.rounds >= MOST_ROUNDS };
        let is_found_twice = first.log_posterior - second.log_posterior < SAME;
        self.rounds >= MOST_ROUNDS || is_found_twice && self.rounds >= fewest_rounds(likelihood, first)
    }

    /// The next round of guesses.
    ///
    /// # Errors
    /// [`Error::Cancelled`], after which the search is as it was before the round.
    pub fn advance(&mut self, likelihood: &ImageLikelihood, seed: u64, monitor: &dyn Monitor) -> Result<()> {
        let counter = Counter::new(monitor);
        let finals = search_round(likelihood, seed, self.rounds, &counter, monitor);
        self.evaluations += counter.evaluations()?;
        self.rounds += 1;
        self.finals.extend(finals);
        self.finals.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        Ok(())
    }

    /// Whether what was read back is of a problem of that dimension.
    pub(in crate::inference) fn fits(&self, dimension: usize) -> bool {
        self.finals.iter().all(|maximum| maximum.fits(dimension))
    }
}

/// Searches the posterior's highest maximum from priors and data alone; see [`StartSearch`].
///
/// # Errors
/// When the model cannot be evaluated at any guess: priors that exclude everything. [`Error::Cancelled`].
pub fn find_start(likelihood: &ImageLikelihood, seed: u64, monitor: &dyn Monitor) -> Result<Maximum> {
    let mut search = StartSearch::default();
    while !search.is_done(likelihood) {
        search.advance(likelihood, seed, monitor)?;
    }
    search.best().cloned().ok_or_else(|| no_model(likelihood))
}

/// Rounds before which a maximum that was found twice is not taken: more, the more its χ² is above what noise leaves, less
/// than three of its deviations, √(2/N) per degree of freedom, above one.
fn fewest_rounds(likelihood: &ImageLikelihood, start: &Maximum) -> u64 {
    let image = likelihood.image(&likelihood.model().at_latent(&start.latent).0);
    let of_noise = 1.0 + 3.0 * (2.0 / likelihood.degrees_of_freedom()).sqrt();
    match image.map(|image| likelihood.chi2_reduced(&image)) {
        Some(chi2) if chi2 < of_noise => 1,
        Some(chi2) if chi2 < GROSS_MISFIT => ROUNDS_OF_MISFIT,
        _ => MOST_ROUNDS,
    }
}

/// The finalists of one round of guesses.
fn search_round(
    likelihood: &ImageLikelihood,
    seed: u64,
    round: u64,
    counter: &Counter,
    monitor: &dyn Monitor,
) -> Vec<Maximum> {
    let task = monitor.task(&format!("start, round {}", round + 1), Some(RADII * SHAPES));
    let best = |mut climbs: Vec<Maximum>, most: usize| -> Vec<Maximum> {
        climbs.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        climbs.truncate(most);
        climbs
    };
    let noisier: Vec<ImageLikelihood> = match round % 2 {
        0 => NOISE_ABOVE.iter().map(|fraction| with_noise_above(likelihood, *fraction)).collect(),
        _ => vec![],
    };
    let noisier: Vec<CountedLikelihood> = noisier.iter().map(|noisier| counter.watch(noisier)).collect();
    let own = counter.watch(likelihood);
    let first = noisier.first().unwrap_or(&own);
    // First with the line of sight empty and the sources smooth.
    let held = held_at_first(likelihood);
    let smooth = (round * RADII * SHAPES..(round + 1) * RADII * SHAPES)
        .into_par_iter()
        .filter_map(|number| {
            let climbed = climb(first, guess(likelihood, seed, number), &held, ROUGH_ITERATIONS);
            task.advance(1);
            climbed
        })
        .collect();
    task.tell(&format!("start, round {}: the best {FREED}", round + 1));
    let free = best(smooth, FREED)
        .into_par_iter()
        .filter_map(|start| climb(first, start.latent, &[], ROUGH_ITERATIONS))
        .collect();
    task.tell(&format!("start, round {}: the best {FINALISTS}", round + 1));
    let finals = best(free, FINALISTS)
        .into_par_iter()
        .filter_map(|start| climb_through(&noisier, &own, start.latent))
        .collect();
    best(finals, FINALISTS)
}

/// The likelihood as if its noise were at least as bright as that fraction of the pixels.
fn with_noise_above(likelihood: &ImageLikelihood, fraction: f64) -> ImageLikelihood {
    let observation = likelihood.observation();
    let used = observation.data_e_s.iter().zip(&observation.used).filter(|(_, used)| **used);
    let mut fluxes: Vec<f64> = used.map(|(flux, _)| *flux).collect();
    fluxes.sort_by(f64::total_cmp);
    let brightness = fluxes.get((fraction * fluxes.len() as f64) as usize).copied().unwrap_or(0.0);
    likelihood.with_noise_of_at_least(brightness)
}

/// One climb after the other, each from where the one before ended: under ever less noise, then to the top.
fn climb_through(
    noisier: &[CountedLikelihood],
    last: &CountedLikelihood,
    latent: Vec<f64>,
) -> Option<Maximum> {
    let climbed = |latent: Vec<f64>, likelihood: &CountedLikelihood| {
        Some(climb(likelihood, latent, &[], MIDDLE_ITERATIONS)?.latent)
    };
    to_the_top(last, noisier.iter().try_fold(latent, climbed)?)
}

/// Climbs again from a known point, as after a change of the mesh.
///
/// # Errors
/// When the model cannot be evaluated there.
pub fn climb_from(likelihood: &ImageLikelihood, latent: Vec<f64>) -> Result<Maximum> {
    to_the_top(likelihood, latent).ok_or_else(|| no_model(likelihood))
}

/// Why nothing was found.
pub(in crate::inference) fn no_model(likelihood: &ImageLikelihood) -> Error {
    let middle = likelihood.model().at_latent(&vec![0.0; likelihood.dimension()]).0;
    let reason = likelihood.model().evaluate(&middle).err().map_or_else(
        || "models whose amplitudes can be solved for; none was found among the guesses".into(),
        |error| format!("models that exist; at the medians {error}"),
    );
    Error::out_of_range("what the priors allow", "no model", &reason)
}

fn guess(likelihood: &ImageLikelihood, seed: u64, number: u64) -> Vec<f64> {
    let observation = likelihood.observation();
    let (pixel, edge) = (observation.grid.pixel_scale_arcsec(), 0.9 * observation.grid.half_width_arcsec());
    let step = (number / SHAPES % RADII) as f64 / (RADII - 1) as f64;
    let einstein_radius = 3.0 * pixel * (edge / (3.0 * pixel)).max(1.0).powf(step);
    let mut rng = stream(seed, number, Stage::Start, 0);
    let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
    let is_late = number / (RADII * SHAPES) >= ROUNDS_OF_MISFIT;
    let spread = if is_late { LATE_SPREAD } else { GUESS_SPREAD };
    let free = likelihood.model().free.iter();
    let latent: Vec<f64> = free
        .map(|parameter| {
            let own_guess = match parameter.parameter.guess {
                Guess::Prior => None,
                Guess::EinsteinRadius => Some(einstein_radius),
                Guess::HalfLight => Some(half_light_radius(observation) * (0.3 * random()).exp()),
                Guess::SourceRadius => Some(0.25 * einstein_radius * (0.5 * random()).exp()),
                Guess::About([median, scatter]) => Some(median * (scatter * random()).exp()),
                Guess::Fixed(value) => Some(value),
            };
            own_guess.map_or_else(|| spread * random(), |v| parameter.prior.to_latent(v).clamp(-5.0, 5.0))
        })
        .collect();
    with_einstein_radius(likelihood, latent, einstein_radius)
}

/// The guess with the strengths of its lenses scaled by one factor, so that the mean convergence inside
/// `einstein_radius` is one; lenses that have that radius as a parameter have it already.
fn with_einstein_radius(
    likelihood: &ImageLikelihood,
    mut latent: Vec<f64>,
    einstein_radius: f64,
) -> Vec<f64> {
    let model = likelihood.model();
    let values = model.at_latent(&latent).0;
    let Ok(lenses) = model.lenses(&values) else { return latent };
    let factor = 1.0 / mean_convergence(&lenses, [0.0, 0.0], einstein_radius);
    if !(factor.is_finite() && factor > 0.0) {
        return latent;
    }
    for ((parameter, value), z) in model.free.iter().zip(values).zip(&mut latent) {
        if parameter.parameter.role == Role::Strength {
            *z = parameter.prior.to_latent(factor * value).clamp(-3.0, 3.0);
        }
    }
    latent
}

/// Radius about the centre of the image that holds half of its light.
fn half_light_radius(observation: &Observation) -> f64 {
    let theta = observation.grid.theta_arcsec();
    let mut pixels: Vec<(f64, f64)> = theta
        .iter()
        .zip(observation.data_e_s.iter().zip(&observation.used))
        .map(|([x, y], (flux, used))| (x.hypot(*y), if *used { flux.max(0.0) } else { 0.0 }))
        .collect();
    pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * pixels.iter().map(|p| p.1).sum::<f64>();
    let mut sum = 0.0;
    let inside = pixels.iter().find(|(_, flux)| {
        sum += flux;
        sum >= half
    });
    inside.map_or(1.0, |(radius, _)| *radius).max(observation.grid.pixel_scale_arcsec())
}

/// Whether a parameter belongs to the line of sight or is the Sérsic index of a source.
fn held_at_first(likelihood: &ImageLikelihood) -> Vec<bool> {
    let is_held = |parameter: &FreeParameter| match parameter.part {
        Part::LineOfSight => true,
        Part::Source => parameter.parameter.role == Role::Shape,
        Part::Lens | Part::LensLight => false,
    };
    likelihood.model().free.iter().map(is_held).collect()
}
