//! `haloray schema`: the JSON schema of the configuration, its keys in words, and the presets.

use std::fmt::Write;

use clap::ValueEnum;
use haloray::config::{KeyHelp, Preset, explain, json_schema};
use haloray::{Error, Result};

use crate::terminal::print_result;

/// Print the JSON schema of the configuration, what its keys mean, or a complete preset to start from.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray schema haloes.min_point_shear\n  haloray schema lens\n  haloray schema all | less\n  \
                  haloray schema > haloray.schema.json\n  haloray schema --preset paper > my.toml"
)]
pub struct Args {
    /// Explain this key, all keys of this table, or `all`, instead of printing the schema.
    key: Option<String>,
    /// Print this preset as a TOML file instead of the schema.
    #[arg(long, value_enum, conflicts_with = "key")]
    preset: Option<PresetArg>,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    Paper,
    Consistent,
}

pub fn run(args: &Args) -> Result<()> {
    match (args.preset, &args.key) {
        (Some(PresetArg::Paper), _) => print_result(Preset::Paper.toml()),
        (Some(PresetArg::Consistent), _) => print_result(Preset::Consistent.toml()),
        (None, Some(key)) => print_result(&in_words(&explain(key)?)),
        (None, None) => {
            let text = serde_json::to_string_pretty(&json_schema())
                .map_err(|e| Error::out_of_range("schema", e, "representable as JSON"))?;
            print_result(&(text + "\n"))
        }
    }
}

fn in_words(keys: &[KeyHelp]) -> String {
    let mut text = String::new();
    for KeyHelp { key, meaning, choices, presets } in keys {
        let values =
            presets.iter().map(|(name, value)| format!("{name}: {}", value.as_deref().unwrap_or("left out")));
        let _ = writeln!(text, "{key}\n    {meaning}");
        if !choices.is_empty() {
            let _ = writeln!(text, "    One of {}.", choices.join(", "));
        }
        let _ = writeln!(text, "    {}", values.collect::<Vec<_>>().join(", "));
    }
    text
}
