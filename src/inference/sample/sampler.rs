//! What every sampler is: a state that one block of draws after the other advances.

use serde::{Deserialize, Serialize};

use super::chains::Chains;
use crate::inference::likelihood::LatentLikelihood;

/// A sampler between two blocks.
///
/// **A block is a function of settings, seed, number of the block and state alone**, for any number of threads: a run that is
/// saved after any block, killed, read back and continued ends with the same bytes as one never stopped.
pub trait Sampler {
    /// Its chains before the first draw.
    fn empty_chains(&self, dimension: usize) -> Chains;

    /// The next block, counted from one: a round of warm-up, or draws that are put behind those of `chains`.
    fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains);

    /// Draws of a chain after which sampling stops; `None` where it ends by itself.
    fn max_draws(&self) -> Option<usize>;

    /// Whether so many evaluations are all that is allowed.
    fn is_exhausted(&self, _evaluations: u64) -> bool {
        false
    }

    /// Whether it learns about the posterior as it draws, so that its first draws may be worse than later ones.
    fn learns(&self) -> bool {
        false
    }

    /// What it knows of the evidence, if it asks for it; such a sampler ends when the evidence is known.
    fn evidence(&self) -> Option<EvidenceSoFar> {
        None
    }

    /// Whether a state that was read back has the shapes of a problem of that dimension.
    fn fits(&self, dimension: usize) -> bool;
}

/// The evidence of a model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// ln Z = ln ∫ L π: Z is normalised over the prior, with the likelihood's own constants.
    pub log_evidence: f64,
    /// Standard deviation of ln Z when the unknown shrinkage of each step is drawn anew (Skilling 2006), with
    /// that of the fraction of the prior that has any likelihood.
    pub log_evidence_error: f64,
    /// Information H = ∫ p ln(p/π) in nats: how much the data tell; √(H/live points) is the classical error.
    pub information_nats: f64,
    /// Kish's effective number (Σw)²/Σw² of weighted draws, of all runs. It leaves out that the weights
    /// themselves are uncertain: means scatter by up to 1.7 times what it says.
    pub effective_draws: f64,
}

/// How far nested sampling has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvidenceSoFar {
    /// The evidence, at the end.
    pub evidence: Option<Evidence>,
    /// What the live points may still add to ln Z.
    pub remaining_log_evidence: f64,
    /// Whether that is as little as was asked for.
    pub is_precise: bool,
}
