//! The valley sampler between two blocks: what its chains share, and what it learns from their draws.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::chain_block::{ChainBlock, Proposals};
use super::importance::ImportanceDraws;
use super::kernel_density::KernelDensity;
use super::known_maximum::{KnownMaximum, weights};
use super::position::Position;
use super::profiles::profiles;
use super::settings::ValleySettings;
use super::slow_directions::{slow_directions, widest};
use super::surrogate::Surrogate;
use super::transport_map::TransportMap;
use crate::error::{Domain, Error, Result};
use crate::inference::likelihood::{Curvature, LatentLikelihood, NoCurvature};
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES, to_the_top};
use crate::inference::sample::chains::Chains;
use crate::inference::sample::problem::Problem;
use crate::inference::sample::sampler::Sampler;
use crate::numerics::random::{Stage, stream};

/// Rounds of warm-up.
const ROUNDS: u64 = 2;

/// Everything a block of draws starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Valley {
    pub settings: ValleySettings,
    proposals: Proposals,
    /// Where every chain stands, and which known maximum that belongs to.
    positions: Vec<Position>,
    standing: Vec<usize>,
    /// Which known maximum each draw belongs to.
    visited: Vec<usize>,
    /// Of one weight, at every floor since t has been drawn as it is.
    variances: Vec<f64>,
    /// Block with which warm-up began.
    began: u64,
    /// ln p of the conditional maximum that it began at.
    top: f64,
}

impl Valley {
    pub fn start(settings: ValleySettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check()?;
        let (likelihood, dimension) = (problem.likelihood, problem.likelihood.dimension());
        let start = problem.starts.first().filter(|start| start.len() == dimension);
        let start = start.ok_or_else(|| {
            let allowed = format!("at least 1, of {dimension} coordinates");
            Error::out_of_range("the number of start points of valley", problem.starts.len(), &allowed)
        })?;
        Domain::FINITE.check("the log-likelihood at a start point", likelihood.log_likelihood(start))?;
        if likelihood.curvature(start).is_err_and(|none| none == NoCurvature::Unknown) {
            let what = "the curvature of the likelihood";
            return Err(Error::out_of_range(what, "unknown", "known for valley; other samplers need none"));
        }
        let nowhere = || {
            let what = "the curvature of the posterior at the start of valley";
            Error::out_of_range(what, "without a maximum nearby", "positive definite around a maximum")
        };
        let mut rng = stream(seed, settings.chains as u64, Stage::Sampling, 0);
        Self::about(settings, likelihood, (start, &problem.starts[1..]), &mut rng).ok_or_else(nowhere)
    }

    /// Before warm-up, the chains in turn at the conditional maximum nearest to `start`, at those nearest to the other modes and at
    /// the ends of profiles; `None` where the posterior has none near `start`, or no draw is possible there.
    fn about(
        settings: ValleySettings,
        likelihood: &dyn LatentLikelihood,
        (start, modes): (&[f64], &[Vec<f64>]),
        rng: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let Curvature { metric, .. } = likelihood.curvature(start).ok()?;
        let axes = Axes::split(start, &metric, widest(settings.slow_width, &metric));
        let (axes, maximum) = slow_directions(likelihood, axes, rng)?;
        let slow = axes.slow_dimension();
        let mut known = first_maxima(likelihood, &axes, DVector::zeros(slow), &maximum)?;
        // Each with its number among the known.
        let mut tops = vec![(0, DVector::zeros(slow), maximum.clone())];
        let floor_at = |z: &[f64]| {
            let [s, t] = axes.coordinates(z);
            axes.maximum(likelihood, &s, t, MOST_CURVATURES).map(|floor| (s, floor))
        };
        let profiles = profiles(likelihood, start, &metric, maximum.log_density);
        let ends = profiles.iter().filter_map(|points| points.last());
        for z in profiles.iter().flat_map(|points| &points[..points.len() - 1]) {
            known.extend(floor_at(z).map(|(s, floor)| KnownMaximum::new(s, &floor)));
        }
        for mode in modes.iter().filter(|mode| mode.len() == start.len()).chain(ends) {
            let Some((s, top)) = floor_at(mode) else { continue };
            let Some(around) = first_maxima(likelihood, &axes, s.clone(), &top) else { continue };
            tops.push((known.len(), s, top));
            known.extend(around);
        }
        let map = TransportMap::fit(&weighted(&known))?;
        let surrogate = Surrogate::fit(known)?;
        let importance = ImportanceDraws::about(&maximum);
        let mut draw = |(number, s, top): &(usize, DVector<f64>, ConditionalMaximum)| {
            let (position, _) = Position::draw(likelihood, &axes, s.clone(), top, importance, rng);
            position.log_weight().is_finite().then_some((position, *number))
        };
        // Where no draw is possible a chain begins at the first.
        let begun =
            (0..settings.chains).map(|chain| draw(&tops[chain % tops.len()]).or_else(|| draw(&tops[0])));
        let (positions, standing) = begun.collect::<Option<Vec<(Position, usize)>>>()?.into_iter().unzip();
        Some(Self {
            settings,
            proposals: Proposals { axes, surrogate, map, density: None, importance },
            positions,
            standing,
            visited: vec![],
            variances: vec![],
            began: 0,
            top: maximum.log_density,
        })
    }

    /// Before warm-up at a higher maximum, if points far above that at the start have been found: chains would only climb.
    fn begun_higher(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        done: &[ChainBlock],
        seed: u64,
        block: u64,
    ) -> Option<Self> {
        const FAR: f64 = 10.0;
        let known = done.iter().flat_map(|chain| &chain.known);
        let highest = known.max_by(|a, b| a.log_density().total_cmp(&b.log_density()))?;
        if highest.log_density() < self.top + FAR {
            return None;
        }
        self.top = highest.log_density();
        let z = self.proposals.axes.at(&highest.s, &highest.stiff);
        let top = to_the_top(likelihood, z.as_slice().to_vec())?;
        let mut rng = stream(seed, self.positions.len() as u64, Stage::Sampling, block);
        let begun = Self::about(self.settings, likelihood, (&top.latent, &[]), &mut rng)?;
        Some(Self { began: block, ..begun })
    }

    /// Makes surrogate and density again with the new maxima, and takes as many draws across the valley as half of the
    /// positions need.
    fn learn(&mut self, done: &[ChainBlock]) {
        let proposals = &mut self.proposals;
        let mut known = proposals.surrogate.known().to_vec();
        let (mut standing, mut visited) = (vec![], self.visited.clone());
        for (chain, began) in done.iter().zip(&self.standing) {
            let maximum = |of: &Option<usize>| of.map_or(*began, |own| known.len() + own);
            standing.push(maximum(&chain.standing));
            visited.extend(chain.visited.iter().map(maximum));
            known.extend_from_slice(&chain.known);
            self.variances.extend_from_slice(&chain.variances);
        }
        let recent = &mut self.variances.clone()[self.variances.len() / 2..];
        if let Some(variance) = median(recent) {
            proposals.importance = proposals.importance.for_variance(variance);
        }
        // The later half of the draws tells the shape, once they are many.
        let later: Vec<_> = visited[visited.len() / 2..].iter().map(|maximum| &known[*maximum]).collect();
        let are_many = later.len() >= 10 * proposals.axes.slow_dimension();
        let map = match are_many {
            true => TransportMap::fit(&later.iter().map(|known| (*known, 1.0)).collect::<Vec<_>>()),
            false => TransportMap::fit(&weighted(&known)),
        };
        let density =
            KernelDensity::of(&later.iter().map(|known| (&known.s, &known.metric)).collect::<Vec<_>>());
        if let Some(surrogate) = Surrogate::fit(known) {
            proposals.map = map.unwrap_or_else(|| proposals.map.clone());
            (proposals.surrogate, proposals.density) = (surrogate, density);
            (self.standing, self.visited) = (standing, visited);
        }
    }
}

impl Sampler for Valley {
    fn empty_chains(&self, dimension: usize) -> Chains {
        Chains::new(dimension, self.settings.chains, 1)
    }

    fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let is_warm_up = block <= self.began + ROUNDS;
        let draws = if is_warm_up { self.settings.round_draws } else { self.settings.block_draws };
        let done: Vec<ChainBlock> = (0..self.positions.len())
            .into_par_iter()
            .map(|chain| {
                let rng = stream(seed, chain as u64, Stage::Sampling, block);
                self.proposals.chain_block(
                    likelihood,
                    self.positions[chain].clone(),
                    (draws, is_warm_up),
                    rng,
                )
            })
            .collect();
        if likelihood.is_cancelled() {
            return;
        }
        if let Some(again) = self.begun_higher(likelihood, &done, seed, block) {
            *self = again;
            chains.forget();
            return;
        }
        self.positions = done.iter().map(|chain| chain.position.clone()).collect();
        self.learn(&done);
        if !is_warm_up {
            chains.chains.iter_mut().zip(done).for_each(|(chain, done)| chain.append(done.chain));
            let nested = self.proposals.importance.or_nested();
            if nested != self.proposals.importance {
                self.proposals.importance = nested;
                self.variances.clear();
            }
        }
    }

    fn max_draws(&self) -> Option<usize> {
        Some(self.settings.max_draws)
    }

    fn learns(&self) -> bool {
        true
    }

    fn fits(&self, dimension: usize) -> bool {
        let (chains, known) = (self.settings.chains, self.proposals.surrogate.known().len());
        let [slow, stiff] = [self.proposals.axes.slow_dimension(), self.proposals.axes.stiff_dimension()];
        (self.positions.len(), self.standing.len()) == (chains, chains)
            && self.proposals.fits(dimension)
            && self.positions.iter().all(|position| position.fits(dimension, slow, stiff))
            && self.standing.iter().chain(&self.visited).all(|maximum| *maximum < known)
    }
}

/// F with F Fᵀ the covariance of s as the curvature along the conditional maxima has it.
fn widths(maximum: &ConditionalMaximum) -> Option<DMatrix<f64>> {
    Some(maximum.metric.clone().cholesky()?.inverse().cholesky()?.l())
}

/// The conditional maximum at `middle` and those a deviation away to both sides along each column of F.
fn first_maxima(
    likelihood: &dyn LatentLikelihood,
    axes: &Axes,
    middle: DVector<f64>,
    top: &ConditionalMaximum,
) -> Option<Vec<KnownMaximum>> {
    let factor = widths(top)?;
    let mut known = vec![KnownMaximum::new(middle.clone(), top)];
    for column in factor.column_iter() {
        for side in [-1.0, 1.0] {
            let step = column * side;
            let guess = &top.stiff + &top.bend * &step;
            let s = &middle + step;
            let maximum = axes.maximum(likelihood, &s, guess, MOST_CURVATURES);
            known.extend(maximum.map(|maximum| KnownMaximum::new(s, &maximum)));
        }
    }
    Some(known)
}

/// Floors with their weights.
fn weighted(known: &[KnownMaximum]) -> Vec<(&KnownMaximum, f64)> {
    known.iter().zip(weights(known)).collect()
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::known::Known;

    /// Both coordinates measured to 0.1, the first as 2.
    const MEASURED: Known = Known {
        dimension: 2,
        log_likelihood: |z| -50.0 * ((z[0] - 2.0).powi(2) + z[1] * z[1]),
        slope_and_metric: |z| {
            let slope = vec![200.0 - 101.0 * z[0], -101.0 * z[1]];
            (DVector::from_vec(slope), DMatrix::identity(2, 2) * 101.0)
        },
    };

    #[test]
    fn a_start_far_below_the_maximum_is_left_for_it() {
        let starts = [vec![0.0; 2]];
        let problem = Problem { likelihood: &MEASURED, starts: &starts, metric: None };
        let mut valley = Valley::start(ValleySettings::default(), 1, &problem).unwrap();
        assert!(valley.top < -150.0, "{}", valley.top);
        let mut chains = Chains::new(2, 4, 1);
        (1..=3).for_each(|block| valley.advance(&MEASURED, 1, block, &mut chains));
        assert!((valley.top + 2.0).abs() < 0.1 && valley.began > 0, "{} {}", valley.top, valley.began);
        (4..=20).for_each(|block| valley.advance(&MEASURED, 1, block, &mut chains));
        let draws = chains.coordinate(0).concat();
        assert!(draws.len() > 400 && draws.iter().all(|z| (z - 1.98).abs() < 0.6));
    }

    /// ln of the share of each of two round modes, 20 and 30 of their deviations apart, in the posterior density.
    fn shares(z: &[f64]) -> [f64; 2] {
        [(0.7_f64, 1.0, 0.1), (0.3, -1.0, 0.07)].map(|(share, x, deviation): (f64, f64, f64)| {
            let squared = (z[0] - x).powi(2) + z[1] * z[1];
            share.ln() - 2.0 * deviation.ln() - 0.5 * squared / (deviation * deviation)
        })
    }

    const TWO_MODES: Known = Known {
        dimension: 2,
        log_likelihood: |z| {
            let [a, b] = shares(z);
            a.max(b) + (-(a - b).abs()).exp().ln_1p() + 0.5 * (z[0] * z[0] + z[1] * z[1])
        },
        slope_and_metric: |z| {
            let [a, b] = shares(z);
            let (x, deviation) = if a > b { (1.0, 0.1_f64) } else { (-1.0, 0.07) };
            let precision = deviation.powi(-2);
            (
                DVector::from_vec(vec![(x - z[0]) * precision, -z[1] * precision]),
                DMatrix::identity(2, 2) * precision,
            )
        },
    };

    #[test]
    fn modes_that_are_known_are_visited_as_often_as_they_weigh() {
        let share_of_second = |starts: &[Vec<f64>]| {
            let problem = Problem { likelihood: &TWO_MODES, starts, metric: None };
            let mut valley = Valley::start(ValleySettings::default(), 3, &problem).unwrap();
            let mut chains = Chains::new(2, 4, 1);
            (1..=20).for_each(|block| valley.advance(&TWO_MODES, 3, block, &mut chains));
            let by_chain = chains.coordinate(0);
            let draws = by_chain.concat();
            let crossed = by_chain
                .iter()
                .filter(|chain| chain.iter().any(|z| *z < 0.0) && chain.iter().any(|z| *z > 0.0));
            (draws.iter().filter(|z| **z < 0.0).count() as f64 / draws.len() as f64, crossed.count())
        };
        assert_eq!(share_of_second(&[vec![1.0, 0.0]]), (0.0, 0));
        let (share, crossed) = share_of_second(&[vec![1.0, 0.0], vec![-1.0, 0.0]]);
        assert!((share - 0.3).abs() < 0.05 && crossed == 4, "{share} {crossed}");
    }

    /// The first coordinate measured to 0.1 about 2 or −2, the second to 0.001.
    const MIRRORED: Known = Known {
        dimension: 2,
        log_likelihood: |z| -50.0 * (z[0].abs() - 2.0).powi(2) - 5e5 * z[1] * z[1],
        slope_and_metric: |z| {
            let slope = vec![200.0 * z[0].signum() - 101.0 * z[0], -1_000_001.0 * z[1]];
            let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![101.0, 1_000_001.0]));
            (DVector::from_vec(slope), metric)
        },
    };

    #[test]
    fn a_chain_begins_at_the_top_where_no_draw_is_possible_at_its_own_beginning() {
        let begun = |likelihood: Known| {
            let starts = [vec![1.98, 0.0], vec![-1.98, 0.0]];
            let problem = Problem { likelihood: &likelihood, starts: &starts, metric: None };
            let valley = Valley::start(ValleySettings::default(), 1, &problem).unwrap();
            valley.positions.iter().map(|position| position.z[0].signum()).collect::<Vec<_>>()
        };
        assert_eq!(begun(MIRRORED)[1], -1.0);
        let log_likelihood = |z: &[f64]| match z[0] < 0.0 && z[1].abs() > 1e-12 {
            true => f64::NEG_INFINITY,
            false => (MIRRORED.log_likelihood)(z),
        };
        assert_eq!(begun(Known { log_likelihood, ..MIRRORED }), [1.0; 4]);
    }
}
