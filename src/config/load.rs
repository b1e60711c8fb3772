//! From a preset and a user's file to a resolved [`Config`], or an error with line and column.

use std::path::Path;

use serde::Deserialize;
use serde::de::IntoDeserializer;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::schema::Config;
use crate::error::{Error, Result};

/// The embedded presets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Section 4 of the paper as its authors ran it.
    #[default]
    Paper,
    /// One cosmology, evolving relations, comoving radius, integrated pixels.
    Consistent,
}

impl Preset {
    /// The preset's file as it stands in `data/presets/`.
    pub fn toml(self) -> &'static str {
        match self {
            Self::Paper => include_str!("../../data/presets/paper.toml"),
            Self::Consistent => include_str!("../../data/presets/consistent.toml"),
        }
    }

    /// The preset as a configuration.
    ///
    /// # Errors
    /// Never for the embedded files; a test resolves both.
    pub fn config(self) -> Result<Config> {
        load(self, None)
    }
}

/// Resolves `preset`, overlaid key by key with the user's file, which holds only the keys it changes.
///
/// # Errors
/// A file that cannot be read, is not TOML, or holds an unknown key, a wrong type or a value outside its domain:
/// with file, line and column.
pub fn load(preset: Preset, user: Option<&Path>) -> Result<Config> {
    let path = user.unwrap_or(Path::new("preset"));
    let text = match user {
        None => String::new(),
        Some(path) => {
            std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })?
        }
    };
    let mut config = resolve(preset, &text).map_err(|problem| match problem {
        Problem::Toml(mut error) => {
            error.set_input(Some(&text));
            Error::Config { path: path.into(), problem: error.to_string().trim_end().into() }
        }
        Problem::Value { at, error } => Error::Config { path: path.into(), problem: format!("{at}{error}") },
    })?;
    // Files named in a configuration lie where it lies.
    if let Some(folder) = user.and_then(Path::parent) {
        for file in [&mut config.haloes.catalogue, &mut config.instrument.psf_file].into_iter().flatten() {
            *file = folder.join(&*file);
        }
    }
    Ok(config)
}

/// What is wrong with a configuration: its text, or a value (with its place).
enum Problem {
    Toml(toml::de::Error),
    Value { at: String, error: Error },
}

fn resolve(preset: Preset, text: &str) -> std::result::Result<Config, Problem> {
    let mut merged = DeTable::parse(preset.toml()).map_err(Problem::Toml)?;
    let user = DeTable::parse(text).map_err(Problem::Toml)?;
    overlay(merged.get_mut(), user.get_ref());
    let config =
        Config::deserialize(Deserializer::from(merged).into_deserializer()).map_err(Problem::Toml)?;
    config.validate().map_err(|error| {
        let at = match &error {
            Error::OutOfRange { what, .. } => place(text, user.get_ref(), what),
            _ => String::new(),
        };
        Problem::Value { at, error }
    })?;
    Ok(config)
}

fn overlay<'i>(base: &mut DeTable<'i>, top: &DeTable<'i>) {
    for (key, value) in top {
        let below = base.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut);
        if let (Some(DeValue::Table(below)), DeValue::Table(above)) = (below, value.get_ref()) {
            overlay(below, above);
        } else {
            base.remove(key.get_ref().as_ref());
            base.insert(key.clone(), value.clone());
        }
    }
}

/// "line 3, column 8: " of a dotted key in the user's text, or nothing when it is not there.
fn place(text: &str, table: &DeTable, dotted: &str) -> String {
    let mut table = table;
    let mut found = None;
    for key in dotted.split('.') {
        let Some(value) = table.get(key) else { break };
        found = Some(value.span().start);
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    let Some(before) = found.and_then(|start| text.get(..start)) else { return String::new() };
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
    format!("line {line}, column {column}: ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        match resolve(Preset::Paper, text) {
            Ok(_) => "accepted".into(),
            Err(Problem::Toml(mut e)) => {
                e.set_input(Some(text));
                e.to_string()
            }
            Err(Problem::Value { at, error }) => format!("{at}{error}"),
        }
    }

    #[test]
    fn both_presets_resolve_and_survive_a_round_trip() {
        for preset in [Preset::Paper, Preset::Consistent] {
            let config = preset.config().unwrap();
            let text = toml::to_string(&config).unwrap();
            assert_eq!(toml::from_str::<Config>(&text).unwrap(), config);
        }
    }

    #[test]
    fn a_user_file_changes_only_its_keys() {
        let config = resolve(Preset::Paper, "seed = 7\n[lens]\nslope = 2.1\n").ok().unwrap();
        let paper = Preset::Paper.config().unwrap();
        assert_eq!((config.seed, config.lens.slope), (7, 2.1));
        assert_eq!(config.lens.einstein_radius_arcsec, paper.lens.einstein_radius_arcsec);
        assert_eq!(config.haloes, paper.haloes);
    }

    #[test]
    fn unknown_keys_name_line_and_alternatives() {
        let text = message("seed = 1\n[haloes]\nradius_mpc = 10.0\n");
        assert!(
            text.contains("line 3") && text.contains("radius_mpc") && text.contains("radius_cmpc"),
            "{text}"
        );
    }

    #[test]
    fn wrong_types_name_the_line() {
        let text = message("[lens]\nslope = \"steep\"\n");
        assert!(text.contains("line 2") && text.contains("expected f64"), "{text}");
    }

    #[test]
    fn values_outside_their_domain_name_line_key_and_domain() {
        for (file, line, key, allowed) in [
            ("[line_of_sight]\nz_lens = 1.6\n", "line 2", "z_lens", "below z_source = 1.5"),
            ("\n\n[haloes]\nmass_min_msun = -1e8\n", "line 4", "mass_min_msun", "from 1e2"),
            ("[lens]\nslope = nan", "line 2", "lens.slope", "below 3"),
            ("[image]\npixels = 0", "line 2", "image.pixels", "from 1 to 4096"),
            ("[source]\ne1 = 0.1", "line 1", "source.e2", "together with e1"),
        ] {
            let text = message(file);
            assert!(text.contains(line) && text.contains(key) && text.contains(allowed), "{file}: {text}");
        }
    }

    #[test]
    fn a_mass_definition_not_covered_is_refused() {
        let text = message("[haloes]\nmass_definition = \"fof\"\n");
        assert!(text.contains("Tinker08") || text.contains("tinker08"), "{text}");
        assert!(message("[haloes]\nmass_function = \"sheth99\"\n").contains("fof"));
    }
}
