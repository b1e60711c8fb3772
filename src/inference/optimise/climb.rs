//! Climbs to a maximum of a posterior.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::conditional_maximum::Axes;
use crate::error::{Error, Result};
use crate::inference::likelihood::{Counter, Curvature, ImageLikelihood, LatentLikelihood, Mode};
use crate::monitor::Monitor;

/// A maximum of the posterior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Maximum {
    /// Latent coordinates.
    pub latent: Vec<f64>,
    /// ln L − ½|z|² there.
    pub log_posterior: f64,
    /// Fisher matrix plus prior there.
    pub metric: DMatrix<f64>,
}

impl Maximum {
    /// Whether it is of a problem of that dimension.
    pub(in crate::inference) fn fits(&self, dimension: usize) -> bool {
        self.latent.len() == dimension && self.metric.shape() == (dimension, dimension)
    }

    /// As the likelihood's refinements take it.
    pub(in crate::inference) fn mode(&self) -> Mode<'_> {
        (&self.latent, &self.metric)
    }

    /// ln ∫ L(z) N(z; 0, 1) dz by Laplace's approximation: ln p − ½ ln det(metric); none where the metric is indefinite.
    pub fn log_evidence(&self) -> Option<f64> {
        let factor = self.metric.clone().cholesky()?;
        Some(self.log_posterior - factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>())
    }

    /// Whether each lies far outside the normal posterior about the other.
    pub(in crate::inference) fn is_apart_from(&self, other: &Self) -> bool {
        /// Standard deviations.
        const FAR: f64 = 6.0;
        let apart = DVector::from_column_slice(&self.latent) - DVector::from_column_slice(&other.latent);
        [&self.metric, &other.metric].iter().all(|metric| (*metric * &apart).dot(&apart) > FAR * FAR)
    }
}

/// Levenberg–Marquardt to its end, and along the valley to the maximum; `None` where `latent` has no likelihood.
pub(crate) fn to_the_top(likelihood: &dyn LatentLikelihood, latent: Vec<f64>) -> Option<Maximum> {
    const ITERATIONS: usize = 80;
    Some(follow_valley(likelihood, climb(likelihood, latent, &[], ITERATIONS)?))
}

/// The top that is reached from a known point.
///
/// # Errors
/// When the model cannot be evaluated there; when cancelled.
pub fn climb_from(likelihood: &ImageLikelihood, latent: Vec<f64>, monitor: &dyn Monitor) -> Result<Maximum> {
    let counter = Counter::new(monitor);
    let top = to_the_top(&counter.watch(likelihood), latent);
    counter.evaluations()?;
    top.ok_or_else(|| no_model(likelihood))
}

/// Why nothing was found.
pub(in crate::inference) fn no_model(likelihood: &ImageLikelihood) -> Error {
    let middle = likelihood.model().at_latent(&vec![0.0; likelihood.dimension()]).0;
    let reason = likelihood.model().evaluate(&middle).err().map_or_else(
        || "models whose amplitudes can be solved for; none was found among the guesses".into(),
        |error| format!("models that exist; at the medians {error}"),
    );
    Error::out_of_range("what the priors allow", "no model", &reason)
}

/// Levenberg–Marquardt on ln L − ½|z|² with the Fisher matrix, the coordinates `held` staying where they are; `None` where
/// the start has no likelihood.
pub(super) fn climb(
    likelihood: &dyn LatentLikelihood,
    mut latent: Vec<f64>,
    held: &[bool],
    iterations: usize,
) -> Option<Maximum> {
    /// A latent coordinate moves by no more than this at once.
    const LONGEST: f64 = 0.5;
    /// Gain of ln p below which the climb ends, and the damping above which no step helps.
    const SMALLEST_GAIN: f64 = 1e-4;
    const MOST_DAMPING: f64 = 1e8;
    let mut here = likelihood.curvature(&latent).ok()?;
    let mut damping = 1e-2;
    for _ in 0..iterations {
        let step = damped_step(&here, held, damping)?;
        let scale = (LONGEST / step.amax()).min(1.0);
        let moved: Vec<f64> = latent.iter().zip(step.iter()).map(|(z, s)| z + scale * s).collect();
        // The value alone, which refuses a step at a tenth of the cost.
        let log_posterior =
            likelihood.log_likelihood(&moved) - 0.5 * moved.iter().map(|z| z * z).sum::<f64>();
        let is_higher = log_posterior > here.log_posterior;
        match is_higher.then(|| likelihood.curvature(&moved).ok()).flatten() {
            Some(there) => {
                let gain = there.log_posterior - here.log_posterior;
                (latent, here) = (moved, there);
                if gain < SMALLEST_GAIN && damping < 1.0 {
                    break;
                }
                damping = f64::max(0.2 * damping, 1e-9);
            }
            _ if damping > MOST_DAMPING => break,
            _ => damping *= 8.0,
        }
    }
    Some(Maximum { latent, log_posterior: here.log_posterior, metric: here.metric })
}

fn damped_step(here: &Curvature, held: &[bool], damping: f64) -> Option<DVector<f64>> {
    let mut matrix = here.metric.clone();
    let mut gradient = here.gradient.clone();
    for i in 0..matrix.nrows() {
        matrix[(i, i)] *= 1.0 + damping;
    }
    for i in (0..held.len()).filter(|i| held[*i]) {
        matrix.row_mut(i).fill(0.0);
        matrix.column_mut(i).fill(0.0);
        (matrix[(i, i)], gradient[i]) = (1.0, 0.0);
    }
    let step = matrix.cholesky()?.solve(&gradient);
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// Newton steps along the floor of the valley in which a start lies, which bends too much for Levenberg–Marquardt.
fn follow_valley(likelihood: &dyn LatentLikelihood, mut start: Maximum) -> Maximum {
    /// Directions measured worse than this, in units of their priors' widths, lead along the valley.
    const SLOW_WIDTH: f64 = 0.03;
    const MOST_STEPS: usize = 100;
    const SMALLEST_GAIN: f64 = 1e-3;
    let mut damping = 0.0;
    for _ in 0..MOST_STEPS {
        let slow = Axes::wider_than(SLOW_WIDTH, &start.metric).max(1);
        let axes = Axes::split(&start.latent, &start.metric, slow);
        let Some(latent) = valley_step(likelihood, &axes, &mut damping) else { break };
        let Ok(there) = likelihood.curvature(&latent) else { break };
        let gain = there.log_posterior - start.log_posterior;
        if gain > 0.0 {
            start = Maximum { latent, log_posterior: there.log_posterior, metric: there.metric };
        }
        if gain < SMALLEST_GAIN {
            break;
        }
    }
    start
}

/// A point on the floor of the valley that is higher than the origin of the axes, a damped Newton step away; the one above the
/// origin if none is found.
fn valley_step(likelihood: &dyn LatentLikelihood, axes: &Axes, damping: &mut f64) -> Option<Vec<f64>> {
    /// A step moves no slow coordinate by more.
    const LONGEST: f64 = 1.0;
    const MOST_DAMPING: f64 = 1e4;
    /// Curvatures for one point of the floor; steps that need more are too long.
    const MOST_CURVATURES: u64 = 8;
    let origin = DVector::zeros(axes.slow_dimension());
    let guess = DVector::zeros(axes.stiff_dimension());
    let here = axes.maximum(likelihood, &origin, guess, 2 * MOST_CURVATURES)?;
    while *damping <= MOST_DAMPING {
        let mut metric = here.metric.clone();
        (0..metric.nrows()).for_each(|i| metric[(i, i)] *= 1.0 + *damping);
        let step = metric.cholesky()?.solve(&here.slope);
        let step = &step * (LONGEST / step.amax()).min(1.0);
        let guess = &here.stiff + &here.bend * &step;
        let there = axes.maximum(likelihood, &step, guess, MOST_CURVATURES);
        if let Some(there) = there.filter(|there| there.log_density > here.log_density) {
            *damping = if *damping > 1e-2 { 0.2 * *damping } else { 0.0 };
            return Some(axes.at(&step, &there.stiff).as_slice().to_vec());
        }
        *damping = f64::max(8.0 * *damping, 0.1);
    }
    Some(axes.at(&origin, &here.stiff).as_slice().to_vec())
}
