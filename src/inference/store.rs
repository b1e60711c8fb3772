//! What is saved of an unfinished fit, and who keeps it.

use serde::{Deserialize, Serialize};

use super::fit_settings::FitSettings;
use super::likelihood::{Counter, ImageLikelihood, LatentLikelihood, Mode};
use super::optimise::{Maximum, StartSearch, no_model, to_the_top};
use super::run::SamplerRun;
use crate::error::Result;
use crate::imaging::PixelSampling;
use crate::monitor::Monitor;

/// How far a fit has come: from this the same fit goes on, and ends with the same bytes as one never stopped.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FitState {
    pub(super) search: StartSearch,
    /// The modes that the search found, the highest first, then those of each refinement.
    modes: Vec<Vec<Maximum>>,
    evaluations: u64,
    pub(super) run: Option<SamplerRun>,
}

/// Keeps the state of an unfinished fit.
pub trait FitStore {
    /// What was saved, if it can be read.
    ///
    /// # Errors
    /// Where there is a state that cannot be read at all.
    fn load(&mut self) -> Result<Option<FitState>>;

    /// What was loaded is of another fit, which therefore begins anew.
    fn refuse(&mut self) {}

    /// Something speaks against the image, its noise, its mask or the priors; told before the fit begins.
    fn doubt(&mut self, _: &str) {}

    /// Told after every step of the fit, and once more when it is cancelled; may leave some out.
    ///
    /// # Errors
    /// A failed write, which ends the fit.
    fn save(&mut self, state: &FitState) -> Result<()>;
}

/// Keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoStore;

impl FitStore for NoStore {
    fn load(&mut self) -> Result<Option<FitState>> {
        Ok(None)
    }

    fn save(&mut self, _: &FitState) -> Result<()> {
        Ok(())
    }
}

/// Times that mesh and rays are refined and the start is climbed to again: the maximum moves when they do; twice is enough for
/// it to settle.
fn refinements(likelihood: &ImageLikelihood, sampling: PixelSampling) -> usize {
    match (sampling, likelihood.model().haloes()) {
        (PixelSampling::Point, None) => 0,
        _ => 2,
    }
}

/// Of maxima, the highest first, those within 3 of it in ln p, which draws of the posterior should reach.
fn high(maxima: &[Maximum]) -> &[Maximum] {
    const BELOW: f64 = 3.0;
    let least = maxima.first().map_or(f64::INFINITY, |best| best.log_posterior - BELOW);
    &maxima[..maxima.partition_point(|maximum| maximum.log_posterior > least)]
}

/// Those of them that are modes of their own: so far from each other that normal posteriors about them do not meet.
fn modes_among(maxima: &[Maximum]) -> Vec<Maximum> {
    let mut modes: Vec<Maximum> = vec![];
    for maximum in high(maxima) {
        if modes.iter().all(|mode| mode.is_apart_from(maximum)) {
            modes.push(maximum.clone());
        }
    }
    modes
}

impl FitState {
    /// That of a fit whose blind start ended at `maximum`, before the pixels are refined.
    pub(super) fn at(maximum: Maximum) -> Self {
        Self { modes: vec![vec![maximum]], ..Self::default() }
    }

    /// The state that `store` has of this fit, or none yet.
    pub(super) fn load(
        store: &mut dyn FitStore,
        likelihood: &ImageLikelihood,
        settings: &FitSettings,
    ) -> Result<Self> {
        let Some(state) = store.load()? else { return Ok(Self::default()) };
        if state.fits(likelihood, settings) {
            return Ok(state);
        }
        store.refuse();
        Ok(Self::default())
    }

    /// Whether all shapes are those of this fit, and steps come in order.
    fn fits(&self, likelihood: &ImageLikelihood, settings: &FitSettings) -> bool {
        let dimension = likelihood.dimension();
        let most = 1 + refinements(likelihood, settings.pixel_sampling);
        let run_fits = |run: &SamplerRun| {
            self.modes.len() == most && run.fits(&settings.sampler, settings.seed, dimension)
        };
        self.search.fits(likelihood.model())
            && self.modes.len() <= most
            && self.modes.iter().all(|modes| !modes.is_empty())
            && self.modes.iter().flatten().all(|mode| mode.fits(dimension))
            && self.run.as_ref().is_none_or(run_fits)
    }

    /// Where the sampler starts, the highest mode first; `likelihood` is then refined. What has been done before is not done
    /// again, but for the refinements, which follow from the modes.
    pub(super) fn start(
        &mut self,
        likelihood: &mut ImageLikelihood,
        settings: &FitSettings,
        store: &mut dyn FitStore,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Maximum>> {
        let how = (settings.pixel_sampling, settings.seed);
        if self.modes.is_empty() {
            while !self.search.is_done() {
                self.search.advance(likelihood, how, monitor)?;
                store.save(self)?;
            }
            let mut modes = modes_among(self.search.found());
            if likelihood.model().haloes().is_some() {
                // Rays through haloes are expanded about the start alone.
                modes.truncate(1);
            }
            if modes.is_empty() {
                return Err(no_model(likelihood));
            }
            self.modes.push(modes);
        }
        for refined in 1..=refinements(likelihood, settings.pixel_sampling) {
            monitor.check()?;
            let modes: Vec<Mode> = self.modes[refined - 1].iter().map(Maximum::mode).collect();
            likelihood.refine(&modes, how, monitor)?;
            if self.modes.len() <= refined {
                let counter = Counter::new(monitor);
                let own = counter.watch(likelihood);
                let from = self.modes[refined - 1].iter();
                let mut tops: Vec<Maximum> =
                    from.filter_map(|mode| to_the_top(&own, mode.latent.clone())).collect();
                self.evaluations += counter.evaluations()?;
                if tops.is_empty() {
                    return Err(no_model(likelihood));
                }
                tops.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
                self.modes.push(modes_among(&tops));
                store.save(self)?;
            }
        }
        Ok(self.modes.last().cloned().unwrap_or_default())
    }

    /// Maxima nearly as high as the highest, the highest first, of the likelihood that is sampled where its pixels were refined.
    pub(super) fn high(&self, sampling: PixelSampling) -> &[Maximum] {
        match (sampling, self.modes.last()) {
            (PixelSampling::Adaptive, Some(modes)) => modes,
            _ => high(self.search.found()),
        }
    }

    /// Evaluations of the likelihood before sampling.
    pub(super) fn evaluations(&self) -> u64 {
        self.search.evaluations() + self.evaluations
    }
}
