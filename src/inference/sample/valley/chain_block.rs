//! The draws of one chain in a block: proposals along the valley, each with draws across it.

use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::importance::ImportanceDraws;
use super::kernel_density::KernelDensity;
use super::position::Position;
use super::surrogate::{APART, KnownMaximum, Surrogate};
use super::surrogate_moves::transition;
use crate::inference::likelihood::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES};
use crate::inference::sample::chains::Chain;

/// What proposals are made with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Proposals {
    pub axes: Axes,
    pub surrogate: Surrogate,
    /// Where chains have been.
    pub density: Option<KernelDensity>,
    /// How t is drawn at each s.
    pub importance: ImportanceDraws,
}

/// What one chain brings back from a block.
pub(super) struct ChainBlock {
    pub position: Position,
    pub chain: Chain,
    pub known: Vec<KnownMaximum>,
    /// Which of those the position belongs to, `None` of that on which it began; and the same of every draw.
    pub standing: Option<usize>,
    pub visited: Vec<Option<usize>>,
    /// Deviation of ln w at each maximum.
    pub spreads: Vec<f64>,
}

impl Proposals {
    /// A chain's `draws` from a position on.
    pub fn chain_block(
        &self,
        likelihood: &dyn LatentLikelihood,
        position: Position,
        draws: usize,
        mut rng: ChaCha8Rng,
    ) -> ChainBlock {
        let mut block = ChainBlock {
            position: self.renewed(likelihood, position, &mut rng),
            chain: Chain::default(),
            known: vec![],
            standing: None,
            visited: vec![],
            spreads: vec![],
        };
        for _ in (0..draws).take_while(|_| !likelihood.is_cancelled()) {
            self.propose(likelihood, &mut block, &mut rng);
            block.chain.push(block.position.z.as_slice(), block.position.log_likelihood);
            block.visited.push(block.standing);
        }
        block
    }

    /// A position as the surrogate of this block sees it: what is remembered of it was made with that of the block before.
    fn renewed(&self, likelihood: &dyn LatentLikelihood, from: Position, rng: &mut ChaCha8Rng) -> Position {
        match self.maximum(likelihood, &self.surrogate.x(&from.s), &from.s) {
            Some(Ok(maximum)) => from.renewed(likelihood, &self.axes, &maximum, self.importance, rng),
            _ => from,
        }
    }

    /// One proposal, accepted or not.
    fn propose(&self, likelihood: &dyn LatentLikelihood, block: &mut ChainBlock, rng: &mut ChaCha8Rng) {
        let start = self.surrogate.x(&block.position.s);
        let (x, surrogate_gain) = transition(&self.surrogate, self.density.as_ref(), &start, rng);
        if x == start {
            return;
        }
        let s = self.surrogate.s(&x);
        let maximum = match self.maximum(likelihood, &x, &s) {
            Some(Ok(maximum)) => maximum,
            // From there the next search nearby goes on.
            Some(Err(reached)) => {
                block.known.push(KnownMaximum::new(s, &reached));
                return;
            }
            None => return,
        };
        block.known.push(KnownMaximum::new(s.clone(), &maximum));
        let gain = maximum.log_marginal() - block.position.log_marginal;
        if rng.random::<f64>().ln() >= gain - surrogate_gain {
            return;
        }
        let (position, spread) = Position::draw(likelihood, &self.axes, s, &maximum, self.importance, rng);
        block.spreads.push(spread);
        if rng.random::<f64>().ln() < position.log_weight() - block.position.log_weight() {
            block.position = position;
            block.standing = Some(block.known.len() - 1);
        }
    }

    /// The conditional maximum at s, sought again where the one found is far below what the surrogate promises: ln p may have
    /// several maxima over t. As [`Axes::search`].
    fn maximum(
        &self,
        likelihood: &dyn LatentLikelihood,
        x: &DVector<f64>,
        s: &DVector<f64>,
    ) -> Option<Result<ConditionalMaximum, ConditionalMaximum>> {
        let promised = self.surrogate.log_marginal(x, None).0;
        let search = |guess| self.axes.search(likelihood, s, guess, MOST_CURVATURES);
        let [together, nearest] = self.surrogate.stiff(x);
        match search(together)? {
            Ok(found) if found.log_marginal() < promised - APART => {
                let other = search(nearest)
                    .and_then(Result::ok)
                    .filter(|other| other.log_marginal() > found.log_marginal());
                Some(Ok(other.unwrap_or(found)))
            }
            found => Some(found),
        }
    }

    /// Whether all shapes are those of a problem of that dimension.
    pub fn fits(&self, dimension: usize) -> bool {
        let [slow, stiff] = [self.axes.slow_dimension(), self.axes.stiff_dimension()];
        self.axes.fits(dimension)
            && self.surrogate.fits(slow, stiff)
            && self.density.as_ref().is_none_or(|density| density.fits(slow))
    }
}
