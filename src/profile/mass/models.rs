//! The closed list of mass profiles.

use super::profile::{MOST_PARAMETERS, deflect_each_lane, deflect_lanes, respond_each_lane, respond_lanes};
use super::{
    BoxyEpl, Described, Epl, External, MassProfile, Nfw, PointMass, PolarShear, Response, SersicMass,
    TruncatedNfw,
};
use crate::numerics::complex::Cx;
use crate::numerics::real::{Lanes, Real};
use crate::profile::parameter::{Description, Parameter};

/// The closed list of mass profiles: each line makes a model of [`MassModel`] and an entry of the registry, and says which
/// functions evaluate it in lanes.
macro_rules! mass_models {
    ($($(#[$doc:meta])* $model:ident($profile:ty): $deflect:ident, $respond:ident;)*) => {
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
                match self { $(Self::$model(profile) => $deflect(profile, &x, &y),)* }
            }

            /// Deflection, convergence, shear and parameter derivatives in every lane.
            pub(crate) fn response_lanes(&self, x: Lanes, y: Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
                match self { $(Self::$model(profile) => $respond(profile, &x, &y, by_parameter),)* }
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
    Epl(Epl): deflect_lanes, respond_lanes;
    /// Elliptical power law with boxy or disky contours.
    BoxyEpl(BoxyEpl): deflect_each_lane, respond_each_lane;
    /// Navarro–Frenk–White halo.
    Nfw(Nfw): deflect_lanes, respond_lanes;
    /// Truncated NFW halo.
    TruncatedNfw(TruncatedNfw): deflect_each_lane, respond_each_lane;
    /// Sérsic profile of the convergence.
    Sersic(SersicMass): deflect_lanes, respond_lanes;
    /// Point mass.
    PointMass(PointMass): deflect_each_lane, respond_each_lane;
    /// Convergence, shear and flexion from outside.
    External(External): deflect_each_lane, respond_each_lane;
    /// Shear from outside by strength and direction.
    PolarShear(PolarShear): deflect_each_lane, respond_each_lane;
}

// Every profile has room for its parameters.
const _: () = {
    let mut i = 0;
    while i < MASSES.len() {
        assert!(MASSES[i].parameters.len() <= MOST_PARAMETERS);
        i += 1;
    }
};
