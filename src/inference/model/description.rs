//! A model to fit, as written in TOML: lenses, lights, line of sight, and a rule for every parameter.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::likelihood_kind::LikelihoodKind;
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::inference::parameter::Prior;
use crate::mapping::tidal::LineOfSightKind;

/// What a parameter is: a number, another parameter's name, or a prior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ParameterRule {
    /// Fixed to a value.
    Fixed(f64),
    /// Always equal to the parameter of that name, such as `lens.e1`.
    Tied(String),
    /// Free, with a prior.
    Free(Prior),
}

/// A model of the line of sight and the rules of its numbers; numbers that are left out are 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineOfSightDescription {
    /// `none`, `full`, `minimal`, `flexion` or `flexion-minimal`.
    #[schemars(with = "String")]
    pub model: LineOfSightKind,
    /// kappa_, gamma1_, gamma2_, omega_, F1_ … with od, os, ds, los.
    #[serde(default)]
    pub parameters: BTreeMap<String, ParameterRule>,
}

impl Default for LineOfSightDescription {
    fn default() -> Self {
        Self { model: LineOfSightKind::None, parameters: BTreeMap::new() }
    }
}

/// A mass profile under lenstronomy's name and the rules of its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileDescription {
    /// `EPL`, `NFW_ELLIPSE_POTENTIAL`, ….
    pub profile: String,
    /// Its parameters; e1, e2 and the centre may be left out and are then 0.
    pub parameters: BTreeMap<String, ParameterRule>,
}

/// An elliptical Sérsic light profile, its amplitude solved for, and the rules of its other parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightDescription {
    /// `SERSIC_ELLIPSE` or `SERSIC`.
    pub profile: String,
    /// Normal prior (mean, standard deviation) of the brightness at R_sersic, e⁻/s per arcsec²; very wide when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<[f64; 2]>,
    /// R_sersic, n_sersic, e1, e2, center_x, center_y.
    pub parameters: BTreeMap<String, ParameterRule>,
}

/// A model to fit an image with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelDescription {
    /// A short name.
    pub name: String,
    /// What it is for, in a sentence.
    #[serde(default)]
    pub about: String,
    /// How pixels are integrated; that of the image's own simulation, or adaptive, when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_sampling: Option<PixelSampling>,
    /// `gaussian` (right: one variance from the model, with its determinant) or `lenstronomy`.
    #[serde(default)]
    pub likelihood: LikelihoodKind,
    /// The line of sight.
    #[serde(default)]
    pub line_of_sight: LineOfSightDescription,
    /// Mass of the lens; the profiles add up.
    #[serde(default)]
    pub lens: Vec<ProfileDescription>,
    /// Light of the source.
    #[serde(default)]
    pub source: Vec<LightDescription>,
    /// Light of the lens.
    #[serde(default)]
    pub lens_light: Vec<LightDescription>,
}

/// The models that are built in, by name.
pub const BUILT_IN: [(&str, &str); 8] = [
    ("simple-full", include_str!("../../../data/models/simple-full.toml")),
    ("simple-minimal", include_str!("../../../data/models/simple-minimal.toml")),
    ("tidal-minimal", include_str!("../../../data/models/tidal-minimal.toml")),
    ("tidal-flexion", include_str!("../../../data/models/tidal-flexion.toml")),
    ("comprehensive", include_str!("../../../data/models/comprehensive.toml")),
    ("no-foreground-shear", include_str!("../../../data/models/no-foreground-shear.toml")),
    ("aligned", include_str!("../../../data/models/aligned.toml")),
    ("power-law", include_str!("../../../data/models/power-law.toml")),
];

impl ModelDescription {
    /// The built-in model of that name.
    ///
    /// # Errors
    /// A name that is not built in, with all that are.
    pub fn built_in(name: &str) -> Result<Self> {
        let found = BUILT_IN.iter().find(|(own, _)| *own == name);
        let names = BUILT_IN.map(|(name, _)| name).join(", ");
        let allowed = format!("one of {names}, or a file ending in .toml");
        let (_, text) = found.ok_or_else(|| Error::ModelName { name: name.into(), allowed })?;
        Self::parse(text).map_err(|e| Error::out_of_range("the model", name, &e.to_string()))
    }

    /// Reads a description; the message of the error has line and column.
    ///
    /// # Errors
    /// Text that is not such a description.
    pub fn parse(text: &str) -> std::result::Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// How pixels are integrated: as asked for or as the image says, else as the model says, else adaptively.
    pub fn sampling(&self, asked: Option<PixelSampling>) -> PixelSampling {
        asked.or(self.pixel_sampling).unwrap_or(PixelSampling::Adaptive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_model_is_read_and_says_what_it_is_for() {
        for (name, _) in BUILT_IN {
            let model = ModelDescription::built_in(name).unwrap();
            assert_eq!(model.name, name);
            assert!(!model.about.is_empty());
        }
        assert!(ModelDescription::built_in("simple").unwrap_err().to_string().contains("tidal-flexion"));
    }
}
