//! How often β − β_s winds about zero along the edge of a square: the sum of the parities inside.

use crate::mapping::{Mapping, Order};

/// Points on each side of the square at the start.
const POINTS_PER_SIDE: usize = 24;
/// Largest turn of β − β_s between neighbouring points, rad.
const LARGEST_TURN_RAD: f64 = 0.7;
/// Rounds of inserting points; each halves the gaps.
const ROUNDS: usize = 40;
/// Points beyond which β_s is taken to lie on the image of the edge.
const POINTS_MAX: usize = 20_000;

/// Number of turns of β(θ) − `source` while θ runs once counter-clockwise round the square.
///
/// For a smooth mapping this is the sum of sign(det A) over the images inside (degree theorem). Points are inserted
/// until no turn between neighbours exceeds 0.7 rad. `None` when `source` lies on the image of the edge.
pub(super) fn winding_number(
    mapping: &(impl Mapping + ?Sized),
    centre: [f64; 2],
    half: f64,
    source: [f64; 2],
) -> Option<i64> {
    let place = |t: f64| {
        let (side, along) = (t.floor() as usize % 4, 2.0 * t.fract() - 1.0);
        let [u, v] = [[along, -1.0], [1.0, along], [-along, 1.0], [-1.0, -along]][side];
        [centre[0] + half * u, centre[1] + half * v]
    };
    let angles = |at: &[f64]| -> Vec<(f64, f64)> {
        let theta: Vec<[f64; 2]> = at.iter().map(|&t| place(t)).collect();
        let beta = mapping.map(&theta, Order::Position).beta_arcsec;
        at.iter()
            .zip(beta)
            .map(|(&t, b)| {
                let (dx, dy) = (b[0] - source[0], b[1] - source[1]);
                (t, if dx == 0.0 && dy == 0.0 { f64::NAN } else { dy.atan2(dx) })
            })
            .collect()
    };
    let n = 4 * POINTS_PER_SIDE;
    let start: Vec<f64> = (0..n).map(|i| i as f64 / POINTS_PER_SIDE as f64).collect();
    let mut points = angles(&start);
    for _ in 0..ROUNDS {
        if points.len() > POINTS_MAX || points.iter().any(|(_, angle)| !angle.is_finite()) {
            return None;
        }
        let gaps = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            (0..points.len())
                .map(|i| {
                    let (t, angle) = points[i];
                    let (next, other) = points.get(i + 1).map_or((4.0, points[0].1), |&p| p);
                    (0.5 * (t + next), turn(other - angle))
                })
                .collect()
        };
        let gaps = gaps(&points);
        let wide: Vec<f64> =
            gaps.iter().filter(|(_, turn)| turn.abs() > LARGEST_TURN_RAD).map(|&(t, _)| t).collect();
        if wide.is_empty() {
            let total: f64 = gaps.iter().map(|(_, turn)| turn).sum();
            return Some((total / std::f64::consts::TAU).round() as i64);
        }
        points.extend(angles(&wide));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    None
}

/// An angle brought to (−π, π].
fn turn(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::tidal::{LineOfSightModel, TidalLens};
    use crate::profile::mass::{Epl, MassModel, PointMass};

    fn lens(profile: MassModel) -> TidalLens {
        TidalLens::new(LineOfSightModel::EMPTY, vec![profile])
    }

    #[test]
    fn one_turn_far_out_and_the_index_of_the_centre_near_it() {
        let far = |lens: &TidalLens| winding_number(lens, [0.0; 2], 6.0, [0.1, 0.2]);
        let near = |lens: &TidalLens| winding_number(lens, [0.0; 2], 1e-3, [0.1, 0.2]);
        let sphere = lens(MassModel::Epl(Epl::new(1.0, 2.0, [0.0; 2], [0.0; 2]).unwrap()));
        assert_eq!((far(&sphere), near(&sphere)), (Some(1), Some(1)));
        let point = lens(MassModel::PointMass(PointMass::new(1.0, [0.0; 2]).unwrap()));
        // −θ/θ² keeps the sense of rotation: the pole counts +1.
        assert_eq!((far(&point), near(&point)), (Some(1), Some(1)));
        assert_eq!(winding_number(&sphere, [0.0; 2], 0.5, [3.0, 0.0]), Some(0));
    }

    #[test]
    fn a_source_on_the_image_of_the_edge_has_no_number() {
        let nothing = TidalLens {
            lenses: Vec::new(),
            ..lens(MassModel::PointMass(PointMass::new(1.0, [0.0; 2]).unwrap()))
        };
        assert_eq!(winding_number(&nothing, [0.0; 2], 1.0, [1.0, 0.123]), None);
        assert_eq!(winding_number(&nothing, [0.0; 2], 1.0, [0.999_999, 0.123]), Some(1));
    }
}
