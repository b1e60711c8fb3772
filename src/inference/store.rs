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
    /// That of a fit whose blind start ended at `maximum`, before the pixels are refined.
    pub(super) fn at(maximum: Maximum) -> Self {
        Self { maxima: vec![maximum], ..Self::default() }
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
            self.maxima.len() == most && run.fits(&settings.sampler, settings.seed, dimension)
        };
        self.search.fits(dimension)
            && self.maxima.len() <= most
            && self.maxima.iter().all(|maximum| maximum.fits(dimension))
            && self.run.as_ref().is_none_or(run_fits)
    }

    /// The start of the sampler; `likelihood` is then refined. What has been done before is not done again, but for the
    /// refinements, which follow from the maxima.
    pub(super) fn start(
        &mut self,
        likelihood: &mut ImageLikelihood,
        settings: &FitSettings,
        store: &mut dyn FitStore,
        monitor: &dyn Monitor,
    ) -> Result<Maximum> {
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
            let others = self.modes_beside(likelihood, &start);
            let others: Vec<Mode> =
                others.iter().map(|mode| (mode.latent.as_slice(), &mode.metric)).collect();
            likelihood.refine((&start.latent, &start.metric), &others, how, monitor)?;
            if self.maxima.len() <= refined {
                let counter = Counter::new(monitor);
                let top = to_the_top(&counter.watch(likelihood), start.latent);
                self.evaluations += counter.evaluations()?;
                self.maxima.push(top.ok_or_else(|| no_model(likelihood))?);
                store.save(self)?;
            }
            start = self.maxima[refined].clone();
        }
        Ok(start)
    }

    /// Other modes nearly as high as the start, which chains should reach too; none where rays through haloes are expanded about
    /// the start.
    fn modes_beside(&self, likelihood: &ImageLikelihood, start: &Maximum) -> Vec<Maximum> {
        match likelihood.model().haloes() {
            Some(_) => vec![],
            None => self.search.modes_beside(start),
        }
    }

    /// Where chains are to start: the start, and the tops of the other modes of the refined likelihood.
    pub(super) fn starts(
        &mut self,
        likelihood: &ImageLikelihood,
        start: &Maximum,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Vec<f64>>> {
        let mut starts = vec![start.latent.clone()];
        for mode in self.modes_beside(likelihood, start) {
            let counter = Counter::new(monitor);
            let top = to_the_top(&counter.watch(likelihood), mode.latent);
            self.evaluations += counter.evaluations()?;
            starts.extend(top.filter(|top| top.is_apart_from(start)).map(|top| top.latent));
        }
        Ok(starts)
    }

    /// Evaluations of the likelihood before sampling.
    pub(super) fn evaluations(&self) -> u64 {
        self.search.evaluations() + self.evaluations
    }
}
