//! The closed list of mass profiles.

use super::profile::{deflect_lanes, respond_lanes};
use super::{
    BoxyEpl, Described, Epl, External, MassProfile, Nfw, PointMass, PolarShear, Response, SersicMass,
    TruncatedNfw,
};
use crate::numerics::complex::Cx;
use crate::numerics::real::{Lanes, Real};
use crate::profile::parameter::{Description, Parameter};

/// The closed list of mass profiles: each line makes a model of [`MassModel`] and an entry of the registry.
macro_rules! mass_models {
    ($($(#[$doc:meta])* $model:ident($profile:ty),)*) => {
        /// Every mass profile that can stand in a lens plane.
        #[derive(Debug, Clone)]
        pub enum MassModel {
            $($(#[$doc])* $model($profile),)*
        }

        /// The descriptions of all mass profiles.
        pub static MASSES: &[Description<MassModel>] = &[$(Description {
            names: <$profile>::NAMES,
            parameters: <$profile>::PARAMETERS,
            builder: |values| <$profile>::of_parameters(values).map(MassModel::$model),
        },)*];

        impl MassModel {
            /// Centre of the profile in arcsec; `None` for external fields, which have none.
            pub fn centre_arcsec(&self) -> Option<[f64; 2]> {
                match self { $(Self::$model(profile) => profile.centre_arcsec(),)* }
            }

            /// Deflection in every lane.
            pub(crate) fn deflection_lanes(&self, x: Lanes, y: Lanes) -> Cx<Lanes> {
                match self { $(Self::$model(profile) => deflect_lanes(profile, &x, &y),)* }
            }

            /// Deflection, convergence, shear and parameter derivatives in every lane.
            pub(crate) fn response_lanes(&self, x: Lanes, y: Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
                match self { $(Self::$model(profile) => respond_lanes(profile, &x, &y, by_parameter),)* }
            }
        }

        impl MassProfile for MassModel {
            fn potential(&self, x: f64, y: f64) -> f64 {
                match self { $(Self::$model(profile) => profile.potential(x, y),)* }
            }

            fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
                match self { $(Self::$model(profile) => profile.deflect(x, y),)* }
            }

            fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
                match self { $(Self::$model(profile) => profile.respond(x, y, by_parameter),)* }
            }

            fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
                match self { $(Self::$model(profile) => profile.hessian(x, y),)* }
            }

            fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
                match self { $(Self::$model(profile) => profile.third_derivatives(x, y),)* }
            }

            fn parameters(&self) -> &'static [Parameter] {
                match self { $(Self::$model(profile) => profile.parameters(),)* }
            }
        }
    };
}

mass_models! {
    /// Elliptical power law.
    Epl(Epl),
    /// Elliptical power law with boxy or disky contours.
    BoxyEpl(BoxyEpl),
    /// Navarro–Frenk–White halo.
    Nfw(Nfw),
    /// Truncated NFW halo.
    TruncatedNfw(TruncatedNfw),
    /// Sérsic profile of the convergence.
    Sersic(SersicMass),
    /// Point mass.
    PointMass(PointMass),
    /// Convergence, shear and flexion from outside.
    External(External),
    /// Shear from outside by strength and direction.
    PolarShear(PolarShear),
}

/// The most parameters a profile has.
pub(crate) const MOST_PARAMETERS: usize = {
    let (mut most, mut i) = (0, 0);
    while i < MASSES.len() {
        if MASSES[i].parameters.len() > most {
            most = MASSES[i].parameters.len();
        }
        i += 1;
    }
    most
};
