//! Cones of a few haloes drawn by the property tests, and how many of them a test draws.

use proptest::collection;
use proptest::strategy::Strategy;
use proptest::test_runner::Config;

use crate::cone::Halo;

/// Any halo in or near a field of a few arcsec, of the sizes that a shear cut leaves there.
pub fn any_halo() -> impl Strategy<Value = Halo> {
    (0.05..1.45_f64, -4.0..4.0_f64, -4.0..4.0_f64, -1.2..0.5_f64, 0.005..0.04_f64).prop_map(
        |(z, x, y, lg_r_s, strength)| {
            let r_s = 10f64.powf(lg_r_s);
            Halo { z, centre: [x, y], r_s, alpha_rs: strength * r_s }
        },
    )
}

/// A small cone of such haloes.
pub fn any_cone() -> impl Strategy<Value = Vec<Halo>> {
    collection::vec(any_halo(), 2..12)
}

/// Settings of the property tests: so many cases, failures printed and not stored.
pub fn cases(number: u32) -> Config {
    Config { cases: number, failure_persistence: None, ..Default::default() }
}
