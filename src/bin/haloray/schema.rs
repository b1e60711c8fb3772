//! `haloray schema`: the JSON schema of the configuration.

use clap::ValueEnum;
use haloray::config::{Preset, json_schema};
use haloray::{Error, Result};

/// Print the JSON schema of the configuration, or a complete preset to start from.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray schema > haloray.schema.json\n  haloray schema --preset paper > my.toml"
)]
pub struct Args {
    /// Print this preset as a TOML file instead of the schema.
    #[arg(long, value_enum)]
    preset: Option<PresetArg>,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    Paper,
    Consistent,
}

pub fn run(args: &Args) -> Result<()> {
    match args.preset {
        Some(PresetArg::Paper) => crate::terminal::print_result(Preset::Paper.toml()),
        Some(PresetArg::Consistent) => crate::terminal::print_result(Preset::Consistent.toml()),
        None => {
            let text = serde_json::to_string_pretty(&json_schema())
                .map_err(|e| Error::out_of_range("schema", e, "representable as JSON"))?;
            crate::terminal::print_result(&(text + "\n"))
        }
    }
}
