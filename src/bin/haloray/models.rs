//! Models to fit, by name or in files.

use std::fmt::Write;
use std::path::Path;

use haloray::inference::model::{BUILT_IN, ModelDescription};
use haloray::io::read_text;
use haloray::{Error, Result};

/// The model of that name, or in that file.
pub fn description(model: &str) -> Result<ModelDescription> {
    let path = Path::new(model);
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("toml")) {
        return ModelDescription::built_in(model).map_err(|error| match error {
            Error::ModelName { name, allowed } => {
                Error::ModelName { name, allowed: allowed + ", or a file ending in .toml" }
            }
            other => other,
        });
    }
    let text = read_text(path)?;
    ModelDescription::parse(&text)
        .map_err(|error| Error::Model { model: model.into(), problem: error.to_string().trim_end().into() })
}

/// The file that describes a model.
pub fn toml_of(description: &ModelDescription) -> String {
    toml::to_string_pretty(description).unwrap_or_else(|error| format!("# {error}\n"))
}

/// The built-in models as a person reads them.
pub fn list() -> String {
    let mut text = String::from(
        "Built-in models (`haloray fit --list --model NAME` prints one to copy and change):\n\n",
    );
    for (name, toml) in BUILT_IN {
        let about = ModelDescription::parse(toml).map_or_else(|e| e.to_string(), |d| d.about);
        let _ = writeln!(text, "{name:<16} {about}");
    }
    text + "\nA model file lists [[lens]], [[source]], [[lens_light]] and [line_of_sight]; a parameter is a number, the name\n\
            of another parameter (\"lens.e1\"), or a prior: { uniform = [a, b] }, { normal = [mean, sd] },\n\
            { log_normal = [median, sd of ln] }, the last two with low and high if wanted.\n"
}
