//! A sampler for posteriors that lie in a curved valley, as those of composite lenses do.
//!
//! The image measures some directions T of the model to 1e-4 of their priors and says little of others, S (see
//! [`crate::inference`]'s `floor`). Among S is also what is measured well but bends the others: where one point stands for a
//! pixel and its ray meets the cusp of a source, the pixel's flux tells their distance and not the angle, an arc of some
//! 1e-3 arcsec. No-U-Turn trajectories must then follow the bends of the valley in steps of the
//! width across it. Here the two are taken apart:
//!
//! - *Along* the valley: the density of s is Laplace's integral over t, ln m(s) = ln p(s, t̂(s)) − ½ ln det H(s), with H the
//!   curvature over t; the floor t̂ is solved anew for each proposal. Of several maxima over t the highest met counts. Proposals are ends of Hamiltonian trajectories in a
//!   surrogate for m, made of the floors found so far, so that a way of any length costs one floor at its end (Rasmussen
//!   2003, Bayesian Statistics 7, 651). On that way each trajectory is accepted by the surrogate s̃ itself; its end is then
//!   accepted by m(s′) s̃(s)/[m(s) s̃(s′)], which makes the chain exact whatever the surrogate is (Liu 2001, Monte Carlo
//!   Strategies in Scientific Computing, section 9.4.3).
//!   Of the surrogate made again with new floors less and less is new, so that the chain still tends to the posterior
//!   (Roberts & Rosenthal 2007, J. Appl. Probab. 44, 458). Early draws are left out where the
//!   others converge without them (`run.rs`).
//! - *Between* valleys: ellipticity and foreground shear turn the same image into two modes with hardly anything between
//!   them, and a bent valley is followed only in small steps. Of several moves on the surrogate half leap to where chains have
//!   been before, by the density of normal kernels about their draws that have the shape of the valley there.
//!   Where floors are found far above that at the start, the start was no maximum: all begins again at the top above them.
//! - *ImportanceDraws* it: t ~ N(t̂, H⁻¹), weighted by w = p(s, t)/[m(s) N(t; t̂, H⁻¹)]. The mean weight of several such t is an
//!   unbiased estimate of p(s)/m(s); m times it in the acceptance, and a draw of one t by its weight, give exact draws of
//!   (s, t) (Andrieu & Roberts 2009, Annals of Statistics 37, 697). What m alone refuses needs no t: a proposal is accepted
//!   by m first and by the mean weight then (Christen & Fox 2005, J. Comput. Graph. Stat. 14, 795). A t of far too much weight
//!   would hold the chain where it is; Metropolis steps of t at the same s, after each proposal, lead it back, and where
//!   weights are very unequal t is drawn with Cauchy tails.

mod chain_block;
mod importance;
mod kernel_density;
mod neighbours;
mod position;
mod slow_directions;
mod surrogate;
mod surrogate_moves;

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::chain_block::ChainBlock;
use self::importance::ImportanceDraws;
use self::kernel_density::KernelDensity;
use self::position::Position;
use self::slow_directions::{slow_directions, widest};
use self::surrogate::{KnownMaximum, Surrogate};
use self::surrogate_moves::Pace;
use super::chains::Chains;
use super::point::Problem;
use crate::error::{Error, Result, require};
use crate::inference::bits;
use crate::inference::optimise::to_the_top;
use crate::inference::optimise::{Axes, ConditionalMaximum};
use crate::inference::{Curvature, LatentLikelihood};
use crate::numerics::random::{Stage, stream};

/// Rounds of warm-up; fewer are enough once the marginal accepts such a share of every chain's proposals. Where it accepts
/// nearly all, the surrogate can be trusted.
const ROUNDS: u64 = 8;
const FEWER_ROUNDS: (u64, f64) = (5, 0.5);
const TRUSTED_ROUNDS: (u64, f64) = (4, 0.9);
/// Curvatures after which the search for a floor is given up.
const MOST_CURVATURES: u64 = 30;

/// Settings of the valley sampler.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ValleySettings {
    /// Independent chains, at least 2.
    pub chains: usize,
    /// Proposals of a chain in each of the four to eight rounds of warm-up, which teach the surrogate; at least 10.
    pub round_draws: usize,
    /// Draws of a chain between two looks at convergence, each of which makes the surrogate again.
    pub block_draws: usize,
    /// Draws of a chain after which sampling stops unconverged.
    pub max_draws: usize,
    /// Directions measured worse than this, in units of their priors' widths, are followed; the rest is integrated over.
    /// More are followed where they are few or the integral is poor.
    pub slow_width: f64,
}

impl Default for ValleySettings {
    fn default() -> Self {
        Self { chains: 4, round_draws: 30, block_draws: 50, max_draws: 8_000, slow_width: 0.03 }
    }
}

impl ValleySettings {
    fn check(&self) -> Result<()> {
        let at_least = |what: &str, value: usize, least: usize| {
            let allowed = format!("at least {least}");
            require(value >= least, &format!("{what} of valley"), value as f64, &allowed)
        };
        at_least("chains", self.chains, 2)?;
        at_least("round_draws", self.round_draws, 10)?;
        at_least("block_draws", self.block_draws, 1)?;
        at_least("max_draws", self.max_draws, 4)?;
        require(self.slow_width > 0.0, "slow_width of valley", self.slow_width, "positive")
    }
}

/// Everything a block of draws starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ValleyState {
    settings: ValleySettings,
    axes: Axes,
    surrogate: Surrogate,
    memory: Option<KernelDensity>,
    places: Vec<Position>,
    /// Which known floor each place stands on.
    standing: Vec<usize>,
    /// How t is drawn at each s.
    across: ImportanceDraws,
    /// Which known floor each draw stands on, and deviations of ln w.
    visited: Vec<usize>,
    #[serde(with = "bits")]
    spreads: Vec<f64>,
    pace: Pace,
    /// Block with which warm-up began, and ln p of the floor that it began at.
    began: u64,
    #[serde(with = "bits::number")]
    top: f64,
    pub evaluations: u64,
}

impl ValleyState {
    pub fn start(settings: ValleySettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check()?;
        let (likelihood, dimension) = (problem.likelihood, problem.likelihood.dimension());
        let start = problem.starts.first().filter(|start| start.len() == dimension);
        let start = start.ok_or_else(|| {
            let allowed = format!("at least 1, of {dimension} coordinates");
            Error::out_of_range("the number of start points of valley", problem.starts.len(), &allowed)
        })?;
        let density = likelihood.log_likelihood(start);
        require(density.is_finite(), "the log-likelihood at a start point", density, "finite")?;
        let nowhere = || {
            let what = "the curvature of the posterior at the start of valley";
            Error::out_of_range(what, "without a maximum nearby", "positive definite around a maximum")
        };
        let mut rng = stream(seed, settings.chains as u64, Stage::Sampling, 0);
        Self::about(settings, likelihood, start, &mut rng).ok_or_else(nowhere)
    }

    /// Before warm-up, all chains on the floor nearest to `start`; `None` where the posterior has no maximum nearby.
    fn about(
        settings: ValleySettings,
        likelihood: &dyn LatentLikelihood,
        start: &[f64],
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let Curvature { metric, .. } = likelihood.curvature(start)?;
        let mut evaluations = 1;
        let axes = Axes::split(start, &metric, widest(settings.slow_width, &metric));
        let (axes, floor) = slow_directions(likelihood, axes, rng, &mut evaluations)?;
        let slow = axes.slow_dimension();
        let known = first_floors(likelihood, &axes, &floor, &mut evaluations)?;
        let surrogate = Surrogate::fit(DVector::zeros(slow), widths(&floor)?, known)?;
        let across = ImportanceDraws::normal(8);
        let places: Vec<Position> = (0..settings.chains)
            .map(|_| Position::draw(likelihood, &axes, DVector::zeros(slow), &floor, across, rng).0)
            .collect();
        evaluations += (across.tries * settings.chains) as u64;
        places.iter().all(|place| place.log_weight().is_finite()).then(|| Self {
            settings,
            axes,
            surrogate,
            memory: None,
            places,
            standing: vec![0; settings.chains],
            across,
            visited: vec![],
            spreads: vec![],
            pace: Pace::Learning,
            began: 0,
            top: floor.log_density,
            evaluations,
        })
    }

    /// Draws of a chain after which sampling stops.
    pub fn max_draws(&self) -> usize {
        self.settings.max_draws
    }

    /// One round of warm-up or one block of draws.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let is_warm_up = self.pace == Pace::Learning;
        let draws = if is_warm_up { self.settings.round_draws } else { self.settings.block_draws };
        let legs: Vec<ChainBlock> = (0..self.places.len())
            .into_par_iter()
            .map(|chain| {
                let rng = stream(seed, chain as u64, Stage::Sampling, block);
                self.leg(likelihood, self.places[chain].clone(), draws, rng)
            })
            .collect();
        self.evaluations += legs.iter().map(|leg| leg.evaluations).sum::<u64>();
        if let Some(again) = self.begun_higher(likelihood, &legs, seed, block) {
            *self = again;
            chains.forget();
            return;
        }
        self.places = legs.iter().map(|leg| leg.place.clone()).collect();
        self.learn(&legs);
        if is_warm_up {
            let rounds_done = block - self.began;
            let are_enough = |(rounds, share): (u64, f64)| {
                rounds_done >= rounds
                    && legs.iter().all(|leg| leg.spreads.len() as f64 > share * draws as f64)
            };
            if are_enough(TRUSTED_ROUNDS) {
                self.pace = Pace::Trusting;
            } else if rounds_done >= ROUNDS || are_enough(FEWER_ROUNDS) {
                self.pace = Pace::Doubting;
            }
        } else {
            chains.chains.iter_mut().zip(legs).for_each(|(chain, leg)| chain.append(leg.chain));
            self.across = self.across.or_with_tails();
        }
    }

    /// Before warm-up at a higher maximum, if floors far above that at the start have been found: chains would only climb.
    fn begun_higher(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        legs: &[ChainBlock],
        seed: u64,
        block: u64,
    ) -> Option<Self> {
        const FAR: f64 = 10.0;
        let known = legs.iter().flat_map(|leg| &leg.known);
        let highest = known.max_by(|a, b| a.log_density().total_cmp(&b.log_density()))?;
        if highest.log_density() < self.top + FAR {
            return None;
        }
        self.top = highest.log_density();
        let top = to_the_top(likelihood, self.axes.at(&highest.s, &highest.stiff).as_slice().to_vec())?;
        let mut rng = stream(seed, self.places.len() as u64, Stage::Sampling, block);
        let begun = Self::about(self.settings, likelihood, &top.latent, &mut rng)?;
        let evaluations = self.evaluations + top.evaluations + begun.evaluations;
        Some(Self { began: block, evaluations, ..begun })
    }

    /// Makes surrogate and memory again with the new floors, and takes as many draws across the valley as half of the places
    /// need.
    fn learn(&mut self, legs: &[ChainBlock]) {
        let mut known = self.surrogate.known().to_vec();
        let (mut standing, mut visited) = (vec![], self.visited.clone());
        for (leg, began) in legs.iter().zip(&self.standing) {
            let floor = |of: &Option<usize>| of.map_or(*began, |own| known.len() + own);
            standing.extend([leg.standing].iter().map(floor));
            visited.extend(leg.visited.iter().map(floor));
            known.extend_from_slice(&leg.known);
            self.spreads.extend_from_slice(&leg.spreads);
        }
        let recent = &mut self.spreads.clone()[self.spreads.len() / 2..];
        if let Some(spread) = median(recent) {
            self.across = self.across.for_spread(spread);
        }
        // The later half of the draws tells the shape, once they are many.
        let later: Vec<_> = visited[visited.len() / 2..].iter().map(|floor| &known[*floor]).collect();
        let are_many = later.len() >= 10 * self.axes.slow_dimension();
        let scale = are_many.then(|| shape(later.iter().map(|floor| &floor.s))).flatten();
        let (centre, factor) = scale.unwrap_or_else(|| {
            let (centre, factor) = self.surrogate.scale();
            (centre.clone(), factor.clone())
        });
        let memory =
            KernelDensity::of(&later.iter().map(|floor| (&floor.s, &floor.metric)).collect::<Vec<_>>());
        if let Some(surrogate) = Surrogate::fit(centre, factor, known) {
            (self.surrogate, self.memory, self.standing, self.visited) =
                (surrogate, memory, standing, visited);
        }
    }
}

/// F with F Fᵀ the covariance of s as the curvature along the floor has it.
fn widths(floor: &ConditionalMaximum) -> Option<DMatrix<f64>> {
    Some(floor.metric.clone().cholesky()?.inverse().cholesky()?.l())
}

/// The floor at the origin, and a deviation away to both sides along each column of F.
fn first_floors(
    likelihood: &dyn LatentLikelihood,
    axes: &Axes,
    origin: &ConditionalMaximum,
    evaluations: &mut u64,
) -> Option<Vec<KnownMaximum>> {
    let factor = widths(origin)?;
    let mut known = vec![KnownMaximum::new(DVector::zeros(factor.ncols()), origin)];
    for column in factor.column_iter() {
        for side in [-1.0, 1.0] {
            let s = column * side;
            let guess = &origin.stiff + &origin.bend * &s;
            let floor = axes.floor(likelihood, &s, guess, MOST_CURVATURES, evaluations);
            known.extend(floor.map(|floor| KnownMaximum::new(s, &floor)));
        }
    }
    Some(known)
}

/// Mean, and lower factor of the covariance, of points.
fn shape<'a>(points: impl Iterator<Item = &'a DVector<f64>>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let columns = DMatrix::from_columns(&points.cloned().collect::<Vec<_>>());
    let mean = columns.column_mean();
    let mut covariance = DMatrix::zeros(mean.len(), mean.len());
    for column in columns.column_iter() {
        let offset = column - &mean;
        covariance.ger(1.0 / columns.ncols() as f64, &offset, &offset, 1.0);
    }
    Some((mean, covariance.cholesky()?.l()))
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both coordinates measured to 0.1, the first as 2.
    struct Measured;

    impl LatentLikelihood for Measured {
        fn dimension(&self) -> usize {
            2
        }

        fn log_likelihood(&self, z: &[f64]) -> f64 {
            -50.0 * ((z[0] - 2.0).powi(2) + z[1] * z[1])
        }

        fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
            unreachable!("only curvatures are asked for")
        }

        fn curvature(&self, z: &[f64]) -> Option<Curvature> {
            Some(Curvature {
                log_posterior: self.log_likelihood(z) - 0.5 * (z[0] * z[0] + z[1] * z[1]),
                gradient: DVector::from_vec(vec![200.0 - 101.0 * z[0], -101.0 * z[1]]),
                metric: DMatrix::identity(2, 2) * 101.0,
            })
        }
    }

    #[test]
    fn a_start_far_below_the_maximum_is_left_for_it() {
        let starts = [vec![0.0; 2]];
        let problem = Problem { likelihood: &Measured, starts: &starts, metric: None };
        let mut state = ValleyState::start(ValleySettings::default(), 1, &problem).unwrap();
        assert!(state.top < -150.0, "{}", state.top);
        let mut chains = Chains::new(2, 4, 1);
        (1..=3).for_each(|block| state.advance(&Measured, 1, block, &mut chains));
        assert!((state.top + 2.0).abs() < 0.1 && state.began > 0, "{} {}", state.top, state.began);
        (4..=20).for_each(|block| state.advance(&Measured, 1, block, &mut chains));
        let draws = chains.coordinate(0).concat();
        assert!(draws.len() > 400 && draws.iter().all(|z| (z - 1.98).abs() < 0.6));
    }

    #[test]
    fn the_shape_of_points_is_their_covariance() {
        let of = |points: &[[f64; 2]]| {
            shape(points.iter().map(|point| DVector::from_column_slice(point)).collect::<Vec<_>>().iter())
        };
        let (mean, factor) = of(&[[1.0, 0.0], [-1.0, 0.0], [0.0, 2.0], [0.0, -2.0]]).unwrap();
        assert!(mean.amax() < 1e-15);
        assert!(
            (factor[(0, 0)] - 0.5_f64.sqrt()).abs() < 1e-15
                && (factor[(1, 1)] - 2.0_f64.sqrt()).abs() < 1e-15
        );
        assert!(of(&[[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]).is_none());
    }
}
