//! What "the mass of a halo" means: a density threshold, or friends of friends.

use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::cosmology::Background;
use crate::error::{Error, Result};

/// Spherical-overdensity or friends-of-friends mass, written "200c", "200m", "vir" or "fof".
///
/// ```
/// use haloray::cosmology::Background;
/// use haloray::halo::MassDefinition;
/// let definition: MassDefinition = "200c".parse().unwrap();
/// let overdensity = definition.mean_overdensity(&Background::planck18(), 0.0).unwrap();
/// assert!((overdensity - 200.0 / 0.3111).abs() < 1e-10);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub enum MassDefinition {
    /// Mean density inside the halo is this many times the critical density at its redshift.
    Critical(f64),
    /// Mean density inside the halo is this many times the mean matter density at its redshift.
    Mean(f64),
    /// Virial overdensity of Bryan & Norman 1998 for flat ΛCDM.
    Virial,
    /// Friends of friends; no density threshold.
    FriendsOfFriends,
}

const SPELLING: &str = "\"200c\", \"200m\" (any positive number), \"vir\" or \"fof\"";

impl MassDefinition {
    /// Mean density inside the halo, physical Msun/Mpc³; `None` for friends of friends.
    ///
    /// Virial: Δ_c = 18π² + 82x − 39x², x = Ωm(z) − 1 (Bryan & Norman 1998, ApJ 495, 80, eq. 6).
    pub fn density_threshold_msun_mpc3(&self, background: &Background, z: f64) -> Option<f64> {
        let critical = background.critical_density_msun_mpc3(z);
        match self {
            Self::Critical(overdensity) => Some(overdensity * critical),
            Self::Mean(overdensity) => Some(overdensity * critical * background.omega_m_at(z)),
            Self::Virial => {
                let x = background.omega_m_at(z) - 1.0;
                Some((18.0 * PI * PI + x * (82.0 - 39.0 * x)) * critical)
            }
            Self::FriendsOfFriends => None,
        }
    }

    /// Refuses every definition but `allowed`, for a published relation.
    pub(super) fn must_be(self, allowed: &'static str, relation: &'static str) -> Result<()> {
        let given = self.to_string();
        if given == allowed { Ok(()) } else { Err(Error::MassDefinition { relation, given, allowed }) }
    }

    /// Overdensity with respect to the mean matter density at `z`; `None` for friends of friends.
    pub fn mean_overdensity(&self, background: &Background, z: f64) -> Option<f64> {
        if let Self::Mean(overdensity) = self {
            return Some(*overdensity);
        }
        let mean = background.critical_density_msun_mpc3(z) * background.omega_m_at(z);
        self.density_threshold_msun_mpc3(background, z).map(|threshold| threshold / mean)
    }
}

impl fmt::Display for MassDefinition {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Critical(overdensity) => write!(formatter, "{overdensity}c"),
            Self::Mean(overdensity) => write!(formatter, "{overdensity}m"),
            Self::Virial => formatter.write_str("vir"),
            Self::FriendsOfFriends => formatter.write_str("fof"),
        }
    }
}

impl FromStr for MassDefinition {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let refuse = || Error::out_of_range("mass definition", format!("\"{text}\""), SPELLING);
        let overdensity = |digits: &str| match digits.parse::<f64>() {
            Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
            _ => Err(refuse()),
        };
        match text {
            "vir" => Ok(Self::Virial),
            "fof" => Ok(Self::FriendsOfFriends),
            _ => match (text.strip_suffix('c'), text.strip_suffix('m')) {
                (Some(digits), _) => Ok(Self::Critical(overdensity(digits)?)),
                (_, Some(digits)) => Ok(Self::Mean(overdensity(digits)?)),
                _ => Err(refuse()),
            },
        }
    }
}

impl TryFrom<String> for MassDefinition {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<MassDefinition> for String {
    fn from(definition: MassDefinition) -> Self {
        definition.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling_survives_a_round_trip() {
        for text in ["200c", "500c", "200m", "177.5m", "vir", "fof"] {
            let definition: MassDefinition = text.parse().unwrap();
            assert_eq!(definition.to_string(), text);
            let json = serde_json::to_string(&definition).unwrap();
            assert_eq!(json, format!("\"{text}\""));
            assert_eq!(serde_json::from_str::<MassDefinition>(&json).unwrap(), definition);
        }
    }

    #[test]
    fn misspellings_are_refused_with_the_cure() {
        for text in ["", "c", "200", "-200c", "0m", "NaNc", "infm", "virial", "200C", "200 c"] {
            let message = text.parse::<MassDefinition>().unwrap_err().to_string();
            assert!(message.contains("\"vir\""), "{text}: {message}");
        }
    }

    #[test]
    fn the_virial_overdensity_has_its_known_limits() {
        // 18π² in Einstein–de Sitter, about 100 of critical today in ΛCDM.
        let eds = Background::new(70.0, 1.0).unwrap();
        let overdensity = MassDefinition::Virial.mean_overdensity(&eds, 0.7).unwrap();
        assert!((overdensity / (18.0 * PI * PI) - 1.0).abs() < 1e-14);
        let today = Background::new(70.0, 0.3).unwrap();
        let critical = MassDefinition::Virial.mean_overdensity(&today, 0.0).unwrap() * 0.3;
        assert!((critical - 101.14).abs() < 0.01, "{critical}");
    }

    #[test]
    fn critical_and_mean_thresholds_meet_while_matter_dominates() {
        let background = Background::paper();
        let ratio = |z| {
            let critical = MassDefinition::Critical(200.0).density_threshold_msun_mpc3(&background, z);
            let mean = MassDefinition::Mean(200.0).density_threshold_msun_mpc3(&background, z);
            critical.unwrap() / mean.unwrap()
        };
        assert!((ratio(0.0) - 1.0 / 0.315).abs() < 1e-12);
        assert!((ratio(1000.0) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn friends_of_friends_has_no_threshold() {
        let background = Background::paper();
        let fof = MassDefinition::FriendsOfFriends;
        assert_eq!(fof.density_threshold_msun_mpc3(&background, 0.0), None);
        assert_eq!(fof.mean_overdensity(&background, 0.0), None);
    }
}
