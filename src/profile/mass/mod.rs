//! Mass profiles: potential ψ, deflection α = ∇ψ, Hessian and third derivatives, all analytic.

mod boxy_epl;
mod einstein_radius;
mod epl;
mod external;
mod models;
mod nfw;
pub mod nfw_radial;
mod point_mass;
mod polar_shear;
mod profile;
mod radial;
mod response;
mod sersic;
mod truncated_nfw;

pub use boxy_epl::BoxyEpl;
pub use einstein_radius::{einstein_radius_arcsec, mean_convergence};
pub use epl::Epl;
pub use external::External;
pub use nfw::Nfw;
pub(crate) use nfw::resolved_scale_radius;
pub use point_mass::PointMass;
pub use polar_shear::PolarShear;
pub(crate) use profile::MOST_PARAMETERS;
pub use profile::{Described, MassProfile, Response};
pub(crate) use radial::RadialDerivatives;
pub use radial::{Radial, RadialLaw};
pub use response::{Responses, deflections, responses};
pub use sersic::SersicMass;
pub use truncated_nfw::{TruncatedNfw, Truncation, potential as truncated_potential};

use self::models::mass_models;
use self::profile::{each_lane, kernels};
use crate::numerics::complex::Cx;
use crate::numerics::real::{Lanes, Real};
use crate::profile::parameter::{Description, Parameter};

mass_models! {
    /// Elliptical power law.
    Epl(Epl) in kernels;
    /// Elliptical power law with boxy or disky contours.
    BoxyEpl(BoxyEpl) in each_lane;
    /// Navarro–Frenk–White halo.
    Nfw(Nfw) in kernels;
    /// Truncated NFW halo.
    TruncatedNfw(TruncatedNfw) in kernels;
    /// Sérsic profile of the convergence.
    Sersic(SersicMass) in kernels;
    /// Point mass.
    PointMass(PointMass) in each_lane;
    /// Convergence, shear and flexion from outside.
    External(External) in kernels;
    /// Shear from outside by strength and direction.
    PolarShear(PolarShear) in each_lane;
}

// Every profile has room for its parameters.
const _: () = {
    let mut i = 0;
    while i < MASSES.len() {
        assert!(MASSES[i].parameters.len() <= MOST_PARAMETERS);
        i += 1;
    }
};
