//! A light cone of an N-body simulation as the source of haloes: files, columns, units, directions.

use std::fmt;
use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::error::{Domain, Error, Result, shortest};
use crate::halo::MassDefinition;
use crate::halo::lightcone::Footprint;

/// A light cone of haloes: their files, and what the files do not say themselves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
pub struct LightconeConfig {
    /// Its files (CSV, HDF5, FITS), all with the same columns; or one folder made by `haloray extract`.
    pub files: Vec<PathBuf>,
    /// Column of right ascensions, where it has none of the names that are known (ra_deg, ra).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ra: Option<String>,
    /// Column of declinations (dec_deg, dec).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dec: Option<String>,
    /// Column of redshifts (z, redshift).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub redshift: Option<String>,
    /// Column of masses (m200c_msun, M200c, Mvir, …).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<String>,
    /// Column of concentrations (c200c, cvir, …); c200c of rows without one follows haloes.concentration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub concentration: Option<String>,
    /// Unit of both angles where the file does not say: deg, rad, hourangle, arcmin, arcsec.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_unit: Option<String>,
    /// Unit of the masses where the file does not say: Msun, Msun/h, 1e10 Msun/h.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_unit: Option<String>,
    /// h = H0/100 of the simulation, for masses in units with h.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub h: Option<f64>,
    /// Definition of the masses where the column's name does not say: "200c", "200m", "vir", "500c".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_definition: Option<MassDefinition>,
    /// Definition of the concentrations where the column's name does not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub concentration_definition: Option<MassDefinition>,
    /// Where sightlines may point: RA from, RA to, Dec from, Dec to in degrees, through 0° where RA from is larger; the box
    /// around the haloes when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub footprint_deg: Option<[f64; 4]>,
    /// Centre sightlines on haloes of M200c from the first to the second, near z_lens; random directions when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub behind_mass_msun: Option<[f64; 2]>,
    /// How far from z_lens these haloes may be in redshift; 0.02 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub behind_delta_z: Option<f64>,
    /// Leave out rows with values that no halo has, and say how many, instead of stopping there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub skip_bad_rows: bool,
}

impl LightconeConfig {
    /// What stands for `behind_delta_z` where it is left out.
    pub const BEHIND_DELTA_Z: f64 = 0.02;

    /// The light cone in these files, whose columns and units speak for themselves.
    pub fn of(files: Vec<PathBuf>) -> Self {
        Self { files, ..Self::default() }
    }

    /// The footprint, if it is given.
    ///
    /// # Errors
    /// As [`Footprint::new`].
    pub fn footprint(&self) -> Result<Option<Footprint>> {
        self.footprint_deg.map(Footprint::new).transpose()
    }

    /// How far from z_lens haloes may be that sightlines are centred on.
    pub fn behind_delta_z(&self) -> f64 {
        self.behind_delta_z.unwrap_or(Self::BEHIND_DELTA_Z)
    }

    pub(super) fn validate(&self) -> Result<()> {
        let key = |name: &str| format!("haloes.lightcone.{name}");
        if self.files.is_empty() {
            return Err(Error::out_of_range(&key("files"), "empty", "at least one file"));
        }
        if let (Some(corners), Err(Error::OutOfRange { what, value, allowed })) =
            (self.footprint_deg, self.footprint())
        {
            let corners = corners.map(shortest).join(", ");
            let allowed = format!("a box whose {what} ({value}) is {allowed}");
            return Err(Error::out_of_range(&key("footprint_deg"), corners, &allowed));
        }
        if let Some([low, high]) = self.behind_mass_msun {
            Domain::POSITIVE.check(&key("behind_mass_msun"), low)?;
            let above = format!("two masses, the second above the first, {low:e}");
            Domain::above(low).check_in_words(&key("behind_mass_msun"), high, &above)?;
        }
        if let Some(delta) = self.behind_delta_z {
            Domain::POSITIVE.check(&key("behind_delta_z"), delta)?;
        }
        if let Some(h) = self.h {
            Domain::from_to(0.1, 2.0).check(&key("h"), h)?;
        }
        Ok(())
    }

    /// The path of one file, or a table with keys.
    pub(super) fn path_or_table<'de, D>(deserializer: D) -> std::result::Result<Option<Self>, D::Error>
    where
        D: Deserializer<'de>,
    {
        struct PathOrTable;
        impl<'de> Visitor<'de> for PathOrTable {
            type Value = LightconeConfig;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the path of a light cone, or a table with its files")
            }

            fn visit_str<E>(self, path: &str) -> std::result::Result<LightconeConfig, E> {
                Ok(LightconeConfig::of(vec![Path::new(path).into()]))
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> std::result::Result<LightconeConfig, M::Error> {
                LightconeConfig::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(PathOrTable).map(Some)
    }

    /// The schema of that.
    pub(super) fn path_or_table_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<Self>();
        json_schema!({ "anyOf": [{ "type": "string" }, table, { "type": "null" }] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> std::result::Result<LightconeConfig, String> {
        #[derive(Deserialize)]
        struct Holder {
            #[serde(deserialize_with = "LightconeConfig::path_or_table")]
            lightcone: Option<LightconeConfig>,
        }
        match toml::from_str::<Holder>(text) {
            Ok(holder) => Ok(holder.lightcone.unwrap()),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn a_path_and_a_table_are_read_and_survive_a_round_trip() {
        assert_eq!(read("lightcone = \"a.h5\"").unwrap(), LightconeConfig::of(vec!["a.h5".into()]));
        let table = "[lightcone]\nfiles = [\"a.h5\", \"b.h5\"]\nmass = \"Mvir\"\nmass_unit = \"Msun/h\"\nh = 0.7\n\
                     footprint_deg = [350.0, 10.0, -5.0, 5.0]\nbehind_mass_msun = [1e13, 1e14]\n";
        let read_once = read(table).unwrap();
        assert_eq!((read_once.h, read_once.behind_delta_z()), (Some(0.7), 0.02));
        read_once.validate().unwrap();
        let written = format!("[lightcone]\n{}", toml::to_string(&read_once).unwrap());
        assert_eq!(read(&written).unwrap(), read_once);
        let unknown = read("[lightcone]\nfiles = []\nmas = \"M\"").unwrap_err();
        assert!(unknown.contains("mas") && unknown.contains("mass_unit"), "{unknown}");
        assert!(read("lightcone = 3").unwrap_err().contains("the path of a light cone"));
    }

    #[test]
    fn what_makes_no_sense_is_refused_by_key() {
        let fault = |config: LightconeConfig| config.validate().unwrap_err().to_string();
        let own = || LightconeConfig::of(vec!["a.h5".into()]);
        let reversed = LightconeConfig { behind_mass_msun: Some([1e14, 1e13]), ..own() };
        assert!(fault(reversed).starts_with("haloes.lightcone.behind_mass_msun is 10000000000000"));
        let flat = LightconeConfig { footprint_deg: Some([0.0, 10.0, 5.0, 5.0]), ..own() };
        let text = fault(flat);
        assert!(text.starts_with("haloes.lightcone.footprint_deg is 0, 10, 5, 5, but must be"), "{text}");
        assert!(fault(LightconeConfig::default()).contains("at least one file"));
    }
}
