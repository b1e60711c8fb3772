//! The registry of profiles: every mass and light profile under lenstronomy's names, described once for all readers.
//!
//! ```
//! use haloray::profile::registry;
//! let sie = registry::mass("SIE").unwrap();
//! let names: Vec<&str> = sie.arguments().map(|parameter| parameter.name).collect();
//! assert_eq!(names, ["theta_E", "e1", "e2", "center_x", "center_y"]);
//! assert_eq!(sie.description.parameters[0].unit, "arcsec");
//! assert!(sie.description.build(&[1.2, 2.0, 0.1, 0.0, 0.0, 0.0]).is_ok());
//! assert!(sie.description.build(&[1.2, 2.0]).is_err());
//! ```

pub use super::light::{LENS_LIGHTS, SOURCES};
pub use super::mass::MASSES;
pub use super::parameter::{Description, Guess, Name, Named, Parameter, PriorShape, Role};
use crate::error::{Error, Result};
use crate::profile::light::Sersic;
use crate::profile::mass::MassModel;

/// The mass profile of a name.
///
/// # Errors
/// A name that is not known, with all that are.
pub fn mass(name: &str) -> Result<Named<MassModel>> {
    named(MASSES, "profile of a lens", name)
}

/// The light profile of a name as that of a source.
///
/// # Errors
/// A name that is not known, with all that are.
pub fn source(name: &str) -> Result<Named<Sersic>> {
    named(SOURCES, "profile of a light", name)
}

/// The light profile of a name as that of a lens.
///
/// # Errors
/// A name that is not known, with all that are.
pub fn lens_light(name: &str) -> Result<Named<Sersic>> {
    named(LENS_LIGHTS, "profile of a light", name)
}

/// The names of all mass profiles.
pub fn mass_names() -> Vec<&'static str> {
    names(MASSES)
}

fn names<M>(all: &'static [Description<M>]) -> Vec<&'static str> {
    all.iter().flat_map(|description| description.names).map(|name| name.name).collect()
}

fn named<M>(all: &'static [Description<M>], what: &str, name: &str) -> Result<Named<M>> {
    let mut pairs =
        all.iter().flat_map(|description| description.names.iter().map(move |own| (own, description)));
    pairs
        .find(|(own, _)| own.name == name)
        .map(|(name, description)| Named { name, description })
        .ok_or_else(|| Error::out_of_range(what, name, &format!("one of {}", names(all).join(", "))))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::profile::mass::derivative_checks::{assert_consistent, assert_parameter_derivatives};

    /// Richardson differences over steps of 1% to 2%.
    const DIFFERENCES: f64 = 1e-7;

    /// A value inside the usual prior; ellipticities keep away from 0, where the direction of a multipole jumps.
    fn usual(parameter: &Parameter, u: f64) -> f64 {
        match parameter.usual_prior {
            _ if parameter.role == Role::Ellipticity => 0.05 + 0.3 * u,
            PriorShape::Uniform([low, high]) => low + (0.1 + 0.8 * u) * (high - low),
            PriorShape::Normal([mean, sd]) => mean + (2.0 * u - 1.0) * sd,
            PriorShape::LogNormal([median, sd]) => median * ((2.0 * u - 1.0) * sd).exp(),
        }
    }

    proptest! {
        #[test]
        fn every_derivative_of_every_profile_is_one(
            u in prop::array::uniform9(0.0..1.0_f64), r in 0.05..5.0_f64, phi in 0.0..std::f64::consts::TAU,
        ) {
            for description in MASSES {
                let values = description.parameters.iter().zip(u).map(|(parameter, u)| usual(parameter, u));
                let mut values: Vec<f64> = values.collect();
                let build = |values: &[f64]| description.build(values).unwrap();
                let [x, y] = build(&values).centre_arcsec().unwrap_or_default();
                let (x, y) = (x + r * phi.cos(), y + r * phi.sin());
                assert_consistent(&build(&values), x, y, 0.02 * r, DIFFERENCES);
                assert_parameter_derivatives(build, &values, [x, y], DIFFERENCES);
                let is_round = |p: &Parameter| p.role == Role::Ellipticity || p.name == "a4_a";
                let round = description.parameters.iter().zip(&mut values).filter(|(p, _)| is_round(p));
                round.for_each(|(_, value)| *value = 0.0);
                assert_consistent(&build(&values), x, y, 0.02 * r, DIFFERENCES);
                if description.names[0].name != "EPL_BOXYDISKY" {
                    assert_parameter_derivatives(build, &values, [x, y], DIFFERENCES);
                }
            }
        }
    }

    fn values(parameters: &[Parameter]) -> Vec<f64> {
        parameters.iter().map(|parameter| usual(parameter, 0.5)).collect()
    }

    #[test]
    fn every_profile_is_built_from_exactly_its_parameters() {
        for description in MASSES {
            let values = values(description.parameters);
            let built = description.build(&values).unwrap();
            assert_eq!(built.parameters(), description.parameters);
            for wrong in [&values[1..], &[values.as_slice(), &[0.1]].concat(), &[]] {
                assert!(description.build(wrong).is_err(), "{:?}", description.names);
            }
            for (i, parameter) in description.parameters.iter().enumerate() {
                let mut outside = values.clone();
                outside[i] = f64::NAN;
                let message = description.build(&outside).unwrap_err().to_string();
                assert!(message.starts_with(parameter.name), "{message}");
            }
        }
        for description in SOURCES.iter().chain(LENS_LIGHTS) {
            assert!(description.build(&values(description.parameters)).is_ok());
            assert!(description.build(&[0.3]).is_err());
        }
    }

    #[test]
    fn facts_agree_with_one_another() {
        let mut seen = Vec::new();
        for (names, parameters) in MASSES
            .iter()
            .map(|d| (d.names, d.parameters))
            .chain(SOURCES.iter().chain(LENS_LIGHTS).map(|d| (d.names, d.parameters)))
        {
            for parameter in parameters {
                assert!(!parameter.label.is_empty(), "{parameter:?}");
                assert!(
                    parameter.default.is_none_or(|value| parameter.domain.contains(value)),
                    "{parameter:?}"
                );
                let [low, high] = parameter.domain.edges();
                if let PriorShape::Uniform([from, to]) = parameter.usual_prior {
                    assert!(low <= from && from < to && to <= high, "{parameter:?}");
                }
            }
            for name in names {
                for (held, value) in name.held {
                    let parameter = parameters.iter().find(|parameter| parameter.name == *held).unwrap();
                    assert!(parameter.domain.contains(*value), "{name:?}");
                }
                seen.push(name.name);
            }
        }
        assert_eq!(mass_names(), seen[..mass_names().len()]);
        assert!(mass("EPLX").unwrap_err().to_string().contains("SHEAR_GAMMA_PSI"));
        assert!(lens_light("EPL").unwrap_err().to_string().ends_with("one of SERSIC_ELLIPSE, SERSIC"));
    }
}
