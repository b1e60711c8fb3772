//! What the study of validity is to do.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::error::{Error, Result};
use crate::imaging::Psf;
use crate::inference::model::{CompiledModel, ModelDescription};
use crate::mapping::tidal::LineOfSightKind;

/// How γ_LOS and its errors are taken from a posterior.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimate {
    /// The normal posterior about the highest maximum found.
    Laplace,
    /// Mean and covariance of converged draws.
    Sample,
}

/// Where a fit begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FitStart {
    /// From priors and image alone.
    Blind,
    /// From the true lens and source behind the nearest tidal model.
    Truth,
}

/// Which of the haloes of a sightline are traced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenHaloes {
    /// Those with Δ_h below this; all where there is none.
    pub below: Option<f64>,
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Laplace { "laplace" } else { "sample" })
    }
}

impl fmt::Display for FitStart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Blind { "blind" } else { "truth" })
    }
}

impl fmt::Display for SeenHaloes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.below {
            None => f.write_str("all"),
            Some(limit) => write!(f, "{limit}"),
        }
    }
}

impl SeenHaloes {
    /// All haloes.
    pub const ALL: Self = Self { below: None };

    /// In words for a table: `all`, `Δ_h < 0.1`.
    pub fn words(self) -> String {
        self.below.map_or_else(|| "all".into(), |limit| format!("Δ_h < {limit}"))
    }
}

impl FromStr for SeenHaloes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let below = if text == "all" { None } else { text.parse::<f64>().ok() };
        match below {
            None if text != "all" => Err(Error::out_of_range("haloes", text, "all or a limit of Δ_h")),
            Some(limit) if !(limit.is_finite() && limit > 0.0) => {
                Err(Error::out_of_range("limit of Δ_h", text, "positive and finite"))
            }
            below => Ok(Self { below }),
        }
    }
}

/// One configuration, the first among several or one that differs from it in one key.
#[derive(Debug, Clone)]
pub struct ValidityCase {
    /// `base`, or `KEY=VALUE`.
    pub name: String,
    /// The configuration.
    pub config: Config,
    /// Its point-spread function.
    pub psf: Psf,
}

/// Everything that the rows of the study depend on but their number.
#[derive(Debug, Clone)]
pub struct ValidityPlan {
    /// Configurations; each sees every sightline.
    pub cases: Vec<ValidityCase>,
    /// Which haloes are traced, view by view.
    pub views: Vec<SeenHaloes>,
    /// Built-in models; evidences are compared with the first one's.
    pub models: Vec<String>,
    /// Where fits begin.
    pub starts: Vec<FitStart>,
    /// How γ_LOS is taken from a posterior.
    pub estimate: Estimate,
    /// Whether delays are computed, for which every truncated halo costs an integral.
    pub has_delays: bool,
}

impl ValidityPlan {
    /// Refuses models without free γ_LOS, and lists that are empty or name something twice.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with what is allowed.
    pub fn validate(&self) -> Result<()> {
        let is_there = |what: &str, names: Vec<String>| match names.iter().enumerate() {
            _ if names.is_empty() => Err(Error::out_of_range(what, "none", "at least one")),
            mut all => match all.find(|(i, name)| names[..*i].contains(name)) {
                Some((_, twice)) => Err(Error::out_of_range(what, format!("{twice} twice"), "named once")),
                None => Ok(()),
            },
        };
        is_there("views", self.views.iter().map(ToString::to_string).collect())?;
        is_there("starts", self.starts.iter().map(ToString::to_string).collect())?;
        is_there("cases", self.cases.iter().map(|case| case.name.clone()).collect())?;
        is_there("models", self.models.clone())?;
        self.cases.iter().try_for_each(|case| case.config.check_draws())?;
        for name in &self.models {
            let description = ModelDescription::built_in(name)?;
            let has_shear = description.line_of_sight.model != LineOfSightKind::Haloes && {
                let free = CompiledModel::new(&description)?.free;
                ["gamma1_los", "gamma2_los"].iter().all(|wanted| free.iter().any(|own| own.name == *wanted))
            };
            if !has_shear {
                let allowed = "one whose gamma1_los and gamma2_los are free";
                return Err(Error::out_of_range("model", name, allowed));
            }
        }
        Ok(())
    }

    /// All of it as a text; configurations in TOML as given.
    pub fn identity(&self, configurations: &[String]) -> String {
        let list = |names: Vec<String>| names.join(", ");
        let mut text = format!(
            "study validity\nviews {}\nmodels {}\nstarts {}\nestimate {}\ndelays {}\n",
            list(self.views.iter().map(ToString::to_string).collect()),
            list(self.models.clone()),
            list(self.starts.iter().map(ToString::to_string).collect()),
            self.estimate,
            self.has_delays
        );
        for (case, toml) in self.cases.iter().zip(configurations) {
            text += &format!("case {}\n{toml}\n", case.name);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_have_names_and_nothing_else_is_one() {
        assert_eq!("all".parse::<SeenHaloes>().unwrap(), SeenHaloes::ALL);
        let tidal: SeenHaloes = "0.1".parse().unwrap();
        assert_eq!((tidal.below, tidal.to_string()), (Some(0.1), "0.1".into()));
        for wrong in ["", "none", "-0.1", "0", "inf", "nan"] {
            assert!(wrong.parse::<SeenHaloes>().unwrap_err().is_bad_input(), "{wrong}");
        }
    }

    #[test]
    fn models_without_a_free_shear_and_names_given_twice_are_refused() {
        let plan = |models: &[&str], views: &[SeenHaloes]| ValidityPlan {
            cases: vec![],
            views: views.to_vec(),
            models: models.iter().map(ToString::to_string).collect(),
            starts: vec![FitStart::Truth],
            estimate: Estimate::Laplace,
            has_delays: false,
        };
        let cases = |plan: ValidityPlan| {
            let config = crate::config::Preset::Consistent.config().unwrap();
            let psf = Psf::gaussian(0.1, 3.0, 0.1).unwrap();
            ValidityPlan { cases: vec![ValidityCase { name: "base".into(), config, psf }], ..plan }
        };
        let all = [SeenHaloes::ALL];
        assert!(cases(plan(&["tidal-minimal", "tidal-flexion"], &all)).validate().is_ok());
        assert!(plan(&["tidal-minimal"], &all).validate().is_err());
        for (models, views) in [
            (&["haloes"][..], &all[..]),
            (&["simple-full"], &all),
            (&["tidal-minimal"], &[SeenHaloes::ALL; 2]),
            (&["tidal-minimal", "tidal-minimal"], &all),
            (&[], &all),
        ] {
            assert!(cases(plan(models, views)).validate().unwrap_err().is_bad_input(), "{models:?}");
        }
    }
}
