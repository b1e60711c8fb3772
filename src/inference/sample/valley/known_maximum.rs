//! A floor that has been found, as the surrogate uses it.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::inference::optimise::ConditionalMaximum;

/// What is remembered of a floor while the surrogate is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct KnownMaximum {
    pub s: DVector<f64>,
    /// ln m = ln p on the floor − ½ ln det.
    pub log_marginal: f64,
    /// ½ ln det.
    pub half_log_determinant: f64,
    pub slope: DVector<f64>,
    /// −d² ln p/ds² along the floor.
    pub metric: DMatrix<f64>,
    /// t̂.
    pub stiff: DVector<f64>,
    pub bend: DMatrix<f64>,
}

impl KnownMaximum {
    pub fn new(s: DVector<f64>, floor: &ConditionalMaximum) -> Self {
        Self {
            s,
            log_marginal: floor.log_marginal(),
            half_log_determinant: floor.half_log_determinant(),
            slope: floor.slope.clone(),
            metric: floor.metric.clone(),
            stiff: floor.stiff.clone(),
            bend: floor.bend.clone(),
        }
    }

    /// ln p on the floor.
    pub fn log_density(&self) -> f64 {
        self.log_marginal + self.half_log_determinant
    }
}

/// How much each counts in what is said of all, one in sum: what lies far below the top hardly matters, and bends in its own way.
pub(super) fn weights(known: &[KnownMaximum]) -> Vec<f64> {
    let top = known.iter().map(|k| k.log_marginal).fold(f64::NEG_INFINITY, f64::max);
    let of = |k: &KnownMaximum| 1.0 / (1.0 + ((top - k.log_marginal) / k.s.len() as f64).powi(2));
    let sum: f64 = known.iter().map(of).sum();
    known.iter().map(|k| of(k) / sum).collect()
}
