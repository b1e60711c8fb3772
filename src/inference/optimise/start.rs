//! A start for the samplers from priors and data alone: many rough guesses, Levenberg–Marquardt from each, the best kept.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::climb::{Maximum, climb, no_model, to_the_top};
use super::easier;
use super::guess::{Known, RADII, ROUNDS_NEAR, SHAPES, guess, held_at_first};
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::inference::likelihood::{CountedLikelihood, Counter, ImageLikelihood};
use crate::inference::model::CompiledModel;
use crate::monitor::Monitor;

/// Rough guesses of a round that are followed with everything free, and the best of those, which are followed to the end.
const FREED: usize = 12;
const FINALISTS: usize = 4;
/// Iterations of each stage of a rough search, and of later ones but the last.
const ROUGH_ITERATIONS: usize = 12;
const MIDDLE_ITERATIONS: usize = 40;
/// Rounds of guesses after which the best is taken that has withstood its challenges, and after which whatever is best.
const MANY_ROUNDS: u64 = 10;
const MOST_ROUNDS: u64 = 30;
/// The highest maxima that are climbed on from where nothing settles which is the top.
const CLIMBED_ON: usize = 3;
/// Maxima whose ln p differ by less are the same.
const SAME: f64 = 1.0;
/// Of the noise of each pixel, its error of integration after the first round.
const TOLERANCE_OF_NOISE: f64 = 0.1;
/// Deviations of χ² above one that noise leaves.
const OF_NOISE: f64 = 3.0;

/// A search for the posterior's highest maximum, between two rounds.
///
/// A lens of several masses is first understood as a single elliptical power law: the search for the best fit of that model
/// comes before, and two guesses of three then take its line of sight, its lights and its Einstein radius, which the masses
/// share in random parts. A line of sight with flexions is likewise first understood as a tidal one.
///
/// Sizes are guessed from the image: Einstein radii from 3 pixels to its corners in logarithmic steps, source radii as a
/// quarter of them, lens light as wide as half of the light; the line of sight is empty at first. Everything else is
/// guessed around its prior median, in later rounds all over its prior. Rounds of guesses go on until the highest maximum so far
/// has been reached from two of them, and for a round at least for each of the deviations by which its χ² is above one.
/// Then, and in every other round from the fourth on, it is challenged: in a round of guesses with its Einstein radius a third
/// begins anew, a third with its lights but another lens, a third with its lens turned or of another ellipticity and the
/// foreground shear that makes up for it, or with another slope and foreground shear; what climbs back is followed no further.
/// The maximum is taken when nothing higher is found so, in two rounds if its χ² is above what noise leaves, else the search goes
/// on. After ten rounds that is enough even if nothing has been reached twice; thirty end the search.
///
/// Where pixels are to be integrated they are sampled at their centres in the first round, then as the highest maximum so far
/// needs it: whenever a round has found a higher one they are sampled anew about that, and all climbs begin again.
///
/// As long as nothing has been reached twice, or where χ² is above what noise leaves, each round also climbs on from the highest
/// maxima so far: again, as bent valleys end climbs early, and where χ² is above noise through fits of the fainter pixels.
///
/// Climbs begin with an image that is easier, of another kind in each of three rounds (`easier`), and end with the image as it is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StartSearch {
    /// The search for the simpler model's best fit, where there is one.
    simpler: Option<Box<StartSearch>>,
    /// Rounds of guesses and of challenges.
    rounds: u64,
    /// The finalists of all rounds, the highest first; since pixels were sampled anew, those that are followed.
    finals: Vec<Maximum>,
    /// By how many deviations the χ² of the highest is above one: √(2/N) each, per degree of freedom.
    judged: Option<f64>,
    /// Where pixels are to be integrated: the maximum about which they are sampled.
    sampled_about: Option<Maximum>,
    /// Whether the maximum that was the highest then has been reached twice.
    is_found_twice: bool,
    /// Challenges that the highest has withstood.
    withstood: u64,
    evaluations: u64,
}

impl StartSearch {
    /// The highest maximum so far.
    pub fn best(&self) -> Option<&Maximum> {
        self.finals.first()
    }

    /// The finalists, the highest first.
    pub(in crate::inference) fn found(&self) -> &[Maximum] {
        &self.finals
    }

    /// Evaluations of the likelihoods so far, the simpler model's too.
    pub fn evaluations(&self) -> u64 {
        self.evaluations + self.simpler.as_ref().map_or(0, |simpler| simpler.evaluations())
    }

    /// Whether the highest maximum is taken for the posterior's own.
    pub fn is_done(&self) -> bool {
        let challenges = if self.is_of_noise() { 1 } else { 2 };
        let is_enough = self.is_found() || self.rounds >= MANY_ROUNDS;
        self.rounds >= MOST_ROUNDS || is_enough && self.withstood >= challenges
    }

    /// Whether the χ² of the highest maximum is one that noise leaves.
    fn is_of_noise(&self) -> bool {
        self.judged.is_some_and(|deviations| deviations < OF_NOISE)
    }

    /// Whether guesses have reached the highest maximum often enough: the more, the more its χ² is above what noise leaves.
    fn is_found(&self) -> bool {
        let rounds = self.judged.map_or(MANY_ROUNDS, |deviations| match self.is_of_noise() {
            true => 1,
            false => (deviations as u64).min(MANY_ROUNDS),
        });
        self.is_found_twice && self.rounds >= rounds
    }

    /// The next round.
    ///
    /// # Errors
    /// [`Error::Cancelled`], after which the search is as it was before the round.
    pub fn advance(
        &mut self,
        likelihood: &ImageLikelihood,
        (sampling, seed): (PixelSampling, u64),
        monitor: &dyn Monitor,
    ) -> Result<()> {
        self.next_round(likelihood, (sampling, seed, ("start", MOST_ROUNDS)), monitor)
    }

    /// The next round, first of the simpler model's search.
    fn next_round(
        &mut self,
        likelihood: &ImageLikelihood,
        (sampling, seed, named): (PixelSampling, u64, (&str, u64)),
        monitor: &dyn Monitor,
    ) -> Result<()> {
        let mut known = None;
        if let Some(simpler) = likelihood.simpler() {
            let search = self.simpler.get_or_insert_default();
            // A lens that is taken over as it is has been challenged before.
            let takes_lens = likelihood.model().has_the_lenses_of(simpler.model());
            let is_enough = if takes_lens { search.is_done() } else { search.is_found_twice };
            if !(is_enough || search.rounds >= ROUNDS_NEAR) {
                let named = ("simpler model", ROUNDS_NEAR);
                return search.next_round(&simpler, (sampling, seed, named), monitor);
            }
            known = search.best().and_then(|best| Known::from_simpler(simpler.model(), best, takes_lens));
        }
        self.round(likelihood, known, (sampling, seed, named), monitor)
    }

    fn round(
        &mut self,
        centres: &ImageLikelihood,
        mut known: Option<Known>,
        (sampling, seed, named): (PixelSampling, u64, (&str, u64)),
        monitor: &dyn Monitor,
    ) -> Result<()> {
        let counter = Counter::new(monitor);
        let likelihood = &self.sampled(centres, seed, monitor)?;
        let highest = self.finals.first().map(|highest| highest.log_posterior);
        // What nothing has reached twice is challenged in every other round all the same.
        let is_due = self.rounds >= ROUNDS_NEAR && !self.rounds.is_multiple_of(2);
        let is_challenge = self.is_found() || is_due;
        if is_challenge {
            let highest = self.finals.first();
            known = highest.and_then(|highest| Known::from_maximum(likelihood.model(), highest)).or(known);
        }
        let finals =
            search_round(likelihood, known.as_ref(), (seed, self.rounds), (named, &counter, monitor));
        let mut next = self.clone();
        next.rounds += 1;
        next.finals.extend(finals);
        next.sort();
        next.judge(likelihood);
        next.climb_on(likelihood, &counter);
        next.judge(likelihood);
        let is_higher = |highest| next.finals[0].log_posterior - highest >= SAME;
        let is_higher = highest.is_some_and(is_higher);
        next.withstood = if is_higher { 0 } else { next.withstood + u64::from(is_challenge) };
        if sampling == PixelSampling::Adaptive && (is_higher || next.sampled_about.is_none()) {
            next.sample_anew(centres, seed, (&counter, monitor))?;
        }
        next.evaluations += counter.evaluations()?;
        *self = next;
        Ok(())
    }

    /// The highest first, and whether it has been reached twice.
    fn sort(&mut self) {
        self.finals.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        self.is_found_twice |=
            matches!(self.finals.as_slice(), [a, b, ..] if a.log_posterior - b.log_posterior < SAME);
    }

    /// Finds out whether the highest maximum describes the image.
    fn judge(&mut self, likelihood: &ImageLikelihood) {
        self.judged = self.finals.first().map(|highest| deviations(likelihood, &highest.latent));
    }

    /// The likelihood with its pixels sampled as in this search's next round.
    fn sampled(
        &self,
        centres: &ImageLikelihood,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<ImageLikelihood> {
        let mut likelihood = centres.clone();
        if let Some(about) = &self.sampled_about {
            likelihood.refine_mesh(&[about.mode()], TOLERANCE_OF_NOISE, seed, monitor)?;
        }
        Ok(likelihood)
    }

    /// Samples pixels anew about the highest maximum, and climbs to the top again from all that are followed.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; a maximum that no mesh resolves changes nothing.
    fn sample_anew(
        &mut self,
        centres: &ImageLikelihood,
        seed: u64,
        (counter, monitor): (&Counter, &dyn Monitor),
    ) -> Result<()> {
        let next = Self { sampled_about: self.best().cloned(), ..self.clone() };
        let likelihood = match next.sampled(centres, seed, monitor) {
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(_) => return Ok(()),
            Ok(likelihood) => likelihood,
        };
        let own = counter.watch(&likelihood);
        let again = |maximum: Maximum| to_the_top(&own, maximum.latent);
        let finals: Vec<Maximum> = two_of_a_kind(&self.finals).into_par_iter().filter_map(again).collect();
        if !finals.is_empty() {
            *self = Self { finals, is_found_twice: false, withstood: 0, ..next };
            self.sort();
            self.judge(&likelihood);
        }
        Ok(())
    }

    /// Climbs on from the highest maxima where nothing has been reached twice, or χ² is above what noise leaves: again, along
    /// valleys so bent that a climb ends before their top, and in the second case through fits of the fainter pixels to other
    /// maxima.
    fn climb_on(&mut self, likelihood: &ImageLikelihood, counter: &Counter) {
        let own = counter.watch(likelihood);
        let is_of_noise = self.is_of_noise();
        if is_of_noise && self.is_found_twice {
            return;
        }
        let fainter = if is_of_noise { vec![] } else { easier::faint_pixels(likelihood) };
        let fainter: Vec<CountedLikelihood> = fainter.iter().map(|fainter| counter.watch(fainter)).collect();
        let from: Vec<Maximum> = self.finals.drain(..self.finals.len().min(CLIMBED_ON)).collect();
        let ends: Vec<Vec<Maximum>> = from
            .into_par_iter()
            .map(|maximum| {
                let climbed = || climb_through(&fainter, &own, maximum.latent.clone());
                let through = if is_of_noise { None } else { climbed() };
                let top = climb_on_from(&own, maximum);
                // Back where it was, it has not been reached twice.
                let is_other = |end: &Maximum| (end.log_posterior - top.log_posterior).abs() >= SAME;
                let other = through.filter(is_other);
                [top].into_iter().chain(other).collect()
            })
            .collect();
        self.finals.extend(ends.into_iter().flatten());
        self.sort();
    }

    /// Whether what was read back is of that model.
    pub(in crate::inference) fn fits(&self, model: &CompiledModel) -> bool {
        let simpler_fits = |search: &StartSearch| model.simpler().is_some_and(|model| search.fits(model));
        self.finals.iter().chain(&self.sampled_about).all(|maximum| maximum.fits(model.free.len()))
            && self.simpler.as_deref().is_none_or(simpler_fits)
    }
}

/// Searches the posterior's highest maximum from priors and data alone; see [`StartSearch`].
///
/// # Errors
/// When the model cannot be evaluated at any guess: priors that exclude everything. [`Error::Cancelled`].
pub fn find_start(likelihood: &ImageLikelihood, seed: u64, monitor: &dyn Monitor) -> Result<Maximum> {
    let mut search = StartSearch::default();
    while !search.is_done() {
        search.advance(likelihood, (PixelSampling::Point, seed), monitor)?;
    }
    search.best().cloned().ok_or_else(|| no_model(likelihood))
}

/// By how many deviations the χ² of the image at a point is above one.
fn deviations(likelihood: &ImageLikelihood, latent: &[f64]) -> f64 {
    let image = likelihood.image(&likelihood.model().at_latent(latent).0);
    image.map_or(f64::INFINITY, |image| {
        (likelihood.chi2_reduced(&image) - 1.0) * (likelihood.degrees_of_freedom() / 2.0).sqrt()
    })
}

/// The finalists of one round of guesses.
fn search_round(
    likelihood: &ImageLikelihood,
    known: Option<&Known>,
    (seed, round): (u64, u64),
    ((name, most), counter, monitor): ((&str, u64), &Counter, &dyn Monitor),
) -> Vec<Maximum> {
    let title = format!("{name}, round {} of at most {most}", round + 1);
    let task = monitor.task(&title, Some(RADII * SHAPES));
    let easier = easier::of_round(likelihood, round);
    let easier: Vec<CountedLikelihood> = easier.iter().map(|easier| counter.watch(easier)).collect();
    let own = counter.watch(likelihood);
    let is_changed = |number: &u64| known.is_some_and(|known| known.changes(*number));
    let numbers = round * RADII * SHAPES..(round + 1) * RADII * SHAPES;
    let (changed, others): (Vec<u64>, Vec<u64>) = numbers.partition(is_changed);
    let mut finals = Vec::new();
    // A maximum that is known and was changed needs nothing easier; each kind has its own finalists.
    for (numbers, easier) in [(changed, [].as_slice()), (others, easier.as_slice())] {
        let first = easier.first().unwrap_or(&own);
        // First with the line of sight as it is guessed and the sources smooth.
        let smooth = numbers
            .into_par_iter()
            .filter_map(|number| {
                let held = held_at_first(likelihood, known, number);
                let climbed = climb(first, guess(likelihood, known, seed, number), &held, ROUGH_ITERATIONS);
                task.advance(1);
                climbed
            })
            .collect();
        task.tell(&format!("{title}: the best {FREED}"));
        let came_back = |start: &Maximum| known.is_some_and(|known| known.is_near(&start.latent));
        let free = best(smooth, FREED)
            .into_par_iter()
            .filter_map(|start| climb(first, start.latent, &[], ROUGH_ITERATIONS))
            .filter(|start| !came_back(start))
            .collect();
        task.tell(&format!("{title}: the best {FINALISTS}"));
        let best = best(free, FINALISTS).into_par_iter();
        finals.par_extend(best.filter_map(|start| climb_through(easier, &own, start.latent)));
    }
    two_of_a_kind(&best(finals, 2 * FINALISTS))
}

/// Of maxima, the highest first, the finalists: no more than two of a kind, so that lower modes are met too.
fn two_of_a_kind(maxima: &[Maximum]) -> Vec<Maximum> {
    let mut finalists: Vec<Maximum> = vec![];
    for maximum in maxima {
        let alike = finalists.iter().filter(|other| !other.is_apart_from(maximum)).count();
        if alike < 2 && finalists.len() < FINALISTS {
            finalists.push(maximum.clone());
        }
    }
    finalists
}

fn best(mut climbs: Vec<Maximum>, most: usize) -> Vec<Maximum> {
    climbs.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    climbs.truncate(most);
    climbs
}

/// One climb after the other, each from where the one before ended, on ever harder images; then to the top.
fn climb_through(
    easier: &[CountedLikelihood],
    last: &CountedLikelihood,
    latent: Vec<f64>,
) -> Option<Maximum> {
    let climbed = |latent: Vec<f64>, likelihood: &CountedLikelihood| {
        Some(climb(likelihood, latent, &[], MIDDLE_ITERATIONS)?.latent)
    };
    to_the_top(last, easier.iter().try_fold(latent, climbed)?)
}

/// Climbs again and again until that gains nothing: along a bent valley each climb ends before the top.
fn climb_on_from(likelihood: &CountedLikelihood, mut maximum: Maximum) -> Maximum {
    const MOST_CLIMBS: usize = 20;
    const SMALLEST_GAIN: f64 = 0.1;
    for _ in 0..MOST_CLIMBS {
        let below = maximum.log_posterior;
        let again = to_the_top(likelihood, maximum.latent.clone());
        let Some(higher) = again.filter(|again| again.log_posterior > below) else { break };
        maximum = higher;
        if maximum.log_posterior - below < SMALLEST_GAIN {
            break;
        }
    }
    maximum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::model::ModelDescription;

    #[test]
    fn searches_of_other_models_are_not_gone_on_with() {
        let model = |name| CompiledModel::new(&ModelDescription::built_in(name).unwrap()).unwrap();
        let n = model("comprehensive").simpler().unwrap().free.len();
        let fits = |n, name| {
            let metric = nalgebra::DMatrix::identity(n, n);
            let finals = vec![Maximum { latent: vec![0.0; n], log_posterior: 0.0, metric }];
            let simpler = Some(Box::new(StartSearch { finals, ..StartSearch::default() }));
            StartSearch { simpler, ..StartSearch::default() }.fits(&model(name))
        };
        assert!(fits(n, "comprehensive"));
        assert!(!fits(n + 1, "comprehensive") && !fits(n, "tidal-minimal"));
    }
}
