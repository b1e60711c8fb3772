//! Priors and their latent coordinates.

use haloray::inference::{Prior, PriorShape};
use proptest::prelude::*;

use crate::derivatives::derivative;

fn priors() -> [Prior; 5] {
    let cut = |shape, low, high| Prior { shape, low, high };
    [
        Prior::uniform(-0.5, 3.0),
        cut(PriorShape::Normal([1.0, 0.3]), None, None),
        cut(PriorShape::Normal([1.0, 0.3]), Some(0.9), Some(1.7)),
        cut(PriorShape::LogNormal([0.3, 0.5]), None, None),
        cut(PriorShape::LogNormal([0.3, 0.5]), Some(0.1), None),
    ]
}

proptest! {
    #[test]
    fn latent_coordinates_are_smooth_and_invertible(z in -4.0..4.0_f64) {
        for prior in priors() {
            let [value, slope] = prior.at_latent(z);
            let [low, high] = prior.edges();
            prop_assert!(value >= low && value <= high);
            prop_assert!((prior.to_latent(value) - z).abs() < 1e-9, "{prior:?}");
            let want = derivative(|z| prior.at_latent(z)[0], z, 1e-3);
            prop_assert!((slope - want).abs() < 1e-9 * (1.0 + want.abs()), "{prior:?}: {slope} {want}");
        }
    }
}

#[test]
fn half_of_the_probability_lies_below_zero() {
    assert_eq!(Prior::uniform(-0.5, 3.0).at_latent(0.0)[0], 1.25);
    // The median of a normal cut at its mean is its upper quartile.
    let cut = Prior { shape: PriorShape::Normal([0.0, 1.0]), low: Some(0.0), high: None };
    assert!((cut.at_latent(0.0)[0] - 0.674_489_750_196_081_7).abs() < 1e-12);
}

#[test]
fn priors_without_room_are_refused() {
    let cut = |low, high| Prior { shape: PriorShape::Normal([0.0, 1.0]), low, high };
    for prior in [
        Prior::uniform(1.0, 1.0),
        Prior::uniform(f64::NAN, 1.0),
        cut(Some(2.0), Some(1.0)),
        cut(Some(50.0), None),
        Prior { low: Some(0.0), ..Prior::uniform(0.0, 1.0) },
        Prior { shape: PriorShape::Normal([0.0, 0.0]), low: None, high: None },
        Prior { shape: PriorShape::LogNormal([-1.0, 0.1]), low: None, high: None },
    ] {
        assert!(prior.validate("x").is_err(), "{prior:?}");
    }
}
