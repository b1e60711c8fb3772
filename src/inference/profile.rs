//! The profile likelihood of one parameter: how high ln L gets where it is held, whatever the others are then.
//!
//! For flat priors the interval in which −2Δln L < 1 holds the truth in 68% of many fits (Wilks 1938), however much room the
//! other parameters have; a posterior also counts that room. Where both differ, priors speak.

use rayon::join;
use serde::Serialize;

use super::likelihood::{Counter, ImageLikelihood, LatentLikelihood, Others, WithinEdges};
use super::model::FreeParameter;
use super::optimise::{Maximum, no_model, to_the_top};
use super::parameter::PriorShape;
use super::sample::Chains;
use crate::error::Result;
use crate::monitor::Monitor;

/// The profile likelihood of a free parameter at values in ascending order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// `lens.theta_E`, `gamma1_los`, ….
    pub name: String,
    /// `arcsec`, `1/arcsec`, or empty.
    pub unit: &'static str,
    /// How it stands on an axis.
    #[serde(skip)]
    pub label: String,
    /// Where ln L is highest.
    pub best_fit: f64,
    /// Ends of the values with −2Δln L < 1; none where no value outside was reached, as at an edge of the prior.
    pub interval68: [Option<f64>; 2],
    /// Those of −2Δln L < 4.
    pub interval95: [Option<f64>; 2],
    /// Values at which the parameter was held.
    pub values: Vec<f64>,
    /// ln L there, all others where it is highest, less its highest value.
    pub delta_log_likelihood: Vec<f64>,
}

impl Profile {
    /// (value, L/L_max) on a fine grid: √(−2Δln L), with the sign of the side, is interpolated linearly.
    pub fn likelihood_ratio(&self) -> Vec<[f64; 2]> {
        const PARTS: usize = 12;
        let root = |i: usize| {
            let root = (-2.0 * self.delta_log_likelihood[i]).max(0.0).sqrt();
            if self.values[i] < self.best_fit { -root } else { root }
        };
        let between = |i: usize, part: usize| {
            let t = part as f64 / PARTS as f64;
            let mix = |a: f64, b: f64| a + t * (b - a);
            let r = mix(root(i), root(i + 1));
            [mix(self.values[i], self.values[i + 1]), (-0.5 * r * r).exp()]
        };
        let last = self.values.len() - 1;
        let inner = (0..last).flat_map(|i| (0..PARTS).map(move |part| (i, part)));
        let end = [self.values[last], self.delta_log_likelihood[last].exp()];
        inner.map(|(i, part)| between(i, part)).chain([end]).collect()
    }
}

/// Profiles of the parameters of those names, from the highest maximum that is known and the draws of a sampler.
///
/// A prior that is not uniform is taken for a measurement: −½z² of its latent coordinate belongs to ln L.
///
/// # Errors
/// Names that are not of free parameters; when cancelled.
pub(super) fn profiles(
    likelihood: &ImageLikelihood,
    (maximum, chains): (&Maximum, &Chains),
    names: &[String],
    monitor: &dyn Monitor,
) -> Result<Vec<Profile>> {
    let free = &likelihood.model().free;
    let task = monitor.task("profiles", Some(names.len() as u64));
    let counter = Counter::new(monitor);
    let watched = counter.watch(likelihood);
    let is_flat: Vec<bool> =
        free.iter().map(|free| matches!(free.prior.shape, PriorShape::Uniform(_))).collect();
    let within_edges = WithinEdges { likelihood: &watched, is_flat };
    let draws: Vec<(&[f64], f64)> = chains
        .chains
        .iter()
        .flat_map(|chain| chain.z.chunks_exact(chains.dimension).zip(chain.log_density(chains.dimension)))
        .map(|(z, log_density)| (z, log_density + within_edges.free_of_charge(z)))
        .collect();
    let mut found = Vec::new();
    for name in names {
        let index = likelihood.model().place_of_free(name)?;
        let search = Search { likelihood: &within_edges, free: &free[index], index, draws: &draws };
        let profile = search.profile(&maximum.latent);
        counter.evaluations()?;
        found.push(profile.ok_or_else(|| no_model(likelihood))?);
        task.advance(1);
    }
    Ok(found)
}

/// One parameter that is held, and how its others are found.
struct Search<'a> {
    likelihood: &'a dyn LatentLikelihood,
    free: &'a FreeParameter,
    index: usize,
    /// Draws of a sampler, and the height of each.
    draws: &'a [(&'a [f64], f64)],
}

/// A value at which the parameter was held, and the highest maximum of the others there.
struct Held {
    value: f64,
    maximum: Maximum,
}

impl Search<'_> {
    fn profile(&self, start: &[f64]) -> Option<Profile> {
        let top = to_the_top(self.likelihood, start.to_vec())?;
        let centre = Held { value: self.value(&top.latent), maximum: top };
        let (below, above) = join(|| self.side(&centre, -1.0), || self.side(&centre, 1.0));
        let mut held: Vec<Held> = below.into_iter().rev().chain([centre]).chain(above).collect();
        self.improve(&mut held);
        let highest = held.iter().map(|held| held.maximum.log_posterior).fold(f64::NEG_INFINITY, f64::max);
        let best = held.iter().position(|held| held.maximum.log_posterior == highest).unwrap_or(0);
        let values: Vec<f64> = held.iter().map(|held| held.value).collect();
        let delta: Vec<f64> = held.iter().map(|held| held.maximum.log_posterior - highest).collect();
        let interval = |root: f64| [end(&values, &delta, root, false), end(&values, &delta, root, true)];
        Some(Profile {
            name: self.free.name.clone(),
            unit: self.free.parameter.unit,
            label: self.free.label(),
            best_fit: values[best],
            interval68: interval(1.0),
            interval95: interval(2.0),
            values,
            delta_log_likelihood: delta,
        })
    }

    fn value(&self, latent: &[f64]) -> f64 {
        self.free.prior.at_latent(latent[self.index])[0]
    }

    /// From the centre outwards, until ln L has fallen far and no draw lies further out.
    fn side(&self, centre: &Held, sign: f64) -> Vec<Held> {
        const MOST: usize = 60;
        let drawn: Vec<f64> = self.draws.iter().map(|(draw, _)| self.value(draw)).collect();
        let step = 0.5 * sign * self.deviation(&centre.maximum, &drawn);
        let [lower, upper] = self.free.prior.edges();
        let mut found: Vec<Held> = Vec::new();
        while found.len() < MOST && !self.likelihood.is_cancelled() {
            let last = found.last().unwrap_or(centre);
            let Some(value) = next(last, centre, step, &drawn).filter(|v| (lower..upper).contains(v)) else {
                break;
            };
            let near = self.draws.iter().zip(&drawn).filter(|(_, drawn)| (*drawn - value).abs() < step.abs());
            let best_near = near.map(|(draw, _)| draw).max_by(|a, b| a.1.total_cmp(&b.1));
            let starts = [Some(self.shifted(&last.maximum, value)), best_near.map(|(draw, _)| draw.to_vec())];
            let tops = starts.into_iter().flatten().filter_map(|start| self.held_at(value, start));
            let Some(maximum) = tops.max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior)) else {
                break;
            };
            found.push(Held { value, maximum });
        }
        found
    }

    /// Of the normal likelihood about the top, no more than that of all draws, of which there may be several clouds.
    fn deviation(&self, top: &Maximum, drawn: &[f64]) -> f64 {
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let of_draws = (drawn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / drawn.len() as f64).sqrt();
        let [_, slope] = self.free.prior.at_latent(top.latent[self.index]);
        let inverse = top.metric.clone().cholesky().map(|factor| factor.inverse()[(self.index, self.index)]);
        let of_top = inverse.map_or(of_draws, |variance| slope.abs() * variance.sqrt());
        of_top.min(of_draws).max(0.01 * of_draws)
    }

    /// Looks at each value again from what was found at its neighbours, up and down.
    fn improve(&self, held: &mut [Held]) {
        /// How far below what is known a start may lie and still be worth a climb.
        const REACH: f64 = 3.0;
        let n = held.len();
        let pairs = (1..n).map(|i| (i, i - 1)).chain((0..n.saturating_sub(1)).rev().map(|i| (i, i + 1)));
        for (i, from) in pairs {
            let start = self.shifted(&held[from].maximum, held[i].value);
            let height =
                self.likelihood.log_likelihood(&start) - 0.5 * start.iter().map(|z| z * z).sum::<f64>();
            if height < held[i].maximum.log_posterior - REACH {
                continue;
            }
            match self.held_at(held[i].value, start) {
                Some(top) if top.log_posterior > held[i].maximum.log_posterior => held[i].maximum = top,
                _ => {}
            }
        }
    }

    /// Where the others go to first order when the parameter goes to `value`.
    fn shifted(&self, from: &Maximum, value: f64) -> Vec<f64> {
        let by = self.free.prior.to_latent(value) - from.latent[self.index];
        let mut metric = from.metric.clone();
        let pull = metric.column(self.index) * -by;
        metric.row_mut(self.index).fill(0.0);
        metric.column_mut(self.index).fill(0.0);
        metric[(self.index, self.index)] = 1.0;
        let mut step = metric.cholesky().map_or(pull.clone() * 0.0, |factor| factor.solve(&pull));
        step[self.index] = by;
        from.latent.iter().zip(step.iter()).map(|(z, step)| z + step).collect()
    }

    /// The top that is reached from `start` while the parameter is held.
    fn held_at(&self, value: f64, mut start: Vec<f64>) -> Option<Maximum> {
        let held = self.free.prior.to_latent(value);
        start.remove(self.index);
        let others = Others { likelihood: self.likelihood, index: self.index, held };
        let top = if start.is_empty() { start } else { to_the_top(&others, start)?.latent };
        let latent = others.with_held(&top);
        let there = self.likelihood.curvature(&latent).ok()?;
        Some(Maximum { latent, log_posterior: there.log_posterior, metric: there.metric })
    }
}

/// The value a step further out; where ln L has fallen far, behind what no draw comes near, and none behind all draws.
fn next(last: &Held, centre: &Held, step: f64, drawn: &[f64]) -> Option<f64> {
    /// Fall of ln L.
    const FAR: f64 = 4.0;
    if last.maximum.log_posterior > centre.maximum.log_posterior - FAR {
        return Some(last.value + step);
    }
    let ahead = drawn.iter().map(|value| (value - last.value) * step.signum()).filter(|ahead| *ahead > 0.0);
    let nearest = ahead.min_by(f64::total_cmp)?;
    Some(last.value + step.signum() * nearest.max(step.abs()))
}

/// The outermost value on one side at which √(−2Δln L) passes `root`, which is nearly linear in the value; none where the
/// outermost value of all is still below it.
fn end(values: &[f64], delta: &[f64], root: f64, is_upper: bool) -> Option<f64> {
    let roots: Vec<f64> = delta.iter().map(|delta| (-2.0 * delta).max(0.0).sqrt()).collect();
    let inside = |i: &usize| roots[*i] < root;
    let (last, outside) = match is_upper {
        true => (0..roots.len()).rev().find(inside).map(|i| (i, i + 1))?,
        false => (0..roots.len()).find(inside).and_then(|i| Some((i, i.checked_sub(1)?)))?,
    };
    let part = (root - roots[last]) / (roots.get(outside)? - roots[last]);
    Some(values[last] + part * (values[outside] - values[last]))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::inference::model::Part;
    use crate::inference::parameter::Prior;
    use crate::profile::registry::Parameter;

    const FLAT: Prior = Prior { shape: PriorShape::Uniform([-5.0, 5.0]), low: None, high: None };

    /// Values of both parameters and their slopes by z.
    fn at(z: &[f64]) -> [[f64; 2]; 2] {
        [FLAT.at_latent(z[0]), FLAT.at_latent(z[1])]
    }

    fn search<'a>(likelihood: &'a Known, free: &'a FreeParameter, draws: &'a [(&'a [f64], f64)]) -> Profile {
        let within_edges = WithinEdges { likelihood, is_flat: vec![true; 2] };
        Search { likelihood: &within_edges, free, index: 0, draws }.profile(&[0.0; 2]).unwrap()
    }

    fn first() -> FreeParameter {
        FreeParameter {
            name: "a".into(),
            part: Part::LineOfSight,
            parameter: &Parameter::SERSIC_RADIUS,
            prior: FLAT,
        }
    }

    /// Draws with that spread of the first parameter.
    fn spread(deviation: f64) -> Vec<Vec<f64>> {
        (-8..=8).map(|i| vec![FLAT.to_latent(0.3 * deviation * f64::from(i)), 0.0]).collect()
    }

    #[test]
    fn a_normal_likelihood_has_the_marginal_interval_of_its_covariance() {
        /// Precision of both parameters: deviations 0.1 and 0.2, correlation 0.8.
        const PRECISION: [[f64; 2]; 2] =
            [[277.777_777_777_777_8, -111.111_111_111_111_1], [-111.111_111_111_111_1, 69.444_444_444_444_4]];
        const NORMAL: Known = Known {
            dimension: 2,
            log_likelihood: |z| {
                let [[a, _], [b, _]] = at(z);
                -0.5 * (PRECISION[0][0] * a * a + 2.0 * PRECISION[0][1] * a * b + PRECISION[1][1] * b * b)
            },
            slope_and_metric: |z| {
                let [[a, da], [b, db]] = at(z);
                let by = |row: [f64; 2], slope: f64| -slope * (row[0] * a + row[1] * b);
                let gradient =
                    DVector::from_vec(vec![by(PRECISION[0], da) - z[0], by(PRECISION[1], db) - z[1]]);
                let slopes = [da, db];
                let metric = DMatrix::from_fn(2, 2, |i, j| PRECISION[i][j] * slopes[i] * slopes[j]);
                (gradient, metric + DMatrix::identity(2, 2))
            },
        };
        let draws = spread(0.1);
        let draws: Vec<(&[f64], f64)> =
            draws.iter().map(|z| (z.as_slice(), NORMAL.log_likelihood(z))).collect();
        let profile = search(&NORMAL, &first(), &draws);
        for (interval, wanted) in [(profile.interval68, 0.1), (profile.interval95, 0.2)] {
            let [low, high] = interval.map(Option::unwrap);
            assert!((low + wanted).abs() < 2e-3 && (high - wanted).abs() < 2e-3, "{profile:?}");
        }
        assert!(profile.best_fit.abs() < 1e-3);
        for [x, ratio] in profile.likelihood_ratio() {
            assert!((ratio - (-50.0 * x * x).exp()).abs() < 2e-3, "{x}: {ratio}");
        }
    }

    #[test]
    fn room_of_the_others_does_not_count_and_an_edge_is_no_end() {
        /// b = a ± (0.01 + |a|/10): as likely at every a, with the more room the larger |a| is.
        const CONE: Known = Known {
            dimension: 2,
            log_likelihood: |z| {
                let [[a, _], [b, _]] = at(z);
                -0.5 * ((b - a) / (0.01 + 0.1 * a.abs())).powi(2)
            },
            slope_and_metric: |z| {
                let [[a, da], [b, db]] = at(z);
                let width = 0.01 + 0.1 * a.abs();
                let pull = (b - a) / (width * width);
                let row = DVector::from_vec(vec![-da, db]);
                let metric = &row * row.transpose() / (width * width) + DMatrix::identity(2, 2);
                (row * -pull - DVector::from_column_slice(z), metric)
            },
        };
        let draws = spread(2.0);
        let draws: Vec<(&[f64], f64)> =
            draws.iter().map(|z| (z.as_slice(), CONE.log_likelihood(z))).collect();
        let profile = search(&CONE, &first(), &draws);
        assert!(profile.delta_log_likelihood.iter().all(|delta| *delta > -1e-3), "{profile:?}");
        assert_eq!((profile.interval68, profile.interval95), ([None; 2], [None; 2]));
        assert!(profile.values.first().unwrap() < &-4.0 && profile.values.last().unwrap() > &4.0);
    }
}
