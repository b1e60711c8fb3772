//! The valley from end to end, before any chain has followed it. Expansions about floors elsewhere take a bent valley for a
//! wall: what no chain has met is not proposed, and chains, which learn from one another, may agree (R-hat) on a part of a
//! posterior. So floors are sought along profiles of ln p, and chains begin at their ends too: as far apart as draws get (Gelman & Rubin
//! 1992, Statistical Science 7, 457).

use nalgebra::{DMatrix, DVector};

use crate::inference::LatentLikelihood;
use crate::inference::likelihood::Curvature;
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES};

/// Widest directions that are followed both ways: with the top, ends enough for four chains.
const DIRECTIONS: usize = 2;
/// How far ln p has fallen at an end: three deviations. Draws of nine coordinates lie as low.
const FALL: f64 = 4.5;
/// Longest and shortest step in deviations, and most steps to one side.
const LONGEST: f64 = 0.5;
const SHORTEST: f64 = 0.06;
const STEPS: usize = 30;
/// More than ln p falls in a step before an end: what is lower is another floor.
const DROP: f64 = 2.0;

/// Points on the floor of the valley from next to its top to its ends, both ways along each of its widest directions; none is empty.
pub(super) fn profiles(
    likelihood: &dyn LatentLikelihood,
    top: &[f64],
    metric: &DMatrix<f64>,
    log_density: f64,
) -> Vec<Vec<Vec<f64>>> {
    let widest = Axes::split(top, metric, DIRECTIONS.min(top.len()));
    let headings = widest.slow().column_iter().flat_map(|axis| [-axis, axis.into_owned()]);
    let walks = headings.map(|heading| walk(likelihood, top, heading, log_density - FALL));
    walks.filter(|points| !points.is_empty()).collect()
}

/// The floor from a point on, until ln p is lower than `lowest` or the valley can be followed no further. Each step is along the
/// principal axis that leads on, as along a fixed one a bent valley ends where it turns back, and shorter where that leads off.
fn walk(
    likelihood: &dyn LatentLikelihood,
    from: &[f64],
    heading: DVector<f64>,
    lowest: f64,
) -> Vec<Vec<f64>> {
    let (mut points, mut length) = (vec![], LONGEST);
    let mut stand = Stand::at(likelihood, DVector::from_column_slice(from), &heading);
    for _ in 0..STEPS {
        let Some(here) = &stand else { break };
        let there = here.step(likelihood, length);
        match there.filter(|(_, log_density)| *log_density > here.floor.log_density - DROP) {
            Some((_, log_density)) if log_density < lowest => break,
            Some((z, _)) => {
                points.push(z.as_slice().to_vec());
                length = (2.0 * length).min(LONGEST);
                let heading = &z - &here.z;
                stand = Stand::at(likelihood, z, &heading);
            }
            None if length < SHORTEST => break,
            None => length *= 0.5,
        }
    }
    points
}

/// A point of the floor, with the one direction that leads on.
struct Stand {
    z: DVector<f64>,
    axes: Axes,
    floor: ConditionalMaximum,
}

impl Stand {
    fn at(likelihood: &dyn LatentLikelihood, z: DVector<f64>, heading: &DVector<f64>) -> Option<Self> {
        let Curvature { metric, .. } = likelihood.curvature(z.as_slice()).ok()?;
        let axes = Axes::along(z.as_slice(), &metric, heading);
        let [s, t] = axes.coordinates(z.as_slice());
        Some(Self { floor: axes.maximum(likelihood, &s, t, MOST_CURVATURES)?, z, axes })
    }

    /// The floor so many deviations further on, and ln p there.
    fn step(&self, likelihood: &dyn LatentLikelihood, length: f64) -> Option<(DVector<f64>, f64)> {
        let Self { axes, floor, .. } = self;
        // The prior has a deviation of one.
        let s = DVector::from_element(1, length * floor.metric[(0, 0)].sqrt().recip().min(1.0));
        let there = axes.maximum(likelihood, &s, &floor.stiff + &floor.bend * &s, MOST_CURVATURES)?;
        Some((axes.at(&s, &there.stiff), there.log_density))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::known::Known;

    /// An arc of radius 1 about the origin, 0.01 wide and 0.6 long, its top at (0, 1).
    const ARC: Known = Known {
        dimension: 2,
        log_likelihood: |z| {
            let [across, along] = [(z[0].hypot(z[1]) - 1.0) / 0.01, z[0].atan2(z[1]) / 0.6];
            0.5 * (z[0] * z[0] + z[1] * z[1] - across * across - along * along)
        },
        slope_and_metric: |z| {
            let (r, angle) = (z[0].hypot(z[1]), z[0].atan2(z[1]));
            let rows = [z[0] / r / 0.01, z[1] / r / 0.01, z[1] / (r * r) / 0.6, -z[0] / (r * r) / 0.6];
            let jacobian = DMatrix::from_row_slice(2, 2, &rows);
            let residuals = DVector::from_column_slice(&[(r - 1.0) / 0.01, angle / 0.6]);
            (-jacobian.tr_mul(&residuals), jacobian.tr_mul(&jacobian))
        },
    };

    #[test]
    fn a_bent_valley_is_followed_round_its_bend_to_three_deviations() {
        let top = [0.0, 1.0];
        let metric = ARC.curvature(&top).unwrap().metric;
        let found = profiles(&ARC, &top, &metric, 0.0);
        let along: Vec<_> = found.iter().filter(|points| points.last().unwrap()[0].abs() > 0.5).collect();
        assert_eq!((found.len(), along.len()), (4, 2), "{found:?}");
        for points in along {
            let angles: Vec<f64> = points.iter().map(|z| z[0].atan2(z[1]).abs() / 0.6).collect();
            // 1.8 rad: it has turned back.
            assert!((2.4..3.01).contains(angles.last().unwrap()), "{angles:?}");
            assert!(
                angles.is_sorted() && angles.windows(2).all(|pair| pair[1] - pair[0] < 0.8),
                "{angles:?}"
            );
            assert!(points.iter().all(|z| (z[0].hypot(z[1]) - 1.0).abs() < 1e-3), "{points:?}");
        }
    }

    #[test]
    fn nothing_is_found_beside_a_top_that_is_lower_than_wanted() {
        assert_eq!(walk(&ARC, &[0.0, 1.0], DVector::from_vec(vec![1.0, 0.0]), 0.5).len(), 0);
    }
}
