//! What is saved of an unfinished fit, and who keeps it.

use serde::{Deserialize, Serialize};

use super::fit_settings::FitSettings;
use super::likelihood::{Counter, ImageLikelihood, LatentLikelihood};
use super::optimise::{Maximum, StartSearch, no_model, to_the_top};
use super::run::SamplerRun;
use crate::error::Result;
use crate::imaging::PixelSampling;
use crate::monitor::Monitor;

/// How far a fit has come: from this the same fit goes on, and ends with the same bytes as one never stopped.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FitState {
    pub(super) search: StartSearch,
    /// The maximum found with pixels sampled at their centres, then that of each refinement.
    maxima: Vec<Maximum>,
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

impl FitState {
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
            self.maxima.len() == most && run.fits(&settings.sampler, settings.seed, dimension)
        };
        self.search.fits(dimension)
            && self.maxima.len() <= most
            && self.maxima.iter().all(|maximum| maximum.fits(dimension))
            && self.run.as_ref().is_none_or(run_fits)
    }

    /// The start of the sampler with the evaluations that it took; `likelihood` is then refined. What has been done before
    /// is not done again, but for the refinements, which follow from the maxima.
    pub(super) fn start(
        &mut self,
        likelihood: &mut ImageLikelihood,
        settings: &FitSettings,
        store: &mut dyn FitStore,
        monitor: &dyn Monitor,
    ) -> Result<(Maximum, u64)> {
        if self.maxima.is_empty() {
            while !self.search.is_done(likelihood) {
                self.search.advance(likelihood, settings.seed, monitor)?;
                store.save(self)?;
            }
            self.maxima.extend(self.search.best().cloned());
        }
        let Some(mut start) = self.maxima.first().cloned() else { return Err(no_model(likelihood)) };
        for refined in 1..=refinements(likelihood, settings.pixel_sampling) {
            monitor.check()?;
            let how = (settings.pixel_sampling, settings.seed);
            likelihood.refine(&start.latent, &start.metric, how, monitor)?;
            if self.maxima.len() <= refined {
                let counter = Counter::new(monitor);
                let top = to_the_top(&counter.watch(likelihood), start.latent);
                self.evaluations += counter.evaluations()?;
                self.maxima.push(top.ok_or_else(|| no_model(likelihood))?);
                store.save(self)?;
            }
            start = self.maxima[refined].clone();
        }
        Ok((start, self.search.evaluations() + self.evaluations))
    }
}
