//! One chain's way in a block: proposals along the valley, each followed by steps across it.

use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::position::Position;
use super::surrogate::{APART, KnownMaximum};
use super::surrogate_moves::{Pace, transition};
use super::{MOST_CURVATURES, ValleyState};
use crate::inference::LatentLikelihood;
use crate::inference::optimise::ConditionalMaximum;
use crate::inference::sample::chains::Chain;

/// What one chain brings back from a block.
pub(super) struct ChainBlock {
    pub place: Position,
    pub chain: Chain,
    pub known: Vec<KnownMaximum>,
    /// Which of those the place stands on, `None` of that on which it began; and the same of every draw.
    pub standing: Option<usize>,
    pub visited: Vec<Option<usize>>,
    /// Deviation of ln w at each floor.
    pub spreads: Vec<f64>,
    pub evaluations: u64,
}

impl ValleyState {
    /// A chain's `draws` from a place on.
    pub(super) fn leg(
        &self,
        likelihood: &dyn LatentLikelihood,
        place: Position,
        draws: usize,
        mut rng: ChaCha8Rng,
    ) -> ChainBlock {
        let mut leg = ChainBlock {
            place,
            chain: Chain::default(),
            known: vec![],
            standing: None,
            visited: vec![],
            spreads: vec![],
            evaluations: 0,
        };
        for _ in 0..draws {
            self.propose(likelihood, &mut leg, &mut rng);
            for _ in 0..self.across.steps() {
                leg.place.step(likelihood, &self.axes, &mut rng);
            }
            leg.evaluations += self.across.steps() as u64;
            leg.chain.push(leg.place.z.as_slice(), leg.place.log_likelihood);
            leg.visited.push(leg.standing);
        }
        leg
    }

    /// One proposal, accepted or not.
    fn propose(&self, likelihood: &dyn LatentLikelihood, leg: &mut ChainBlock, rng: &mut ChaCha8Rng) {
        let start = self.surrogate.x(&leg.place.s);
        let (x, surrogate_gain) = transition(&self.surrogate, self.memory.as_ref(), self.pace, &start, rng);
        if x == start {
            return;
        }
        let s = self.surrogate.s(&x);
        let floor = self.floor(likelihood, &x, &s, &mut leg.evaluations);
        let floor = match floor {
            Some(Ok(floor)) => floor,
            // From there the next search nearby goes on.
            Some(Err(reached)) if self.pace == Pace::Learning => {
                leg.known.push(KnownMaximum::new(s, &reached));
                return;
            }
            _ => return,
        };
        leg.known.push(KnownMaximum::new(s.clone(), &floor));
        let gain = floor.log_marginal() - leg.place.log_marginal;
        if rng.random::<f64>().ln() >= gain - surrogate_gain {
            return;
        }
        let (place, spread) = Position::draw(likelihood, &self.axes, s, &floor, self.across, rng);
        leg.evaluations += self.across.tries as u64;
        leg.spreads.push(spread);
        if rng.random::<f64>().ln() < place.log_weight() - leg.place.log_weight() {
            leg.place = place;
            leg.standing = Some(leg.known.len() - 1);
        }
    }

    /// The floor at s, sought again where the one found is far below what the surrogate promises: ln p may have several maxima
    /// over t. As [`Axes::search`](crate::inference::optimise::Axes::search).
    fn floor(
        &self,
        likelihood: &dyn LatentLikelihood,
        x: &DVector<f64>,
        s: &DVector<f64>,
        evaluations: &mut u64,
    ) -> Option<Result<ConditionalMaximum, ConditionalMaximum>> {
        let promised = self.surrogate.log_marginal(x, None).0;
        let mut search = |guess| self.axes.search(likelihood, s, guess, MOST_CURVATURES, evaluations);
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
}
