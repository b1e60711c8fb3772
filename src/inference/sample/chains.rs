//! The draws of all chains with what the sampler noted beside them.

use serde::{Deserialize, Serialize};

/// The draws of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Chains {
    /// Coordinates of a draw.
    pub dimension: usize,
    /// Chains that move together: 1, or the walkers of an ensemble. Consecutive chains form a group; only
    /// groups are independent of one another, so that R-hat compares groups.
    pub group_size: usize,
    /// The chains, of equal length.
    pub chains: Vec<Chain>,
}

/// One chain; all columns have one entry a draw, those that a sampler does not know are empty.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Chain {
    /// Latent coordinates, draw by draw.
    pub z: Vec<f64>,
    /// ln L.
    pub log_likelihood: Vec<f64>,
    /// Energy −ln p + ½|momentum|² at the start of the trajectory (NUTS).
    pub energy: Vec<f64>,
    /// Mean acceptance probability along the trajectory (NUTS).
    pub acceptance: Vec<f64>,
    /// Whether the trajectory left the region where its integrator is stable (NUTS).
    pub divergent: Vec<bool>,
    /// Doublings of the trajectory (NUTS).
    pub tree_depth: Vec<u8>,
}

impl Chain {
    /// Draws so far.
    pub fn len(&self) -> usize {
        self.log_likelihood.len()
    }

    /// True before the first draw.
    pub fn is_empty(&self) -> bool {
        self.log_likelihood.is_empty()
    }

    /// Adds a draw without notes.
    pub(in crate::inference) fn push(&mut self, z: &[f64], log_likelihood: f64) {
        self.z.extend_from_slice(z);
        self.log_likelihood.push(log_likelihood);
    }

    /// Puts the draws of another block behind these.
    pub(super) fn append(&mut self, other: Self) {
        self.z.extend(other.z);
        self.log_likelihood.extend(other.log_likelihood);
        self.energy.extend(other.energy);
        self.acceptance.extend(other.acceptance);
        self.divergent.extend(other.divergent);
        self.tree_depth.extend(other.tree_depth);
    }

    /// Log-density ln L − ½|z|² of every draw.
    pub fn log_density(&self, dimension: usize) -> Vec<f64> {
        let prior = self.z.chunks_exact(dimension).map(super::normal::log_prior);
        self.log_likelihood.iter().zip(prior).map(|(log_l, log_prior)| log_l + log_prior).collect()
    }
}

impl Chains {
    /// Empty chains.
    pub(in crate::inference) fn new(dimension: usize, count: usize, group_size: usize) -> Self {
        Self { dimension, group_size, chains: vec![Chain::default(); count] }
    }

    /// Whether all columns are as long as they must be, and chains as many as `like` has.
    pub(in crate::inference) fn fits(&self, like: &Self) -> bool {
        let (draws, dimension) = (self.draws(), self.dimension);
        let has_columns = |chain: &Chain| {
            let notes =
                [chain.energy.len(), chain.acceptance.len(), chain.divergent.len(), chain.tree_depth.len()];
            chain.len() == draws
                && chain.z.len() == draws * dimension
                && notes.iter().all(|length| [0, draws].contains(length))
        };
        (dimension, self.group_size, self.chains.len())
            == (like.dimension, like.group_size, like.chains.len())
            && self.chains.iter().all(has_columns)
    }

    /// Leaves chains without draws.
    pub(in crate::inference) fn forget(&mut self) {
        self.chains.fill(Chain::default());
    }

    /// Draws of one chain.
    pub fn draws(&self) -> usize {
        self.chains.first().map_or(0, Chain::len)
    }

    /// The same chains without their first draws.
    pub fn without_first(&self, draws: usize) -> Self {
        let chains = self.chains.iter().map(|chain| Chain {
            z: later(&chain.z, draws * self.dimension),
            log_likelihood: later(&chain.log_likelihood, draws),
            energy: later(&chain.energy, draws),
            acceptance: later(&chain.acceptance, draws),
            divergent: later(&chain.divergent, draws),
            tree_depth: later(&chain.tree_depth, draws),
        });
        Self { chains: chains.collect(), ..*self }
    }

    /// Divergent trajectories of all chains.
    pub fn divergences(&self) -> usize {
        self.chains.iter().flat_map(|chain| &chain.divergent).filter(|divergent| **divergent).count()
    }

    /// The draws of one coordinate, a vector a chain.
    pub fn coordinate(&self, index: usize) -> Vec<Vec<f64>> {
        let of = |chain: &Chain| chain.z.iter().skip(index).step_by(self.dimension.max(1)).copied().collect();
        self.chains.iter().map(of).collect()
    }

    /// What `value` makes of each draw z, a vector a chain: a parameter, or a function of several.
    pub fn map(&self, value: impl Fn(&[f64]) -> f64) -> Vec<Vec<f64>> {
        let of = |chain: &Chain| chain.z.chunks_exact(self.dimension.max(1)).map(&value).collect();
        self.chains.iter().map(of).collect()
    }
}

/// A column without its first entries; empty if it is unknown.
fn later<T: Clone>(column: &[T], first: usize) -> Vec<T> {
    column.get(first..).unwrap_or(&[]).to_vec()
}
