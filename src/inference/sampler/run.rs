//! A run of one sampler: its state between blocks, and the loop until convergence.

use serde::{Deserialize, Serialize};

use super::SamplerSettings;
use super::chains::Chains;
use super::nuts::NutsState;
use super::target::Problem;
use crate::error::Result;
use crate::inference::LatentLikelihood;
use crate::inference::convergence::Convergence;

/// What must converge, as a function of z: the free parameters and whatever else is reported.
pub type Quantities<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

/// A run between two blocks. It can be saved (serde; every bit survives) and continued.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SamplerRun {
    settings: SamplerSettings,
    seed: u64,
    /// Blocks done.
    block: u64,
    state: State,
    chains: Chains,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum State {
    Nuts(NutsState),
}

/// How far a run has come.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// True while draws are still thrown away.
    pub is_warming_up: bool,
    /// Draws kept, of all chains.
    pub draws: usize,
    /// Draws after which the run stops unconverged, of all chains.
    pub max_draws: usize,
    /// Evaluations of the likelihood or its gradient.
    pub evaluations: u64,
    /// Divergent trajectories among the draws kept.
    pub divergences: usize,
    /// Convergence of each quantity.
    pub quantities: Vec<Convergence>,
    /// The worst of them.
    pub worst: Convergence,
    /// True if every quantity has converged.
    pub is_converged: bool,
    /// True if there is nothing more to do: converged, or at the end of the draws allowed.
    pub is_finished: bool,
}

impl SamplerRun {
    /// Prepares a run.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for settings out of their domain, a metric that is not positive definite, missing start points or
    /// ones where the likelihood is zero.
    pub fn start(settings: &SamplerSettings, seed: u64, problem: &Problem) -> Result<Self> {
        let dimension = problem.likelihood.dimension();
        let (state, chains) = match settings {
            SamplerSettings::Nuts(nuts) => {
                (State::Nuts(NutsState::start(*nuts, seed, problem)?), Chains::new(dimension, nuts.chains, 1))
            }
        };
        Ok(Self { settings: *settings, seed, block: 0, state, chains })
    }

    /// Computes the next block.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood) {
        self.block += 1;
        match &mut self.state {
            State::Nuts(nuts) => nuts.advance(likelihood, self.seed, self.block, &mut self.chains),
        }
    }

    /// Computes blocks until the run is finished; `after_block` sees every block, may save the run, and may stop it by an
    /// error.
    ///
    /// # Errors
    /// Those of `after_block`.
    pub fn finish(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        quantities: Quantities,
        mut after_block: impl FnMut(&Self, &Progress) -> Result<()>,
    ) -> Result<Progress> {
        let mut progress = self.progress(quantities);
        while !progress.is_finished {
            self.advance(likelihood);
            progress = self.progress(quantities);
            after_block(self, &progress)?;
        }
        Ok(progress)
    }

    /// How far the run has come.
    pub fn progress(&self, quantities: Quantities) -> Progress {
        let max_draws_of_chain = match (&self.state, &self.settings) {
            (State::Nuts(_), SamplerSettings::Nuts(nuts)) => nuts.max_draws,
        };
        let convergence = self.convergence(quantities);
        let worst = Convergence::worst(&convergence);
        let is_converged = !convergence.is_empty() && convergence.iter().all(Convergence::is_converged);
        Progress {
            is_warming_up: self.is_warming_up(),
            draws: self.chains.draws() * self.chains.chains.len(),
            max_draws: max_draws_of_chain * self.chains.chains.len(),
            evaluations: self.evaluations(),
            divergences: self.chains.divergences(),
            quantities: convergence,
            worst,
            is_converged,
            is_finished: is_converged || self.chains.draws() >= max_draws_of_chain,
        }
    }

    fn convergence(&self, quantities: Quantities) -> Vec<Convergence> {
        // By chain, draw and quantity.
        let dimension = self.chains.dimension.max(1);
        let values: Vec<Vec<Vec<f64>>> = self
            .chains
            .chains
            .iter()
            .map(|chain| chain.z.chunks_exact(dimension).map(quantities).collect())
            .collect();
        let count = values.first().and_then(|chain| chain.first()).map_or(0, Vec::len);
        (0..count)
            .map(|quantity| {
                let of = |chain: &Vec<Vec<f64>>| chain.iter().map(|draw| draw[quantity]).collect();
                let chains: Vec<Vec<f64>> = values.iter().map(of).collect();
                Convergence::of(&chains, self.chains.group_size)
            })
            .collect()
    }

    fn is_warming_up(&self) -> bool {
        match &self.state {
            State::Nuts(nuts) => nuts.is_warming_up(self.block),
        }
    }

    /// Evaluations of the likelihood or its gradient so far.
    pub fn evaluations(&self) -> u64 {
        match &self.state {
            State::Nuts(nuts) => nuts.evaluations,
        }
    }

    /// The draws kept so far.
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
