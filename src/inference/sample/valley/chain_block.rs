//! The draws of one chain in a block: proposals along the valley, each with draws across it.

use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::importance::ImportanceDraws;
use super::kernel_density::KernelDensity;
use super::known_maximum::KnownMaximum;
use super::position::Position;
use super::surrogate::{APART, Surrogate};
use super::surrogate_moves::transition;
use super::transport_map::TransportMap;
use crate::inference::likelihood::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES};
use crate::inference::sample::chains::Chain;

/// What proposals are made with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Proposals {
    pub axes: Axes,
    pub surrogate: Surrogate,
    /// In whose coordinates steps on it are made.
    pub map: TransportMap,
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
    /// Variance of one weight at each maximum.
    pub variances: Vec<f64>,
}

impl Proposals {
    /// A chain's `draws` from a position on, or from another t at the same s where none of them will be kept.
    pub fn chain_block(
        &self,
        likelihood: &dyn LatentLikelihood,
        position: Position,
        (draws, is_warm_up): (usize, bool),
        mut rng: ChaCha8Rng,
    ) -> ChainBlock {
        let mut block = ChainBlock {
            position: self.renewed(likelihood, position, is_warm_up, &mut rng),
            chain: Chain::default(),
            known: vec![],
            standing: None,
            visited: vec![],
            variances: vec![],
        };
        for _ in (0..draws).take_while(|_| !likelihood.is_cancelled()) {
            self.propose(likelihood, &mut block, &mut rng);
            block.position.move_across(likelihood, &self.axes, &mut rng);
            block.chain.push(block.position.z.as_slice(), block.position.log_likelihood);
            block.visited.push(block.standing);
        }
        block
    }

    /// A position as the surrogate of this block sees it: what is remembered of it was made with that of the block before. A t
    /// that few draws come near to, as there may be before anything is known, would hold the chain; in warm-up t is new too.
    fn renewed(
        &self,
        likelihood: &dyn LatentLikelihood,
        from: Position,
        is_warm_up: bool,
        rng: &mut ChaCha8Rng,
    ) -> Position {
        let (axes, importance) = (&self.axes, self.importance);
        match self.maximum(likelihood, &from.s) {
            Some(Ok(maximum)) if is_warm_up => {
                let (drawn, _) = Position::draw(likelihood, axes, from.s.clone(), &maximum, importance, rng);
                if drawn.log_weight().is_finite() { drawn } else { from }
            }
            Some(Ok(maximum)) => from.renewed(likelihood, axes, &maximum, importance, rng),
            _ => from,
        }
    }

    /// One proposal, accepted or not.
    fn propose(&self, likelihood: &dyn LatentLikelihood, block: &mut ChainBlock, rng: &mut ChaCha8Rng) {
        let moved = transition((&self.surrogate, &self.map), self.density.as_ref(), &block.position.s, rng);
        let s = moved.s;
        if s == block.position.s {
            return;
        }
        let maximum = match self.maximum(likelihood, &s) {
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
        if rng.random::<f64>().ln() >= gain - moved.gain {
            return;
        }
        let (position, variance) = Position::draw(likelihood, &self.axes, s, &maximum, self.importance, rng);
        block.variances.push(variance);
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
        s: &DVector<f64>,
    ) -> Option<Result<ConditionalMaximum, ConditionalMaximum>> {
        let promised = self.surrogate.log_marginal(s);
        let search = |guess| self.axes.search(likelihood, s, guess, MOST_CURVATURES);
        let [together, nearest] = self.surrogate.stiff(s);
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
            && self.map.fits(slow)
            && self.importance.fits(stiff)
            && self.density.as_ref().is_none_or(|density| density.fits(slow))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::numerics::random::{Stage, stream};

    const WIDTH: f64 = 0.001;

    /// s ~ N(0, 1), and t of Student's kind with one degree of freedom.
    const CAUCHY: Known = Known {
        dimension: 2,
        log_likelihood: |z| 0.5 * z[1] * z[1] - (0.5 * (z[1] / WIDTH).powi(2)).ln_1p(),
        slope_and_metric: |z| {
            let precision = WIDTH.powi(-2) / (1.0 + 0.5 * (z[1] / WIDTH).powi(2));
            let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, precision]));
            (DVector::from_vec(vec![-z[0], -precision * z[1]]), metric)
        },
    };

    #[test]
    fn a_t_that_no_draw_comes_near_to_holds_no_chain_after_warm_up() {
        let axes = Axes::split(&[0.0; 2], &CAUCHY.curvature(&[0.0; 2]).unwrap().metric, 1);
        let origin = DVector::zeros(1);
        let top = axes.maximum(&CAUCHY, &origin, DVector::zeros(1), MOST_CURVATURES).unwrap();
        let known = vec![KnownMaximum::new(origin.clone(), &top)];
        let map = TransportMap::fit(&[(&known[0], 1.0)]).unwrap();
        let surrogate = Surrogate::fit(known).unwrap();
        let importance = ImportanceDraws::normal(3);
        let astray = ConditionalMaximum { stiff: DVector::from_element(1, 100.0 * WIDTH), ..top };
        let rng = || stream(1, 0, Stage::Sampling, 0);
        let (position, _) = Position::draw(&CAUCHY, &axes, origin, &astray, importance, &mut rng());
        let proposals = Proposals { axes, surrogate, map, density: None, importance };
        let end = |is_warm_up| {
            proposals.chain_block(&CAUCHY, position.clone(), (30, is_warm_up), rng()).position.z[1].abs()
        };
        assert!(end(false) > 30.0 * WIDTH && end(true) < 10.0 * WIDTH, "{} {}", end(false), end(true));
    }
}
