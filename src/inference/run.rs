//! A run of one sampler: its state between blocks, and the loop until convergence.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::diagnose::{Convergence, ESS_LIMIT};
use super::likelihood::LatentLikelihood;
use super::sample::{
    Chains, EnsembleState, Evidence, NestedState, NutsState, Plan, Problem, SamplerSettings, ValleyState,
};
use crate::error::{Result, require};

/// What must converge, as a function of z: the free parameters and whatever else is reported.
pub type Quantities<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

/// A run between two blocks. It can be saved (serde; every bit survives) and continued.
///
/// ```
/// use haloray::inference::LatentLikelihood;
/// use haloray::inference::SamplerRun;
/// use haloray::inference::sample::{Problem, SamplerSettings};
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
/// let mut run = SamplerRun::start(&SamplerSettings::default(), 42, &problem)?;
/// let progress = run.finish(&Measurement, &|z| z.to_vec(), |run, _| {
///     let saved = serde_json::to_string(run).unwrap_or_default(); // what a killed run continues from
///     assert!(!saved.is_empty());
///     Ok(())
/// })?;
/// assert!(progress.is_converged);
/// let draws = run.chains().coordinate(0).concat();
/// let mean = draws.iter().sum::<f64>() / draws.len() as f64;
/// assert!((mean - 0.8).abs() < 0.1); // prior N(0, 1) and measurement together: 0.8 ± 0.45
/// # Ok::<(), haloray::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SamplerRun {
    settings: SamplerSettings,
    seed: u64,
    /// Blocks done.
    block: u64,
    state: State,
    chains: Chains,
    /// Effective draws of every quantity before which the run goes on.
    min_ess: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum State {
    Nuts(NutsState),
    Valley(Box<ValleyState>),
    Ensemble(EnsembleState),
    Nested(NestedState),
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

impl SamplerRun {
    /// Prepares a run.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for settings out of their domain, a metric that is not positive definite,
    /// missing start points or ones where the likelihood is zero, and priors under which it is zero everywhere.
    pub fn start(settings: &SamplerSettings, seed: u64, problem: &Problem) -> Result<Self> {
        let dimension = problem.likelihood.dimension();
        let ensemble = |plan: Plan, name: &str| -> Result<(State, Chains)> {
            let walkers = plan.walkers(dimension);
            let state = EnsembleState::start(plan, name, seed, problem)?;
            Ok((State::Ensemble(state), Chains::new(dimension, walkers * plan.ensembles, walkers)))
        };
        let (state, chains) = match settings {
            SamplerSettings::Nuts(nuts) => {
                let state = NutsState::start(*nuts, seed, problem)?;
                (State::Nuts(state), Chains::new(dimension, nuts.chains, 1))
            }
            SamplerSettings::Valley(valley) => {
                let state = ValleyState::start(*valley, seed, problem)?;
                (State::Valley(Box::new(state)), Chains::new(dimension, valley.chains, 1))
            }
            SamplerSettings::EnsembleSlice(slice) => ensemble(slice.plan(), "ensemble-slice")?,
            SamplerSettings::Stretch(stretch) => ensemble(stretch.plan()?, "stretch")?,
            SamplerSettings::Nested(nested) => {
                let state = NestedState::start(*nested, seed, problem)?;
                (State::Nested(state), Chains::new(dimension, nested.runs, 1))
            }
        };
        Ok(Self { settings: *settings, seed, block: 0, state, chains, min_ess: ESS_LIMIT })
    }

    /// The same run, which goes on until every quantity has more than `min_ess` effective draws, bulk and tail, even if it
    /// has converged before. Nested sampling stops by itself.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for fewer than convergence needs.
    pub fn until(self, min_ess: f64) -> Result<Self> {
        require(min_ess >= ESS_LIMIT, "min_ess", min_ess, &format!("{ESS_LIMIT} or more"))?;
        Ok(Self { min_ess, ..self })
    }

    /// Computes the next block.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood) {
        self.block += 1;
        let (seed, block, chains) = (self.seed, self.block, &mut self.chains);
        match &mut self.state {
            State::Nuts(nuts) => nuts.advance(likelihood, seed, block, chains),
            State::Valley(valley) => valley.advance(likelihood, seed, block, chains),
            State::Ensemble(ensemble) => ensemble.advance(likelihood, seed, block, chains),
            State::Nested(nested) => nested.advance(likelihood, seed, block, chains),
        }
    }

    /// Computes blocks until the run is finished; `after_block` sees every block, may save the run, and may
    /// stop it by an error.
    ///
    /// # Errors
    /// Those of `after_block`.
    pub fn finish(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        quantities: Quantities,
        mut after_block: impl FnMut(&Self, &RunStatus) -> Result<()>,
    ) -> Result<RunStatus> {
        let mut progress = self.progress(quantities);
        while !progress.is_finished {
            self.advance(likelihood);
            progress = self.progress(quantities);
            after_block(self, &progress)?;
        }
        Ok(progress)
    }

    /// How far the run has come.
    pub fn progress(&self, quantities: Quantities) -> RunStatus {
        let (early_draws, convergence) = self.convergence(quantities);
        let (draws, chains) = (self.chains.draws(), self.chains.chains.len());
        let all_converged = !convergence.is_empty() && convergence.iter().all(Convergence::is_converged);
        let worst = Convergence::worst(&convergence);
        let is_enough = all_converged && worst.ess_bulk.min(worst.ess_tail) > self.min_ess;
        let (max_draws, is_converged, is_finished, remaining) = match &self.state {
            State::Nuts(nuts) => {
                let is_over = is_enough || draws > 0 && nuts.is_exhausted();
                (Some(nuts.max_draws()), all_converged, is_over, None)
            }
            State::Valley(valley) => (Some(valley.max_draws()), all_converged, is_enough, None),
            State::Ensemble(ensemble) => (Some(ensemble.plan.max_draws()), all_converged, is_enough, None),
            State::Nested(nested) => {
                let (is_over, remaining) = (nested.evidence().is_some(), nested.remaining_log_evidence());
                (None, all_converged && nested.has_ended(), is_over, Some(remaining))
            }
        };
        RunStatus {
            is_warming_up: draws == 0,
            draws: draws * chains,
            early_draws,
            max_draws: max_draws.map(|draws| draws * chains),
            evaluations: self.evaluations(),
            divergences: self.chains.divergences(),
            remaining_log_evidence: remaining,
            worst,
            quantities: convergence,
            is_converged,
            is_finished: is_finished || max_draws.is_some_and(|max| draws >= max),
        }
    }

    /// First draws left out, and the convergence of the others.
    ///
    /// The valley sampler learns as it draws. What it drew before it knew the posterior is left out where that converges or,
    /// before anything does, makes more effective draws (Chodera 2016, J. Chem. Theory Comput. 12, 1799).
    fn convergence(&self, quantities: Quantities) -> (usize, Vec<Convergence>) {
        /// Draws of a chain between two looks at fewer of them.
        const LOOK: usize = 500;
        let dimension = self.chains.dimension.max(1);
        let values_of_chain = |z: &[f64]| z.chunks_exact(dimension).map(quantities).collect();
        // By chain, draw and quantity.
        let values: Vec<Vec<Vec<f64>>> =
            self.chains.chains.iter().map(|chain| values_of_chain(&chain.z)).collect();
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
        let looks = match &self.state {
            State::Valley(valley) => draws > 0 && (draws.is_multiple_of(LOOK) || draws >= valley.max_draws()),
            _ => false,
        };
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
        match &self.state {
            State::Nuts(nuts) => nuts.evaluations,
            State::Valley(valley) => valley.evaluations,
            State::Ensemble(ensemble) => ensemble.evaluations,
            State::Nested(nested) => nested.evaluations(),
        }
    }

    /// The evidence, when nested sampling has ended.
    pub fn evidence(&self) -> Option<Evidence> {
        match &self.state {
            State::Nested(nested) => nested.evidence(),
            _ => None,
        }
    }

    /// The draws kept so far; of nested sampling there are none before its end.
    pub fn chains(&self) -> &Chains {
        &self.chains
    }

    /// Settings of the run.
    pub fn settings(&self) -> &SamplerSettings {
        &self.settings
    }

    /// Seed of the run.
    pub fn seed(&self) -> u64 {
        self.seed
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::inference::Curvature;
    use crate::inference::sample::ValleySettings;
    use crate::numerics::random::{Stage, stream};

    /// z with its prior alone.
    struct Prior;

    impl LatentLikelihood for Prior {
        fn dimension(&self) -> usize {
            2
        }

        fn log_likelihood(&self, _: &[f64]) -> f64 {
            0.0
        }

        fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
            unreachable!("only curvatures are asked for")
        }

        fn curvature(&self, z: &[f64]) -> Option<Curvature> {
            Some(Curvature {
                log_posterior: -0.5 * z.iter().map(|z| z * z).sum::<f64>(),
                gradient: -nalgebra::DVector::from_column_slice(z),
                metric: nalgebra::DMatrix::identity(2, 2),
            })
        }
    }

    #[test]
    fn draws_of_a_valley_not_yet_known_are_left_out_where_the_others_converge() {
        let problem = Problem { likelihood: &Prior, starts: &[vec![0.0; 2]], metric: None };
        let settings = SamplerSettings::Valley(ValleySettings::default());
        let mut run = SamplerRun::start(&settings, 1, &problem).unwrap();
        let progress = |run: &mut SamplerRun, draws: usize| {
            run.chains = Chains::new(2, 4, 1);
            for (number, chain) in run.chains.chains.iter_mut().enumerate() {
                let mut rng = stream(3, number as u64, Stage::Sampling, 0);
                for draw in 0..draws {
                    let early = if draw < 300 { number as f64 } else { 0.0 };
                    let z: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
                    chain.push(&[z[0] + early, z[1]], 0.0);
                }
            }
            run.progress(&|z| z.to_vec())
        };
        let late = progress(&mut run, 2000);
        assert!(late.is_converged && late.is_finished);
        assert_eq!((late.early_draws, late.draws), (500, 8000));
        assert_eq!(run.chains().without_first(500).chains[3].z, run.chains().chains[3].z[1000..]);
        let between_looks = progress(&mut run, 1999);
        assert!(!between_looks.is_converged && between_looks.early_draws == 0);
        let still_early = progress(&mut run, 500);
        assert!(!still_early.is_converged);
    }
}
