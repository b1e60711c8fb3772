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
