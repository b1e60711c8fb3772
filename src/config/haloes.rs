//! The halo population: its keys, their units and domains.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::lightcone::LightconeConfig;
use crate::cosmology::{Background, MASS_MAX_MSUN, StructureParameters};
use crate::error::{Domain, Error, Result, shortest};
use crate::halo::concentration::ConcentrationModel;
use crate::halo::mass_function::MassFunctionModel;
use crate::halo::{Epoch, MassDefinition, PopulationLimits, Truncation};

/// The masses of drawn and imported haloes are M200c.
pub const HALO_MASS_DEFINITION: MassDefinition = MassDefinition::Critical(200.0);

/// Smallest halo mass allowed: diemer19 asks for σ at (0.41)³ of the mass, and σ is tabulated from 100 Msun.
const HALO_MASS_MIN_MSUN: f64 = 1e4;

/// The halo population.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HaloConfig {
    /// A halo table of your own (CSV, HDF5, FITS) to use instead of a draw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub catalogue: Option<PathBuf>,
    /// A light cone of an N-body simulation to take every sightline's haloes from, instead of a draw.
    #[serde(
        default,
        deserialize_with = "LightconeConfig::path_or_table",
        skip_serializing_if = "Option::is_none"
    )]
    #[schemars(schema_with = "LightconeConfig::path_or_table_schema")]
    pub lightcone: Option<LightconeConfig>,
    /// Apply the point-lens shear cut to an imported catalogue or light cone given by mass (a draw always applies it).
    #[serde(default)]
    pub cut_imported: bool,
    /// How haloes are drawn.
    pub draw: Draw,
    /// Mass function.
    pub mass_function: MassFunctionModel,
    /// Mass definition of the mass function: "200c", or "fof" for sheth99 and press74 (masses then count as M200c).
    pub mass_definition: MassDefinition,
    /// Mass–concentration relation.
    pub concentration: ConcentrationModel,
    /// Log-normal scatter of the concentration, dex.
    pub concentration_scatter_dex: f64,
    /// Do mass function and concentration evolve? "evolving" or { frozen_z = 0.5 }.
    pub epoch: Epoch,
    /// Smallest M200c drawn, at least 1e4.
    pub mass_min_msun: f64,
    /// Largest M200c drawn.
    pub mass_max_msun: f64,
    /// H0 by which relations computed in h-units are converted; that of `structure` when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h_units_h0_km_s_mpc: Option<f64>,
    /// Comoving radius of the cylinder around the axis.
    pub radius_cmpc: f64,
    /// Keep haloes whose point-lens shear on the axis is at least this; 0 keeps all.
    pub min_point_shear: f64,
    /// Halo profile.
    pub profile: HaloProfile,
    /// Truncation radius over scale radius; a truncated profile needs one of the three truncations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncation_over_r_s: Option<f64>,
    /// Truncation radius over r_200c.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncation_over_r_200c: Option<f64>,
    /// Total mass over M200c, which sets the truncation radius: with 1 haloes carry what the mass function counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total_mass_over_m200c: Option<f64>,
    /// Leave out haloes whose own convergence on the axis exceeds this; all stay when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_kappa: Option<f64>,
}

/// How haloes are drawn; both give the same Poisson process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Draw {
    /// Only the haloes that pass the cut (milliseconds).
    Direct,
    /// All haloes of the cylinder, then the cut (about a second for ten million).
    BruteForce,
}

/// Density profile of the haloes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HaloProfile {
    /// Navarro–Frenk–White.
    Nfw,
    /// Truncated NFW of Baltz et al. 2009.
    TruncatedNfw,
}

impl HaloConfig {
    /// Geometry and limits for [`crate::halo::Population`].
    pub fn limits(&self) -> PopulationLimits {
        PopulationLimits {
            radius_cmpc: self.radius_cmpc,
            min_point_shear: self.min_point_shear,
            mass_min_msun: self.mass_min_msun,
            mass_max_msun: self.mass_max_msun,
        }
    }

    /// Whether haloes are the user's own and not drawn.
    pub fn is_imported(&self) -> bool {
        self.catalogue.is_some() || self.lightcone.is_some()
    }

    /// Where haloes end, if they do.
    ///
    /// # Errors
    /// A truncated profile without exactly one truncation, a plain one with any, and numbers outside their domain.
    pub fn truncation(&self) -> Result<Option<Truncation>> {
        let given: Vec<Truncation> = [
            self.truncation_over_r_s.map(Truncation::OverRs),
            self.truncation_over_r_200c.map(Truncation::OverR200c),
            self.total_mass_over_m200c.map(Truncation::MassOverM200c),
        ]
        .into_iter()
        .flatten()
        .collect();
        let refused = |truncation: &Truncation, allowed: &str| {
            let (name, value) = truncation.named();
            Err(Error::out_of_range(&format!("haloes.{name}"), shortest(value), allowed))
        };
        match (self.profile, given.as_slice()) {
            (HaloProfile::Nfw, []) => Ok(None),
            (HaloProfile::Nfw, [one, ..]) => {
                refused(one, "left out unless haloes.profile = \"truncated-nfw\"")
            }
            (HaloProfile::TruncatedNfw, []) => Err(Error::out_of_range(
                "haloes.truncation_over_r_s",
                "missing",
                "given when haloes.profile = \"truncated-nfw\", and positive (or truncation_over_r_200c, or total_mass_over_m200c)",
            )),
            (HaloProfile::TruncatedNfw, [one]) => match one.validate() {
                Err(Error::OutOfRange { what, value, allowed }) => {
                    Err(Error::OutOfRange { what: format!("haloes.{what}"), value, allowed })
                }
                checked => checked.map(|()| Some(*one)),
            },
            (HaloProfile::TruncatedNfw, [_, other, ..]) => {
                refused(other, "left out beside another truncation")
            }
        }
    }

    pub(super) fn validate(&self, structure: &StructureParameters, z_source: f64) -> Result<()> {
        let tabulated = format!("from {HALO_MASS_MIN_MSUN:e} to {MASS_MAX_MSUN:e}");
        let masses = Domain::from_to(HALO_MASS_MIN_MSUN, MASS_MAX_MSUN);
        masses.check_in_words("haloes.mass_min_msun", self.mass_min_msun, &tabulated)?;
        masses.check_in_words("haloes.mass_max_msun", self.mass_max_msun, &tabulated)?;
        let above_least = format!("above haloes.mass_min_msun = {:e}", self.mass_min_msun);
        let above = Domain::above(self.mass_min_msun);
        above.check_in_words("haloes.mass_max_msun", self.mass_max_msun, &above_least)?;
        Domain::POSITIVE.check("haloes.radius_cmpc", self.radius_cmpc)?;
        Domain::NON_NEGATIVE.check("haloes.min_point_shear", self.min_point_shear)?;
        let scatter = self.concentration_scatter_dex;
        Domain::from_to(0.0, 1.0).check("haloes.concentration_scatter_dex", scatter)?;
        let z_max = match self.epoch {
            Epoch::Evolving => z_source,
            Epoch::FrozenZ(z) => Domain::from_to(0.0, 20.0).check("haloes.epoch.frozen_z", z)?,
        };
        if let Some(h0) = self.h_units_h0_km_s_mpc {
            Domain::POSITIVE.check("haloes.h_units_h0_km_s_mpc", h0)?;
        }
        if let Some(kappa) = self.max_kappa {
            let allowed = "positive, or left out to keep all haloes";
            Domain::POSITIVE.check_in_words("haloes.max_kappa", kappa, allowed)?;
        }
        if let Some(lightcone) = &self.lightcone {
            lightcone.validate()?;
            if self.catalogue.is_some() {
                let allowed = "left out beside haloes.lightcone";
                return Err(Error::out_of_range("haloes.catalogue", "given", allowed));
            }
        }
        self.truncation()?;
        self.validate_relations(structure, z_max)
    }

    /// Builds the relations once, so that a mass definition they do not cover is found before any work.
    fn validate_relations(&self, structure: &StructureParameters, z_max: f64) -> Result<()> {
        let background = Background::new(structure.h0_km_s_mpc, structure.omega_m)?;
        self.mass_function.build(self.mass_definition, background, z_max)?;
        if !matches!(self.mass_definition, HALO_MASS_DEFINITION | MassDefinition::FriendsOfFriends) {
            return Err(Error::out_of_range(
                "haloes.mass_definition",
                self.mass_definition.to_string(),
                "200c (or fof for sheth99 and press74, whose masses are then taken as M200c): the haloes are NFW haloes of M200c",
            ));
        }
        self.concentration.build(HALO_MASS_DEFINITION)?;
        Ok(())
    }
}
