//! What attributes of foreign HDF5 tables say of their columns: units, and values that are packed.

use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset};

use super::hdf5_reading as reading;
use crate::error::{Error, FileFault, Result};

/// Refuses units that a group states for its columns, under whatever name (`units`, `angle_unit`).
pub(super) fn check_states_no_units(path: &Path, group: &Group) -> Result<()> {
    let attributes = group.attributes().map_err(|error| reading::damaged(path, &error))?;
    attributes.iter().find(|attribute| speaks_of_units(&attribute.name)).map_or(Ok(()), |unit| {
        let problem = format!(
            "/{} has the attribute {}, but must state units dataset by dataset, in an attribute unit of each",
            group.name().trim_start_matches('/'),
            unit.name
        );
        Err(Error::file(FileFault::Content, path, problem))
    })
}

/// The units of single fields of records, in attributes that have a field's name before `_unit` (`mass_units`).
///
/// # Errors
/// An attribute that speaks of units, but of those of no field.
pub(super) fn units_of_fields(
    path: &Path,
    records: &Dataset,
    fields: &[&str],
) -> Result<Vec<(String, String)>> {
    let mut units = Vec::new();
    for attribute in records.attributes() {
        let name = attribute.name.as_str();
        if is_unit(name) || !speaks_of_units(name) {
            continue;
        }
        let lower = name.to_ascii_lowercase();
        let stem =
            lower.trim_end_matches("units").trim_end_matches("unit").trim_end_matches(['_', '.', '-', ' ']);
        let field = fields.iter().find(|field| field.eq_ignore_ascii_case(stem));
        let text = reading::attribute_texts(path, &attribute)?;
        match (field, text.as_slice()) {
            (Some(field), [unit]) => units.push((field.to_string(), unit.clone())),
            _ => {
                let problem = format!(
                    "{} has the attribute {name}, but must state units of all columns in one attribute unit, or each as COLUMN_unit",
                    records.name()
                );
                return Err(Error::file(FileFault::Content, path, problem));
            }
        }
    }
    Ok(units)
}

fn speaks_of_units(name: &str) -> bool {
    name.split(|c: char| !c.is_alphanumeric()).any(is_unit)
}

/// Refuses values that are packed by a rule of netCDF, which its readers undo: a factor, an offset, a number that stands for
/// none.
pub(super) fn check_not_packed(path: &Path, dataset: &Dataset) -> Result<()> {
    for attribute in dataset.attributes() {
        let allowed = match attribute.name.as_str() {
            "scale_factor" => [1.0, 1.0],
            "add_offset" => [0.0, 0.0],
            "_FillValue" | "missing_value" => [f64::NAN, f64::NEG_INFINITY],
            _ => continue,
        };
        let value = attribute.read_as_f64().ok();
        if value.is_none_or(|value| !value.is_nan() && !allowed.contains(&value)) {
            let value = value.map_or_else(|| "no number".into(), |value| value.to_string());
            let problem = format!(
                "has the attribute {} ({value}): packed by netCDF's rules, which are not followed; write the values themselves",
                attribute.name
            );
            return Err(Error::table(path, format!("column {}", dataset.name()), problem));
        }
    }
    Ok(())
}

/// What the attributes `unit`, `units` and `TUNIT` say, without what is said twice. Where they are silent, a power of h or of the scale
/// factor that simulations say their values to be multiplied by is part of a unit that is not known.
pub(super) fn stated_units(path: &Path, dataset: &Dataset) -> Result<Vec<String>> {
    let attributes = dataset.attributes();
    let mut stated: Vec<Vec<String>> = Vec::new();
    for attribute in attributes.iter().filter(|attribute| is_unit(&attribute.name)) {
        let texts = reading::attribute_texts(path, attribute)?;
        if texts.iter().any(|text| !text.trim().is_empty()) && !stated.contains(&texts) {
            stated.push(texts);
        }
    }
    if stated.is_empty() {
        stated.extend(attributes.iter().filter_map(unit_of_scaling).map(|unit| vec![unit]));
    }
    Ok(stated.concat())
}

/// As IllustrisTNG (`h_scaling`), EAGLE (`h-scale-exponent`) and SWIFT (`a-scale exponent`) write it.
fn unit_of_scaling(attribute: &Attribute) -> Option<String> {
    let name: String = attribute.name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let base = match name.as_str() {
        "hscaling" | "hscaleexponent" => "h",
        "ascaling" | "ascaleexponent" | "aexpscaleexponent" => "a",
        _ => return None,
    };
    let exponent = attribute.read_as_f64().ok()?;
    (exponent != 0.0).then(|| format!("? {base}^{exponent} (attribute {})", attribute.name))
}

fn is_unit(attribute: &str) -> bool {
    ["unit", "units", "tunit"].iter().any(|unit| attribute.eq_ignore_ascii_case(unit))
}
