//! From a preset and a user's file to a resolved [`Config`], or an error with line and column.

use std::io::ErrorKind;
use std::path::Path;

use serde::Deserialize;
use serde::de::IntoDeserializer;
use toml::Spanned;
use toml::de::{DeTable, Deserializer, ValueDeserializer};

use super::schema::Config;
use super::toml_tables::{holds, line_and_column, line_of, overlay, plain_words, start_of};
use crate::cosmology::{Background, BackgroundParameters};
use crate::error::{Error, Result};
use crate::halo::Epoch;

/// The embedded presets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// Section 4 of the paper as its authors ran it.
    #[default]
    Paper,
    /// One cosmology, evolving relations, comoving radius, haloes that end, a straight axis ray, integrated pixels.
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

/// Resolves `preset`, overlaid key by key with the user's file, which holds only the keys it changes. A file that is a whole
/// configuration, as every run leaves one, stands alone.
///
/// # Errors
/// A file that cannot be read, is not TOML, or holds an unknown key, a wrong type or a value outside its domain:
/// with file, line and column.
pub fn load(preset: Preset, user: Option<&Path>) -> Result<Config> {
    load_with(preset, user, &[])
}

/// The same, with `KEY=VALUE` laid over the file: `haloes.min_point_shear=1e-5`, `haloes.draw=direct`. Files named in
/// an assignment lie relative to where the program runs.
///
/// # Errors
/// As [`load`]; for what is wrong with an assignment the error names it instead of a file.
pub fn load_with(preset: Preset, user: Option<&Path>, assignments: &[String]) -> Result<Config> {
    let path = user.unwrap_or(Path::new("preset"));
    // First: what stands behind `--set KEY VALUE` is taken for the file.
    let assigned = assignments.iter().map(|one| line_of(one)).collect::<Result<Vec<_>>>()?.join("\n");
    let bytes = user.map_or(Ok(Vec::new()), |path| {
        let found = std::fs::metadata(path).map_err(Error::read(path))?;
        // A pipe or a device may never end.
        if !found.is_file() && !found.is_dir() {
            let problem = "it is a pipe or a device, but must be an ordinary file";
            return Err(Error::read(path)(std::io::Error::new(ErrorKind::InvalidInput, problem)));
        }
        std::fs::read(path).map_err(Error::read(path))
    })?;
    let no_text =
        |_| Error::Toml { path: path.into(), at: None, problem: "is not a TOML file: not UTF-8 text".into() };
    let text = String::from_utf8(bytes).map_err(no_text)?;
    let mut config = resolve(preset, path, &text, &assigned)?;
    // Files named in a configuration lie where it lies.
    if let Some(folder) = user.and_then(Path::parent) {
        let files = [
            ("haloes.catalogue", &mut config.haloes.catalogue),
            ("instrument.psf_file", &mut config.instrument.psf_file),
        ];
        let lightcone = config.haloes.lightcone.iter_mut().flat_map(|cone| &mut cone.files);
        let is_assigned = |key: &str| assignments.iter().any(|one| one.trim_start().starts_with(key));
        for (key, file) in files {
            if let Some(file) = file.as_mut().filter(|_| !is_assigned(key)) {
                *file = folder.join(&*file);
            }
        }
        if !is_assigned("haloes.lightcone") {
            lightcone.for_each(|file| *file = folder.join(&*file));
        }
    }
    Ok(config)
}

/// As [`load_with`], of a text, which errors call `path`, and of lines of TOML with dotted keys laid over it.
///
/// # Errors
/// As [`load_with`], but for reading.
pub fn resolve(preset: Preset, path: &Path, text: &str, assigned: &str) -> Result<Config> {
    let unreadable = |error: toml::de::Error| Error::Toml {
        path: path.into(),
        at: error.span().and_then(|span| line_and_column(text, span.start)),
        problem: plain_words(&error, preset.toml()),
    };
    let user = DeTable::parse(text).map_err(unreadable)?;
    // What a resolved configuration leaves out is left out on purpose: it stands alone.
    let is_complete = Config::deserialize(Deserializer::from(user.clone())).is_ok();
    let below = if is_complete { "" } else { preset.toml() };
    let mut merged = DeTable::parse(below).map_err(unreadable)?;
    overlay(merged.get_mut(), user.get_ref());
    let set = parse_assigned(preset, assigned)?;
    overlay(merged.get_mut(), set.get_ref());
    let of_key = |key: String, cause: Error| {
        // What is missing is missing beside its neighbours.
        let section = key.split('.').next().unwrap_or(&key);
        let is_beside = !holds(user.get_ref(), section) && holds(set.get_ref(), section);
        let is_set = holds(set.get_ref(), &key) || is_beside;
        let start = start_of(user.get_ref(), &key).filter(|_| !is_set);
        Error::Config {
            path: if is_set { "--set".into() } else { path.into() },
            at: start.and_then(|start| line_and_column(text, start)),
            key: Some(key),
            cause: Box::new(cause),
        }
    };
    // serde would turn the fault of a key of this section into text.
    if let Some(cosmology) = merged.get_ref().get("cosmology").cloned()
        && let Ok(parameters) = BackgroundParameters::deserialize(ValueDeserializer::from(cosmology))
        && let Err(fault) = Background::try_from(parameters)
    {
        return Err(match &fault {
            Error::OutOfRange { what, .. } => of_key(format!("cosmology.{what}"), fault),
            _ => fault,
        });
    }
    let mut config =
        Config::deserialize(Deserializer::from(merged).into_deserializer()).map_err(unreadable)?;
    // A preset that freezes relations does so at the lens, wherever the user puts it.
    let has_own = [&user, &set].iter().any(|table| holds(table.get_ref(), "haloes.epoch"));
    if let (Epoch::FrozenZ(z), false) = (&mut config.haloes.epoch, has_own) {
        *z = config.line_of_sight.z_lens;
    }
    config.validate().map_err(|fault| match &fault {
        Error::OutOfRange { what, .. } => of_key(what.clone(), fault),
        Error::MassDefinition { .. } => {
            let keys = ["haloes.mass_definition", "haloes.mass_function"];
            let haloes = user.get_ref().get("haloes").and_then(|section| section.get_ref().as_table());
            let key = keys[usize::from(!haloes.is_some_and(|h| h.contains_key("mass_definition")))];
            of_key(key.into(), fault)
        }
        _ => fault,
    })?;
    Ok(config)
}

/// The assignments, which must be right beside the preset alone, so that their faults are told of as theirs.
fn parse_assigned(preset: Preset, assigned: &str) -> Result<Spanned<DeTable<'_>>> {
    let unreadable = |error: toml::de::Error| {
        let before = error.span().and_then(|span| assigned.get(..span.start));
        let line =
            assigned.lines().nth(before.map_or(0, |text| text.matches('\n').count())).unwrap_or(assigned);
        Error::Toml {
            path: format!("--set {line}").into(),
            at: None,
            problem: plain_words(&error, preset.toml()),
        }
    };
    let set = DeTable::parse(assigned).map_err(unreadable)?;
    let mut alone = DeTable::parse(preset.toml()).map_err(unreadable)?;
    overlay(alone.get_mut(), set.get_ref());
    // Whether a cosmology is within its domain is found beside the file.
    let is_of_domain = |error: &toml::de::Error| {
        holds(set.get_ref(), "cosmology")
            && !["unknown", "invalid"].iter().any(|start| error.message().starts_with(start))
    };
    match Config::deserialize(Deserializer::from(alone).into_deserializer()) {
        Err(error) if !is_of_domain(&error) => Err(unreadable(error)),
        _ => Ok(set),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::LineColumn;

    fn resolve(preset: Preset, path: &Path, text: &str) -> Result<Config> {
        super::resolve(preset, path, text, "")
    }

    fn message(text: &str) -> String {
        let resolved = resolve(Preset::Paper, Path::new("my.toml"), text);
        resolved.map_or_else(|error| error.to_string().replace("my.toml: ", ""), |_| "accepted".into())
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
    fn a_resolved_file_stands_alone_over_any_preset() {
        let assigned = "cosmology.h0_km_s_mpc = 73.0";
        let config = super::resolve(Preset::Consistent, Path::new(""), "", assigned).unwrap();
        let text = toml::to_string(&config).unwrap();
        assert_eq!(resolve(Preset::Paper, Path::new(""), &text).unwrap(), config);
        let seed = super::resolve(Preset::Paper, Path::new(""), &text, "seed = 9").unwrap();
        assert_eq!((seed.seed, seed.haloes), (9, config.haloes));
    }

    #[test]
    fn a_user_file_changes_only_its_keys() {
        let config = resolve(Preset::Paper, Path::new(""), "seed = 7\n[lens]\nslope = 2.1\n").unwrap();
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
        for (file, expected) in [
            (
                "[lens]\nslope = \"steep\"\n",
                "line 2, column 9: invalid type: string \"steep\", expected a number",
            ),
            (
                "\nseed = -1\n",
                "line 2, column 8: invalid value: integer `-1`, expected a whole number, zero or more",
            ),
            ("lens = 3", "line 1, column 8: invalid type: integer `3`, expected a section with keys"),
        ] {
            assert_eq!(message(file), expected);
        }
    }

    #[test]
    fn faults_found_in_a_whole_section_point_into_the_users_text() {
        assert_eq!(
            message("seed = 2\n[cosmology]\n\nomega_m = 2\n"),
            "line 4, column 11: omega_m is 2, but must be above 0 and at most 1"
        );
        assert_eq!(
            message("[lens_light]\nmagnitude = 20"),
            "line 1, column 1: missing field `radius_arcsec`"
        );
    }

    #[test]
    fn the_key_of_a_fault_is_data() {
        for (text, wanted) in [
            ("[cosmology]\nomega_m = 2", "cosmology.omega_m"),
            ("[lens]\nslope = 9", "lens.slope"),
            ("[haloes]\nmass_function = \"sheth99\"", "haloes.mass_function"),
        ] {
            match resolve(Preset::Paper, Path::new(""), text) {
                Err(Error::Config { at: Some(LineColumn { line: 2, .. }), key: Some(key), .. }) => {
                    assert_eq!(key, wanted);
                }
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn an_epoch_replaces_that_of_the_preset() {
        let text = message("[haloes]\nepoch = { frozen = 1.0 }\n");
        assert!(text.starts_with("line 2") && text.contains("unknown variant `frozen`"), "{text}");
        let config = resolve(Preset::Paper, Path::new(""), "haloes.epoch.frozen_z = 0.3").unwrap();
        assert_eq!(config.haloes.epoch, Epoch::FrozenZ(0.3));
    }

    #[test]
    fn relations_are_frozen_at_the_lens_unless_set() {
        let epoch = |text: &str| resolve(Preset::Paper, Path::new(""), text).unwrap().haloes.epoch;
        assert_eq!(epoch("[line_of_sight]\nz_lens = 0.7"), Epoch::FrozenZ(0.7));
        let set = "haloes.epoch.frozen_z = 0.5\nline_of_sight.z_lens = 0.7";
        assert_eq!(epoch(set), Epoch::FrozenZ(0.5));
        assert_eq!(epoch("[haloes]\nmin_point_shear = 1e-5"), Epoch::FrozenZ(0.5));
    }

    #[test]
    fn presets_name_every_key() {
        let schema = serde_json::to_value(schemars::schema_for!(Config)).unwrap();
        let definition = |value: &serde_json::Value| -> serde_json::Value {
            let reference = |v: &serde_json::Value| v["$ref"].as_str().map(str::to_string);
            let own = reference(value).or_else(|| value["anyOf"].as_array()?.iter().find_map(reference));
            own.map_or(value.clone(), |path| schema.pointer(path.trim_start_matches('#')).unwrap().clone())
        };
        for preset in [Preset::Paper, Preset::Consistent] {
            for (section, described) in schema["properties"].as_object().unwrap() {
                let keys = definition(described)["properties"].as_object().cloned().unwrap_or_default();
                for key in keys.keys().chain([section]) {
                    let named = preset.toml().lines().any(|line| {
                        let line = line.trim_start_matches(['#', ' ']);
                        line.starts_with(&format!("{key} =")) || line.starts_with(&format!("[{key}]"))
                    });
                    assert!(named, "{preset:?} lacks {section}.{key}");
                }
            }
        }
    }

    #[test]
    fn a_truncation_replaces_that_of_the_preset_and_two_are_one_too_many() {
        let resolved = |text: &str| resolve(Preset::Consistent, Path::new("my.toml"), text);
        let truncation = |text: &str| resolved(text).unwrap().haloes.truncation().unwrap();
        use crate::halo::Truncation;
        assert_eq!(truncation(""), Some(Truncation::MassOverM200c(1.0)));
        assert_eq!(truncation("[haloes]\nprofile = \"nfw\""), None);
        assert_eq!(truncation("[haloes]\ntruncation_over_r_200c = 2"), Some(Truncation::OverR200c(2.0)));
        for (text, wanted) in [
            ("truncation_over_r_s = 3\ntruncation_over_r_200c = 2", "beside another truncation"),
            ("profile = \"nfw\"\ntruncation_over_r_s = 3", "left out unless haloes.profile"),
            ("total_mass_over_m200c = -1", "haloes.total_mass_over_m200c is -1"),
        ] {
            let error = resolved(&format!("[haloes]\n{text}")).unwrap_err().to_string();
            assert!(error.contains("line") && error.contains(wanted), "{error}");
        }
    }

    #[test]
    fn values_outside_their_domain_name_line_key_and_domain() {
        for (file, line, key, allowed) in [
            ("[line_of_sight]\nz_lens = 1.6\n", "line 2", "z_lens", "below z_source = 1.5"),
            ("\n\n[haloes]\nmass_min_msun = -1e8\n", "line 4", "mass_min_msun", "from 1e4"),
            ("[lens]\nslope = nan", "line 2", "lens.slope", "below 3"),
            ("[image]\npixels = 0", "line 2", "image.pixels", "from 1 to 4096"),
            ("[source]\ne1 = 0.1", "line 1", "source.e2", "together with e1"),
            ("[source]\nmagnitude = -5000", "line 2", "source.magnitude", "from -100 to 100"),
            ("[structure]\nsigma8 = -1", "line 2", "structure.sigma8", "positive"),
            ("[structure]\nomega_m = 2", "line 2", "structure.omega_m", "at most 1"),
            (
                "[haloes]\nh_units_h0_km_s_mpc = nan",
                "line 2",
                "h_units_h0_km_s_mpc",
                "finite number, positive",
            ),
            ("[instrument]\npsf_fwhm_arcsec = 1e9", "line 2", "psf_fwhm_arcsec", "at most 4096 pixels"),
            ("seed = 9223372036854775808", "line 1", "seed", "9223372036854775807"),
        ] {
            let text = message(file);
            assert!(text.contains(line) && text.contains(key) && text.contains(allowed), "{file}: {text}");
        }
    }

    #[test]
    fn a_mass_definition_not_covered_is_refused() {
        let text = message("[haloes]\nmass_definition = \"fof\"\n");
        assert!(text.starts_with("line 2, column 19: haloes.mass_definition: tinker08 is not"), "{text}");
        let text = message("[haloes]\n\nmass_function = \"sheth99\"\n");
        assert!(text.starts_with("line 3, column 17: haloes.mass_function: sheth99 is not"), "{text}");
        assert!(text.ends_with("allowed: fof"), "{text}");
    }

    #[test]
    fn assignments_lie_over_the_file_and_their_faults_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my.toml");
        std::fs::write(&path, "[haloes]\nmin_point_shear = 1e-5\n[line_of_sight]\nz_lens = 0.3\n").unwrap();
        let load = |set: &[&str]| {
            let set: Vec<String> = set.iter().map(|one| one.to_string()).collect();
            load_with(Preset::Paper, Some(&path), &set)
        };
        let config = load(&["haloes.min_point_shear=1e-4", "haloes.draw = brute-force", "seed=7"]).unwrap();
        assert_eq!((config.haloes.min_point_shear, config.seed), (1e-4, 7));
        assert_eq!(config.line_of_sight.z_lens, 0.3);
        let fault = |set: &[&str]| load(set).map_or_else(|error| error.to_string(), |_| "accepted".into());
        assert!(fault(&["haloes.draw"]).contains("KEY=VALUE"), "{}", fault(&["haloes.draw"]));
        let unknown = fault(&["seed=1", "haloes.min_shear=1"]);
        assert!(
            unknown.contains("--set haloes.min_shear = 1") && unknown.contains("min_point_shear"),
            "{unknown}"
        );
        let wrong = fault(&["haloes.radius_cmpc=wide"]);
        assert!(wrong.contains("--set haloes.radius_cmpc") && wrong.contains("expected a number"), "{wrong}");
        let outside = fault(&["line_of_sight.z_source=-1"]);
        assert!(outside.contains("--set") && outside.contains("z_source"), "{outside}");
        let outside = fault(&["cosmology.omega_m=-1"]);
        assert!(outside.contains("--set") && outside.contains("omega_m"), "{outside}");
    }
}
