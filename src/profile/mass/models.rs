//! What makes one model of the closed list out of every mass profile.

/// The closed list of mass profiles: each line makes a model of `MassModel` and an entry of the registry, and says how it
/// is evaluated in lanes: by `kernels` of its own, or by `each_lane` in turn.
macro_rules! mass_models {
    ($($(#[$doc:meta])* $model:ident($profile:ty) in $lanes:ident;)*) => {
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

            /// The parameters; the centre comes last.
            pub fn parameters(&self) -> &'static [Parameter] {
                match self { $(Self::$model(_) => <$profile>::PARAMETERS,)* }
            }

            /// Deflection in every lane.
            pub(crate) fn deflection_lanes(&self, x: Lanes, y: Lanes) -> Cx<Lanes> {
                match self { $(Self::$model(profile) => $lanes::deflect(profile, &x, &y),)* }
            }

            /// Deflection and Hessian in every lane.
            pub(crate) fn expansion_lanes(&self, x: Lanes, y: Lanes) -> (Cx<Lanes>, [Lanes; 3]) {
                match self { $(Self::$model(profile) => $lanes::expand(profile, &x, &y),)* }
            }

            /// Deflection, convergence, shear and parameter derivatives in every lane.
            pub(crate) fn response_lanes(&self, x: Lanes, y: Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
                match self { $(Self::$model(profile) => $lanes::respond(profile, &x, &y, by_parameter),)* }
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

            fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
                match self { $(Self::$model(profile) => profile.expand(x, y),)* }
            }

            fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
                match self { $(Self::$model(profile) => profile.third_derivatives(x, y),)* }
            }
        }
    };
}

pub(super) use mass_models;
