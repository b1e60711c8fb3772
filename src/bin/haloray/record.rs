//! What the page of a run says of the command: the words that repeat it, without paths, threads or times.

use std::path::Path;

use haloray::Result;
use haloray::io::{Provenance, Staging};
use haloray::report::{RunRecord, stage_text};

/// Name of the resolved configuration in the folder of a run.
const CONFIG_FILE: &str = "config.toml";

/// A run of `haloray COMMAND ARGUMENTS -o FOLDER`; empty arguments are left out.
pub fn record(command: &str, arguments: &[String], about: &str, provenance: &Provenance) -> RunRecord {
    let folder = command.split(' ').next_back().unwrap_or(command);
    let words = arguments.iter().filter(|word| !word.is_empty()).cloned();
    let words: Vec<String> = words.chain(["-o".into(), format!("{folder}_again")]).collect();
    RunRecord::new(command, &words, about, provenance)
}

/// The same of a command that takes a configuration, which is staged as `config.toml` and repeats it whatever preset,
/// file and options it came from.
pub fn configured(
    staging: &Staging,
    command: &str,
    arguments: &[String],
    about: &str,
    provenance: &Provenance,
) -> Result<RunRecord> {
    stage_text(staging, CONFIG_FILE, &provenance.config_toml)?;
    let words: Vec<String> = [CONFIG_FILE.to_owned()].into_iter().chain(arguments.iter().cloned()).collect();
    Ok(record(command, &words, about, provenance))
}

/// An option with its value, left out where the value is the default.
pub fn option(name: &str, value: impl ToString, default: impl ToString) -> [String; 2] {
    let value = value.to_string();
    if value == default.to_string() { Default::default() } else { [name.into(), value] }
}

/// A flag, left out where it is not given.
pub fn flag(name: &str, is_given: bool) -> [String; 2] {
    [if is_given { name.into() } else { String::new() }, String::new()]
}

/// A file without its folder.
pub fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The name by which an argument's value is given.
pub fn value_name(value: impl clap::ValueEnum) -> String {
    value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}
