//! What an ensemble is to hold: whose sightlines, how many, and how much is computed of each.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::config::Config;
use crate::constants::ARCSEC_RAD;
use crate::error::{Domain, Error, Result};
use crate::halo::Epoch;
use crate::io::TabledLens;

/// How much is computed of a sightline; every level has the numbers of the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Tensors, flexions, Δ and counts.
    Scalars,
    /// Also the maps of κ, γ, ω, |F|, |G| and Δ.
    Maps,
    /// Also both images, γ_LOS by every definition, and the numbers of the haloes in the tidal regime alone.
    Images,
    /// As images, and γ_LOS as a fit of the image through all haloes finds it.
    Fits,
}

impl Level {
    /// All of them with their names.
    pub const NAMES: [(Self, &'static str); 4] =
        [(Self::Scalars, "scalars"), (Self::Maps, "maps"), (Self::Images, "images"), (Self::Fits, "fits")];

    /// Whether both images are made.
    pub fn has_images(self) -> bool {
        self >= Self::Images
    }
}

impl fmt::Display for Level {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::NAMES.iter().find(|(level, _)| level == self).map_or("", |(_, name)| name);
        formatter.write_str(name)
    }
}

impl FromStr for Level {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let found = Self::NAMES.iter().find(|(_, name)| *name == text);
        let names = || Self::NAMES.map(|(_, name)| name).join(", ");
        found.map(|(level, _)| *level).ok_or_else(|| Error::out_of_range("level", text, &names()))
    }
}

/// An ensemble of `number` sightlines, numbered from `first`: realisations of the configured seed.
///
/// Of L lenses, sightline k is one of lens k mod L, so that no two share random numbers and more sightlines leave the
/// first ones what they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The configuration.
    pub config: Config,
    /// Lenses whose redshifts and Einstein radii replace the configuration's; none for its own alone.
    pub lenses: Vec<TabledLens>,
    /// How much is computed.
    pub level: Level,
    /// The built-in model of the fits.
    pub model: String,
    /// Radii of discs over which γ_LOS is averaged too, arcsec.
    pub smoothing_arcsec: Vec<f64>,
    /// The first number.
    pub first: u64,
    /// How many.
    pub number: u64,
}

impl Plan {
    /// Every number.
    pub fn numbers(&self) -> Range<u64> {
        self.first..self.first + self.number
    }

    /// The lens of a sightline, from 0.
    pub fn lens_of(&self, sightline: u64) -> usize {
        (sightline % self.lenses.len().max(1) as u64) as usize
    }

    /// The configuration of a lens: `haloray simulate` with it and `--sightline k` is sightline k.
    ///
    /// What follows the lens in the configuration (a frozen epoch, the scale of Δ) follows the one of the table.
    ///
    /// # Errors
    /// Redshifts at which the configuration is outside its domain.
    pub fn config_of(&self, lens: usize) -> Result<Config> {
        let mut config = self.config.clone();
        let Some(lens) = self.lenses.get(lens) else { return Ok(config) };
        if let Epoch::FrozenZ(z) = &mut config.haloes.epoch
            && *z == self.config.line_of_sight.z_lens
        {
            *z = lens.z_lens;
        }
        (config.line_of_sight.z_lens, config.line_of_sight.z_source) = (lens.z_lens, lens.z_source);
        if let Some(radius) = lens.einstein_radius_arcsec {
            if config.diagnostics.theta_e_arcsec == config.lens.einstein_radius_arcsec && radius > 0.0 {
                config.diagnostics.theta_e_arcsec = radius;
            }
            config.lens.einstein_radius_arcsec = radius;
        }
        config.validate().map_err(|error| match error {
            Error::OutOfRange { what, value, allowed } => {
                Error::OutOfRange { what: format!("{what} of lens {}", lens.name), value, allowed }
            }
            other => other,
        })?;
        Ok(config)
    }

    /// Refuses lenses and discs that the configuration does not reach to.
    ///
    /// # Errors
    /// Those of [`Self::config_of`]; a radius that is not positive, or larger than the cylinder of the haloes is at the source
    /// of a lens.
    pub fn check(&self) -> Result<()> {
        (0..self.lenses.len()).try_for_each(|lens| self.config_of(lens).map(drop))?;
        let sources = self.lenses.iter().map(|lens| lens.z_source);
        let z_source = sources.fold(self.config.line_of_sight.z_source, f64::max);
        let chi = self.config.cosmology.comoving_distance_mpc(z_source);
        let most = self.config.haloes.radius_cmpc / chi / ARCSEC_RAD;
        let domain = Domain::above_to(0.0, most);
        let allowed = format!("{domain}: the cylinder of the haloes ends there at z = {z_source}");
        self.smoothing_arcsec.iter().try_for_each(|&radius| {
            domain.check_in_words("radius of smoothing in arcsec", radius, &allowed).map(drop)
        })
    }

    /// Everything that a sightline depends on beside its number.
    ///
    /// # Errors
    /// A configuration that TOML cannot hold.
    pub fn identity(&self, config_toml: &str) -> String {
        let model = if self.level == Level::Fits { self.model.as_str() } else { "" };
        let mut text = format!("ensemble\nlevel = {}\nmodel = {model}\n", self.level);
        for TabledLens { name, z_lens, z_source, einstein_radius_arcsec } in &self.lenses {
            text += &format!("lens {name:?} {z_lens} {z_source} {einstein_radius_arcsec:?}\n");
        }
        if !self.smoothing_arcsec.is_empty() {
            text += &format!("smoothing {:?}\n", self.smoothing_arcsec);
        }
        text + config_toml
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;

    fn plan(preset: Preset) -> Plan {
        let lens = |name: &str, z_lens, z_source, einstein_radius_arcsec| TabledLens {
            name: name.into(),
            z_lens,
            z_source,
            einstein_radius_arcsec,
        };
        Plan {
            config: preset.config().unwrap(),
            lenses: vec![lens("a", 0.3, 0.9, Some(0.8)), lens("b", 0.6, 2.0, None)],
            level: Level::Scalars,
            model: "tidal-minimal".into(),
            smoothing_arcsec: Vec::new(),
            first: 3,
            number: 5,
        }
    }

    #[test]
    fn lenses_take_turns_and_bring_what_follows_them() {
        let (paper, consistent) = (plan(Preset::Paper), plan(Preset::Consistent));
        let turns: Vec<usize> = paper.numbers().map(|k| paper.lens_of(k)).collect();
        assert_eq!(turns, [1, 0, 1, 0, 1]);
        let [a, b] = [0, 1].map(|lens| paper.config_of(lens).unwrap());
        assert_eq!((a.line_of_sight.z_lens, b.line_of_sight.z_source), (0.3, 2.0));
        assert_eq!((a.haloes.epoch, b.haloes.epoch), (Epoch::FrozenZ(0.3), Epoch::FrozenZ(0.6)));
        assert_eq!((a.lens.einstein_radius_arcsec, b.lens.einstein_radius_arcsec), (0.8, 1.5));
        assert_eq!(a.diagnostics.theta_e_arcsec, 1.0);
        assert_eq!(consistent.config_of(0).unwrap().diagnostics.theta_e_arcsec, 0.8);
        let alone = Plan { lenses: Vec::new(), ..paper };
        assert_eq!((alone.lens_of(7), alone.config_of(0).unwrap()), (0, alone.config.clone()));
    }

    #[test]
    fn discs_stay_within_the_cylinder() {
        let with = |smoothing_arcsec| Plan { smoothing_arcsec, ..plan(Preset::Paper) }.check();
        with(vec![10.0, 60.0]).unwrap();
        assert!(with(vec![0.0]).unwrap_err().is_bad_input());
        assert!(
            with(vec![2000.0]).unwrap_err().to_string().contains("the cylinder of the haloes ends there")
        );
    }

    #[test]
    fn levels_have_names_and_nothing_else_is_one() {
        for (level, name) in Level::NAMES {
            assert_eq!((name.parse::<Level>().unwrap(), level.to_string()), (level, name.to_string()));
        }
        assert!("scalar".parse::<Level>().unwrap_err().is_bad_input());
        assert!(Level::Fits.has_images() && !Level::Maps.has_images());
    }
}
