//! How accurate rays must be: exact, or within a stated error of β.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Domain, Result};

/// `"exact"`, or the largest |β − β_exact| allowed, in arcsec.
///
/// Away from halo centres the Jacobian is held to 10 times the number per arcsec, second derivatives to 1000 times
/// (1 + |b|·1″) of it per arcsec².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Accuracy {
    /// The largest error of β, arcsec.
    WithinArcsec(f64),
    /// The word `exact`.
    Exact(Exact),
}

/// Every ray through every plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Exact {
    /// `"exact"`.
    Exact,
}

impl Accuracy {
    /// Every ray through every plane.
    pub const EXACT: Self = Self::Exact(Exact::Exact);

    /// Checks that an error allowed is a positive number.
    ///
    /// # Errors
    /// Unless it is; the number is called `name`.
    pub fn validate(&self, name: &str) -> Result<()> {
        if let Self::WithinArcsec(arcsec) = self {
            let allowed = "\"exact\" or a positive number of arcsec";
            Domain::POSITIVE.check_in_words(name, *arcsec, allowed)?;
        }
        Ok(())
    }
}

impl Default for Accuracy {
    /// 1e-7″.
    fn default() -> Self {
        Self::WithinArcsec(1e-7)
    }
}

impl FromStr for Accuracy {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == "exact" => Ok(Self::EXACT),
            Ok(arcsec) if arcsec > 0.0 && arcsec.is_finite() => Ok(Self::WithinArcsec(arcsec)),
            _ => Err("must be `exact` or a positive number of arcsec".into()),
        }
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::WithinArcsec(arcsec) => write!(f, "{arcsec:e}″"),
            Self::Exact(_) => write!(f, "exact"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_numbers_are_understood() {
        assert_eq!("exact".parse(), Ok(Accuracy::EXACT));
        assert_eq!("1e-9".parse(), Ok(Accuracy::WithinArcsec(1e-9)));
        for wrong in ["0", "-1", "nan", "inf", "quick"] {
            assert!(wrong.parse::<Accuracy>().is_err(), "{wrong}");
        }
        assert!(Accuracy::WithinArcsec(-1.0).validate("accuracy").is_err());
        assert!(Accuracy::EXACT.validate("accuracy").is_ok());
    }

    #[test]
    fn both_forms_stand_in_a_configuration() {
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        struct Table {
            accuracy_arcsec: Accuracy,
        }
        for (text, accuracy) in [
            ("accuracy_arcsec = \"exact\"\n", Accuracy::EXACT),
            ("accuracy_arcsec = 1e-7\n", Accuracy::default()),
        ] {
            let table: Table = toml::from_str(text).unwrap();
            assert_eq!(table, Table { accuracy_arcsec: accuracy });
            assert_eq!(toml::from_str::<Table>(&toml::to_string(&table).unwrap()).unwrap(), table);
        }
    }
}
