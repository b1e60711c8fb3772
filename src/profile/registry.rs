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
