//! The reference cone of `data/reference/multiplane_cone.csv` and lines of sight built by hand.

use haloray::cosmology::Background;
use haloray::halo::{HaloCatalogue, HaloMasses};

/// Source redshift of every cone here.
pub const Z_SOURCE: f64 = 1.5;

/// One NFW halo: redshift, centre, scale radius and reduced deflection there, in arcsec.
#[derive(Debug, Clone, Copy)]
pub struct Halo {
    pub z: f64,
    pub centre: [f64; 2],
    pub r_s: f64,
    pub alpha_rs: f64,
}

/// A catalogue of the given haloes, in the given order.
pub fn catalogue(haloes: &[Halo]) -> HaloCatalogue {
    let column = |of: &dyn Fn(&Halo) -> f64| haloes.iter().map(of).collect::<Vec<f64>>();
    let masses =
        HaloMasses::Angles { r_s_arcsec: column(&|h| h.r_s), alpha_rs_arcsec: column(&|h| h.alpha_rs) };
    let centres = [column(&|h| h.centre[0]), column(&|h| h.centre[1])];
    HaloCatalogue::new(Z_SOURCE, &Background::paper(), column(&|h| h.z), centres, masses).unwrap()
}

/// Any halo in or near a field of a few arcsec, of the sizes that a shear cut leaves there.
#[allow(dead_code, reason = "only property tests draw haloes")]
pub fn any_halo() -> impl proptest::strategy::Strategy<Value = Halo> {
    use proptest::strategy::Strategy;
    (0.05..1.45_f64, -4.0..4.0_f64, -4.0..4.0_f64, -1.2..0.5_f64, 0.005..0.04_f64).prop_map(
        |(z, x, y, lg_r_s, strength)| {
            let r_s = 10f64.powf(lg_r_s);
            Halo { z, centre: [x, y], r_s, alpha_rs: strength * r_s }
        },
    )
}

/// A small cone of such haloes.
#[allow(dead_code, reason = "only property tests draw haloes")]
pub fn any_cone() -> impl proptest::strategy::Strategy<Value = Vec<Halo>> {
    proptest::collection::vec(any_halo(), 2..12)
}

/// Settings of the property tests: so many cases, failures printed and not stored.
#[allow(dead_code, reason = "only property tests draw haloes")]
pub fn cases(number: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config { cases: number, failure_persistence: None, ..Default::default() }
}
