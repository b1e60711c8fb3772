//! A model to fit, as written in TOML: lenses, lights, line of sight, and a rule for every parameter.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::likelihood_kind::LikelihoodKind;
use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::inference::parameter::Prior;
use crate::mapping::multiplane::{Reference, Sheets};
use crate::mapping::tidal::LineOfSightKind;

/// What a parameter is: a number, another parameter's name, or a prior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number, the name of another parameter (\"lens.e1\"), or a prior: one of { uniform = [a, b] }, { normal = [mean, sd] }, { log_normal = [median, sd of ln] }, the last two with low and high if wanted"
)]
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
    /// `none`, `full`, `minimal`, `flexion`, `flexion-minimal` or `haloes`.
    #[schemars(with = "String")]
    pub model: LineOfSightKind,
    /// kappa_, gamma1_, gamma2_, omega_, F1_ … with od, os, ds, los; of `haloes` those of the minimal model, a tidal field
    /// beside the haloes.
    #[serde(default)]
    pub parameters: BTreeMap<String, ParameterRule>,
    /// The halo table of `haloes` (.csv, .h5, .fits; also the run.h5 of a simulation), beside the model's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The sheets of those haloes: in each plane −κ_h on the axis, or none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheets: Option<TableSheets>,
    /// What positions among those haloes are measured from; what the table's file says when left out, else `bent`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<Reference>,
    /// Redshift of the lens among those haloes; the image's ZLENS when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z_lens: Option<f64>,
    /// Redshift of the source behind those haloes; the image's ZSOURCE when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z_source: Option<f64>,
    /// The distances of those haloes; H0 = 67.4 km/s/Mpc, Ωm = 0.315 when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cosmology: Option<Background>,
}

/// Sheets that go with a halo table; those of the run that wrote it when left out, else `on-axis`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TableSheets {
    /// In each halo's plane −κ_h(0), see [`Sheets::OnAxis`].
    #[default]
    OnAxis,
    /// In each halo's plane −κ_h where the axis ray passes it, see [`Sheets::OnRay`].
    OnRay,
    /// No compensation.
    None,
}

impl TableSheets {
    /// The same for a line of sight.
    pub fn sheets(self) -> Sheets {
        match self {
            Self::OnAxis => Sheets::OnAxis,
            Self::OnRay => Sheets::OnRay,
            Self::None => Sheets::None,
        }
    }
}

impl Default for LineOfSightDescription {
    fn default() -> Self {
        Self {
            model: LineOfSightKind::None,
            parameters: BTreeMap::new(),
            file: None,
            sheets: None,
            reference: None,
            z_lens: None,
            z_source: None,
            cosmology: None,
        }
    }
}

impl LineOfSightDescription {
    /// Refuses what belongs to `haloes` in other models.
    ///
    /// # Errors
    /// A key of `haloes` in another model, by its name.
    pub fn validate(&self) -> Result<()> {
        let of_haloes = [
            ("file", self.file.is_some()),
            ("sheets", self.sheets.is_some()),
            ("reference", self.reference.is_some()),
            ("z_lens", self.z_lens.is_some()),
            ("z_source", self.z_source.is_some()),
            ("cosmology", self.cosmology.is_some()),
        ];
        match of_haloes.into_iter().find(|(_, given)| *given) {
            Some((key, _)) if self.model != LineOfSightKind::Haloes => Err(Error::out_of_range(
                &format!("line_of_sight.{key}"),
                "given",
                "left out unless line_of_sight.model is \"haloes\"",
            )),
            _ => Ok(()),
        }
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
pub const BUILT_IN: [(&str, &str); 9] = [
    ("simple-full", include_str!("../../../data/models/simple-full.toml")),
    ("simple-minimal", include_str!("../../../data/models/simple-minimal.toml")),
    ("tidal-minimal", include_str!("../../../data/models/tidal-minimal.toml")),
    ("tidal-flexion", include_str!("../../../data/models/tidal-flexion.toml")),
    ("haloes", include_str!("../../../data/models/haloes.toml")),
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
        let allowed = format!("one of {names}");
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

    #[test]
    fn a_prior_has_one_shape_and_no_unknown_name() {
        let with = |prior: &str| {
            let text = format!(
                "name = \"m\"\n[line_of_sight]\nmodel = \"none\"\n[[lens]]\nprofile = \"SIS\"\n[lens.parameters]\ntheta_E = {prior}\n"
            );
            ModelDescription::parse(&text).map(drop)
        };
        assert!(with("{ normal = [1.0, 0.1], low = 0.5 }").is_ok());
        for prior in [
            "{ uniform = [0.3, 3.0], normal = [1.0, 0.1] }",
            "{ normal = [1.0, 0.1], hihg = 2.0 }",
            "{ low = 0.5 }",
            "{ uniform = [0.3] }",
        ] {
            let error = with(prior).unwrap_err().to_string();
            assert!(error.contains("uniform"), "{prior}: {error}");
        }
    }
}
