//! Keys of the configuration in words: what they mean, what they may be, what the presets say.

use serde_json::Value;

use super::{Preset, json_schema};
use crate::error::{Error, Result};

/// A key as a person wants to know it.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyHelp {
    /// The dotted key, `haloes.min_point_shear`.
    pub key: String,
    /// What it means, with its domain; its unit is the end of its name.
    pub meaning: String,
    /// The words that it may be; empty where it is none of a list.
    pub choices: Vec<String>,
    /// What each preset says, by the preset's name; nothing where it leaves the key out.
    pub presets: Vec<(&'static str, Option<String>)>,
}

/// The key of that name, all keys of the table of that name, or every key for `all`.
///
/// # Errors
/// [`Error::OutOfRange`] for a name that is neither.
pub fn explain(name: &str) -> Result<Vec<KeyHelp>> {
    let schema = json_schema();
    let presets = [("paper", Preset::Paper), ("consistent", Preset::Consistent)];
    let presets: Vec<(&'static str, toml::Table)> =
        presets.into_iter().filter_map(|(name, preset)| Some((name, preset.toml().parse().ok()?))).collect();
    let mut keys = Vec::new();
    gather(&schema, &schema, "", &presets, &mut keys);
    let is_wanted = |own: &KeyHelp| {
        name == "all"
            || own.key == name
            || own.key.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'))
    };
    let (found, others): (Vec<_>, Vec<_>) = keys.into_iter().partition(is_wanted);
    if !found.is_empty() {
        return Ok(found);
    }
    // Whole keys, their last parts, and tables.
    let names = others.iter().flat_map(|own| {
        let (table, last) = own.key.rsplit_once('.').unwrap_or((&own.key, &own.key));
        [(&*own.key, &*own.key), (last, &*own.key), (table, table)]
    });
    let likest = names
        .map(|(like, meant)| (strsim::normalized_damerau_levenshtein(name, like), meant))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let meant = likest.map_or(String::new(), |(_, meant)| format!("; did you mean {meant}?"));
    Err(Error::out_of_range("key", name, &format!("a key or table of the configuration, or all{meant}")))
}

/// Adds the keys below a node of the schema, whose dotted name ends in a point unless it is the root.
fn gather(
    schema: &Value,
    node: &Value,
    prefix: &str,
    presets: &[(&'static str, toml::Table)],
    keys: &mut Vec<KeyHelp>,
) {
    for (name, own) in node["properties"].as_object().into_iter().flatten() {
        let (key, named) = (format!("{prefix}{name}"), definition(schema, own));
        if named.is_some_and(|named| named["properties"].is_object()) {
            gather(schema, named.unwrap_or(own), &format!("{key}."), presets, keys);
            continue;
        }
        let words = named.and_then(|named| named["oneOf"].as_array()).into_iter().flatten();
        let of_preset = |table: &toml::Table| {
            let mut parts = key.split('.');
            let first = table.get(parts.next()?)?;
            parts.try_fold(first, |value, part| value.get(part)).map(ToString::to_string)
        };
        keys.push(KeyHelp {
            meaning: own["description"]
                .as_str()
                .unwrap_or_default()
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" "),
            choices: words.filter_map(|word| word["const"].as_str().map(String::from)).collect(),
            presets: presets.iter().map(|(name, table)| (*name, of_preset(table))).collect(),
            key,
        });
    }
}

/// What a node of the schema refers to, if it does.
fn definition<'a>(schema: &'a Value, node: &'a Value) -> Option<&'a Value> {
    let places = std::iter::once(node).chain(node["anyOf"].as_array().into_iter().flatten());
    let name = places.filter_map(|place| place["$ref"].as_str()).next()?.rsplit('/').next()?;
    schema["$defs"].get(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_tables_are_explained_and_others_answered_with_what_is_like_them() {
        let one = explain("haloes.draw").unwrap();
        assert_eq!(one.len(), 1);
        assert!(one[0].choices.iter().any(|word| word == "direct") && !one[0].meaning.is_empty(), "{one:?}");
        let lens = explain("lens").unwrap();
        assert!(lens.iter().all(|own| own.key.starts_with("lens.")) && lens.len() == 4, "{lens:?}");
        let theta_e = lens.iter().find(|own| own.key == "lens.einstein_radius_arcsec").unwrap();
        assert!(theta_e.presets.iter().all(|(_, value)| value.is_some()), "{theta_e:?}");
        let all = explain("all").unwrap();
        assert!(all.len() > 60 && all.iter().all(|own| !own.meaning.is_empty()), "{all:?}");
        let error = explain("min_point_sheer").unwrap_err().to_string();
        assert!(error.contains("did you mean haloes.min_point_shear?"), "{error}");
        let error = explain("lense").unwrap_err().to_string();
        assert!(error.contains("did you mean lens?"), "{error}");
    }
}
