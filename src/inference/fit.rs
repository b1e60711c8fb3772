//! A fit from image and model to posterior: blind start, mesh, sampler until converged, summary.

use serde::{Deserialize, Serialize};

use super::diagnose::{Convergence, DrawStatistics};
use super::likelihood::{ImageLikelihood, LikelihoodKind, ModelImage, Observation};
use super::model::{CompiledModel, Mesh, Quantity};
use super::optimise::{Maximum, climb_from, find_start, to_the_top};
use super::run::{RunStatus, SamplerRun};
use super::sample::{Chains, Evidence, Problem, SamplerSettings};
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::mapping::tidal::LineOfSightModel;

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitSettings {
    /// Which likelihood.
    pub likelihood: LikelihoodKind,
    /// How pixels are integrated.
    pub pixel_sampling: PixelSampling,
    /// The sampler and its settings.
    pub sampler: SamplerSettings,
    /// Effective draws of every quantity before which sampling goes on, [`ESS_LIMIT`](super::diagnose::ESS_LIMIT) or more.
    pub min_ess: f64,
    /// Seed of everything random.
    pub seed: u64,
}

/// Where a fit stands.
#[derive(Debug, Clone, Copy)]
pub enum Stage<'a> {
    /// Looking for a start.
    Searching,
    /// Sampling; the run may be saved.
    Sampling(&'a SamplerRun, &'a RunStatus),
}

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
    /// How the sampling ended.
    pub progress: RunStatus,
    /// The evidence, of nested sampling.
    pub evidence: Option<Evidence>,
    /// One line a fitted or derived quantity.
    pub parameters: Vec<ParameterSummary>,
    /// Values of the free parameters at the best fit.
    pub best_fit: Vec<f64>,
    /// The image of the best fit.
    pub image: ModelImage,
    /// Evaluations of the likelihood or its gradient, start included.
    pub evaluations: u64,
}

impl Fit {
    /// Fits `observation`; `resumed` continues a run that was saved, `watch` sees every stage and may stop the fit.
    ///
    /// # Errors
    /// Observations or priors that cannot be, and those of `watch`.
    pub fn run(
        observation: Observation,
        model: CompiledModel,
        settings: FitSettings,
        resumed: Option<SamplerRun>,
        mut watch: impl FnMut(Stage) -> Result<()>,
    ) -> Result<Self> {
        observation.validate()?;
        watch(Stage::Searching)?;
        let mesh = Mesh::of_centres(&observation.grid);
        let mut likelihood = ImageLikelihood { observation, model, kind: settings.likelihood, mesh };
        let mut start = find_start(&likelihood, settings.seed)?;
        if settings.pixel_sampling == PixelSampling::Adaptive {
            refine_mesh(&mut likelihood, &mut start, settings.seed)?;
        }
        let starts = [start.latent.clone()];
        let problem = Problem { likelihood: &likelihood, starts: &starts, metric: Some(&start.metric) };
        let mut run = match resumed {
            Some(run) => run,
            None => SamplerRun::start(&settings.sampler, settings.seed, &problem)?.until(settings.min_ess)?,
        };
        let quantities = |z: &[f64]| quantities(&likelihood.model, z);
        let progress =
            run.finish(&likelihood, &quantities, |run, progress| watch(Stage::Sampling(run, progress)))?;
        Self::summarise(likelihood, settings, start, run, progress)
    }

    fn summarise(
        likelihood: ImageLikelihood,
        settings: FitSettings,
        start: Maximum,
        run: SamplerRun,
        progress: RunStatus,
    ) -> Result<Self> {
        let drawn = best_draw(run.chains()).and_then(|latent| to_the_top(&likelihood, latent.to_vec()));
        let climbed = start.evaluations + drawn.as_ref().map_or(0, |top| top.evaluations);
        let maximum = drawn.filter(|top| top.log_posterior > start.log_posterior).unwrap_or(start);
        let best_values = quantities(&likelihood.model, &maximum.latent);
        let chains = run.chains().without_first(progress.early_draws);
        let best_fit = likelihood.model.at_latent(&maximum.latent).0;
        let draws: Vec<Vec<f64>> = chains
            .chains
            .iter()
            .flat_map(|chain| chain.z.chunks_exact(chains.dimension))
            .map(|z| quantities(&likelihood.model, z))
            .collect();
        let mut parameters = Vec::new();
        for (i, quantity) in likelihood.model.quantities().into_iter().enumerate() {
            let column: Vec<f64> = draws.iter().map(|draw| draw[i]).collect();
            let statistics = DrawStatistics::of(&column)
                .ok_or_else(|| Error::out_of_range("number of draws", column.len(), "at least 2"))?;
            let convergence = progress.quantities.get(i).copied().unwrap_or(Convergence::worst(&[]));
            parameters.push(summary_of(quantity, statistics, best_values[i], convergence));
        }
        let image = likelihood.image(&best_fit).ok_or_else(|| {
            Error::out_of_range("the best fit", "without an image", "a model that can be evaluated")
        })?;
        let evaluations = run.evaluations() + climbed;
        let evidence = run.evidence();
        Ok(Self {
            likelihood,
            settings,
            maximum,
            chains,
            progress,
            evidence,
            parameters,
            best_fit,
            image,
            evaluations,
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

    /// The draws of one fitted or derived quantity, chain by chain.
    pub fn draws_of(&self, name: &str) -> Option<Vec<Vec<f64>>> {
        let i = self.parameters.iter().position(|p| p.name == name)?;
        Some(self.chains.map(|z| quantities(&self.likelihood.model, z)[i]))
    }
}

fn refine_mesh(likelihood: &mut ImageLikelihood, start: &mut Maximum, seed: u64) -> Result<()> {
    /// The maximum moves when the mesh does; twice is enough for it to settle.
    const ROUNDS: usize = 2;
    for _ in 0..ROUNDS {
        likelihood.mesh = likelihood.adaptive_mesh(&start.latent, &start.metric, seed)?;
        let evaluations = start.evaluations;
        *start = climb_from(likelihood, start.latent.clone())?;
        start.evaluations += evaluations;
    }
    Ok(())
}

/// The free parameters and, for the full line of sight, the minimal quantities it implies.
fn quantities(model: &CompiledModel, latent: &[f64]) -> Vec<f64> {
    let (mut values, _) = model.at_latent(latent);
    if let Some(LineOfSightModel::Minimal { los, .. }) = model.implied_minimal(&values) {
        values.extend([los.gamma.re, los.gamma.im, los.omega]);
    }
    values
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
