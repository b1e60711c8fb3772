//! A fit from image and model to posterior: blind start, mesh, sampler until converged, summary.

use serde::Serialize;

use super::diagnose::{Convergence, DrawStatistics, Goodness, doubts};
use super::fit_settings::FitSettings;
use super::likelihood::{Counter, ImageLikelihood, ModelImage, Observation};
use super::model::{CompiledModel, Quantity};
use super::optimise::{Maximum, climb_from, to_the_top};
use super::profile::{Profile, profiles};
use super::run::{RunStatus, SamplerRun};
use super::sample::{Chains, Evidence, Problem};
use super::store::{FitState, FitStore, NoStore};
use crate::error::{Error, Result};
use crate::monitor::Monitor;

/// What is told of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterSummary {
    /// `lens.theta_E`, `gamma1_los`, ….
    pub name: String,
    /// `arcsec`, `1/arcsec`, or empty.
    pub unit: &'static str,
    /// How it stands on an axis.
    #[serde(skip)]
    pub label: String,
    /// True if it is computed from the fitted parameters.
    pub derived: bool,
    /// Mean of the draws.
    pub mean: f64,
    /// Median of the draws.
    pub median: f64,
    /// Standard deviation of the draws.
    pub standard_deviation: f64,
    /// Value at the highest maximum of the posterior that was met.
    pub best_fit: f64,
    /// Lower end of the highest-density interval with 68% of the draws.
    pub hpd68_low: f64,
    /// Upper end of that interval.
    pub hpd68_high: f64,
    /// False if that interval touches an edge of the prior.
    pub bounded: bool,
    /// Rank-normalised split R-hat.
    pub r_hat: f64,
    /// Effective number of draws for the centre.
    pub ess_bulk: f64,
    /// Effective number of draws for the tails.
    pub ess_tail: f64,
}

/// Another maximum of a posterior, among whose draws it is not.
#[derive(Debug, Clone, PartialEq)]
pub struct UnsampledMaximum {
    /// ln p of the highest maximum less that of this one.
    pub below: f64,
    /// Name and value there of the free parameter furthest outside the draws.
    pub outside: (String, f64),
}

/// A finished fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The likelihood that was sampled.
    pub likelihood: ImageLikelihood,
    /// Settings.
    pub settings: FitSettings,
    /// The highest maximum: above the best draw, or the one the samplers started from.
    pub maximum: Maximum,
    /// The draws that count, in latent coordinates.
    pub chains: Chains,
    /// The draws of each fitted or derived quantity, in the order of `parameters`, chain by chain.
    draws: Vec<Vec<Vec<f64>>>,
    /// How the sampling ended.
    pub status: RunStatus,
    /// The evidence, of nested sampling.
    pub evidence: Option<Evidence>,
    /// One line a fitted or derived quantity.
    pub parameters: Vec<ParameterSummary>,
    /// Values of the free parameters at the best fit.
    pub best_fit: Vec<f64>,
    /// The image of the best fit.
    pub image: ModelImage,
    /// Whether that image describes the observation.
    pub goodness: Goodness,
    /// What spoke against image or priors before the fit began.
    pub doubts: Vec<String>,
    /// A maximum nearly as high as the highest that no draw comes near.
    pub unsampled: Option<UnsampledMaximum>,
    /// Evaluations of the likelihood or its gradient, start included.
    pub evaluations: u64,
    /// Where the model's line of sight is made of haloes: by how much at most the β of the fit differed from that of rays
    /// traced through them, at the best fit and at draws.
    pub expansion_error_arcsec: Option<f64>,
}

impl Fit {
    /// Fits `observation`, going on where `store` has it from an earlier attempt.
    ///
    /// # Errors
    /// Observations or priors that cannot be, those of `store`, and [`Error::Cancelled`].
    pub fn run(
        observation: Observation,
        model: CompiledModel,
        settings: FitSettings,
        store: &mut dyn FitStore,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let likelihood = ImageLikelihood::new(observation, model, settings.likelihood, monitor)?;
        let doubts = doubts(&likelihood);
        doubts.iter().for_each(|doubt| store.doubt(doubt));
        let mut state = FitState::load(store, &likelihood, &settings)?;
        let fit = Self::go_on(likelihood, settings, &mut state, store, monitor);
        let fit = fit.map(|fit| {
            let unsampled = unsampled(&fit, state.high(fit.settings.pixel_sampling));
            Self { doubts, unsampled, ..fit }
        });
        if matches!(fit, Err(Error::Cancelled)) {
            store.save(&state)?;
        }
        fit
    }

    /// As [`Self::run`] with nothing kept, from a point that is known in place of a blind start: latent coordinates.
    ///
    /// # Errors
    /// As [`Self::run`]; a point where the model cannot be evaluated.
    pub fn run_from(
        observation: Observation,
        model: CompiledModel,
        settings: FitSettings,
        latent: Vec<f64>,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let likelihood = ImageLikelihood::new(observation, model, settings.likelihood, monitor)?;
        let mut state = FitState::at(climb_from(&likelihood, latent, monitor)?);
        Self::go_on(likelihood, settings, &mut state, &mut NoStore, monitor)
    }

    fn go_on(
        mut likelihood: ImageLikelihood,
        settings: FitSettings,
        state: &mut FitState,
        store: &mut dyn FitStore,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let modes = state.start(&mut likelihood, &settings, store, monitor)?;
        let start = modes[0].clone();
        let quantities = |z: &[f64]| likelihood.model().quantities_at(z);
        let task = monitor.task("sampling", None);
        let (run, status) = loop {
            match &mut state.run {
                None => {
                    let starts: Vec<Vec<f64>> = modes.iter().map(|mode| mode.latent.clone()).collect();
                    let problem =
                        Problem { likelihood: &likelihood, starts: &starts, metric: Some(&start.metric) };
                    let run = SamplerRun::start(&settings.sampler, settings.seed, &problem, monitor)?;
                    state.run = Some(run.until(settings.min_ess)?);
                }
                Some(run) => {
                    let status = run.status(&quantities);
                    task.tell(&status.to_string());
                    if status.is_finished {
                        break (run.clone(), status);
                    }
                    run.advance(&likelihood, monitor)?;
                }
            }
            store.save(state)?;
        };
        Self::summarise(likelihood, settings, (start, state.evaluations()), &run, status, monitor)
    }

    fn summarise(
        likelihood: ImageLikelihood,
        settings: FitSettings,
        (start, evaluations): (Maximum, u64),
        run: &SamplerRun,
        status: RunStatus,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let counter = Counter::new(monitor);
        let drawn = best_draw(run.chains())
            .and_then(|latent| to_the_top(&counter.watch(&likelihood), latent.to_vec()));
        let evaluations = evaluations + run.evaluations() + counter.evaluations()?;
        let maximum = drawn.filter(|top| top.log_posterior > start.log_posterior).unwrap_or(start);
        let best_values = likelihood.model().quantities_at(&maximum.latent);
        let chains = run.chains().without_first(status.early_draws);
        let best_fit = likelihood.model().at_latent(&maximum.latent).0;
        let of_chain = |chain: &Vec<Vec<f64>>, i: usize| -> Vec<f64> {
            chain[status.early_draws..].iter().map(|draw| draw[i]).collect()
        };
        let (mut parameters, mut draws) = (Vec::new(), Vec::new());
        for (i, quantity) in likelihood.model().quantities().into_iter().enumerate() {
            let own: Vec<Vec<f64>> = run.values().iter().map(|chain| of_chain(chain, i)).collect();
            let column = own.concat();
            let statistics = DrawStatistics::of(&column)
                .ok_or_else(|| Error::out_of_range("number of draws", column.len(), "at least 2"))?;
            let convergence = status.quantities.get(i).copied().unwrap_or(Convergence::worst(&[]));
            parameters.push(summary_of(quantity, statistics, best_values[i], convergence));
            draws.push(own);
        }
        let image = likelihood.image(&best_fit).ok_or_else(|| {
            Error::out_of_range("the best fit", "without an image", "a model that can be evaluated")
        })?;
        let goodness = Goodness::of(&likelihood, &image);
        let evidence = run.evidence();
        let expansion_error_arcsec = expansion_error_arcsec(&likelihood, &best_fit, &chains, monitor)?;
        Ok(Self {
            likelihood,
            settings,
            maximum,
            chains,
            draws,
            status,
            evidence,
            parameters,
            best_fit,
            image,
            goodness,
            doubts: Vec::new(),
            unsampled: None,
            evaluations,
            expansion_error_arcsec,
        })
    }

    /// Sum of squared normalised residuals per degree of freedom.
    pub fn chi2_reduced(&self) -> f64 {
        self.likelihood.chi2_reduced(&self.image)
    }

    /// (data − model)/σ of every pixel; see [`ImageLikelihood::normalised_residuals`].
    pub fn normalised_residuals(&self) -> Vec<f64> {
        self.likelihood.normalised_residuals(&self.image.model_e_s)
    }

    /// Profile likelihoods of the free parameters of those names; see [`Profile`].
    ///
    /// # Errors
    /// A name that is not of a free parameter; when cancelled.
    pub fn profiles(&self, names: &[String], monitor: &dyn Monitor) -> Result<Vec<Profile>> {
        profiles(&self.likelihood, (&self.maximum, &self.chains), names, monitor)
    }

    /// The draws of one fitted or derived quantity, chain by chain.
    pub fn draws_of(&self, name: &str) -> Option<&[Vec<f64>]> {
        self.draws.get(self.parameters.iter().position(|p| p.name == name)?).map(Vec::as_slice)
    }
}

fn expansion_error_arcsec(
    likelihood: &ImageLikelihood,
    best_fit: &[f64],
    chains: &Chains,
    monitor: &dyn Monitor,
) -> Result<Option<f64>> {
    /// Draws that stand for the posterior.
    const DRAWS: usize = 8;
    if likelihood.model().haloes().is_none() {
        return Ok(None);
    }
    let draws: Vec<&[f64]> =
        chains.chains.iter().flat_map(|chain| chain.z.chunks_exact(chains.dimension)).collect();
    let mut largest = likelihood.expansion_error_arcsec(best_fit, monitor)?;
    for z in draws.iter().step_by((draws.len() / DRAWS).max(1)) {
        let free = likelihood.model().at_latent(z).0;
        largest = largest.max(likelihood.expansion_error_arcsec(&free, monitor)?);
    }
    Ok(Some(largest))
}

/// The highest of maxima one of whose coordinates is well outside all draws.
fn unsampled(fit: &Fit, high: &[Maximum]) -> Option<UnsampledMaximum> {
    let chains = &fit.chains;
    let draws = || chains.chains.iter().flat_map(|chain| chain.z.chunks_exact(chains.dimension));
    let ranges: Vec<[f64; 2]> = (0..chains.dimension)
        .map(|i| draws().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(z[i]), b.max(z[i])]))
        .collect();
    // In units of the draws' range, which is six deviations or more of theirs.
    let outside = |z: f64, [low, high]: [f64; 2]| (low - z).max(z - high) / (high - low);
    high.iter().find_map(|maximum| {
        let (i, by) = (0..chains.dimension)
            .map(|i| (i, outside(maximum.latent[i], ranges[i])))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        /// Half a range outside it.
        const WELL: f64 = 0.5;
        (by > WELL).then(|| {
            let model = fit.likelihood.model();
            UnsampledMaximum {
                below: high[0].log_posterior - maximum.log_posterior,
                outside: (model.free[i].name.clone(), model.at_latent(&maximum.latent).0[i]),
            }
        })
    })
}

/// The draw of highest posterior density.
fn best_draw(chains: &Chains) -> Option<&[f64]> {
    let draws = chains
        .chains
        .iter()
        .flat_map(|chain| chain.z.chunks_exact(chains.dimension).zip(chain.log_density(chains.dimension)));
    draws.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(z, _)| z)
}

fn summary_of(
    Quantity { name, unit, label, edges }: Quantity,
    statistics: DrawStatistics,
    best_fit: f64,
    convergence: Convergence,
) -> ParameterSummary {
    /// An interval that ends within this fraction of its width of a prior's edge touches it.
    const TOUCHING: f64 = 0.02;
    ParameterSummary {
        name,
        unit,
        label,
        derived: edges.is_none(),
        mean: statistics.mean,
        median: statistics.median,
        standard_deviation: statistics.standard_deviation,
        best_fit,
        hpd68_low: statistics.hpd68_low,
        hpd68_high: statistics.hpd68_high,
        bounded: edges.is_none_or(|[low, high]| statistics.is_bounded(low, high, TOUCHING)),
        r_hat: convergence.r_hat,
        ess_bulk: convergence.ess_bulk,
        ess_tail: convergence.ess_tail,
    }
}
