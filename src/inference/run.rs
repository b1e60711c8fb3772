//! A run of one sampler: its state between blocks, and the loop until convergence.

use std::fmt;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::diagnose::{Convergence, ESS_LIMIT};
use super::likelihood::{Counter, LatentLikelihood};
use super::sample::{AnySampler, Chains, Evidence, Problem, SamplerSettings};
use crate::error::{Domain, Result};
use crate::monitor::Monitor;

/// What must converge, as a function of z: the free parameters and whatever else is reported.
pub type Quantities<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

/// A run between two blocks. It can be saved (serde, in a format that keeps every bit) and continued.
///
/// ```
/// use haloray::inference::LatentLikelihood;
/// use haloray::inference::SamplerRun;
/// use haloray::inference::sample::{NutsSettings, Problem, SamplerSettings};
/// use haloray::monitor::Silent;
///
/// /// One measurement of z: 1.0 ± 0.5.
/// struct Measurement;
/// impl LatentLikelihood for Measurement {
///     fn dimension(&self) -> usize {
///         1
///     }
///     fn log_likelihood(&self, z: &[f64]) -> f64 {
///         -2.0 * (z[0] - 1.0).powi(2)
///     }
///     fn log_likelihood_gradient(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
///         gradient[0] = -4.0 * (z[0] - 1.0);
///         self.log_likelihood(z)
///     }
/// }
///
/// let problem = Problem { likelihood: &Measurement, starts: &[vec![0.0]], metric: None };
/// let settings = SamplerSettings::Nuts(NutsSettings::default());
/// let mut run = SamplerRun::start(&settings, 42, &problem, &Silent)?;
/// let status = run.finish(&Measurement, &|z| z.to_vec(), &Silent)?;
/// assert!(status.is_converged);
/// let draws = run.chains().coordinate(0).concat();
/// let mean = draws.iter().sum::<f64>() / draws.len() as f64;
/// assert!((mean - 0.8).abs() < 0.1); // prior N(0, 1) and measurement together: 0.8 ± 0.45
/// # Ok::<(), haloray::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SamplerRun {
    seed: u64,
    /// Blocks done.
    block: u64,
    sampler: AnySampler,
    chains: Chains,
    evaluations: u64,
    /// Effective draws of every quantity before which the run goes on.
    min_ess: f64,
    /// Quantities of the draws by chain, draw and quantity, as far as they have been asked for.
    #[serde(skip)]
    values: Vec<Vec<Vec<f64>>>,
}

/// How far a run has come.
#[derive(Debug, Clone, PartialEq)]
pub struct RunStatus {
    /// True while no draw is kept: warm-up, or a nested run under way.
    pub is_warming_up: bool,
    /// Draws kept, of all chains.
    pub draws: usize,
    /// First draws of each chain that convergence leaves out.
    pub early_draws: usize,
    /// Draws after which the run stops unconverged, of all chains; `None` for nested sampling, which stops by
    /// itself.
    pub max_draws: Option<usize>,
    /// Evaluations of the likelihood or its gradient.
    pub evaluations: u64,
    /// Divergent trajectories among the draws kept (NUTS).
    pub divergences: usize,
    /// What the live points may still add to the log-evidence (nested sampling).
    pub remaining_log_evidence: Option<f64>,
    /// Convergence of each quantity.
    pub quantities: Vec<Convergence>,
    /// The worst of them.
    pub worst: Convergence,
    /// True if every quantity has converged, and the evidence where there is one.
    pub is_converged: bool,
    /// True if there is nothing more to do: converged with as many effective draws as wanted, or at the end of what is
    /// allowed.
    pub is_finished: bool,
}

impl fmt::Display for RunStatus {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.is_warming_up {
            return write!(f, "warming up, {} evaluations", self.evaluations);
        }
        let Convergence { r_hat, ess_bulk, ess_tail } = self.worst;
        write!(f, "{} draws, R-hat {r_hat:.3}, ESS {:.0}", self.draws, ess_bulk.min(ess_tail))
    }
}

impl SamplerRun {
    /// Prepares a run.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for settings out of their domain, a metric that is not positive definite,
    /// missing start points or ones where the likelihood is zero, and priors under which it is zero everywhere.
    /// [`crate::Error::Cancelled`].
    pub fn start(
        settings: &SamplerSettings,
        seed: u64,
        problem: &Problem,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let counter = Counter::new(monitor);
        let started = AnySampler::start(
            settings,
            seed,
            &Problem { likelihood: &counter.watch(problem.likelihood), ..*problem },
        );
        let (evaluations, sampler) = (counter.evaluations()?, started?);
        let chains = sampler.sampler().empty_chains(problem.likelihood.dimension());
        Ok(Self { seed, block: 0, sampler, chains, evaluations, min_ess: ESS_LIMIT, values: vec![] })
    }

    /// The same run, which goes on until every quantity has more than `min_ess` effective draws, bulk and tail, even if it
    /// has converged before. Nested sampling stops by itself.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for fewer than convergence needs.
    pub fn until(self, min_ess: f64) -> Result<Self> {
        Domain::at_least(ESS_LIMIT).check("min_ess", min_ess)?;
        Ok(Self { min_ess, ..self })
    }

    /// Computes the next block.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`], after which the run is as it was before the block.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood, monitor: &dyn Monitor) -> Result<()> {
        let counter = Counter::new(monitor);
        let (before, draws) = ((self.sampler.clone(), self.chains.clone()), self.chains.draws());
        let sampler = self.sampler.sampler_mut();
        sampler.advance(&counter.watch(likelihood), self.seed, self.block + 1, &mut self.chains);
        let evaluations = counter.evaluations();
        if evaluations.is_err() {
            (self.sampler, self.chains) = before;
        }
        self.evaluations += evaluations?;
        self.block += 1;
        if self.chains.draws() < draws {
            self.values.clear();
        }
        Ok(())
    }

    /// Computes blocks until the run is finished.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn finish(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        quantities: Quantities,
        monitor: &dyn Monitor,
    ) -> Result<RunStatus> {
        loop {
            let status = self.status(quantities);
            if status.is_finished {
                return Ok(status);
            }
            self.advance(likelihood, monitor)?;
        }
    }

    /// How far the run has come; `quantities` must be the same at every call.
    pub fn status(&mut self, quantities: Quantities) -> RunStatus {
        self.compute_values(quantities);
        let (early_draws, convergence) = self.convergence();
        let (draws, chains) = (self.chains.draws(), self.chains.chains.len());
        let all_converged = !convergence.is_empty() && convergence.iter().all(Convergence::is_converged);
        let worst = Convergence::worst(&convergence);
        let is_enough = all_converged && worst.ess_bulk.min(worst.ess_tail) > self.min_ess;
        let sampler = self.sampler.sampler();
        let (max_draws, evidence) = (sampler.max_draws(), sampler.evidence());
        let is_over = match &evidence {
            Some(so_far) => so_far.evidence.is_some(),
            None => is_enough || draws > 0 && sampler.is_exhausted(self.evaluations),
        };
        RunStatus {
            is_warming_up: draws == 0,
            draws: draws * chains,
            early_draws,
            max_draws: max_draws.map(|draws| draws * chains),
            evaluations: self.evaluations,
            divergences: self.chains.divergences(),
            remaining_log_evidence: evidence.map(|so_far| so_far.remaining_log_evidence),
            worst,
            quantities: convergence,
            is_converged: all_converged && evidence.is_none_or(|so_far| so_far.is_precise),
            is_finished: is_over || max_draws.is_some_and(|max| draws >= max),
        }
    }

    /// Quantities of the draws that are new.
    fn compute_values(&mut self, quantities: Quantities) {
        let dimension = self.chains.dimension.max(1);
        self.values.resize(self.chains.chains.len(), vec![]);
        for (chain, values) in self.chains.chains.iter().zip(&mut self.values) {
            values.extend(chain.z.chunks_exact(dimension).skip(values.len()).map(quantities));
        }
    }

    /// First draws left out, and the convergence of the others.
    ///
    /// The valley sampler learns as it draws. What it drew before it knew the posterior is left out where that converges or,
    /// before anything does, makes more effective draws (Chodera 2016, J. Chem. Theory Comput. 12, 1799).
    fn convergence(&self) -> (usize, Vec<Convergence>) {
        /// Draws of a chain between two looks at fewer of them.
        const LOOK: usize = 500;
        let values = &self.values;
        let count = values.first().and_then(|chain| chain.first()).map_or(0, Vec::len);
        let after = |early: usize| -> Vec<Convergence> {
            (0..count)
                .into_par_iter()
                .map(|quantity| {
                    let of =
                        |chain: &Vec<Vec<f64>>| chain[early..].iter().map(|draw| draw[quantity]).collect();
                    let chains: Vec<Vec<f64>> = values.iter().map(of).collect();
                    Convergence::of(&chains, self.chains.group_size)
                })
                .collect()
        };
        let draws = self.chains.draws();
        let mut best = (0, after(0));
        let rank = |convergence: &[Convergence]| {
            let worst = Convergence::worst(convergence);
            (worst.is_converged(), worst.ess_bulk.min(worst.ess_tail))
        };
        let sampler = self.sampler.sampler();
        let is_time = draws.is_multiple_of(LOOK) || sampler.max_draws().is_some_and(|max| draws >= max);
        let looks = sampler.learns() && draws > 0 && is_time;
        for early in [draws / 4, draws / 2].into_iter().filter(|_| looks) {
            if rank(&best.1).0 {
                break;
            }
            let convergence = after(early);
            if rank(&convergence) > rank(&best.1) {
                best = (early, convergence);
            }
        }
        best
    }

    /// Evaluations of the likelihood or its gradient so far.
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The evidence, when nested sampling has ended.
    pub fn evidence(&self) -> Option<Evidence> {
        self.sampler.sampler().evidence()?.evidence
    }

    /// The draws kept so far; of nested sampling there are none before its end.
    pub fn chains(&self) -> &Chains {
        &self.chains
    }

    /// Quantities of every draw, by chain and draw, as the last [`Self::status`] was asked for them.
    pub fn values(&self) -> &[Vec<Vec<f64>>] {
        &self.values
    }

    /// Whether what was read back is a run of these settings on a problem of that dimension.
    pub(super) fn fits(&self, settings: &SamplerSettings, seed: u64, dimension: usize) -> bool {
        let sampler = self.sampler.sampler();
        self.seed == seed
            && self.sampler.has_settings(settings)
            && sampler.fits(dimension)
            && self.chains.fits(&sampler.empty_chains(dimension))
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::inference::sample::ValleySettings;
    use crate::monitor::Silent;
    use crate::numerics::random::{Stage, stream};

    /// z with its prior alone.
    const PRIOR: Known = Known {
        dimension: 2,
        log_likelihood: |_| 0.0,
        slope_and_metric: |z| (-nalgebra::DVector::from_column_slice(z), nalgebra::DMatrix::identity(2, 2)),
    };

    #[test]
    fn draws_of_a_valley_not_yet_known_are_left_out_where_the_others_converge() {
        let problem = Problem { likelihood: &PRIOR, starts: &[vec![0.0; 2]], metric: None };
        let settings = SamplerSettings::Valley(ValleySettings::default());
        let mut run = SamplerRun::start(&settings, 1, &problem, &Silent).unwrap();
        let status = |run: &mut SamplerRun, draws: usize| {
            run.chains = Chains::new(2, 4, 1);
            run.values.clear();
            for (number, chain) in run.chains.chains.iter_mut().enumerate() {
                let mut rng = stream(3, number as u64, Stage::Sampling, 0);
                for draw in 0..draws {
                    let early = if draw < 300 { number as f64 } else { 0.0 };
                    let z: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
                    chain.push(&[z[0] + early, z[1]], 0.0);
                }
            }
            run.status(&|z| z.to_vec())
        };
        let late = status(&mut run, 2000);
        assert!(late.is_converged && late.is_finished);
        assert_eq!((late.early_draws, late.draws), (500, 8000));
        assert_eq!(run.chains().without_first(500).chains[3].z, run.chains().chains[3].z[1000..]);
        let between_looks = status(&mut run, 1999);
        assert!(!between_looks.is_converged && between_looks.early_draws == 0);
        let still_early = status(&mut run, 500);
        assert!(!still_early.is_converged);
    }
}
