//! The ends of the valley, where chains begin besides its top. Chains learn from one another: if all begin at the top, they may
//! all stay in one part of a long valley and agree on that (R-hat). From points as far apart as draws get they do so less often (Gelman &
//! Rubin 1992, Statistical Science 7, 457).

use nalgebra::{DMatrix, DVector};

use crate::inference::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES};

/// Widest directions of which both ends are sought: with the top, enough for four chains.
const DIRECTIONS: usize = 2;
/// How far ln p has fallen at an end: two deviations.
const FALL: f64 = 2.0;

/// Ends of the profiles of ln p along the widest principal axes at a maximum.
pub(super) fn ends(likelihood: &dyn LatentLikelihood, top: &[f64], metric: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let profile = |number| profile_ends(likelihood, &Axes::along(top, metric, number));
    (0..DIRECTIONS.min(top.len())).flat_map(profile).collect()
}

/// Where the profile along the one slow direction has fallen by [`FALL`], or can be followed no further, on both sides.
fn profile_ends(likelihood: &dyn LatentLikelihood, axes: &Axes) -> Vec<Vec<f64>> {
    /// Length of a step in deviations, and steps to one side: six deviations.
    const STEP: f64 = 0.5;
    const STEPS: usize = 12;
    let follow = |s: &DVector<f64>, guess| axes.maximum(likelihood, s, guess, MOST_CURVATURES);
    let Some(top) = follow(&DVector::zeros(1), DVector::zeros(axes.stiff_dimension())) else { return vec![] };
    // The prior has a deviation of one.
    let deviation = top.metric[(0, 0)].sqrt().recip().min(1.0);
    let end = |side: f64| {
        let step = DVector::from_element(1, side * STEP * deviation);
        let walk = |(s, at): &(DVector<f64>, ConditionalMaximum)| {
            let next = s + &step;
            let there = follow(&next, &at.stiff + &at.bend * &step)?;
            (there.log_density > top.log_density - FALL).then_some((next, there))
        };
        let (s, at) =
            std::iter::successors(Some((DVector::zeros(1), top.clone())), walk).take(STEPS + 1).last()?;
        (s[0] != 0.0).then(|| axes.at(&s, &at.stiff).as_slice().to_vec())
    };
    [-1.0, 1.0].into_iter().filter_map(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::known::Known;

    /// y within 0.01 of 0.4 x², and x within 0.2 of 0.3.
    const BENT: Known = Known {
        dimension: 2,
        log_likelihood: |z| -0.5 * residuals(z).iter().map(|r| r * r).sum::<f64>(),
        slope_and_metric: |z| {
            let jacobian = DMatrix::from_row_slice(2, 2, &[5.0, 0.0, -80.0 * z[0], 100.0]);
            let residuals = DVector::from_column_slice(&residuals(z));
            let metric = jacobian.tr_mul(&jacobian) + DMatrix::identity(2, 2);
            (-jacobian.tr_mul(&residuals) - DVector::from_column_slice(z), metric)
        },
    };

    fn residuals(z: &[f64]) -> [f64; 2] {
        [(z[0] - 0.3) / 0.2, (z[1] - 0.4 * z[0] * z[0]) / 0.01]
    }

    #[test]
    fn both_ends_of_a_bent_valley_are_found_on_its_floor_two_deviations_away() {
        let top = [0.287, 0.4 * 0.287 * 0.287];
        let metric = BENT.curvature(&top).unwrap().metric;
        let mut found = profile_ends(&BENT, &Axes::along(&top, &metric, 0));
        found.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [lower, upper] = &found[..] else { panic!("{found:?}") };
        for end in [lower, upper] {
            assert!((end[1] - 0.4 * end[0] * end[0]).abs() < 0.002, "{end:?}");
            let deviations = (end[0] - 0.287).abs() / 0.196;
            assert!((1.4..2.1).contains(&deviations), "{end:?}");
        }
        assert!(lower[0] < 0.0 && upper[0] > 0.5, "{found:?}");
    }
}
