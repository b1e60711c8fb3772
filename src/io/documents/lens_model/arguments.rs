//! The keyword arguments of one model of a list, read under lenstronomy's names.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::profile::mass::MassModel;
use crate::profile::registry::{Parameter, Role, mass};

/// The keyword arguments of one model.
pub(super) struct Arguments<'a> {
    pub name: &'a str,
    /// Place in the list, from 0.
    pub position: usize,
    pub values: &'a BTreeMap<String, f64>,
}

impl Arguments<'_> {
    /// Refuses arguments in neither list, and the lack of a required one.
    pub fn expect(&self, required: &[&str], optional: &[&str]) -> Result<()> {
        let known = [required, optional].concat();
        let unknown: Vec<&str> =
            self.values.keys().map(String::as_str).filter(|key| !known.contains(key)).collect();
        if !unknown.is_empty() {
            let what = format!("argument of {self}");
            return Err(Error::out_of_range(
                &what,
                unknown.join(", "),
                &format!("one of {}", known.join(", ")),
            ));
        }
        let missing: Vec<&str> =
            required.iter().copied().filter(|key| !self.values.contains_key(*key)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        Err(Error::out_of_range(&format!("argument {} of {self}", missing.join(", ")), "missing", "a number"))
    }

    /// The value of an argument, 0 where it is left out (optional ones only, after [`Self::expect`]).
    pub fn value(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0)
    }

    /// The mass profile of these arguments.
    pub fn profile(&self) -> Result<MassModel> {
        self.checked_profile().map_err(|error| match error {
            Error::OutOfRange { what, value, allowed } if !what.contains(self.name) => {
                Error::out_of_range(&format!("{what} of {self}"), value, &allowed)
            }
            other => other,
        })
    }

    fn checked_profile(&self) -> Result<MassModel> {
        let profile = mass(self.name)?;
        let named = |is_optional: bool| -> Vec<&str> {
            let own = profile.arguments().filter(|own| (own.role == Role::Centre) == is_optional);
            own.map(|own| own.name).collect()
        };
        self.expect(&named(false), &named(true))?;
        profile.build(|parameter: &Parameter| self.value(parameter.name))
    }
}

impl std::fmt::Display for Arguments<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (number {} of the list)", self.name, self.position + 1)
    }
}
