//! What `summary.json` of any command says: its first numbers, its tables, its warnings.

use serde_json::{Map, Value};

use super::model::{Cell, Fact, Label, PageTable};
use super::tables::{DIGITS, capital, name_cell, number_cell, text_cell};
use super::words::label;
use crate::report::{interval_text, number_text, probability_text, with_error_text};

/// What a person wants first, where a summary has it, in this order; a dot leads into an object.
const FIRST: [&str; 31] = [
    "number_of_sightlines",
    "number_failed",
    "rms_gamma_los",
    "rms_gamma_los_ring",
    "good_fit",
    "converged",
    "fits",
    "fits_converged",
    "fits_with_divergences",
    "number_kept",
    "number_beyond_tidal",
    "all_haloes.gamma1_los",
    "all_haloes.gamma2_los",
    "all_haloes.kappa_los",
    "all_haloes.delta_tot",
    "all_haloes.delta_tot_disc",
    "tidal_haloes.gamma1_los",
    "tidal_haloes.gamma2_los",
    "largest_kappa_h",
    "tracing.measured_arcsec",
    "chi2_reduced",
    "p_value",
    "largest_residual_sigma",
    "worst_r_hat",
    "worst_ess",
    "log_evidence",
    "log_evidence_error",
    "divergences",
    "evaluations",
    "model",
    "sampler",
];

/// Parameters of a fit that come before all other numbers.
const FITTED: [&str; 3] = ["gamma1_los", "gamma2_los", "lens.theta_E"];

/// Significant digits of the first numbers.
const FACT_DIGITS: usize = 4;
/// Columns of a table of parameters that come first.
const COLUMNS_FIRST: [&str; 12] = [
    "name",
    "unit",
    "median",
    "hpd68_low",
    "hpd68_high",
    "best_fit",
    "mean",
    "standard_deviation",
    "bounded",
    "r_hat",
    "ess_bulk",
    "ess_tail",
];

/// What a summary says.
#[derive(Default)]
pub(super) struct Numbers {
    pub facts: Vec<Fact>,
    pub tables: Vec<PageTable>,
    pub warnings: Vec<String>,
}

impl Numbers {
    /// Of a `summary.json`.
    pub fn of(summary: &Value) -> Self {
        let Some(object) = summary.as_object() else { return Self::default() };
        let fitted = FITTED.iter().filter_map(|name| fitted(summary, name));
        let facts = fitted.chain(FIRST.iter().filter_map(|path| fact(summary, path))).collect();
        let mut tables: Vec<PageTable> =
            object.iter().filter_map(|(name, value)| of_list(name, value)).collect();
        tables.extend(beside_each_other(object));
        tables.extend(over_sightlines(object));
        tables.push(the_rest(object));
        tables.retain(|table| !table.rows.is_empty());
        Self { facts, tables, warnings: warnings(summary) }
    }
}

fn at<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(value, |value, name| value.get(name))
}

/// Median and 68% interval of a fitted parameter.
fn fitted(summary: &Value, name: &str) -> Option<Fact> {
    let parameters = summary.get("parameters")?.as_array()?;
    let parameter = parameters.iter().find(|parameter| parameter["name"] == name)?;
    let number = |key: &str| parameter[key].as_f64();
    let value = interval_text(number("median")?, [number("hpd68_low")?, number("hpd68_high")?]);
    let label = match name {
        "lens.theta_E" => Label { text: "θ".into(), sub: "E".into(), unit: "arcsec".into(), ..label(name) },
        _ => label(name),
    };
    Some(Fact { label, value })
}

fn fact(summary: &Value, path: &str) -> Option<Fact> {
    let value = at(summary, path)?;
    let name = path.rsplit('.').next().unwrap_or(path);
    let mut label = label(name);
    match path.split_once('.') {
        Some(("tidal_haloes", _)) => label.sub += ", tidal haloes",
        Some(("tracing", _)) => {
            (label.text, label.sub) = ("largest error of β measured".into(), String::new())
        }
        _ => {}
    }
    let number = |value: &Value| value.as_f64().map(|number| number_text(number, FACT_DIGITS));
    let probability = |value: &Value| {
        let text = probability_text(value.as_f64()?, FACT_DIGITS);
        Some(text.trim_start_matches("= ").to_owned())
    };
    let value = match (value, value.as_array().map(Vec::as_slice)) {
        (_, Some([value, error])) => with_error_text(value.as_f64()?, error.as_f64()?),
        _ if name == "p_value" => probability(value)?,
        _ => number(value).or_else(|| words(value))?,
    };
    Some(Fact { label, value })
}

/// A value in words; none of lists and objects.
fn words(value: &Value) -> Option<String> {
    Some(match value {
        Value::Bool(is) => (if *is { "yes" } else { "no" }).into(),
        Value::Number(number) => number_text(number.as_f64()?, DIGITS),
        Value::String(text) => text.clone(),
        Value::Null => "undefined".into(),
        Value::Array(_) | Value::Object(_) => return None,
    })
}

fn cell(value: &Value) -> Cell {
    match value {
        Value::Number(number) => number_cell(number.as_f64().unwrap_or(f64::NAN)),
        Value::Array(list) => text_cell(&list.iter().filter_map(words).collect::<Vec<_>>().join(", ")),
        other => text_cell(&words(other).unwrap_or_default()),
    }
}

/// A list of equal objects: a row each.
fn of_list(name: &str, value: &Value) -> Option<PageTable> {
    let rows: Vec<&Map<String, Value>> = value.as_array()?.iter().filter_map(Value::as_object).collect();
    let first = rows.first()?;
    let rank = |name: &&String| {
        (COLUMNS_FIRST.iter().position(|own| own == name).unwrap_or(COLUMNS_FIRST.len()), name.to_string())
    };
    let mut columns: Vec<&String> = first.keys().collect();
    columns.sort_by_key(rank);
    columns.retain(|name| {
        !rows.iter().all(|row| row.get(*name).is_none_or(|value| value.is_array() || value.is_object()))
    });
    let of_row = |row: &&Map<String, Value>| {
        let of_column = |column: &&String| match (column.as_str(), row.get(*column)) {
            ("name", Some(Value::String(name))) => name_cell(name),
            (_, value) => value.map_or_else(|| text_cell(""), cell),
        };
        columns.iter().map(of_column).collect()
    };
    Some(PageTable {
        id: format!("table-{name}"),
        title: capital(&name.replace('_', " ")),
        columns: columns.iter().map(|name| label(name)).collect(),
        rows: rows.iter().map(of_row).collect(),
        ..PageTable::default()
    })
}

/// Objects with the same numbers of different views: a column each.
fn beside_each_other(object: &Map<String, Value>) -> Option<PageTable> {
    let views: Vec<(&String, &Map<String, Value>)> = ["all_haloes", "tidal_haloes"]
        .iter()
        .filter_map(|name| object.get_key_value(*name))
        .filter_map(|(name, value)| Some((name, value.as_object()?)))
        .collect();
    let (_, first) = views.first()?;
    let mut names: Vec<&String> = first.keys().collect();
    names.sort_by_key(|name| rank_of_quantity(name));
    let columns = views.iter().map(|(name, _)| label(name));
    let row = |name: &&String| {
        let values = views.iter().map(|(_, view)| view.get(*name).map_or_else(|| text_cell(""), cell));
        let unit = text_cell(&label(name).unit);
        [name_cell(name)].into_iter().chain(values).chain([unit]).collect()
    };
    Some(PageTable {
        id: "table-views".into(),
        title: "On the axis, through all haloes and through the tidal ones".into(),
        columns: [head("quantity")].into_iter().chain(columns).chain([head("unit")]).collect(),
        rows: names.iter().map(row).collect(),
        ..PageTable::default()
    })
}

/// The columns of an ensemble: how each is distributed over the sightlines.
fn over_sightlines(object: &Map<String, Value>) -> Option<PageTable> {
    const HEADS: [&str; 9] =
        ["quantity", "mean", "standard deviation", "16%", "50%", "84%", "least", "largest", "unit"];
    let columns = object.get("columns")?.as_object()?;
    let mut names: Vec<&String> = columns.keys().collect();
    names.sort_by_key(|name| rank_of_quantity(name));
    let row = |name: &&String| {
        let column = &columns[*name];
        let numbers = [&column["mean"], &column["standard_deviation"]].into_iter();
        let numbers =
            numbers.chain((1..4).map(|i| &column["quantiles"][i])).chain((0..2).map(|i| &column["range"][i]));
        let unit = text_cell(column["unit"].as_str().unwrap_or(""));
        [name_cell(name)].into_iter().chain(numbers.map(cell)).chain([unit]).collect()
    };
    Some(PageTable {
        id: "table-sightlines".into(),
        title: "Over the sightlines".into(),
        columns: HEADS.map(head).into(),
        rows: names.iter().map(row).collect(),
        ..PageTable::default()
    })
}

/// Sheared γ and κ before flexions, those of the line of sight before its parts.
fn rank_of_quantity(name: &str) -> (usize, usize, String) {
    const KINDS: [&str; 9] = ["gamma1", "gamma2", "kappa", "delta", "omega", "F1", "F2", "G1", "G2"];
    const PLACES: [&str; 6] = ["los", "od", "os", "ds", "tot", "los_linear"];
    let (kind, place) = name.split_once('_').unwrap_or((name, ""));
    let of = |list: &[&str], word: &str| list.iter().position(|own| *own == word).unwrap_or(list.len());
    (of(&PLACES, place), of(&KINDS, kind), name.into())
}

/// Whatever is neither a list nor one of the views.
fn the_rest(object: &Map<String, Value>) -> PageTable {
    let mut rows = Vec::new();
    for (name, value) in object.iter().filter(|(name, _)| !name.ends_with("_haloes")) {
        let inner: Vec<(&String, &Value)> = match value {
            Value::Object(inner) => inner.iter().collect(),
            _ => vec![(name, value)],
        };
        // A number that was not counted is no number that is undefined.
        let is_shown = |name: &str, value: &Value| {
            words(value).is_some() && !(value.is_null() && name.contains("number"))
        };
        for (own, value) in inner.into_iter().filter(|(own, value)| is_shown(own, value)) {
            let group = if own == name { String::new() } else { name.replace('_', " ") };
            rows.push(vec![name_cell(own), cell(value), text_cell(&label(own).unit), text_cell(&group)]);
        }
    }
    PageTable {
        id: "table-rest".into(),
        title: "All other numbers".into(),
        columns: ["quantity", "value", "unit", "group"].map(head).into(),
        rows,
        is_folded: true,
        ..PageTable::default()
    }
}

fn head(text: &str) -> Label {
    Label { text: text.into(), ..Label::default() }
}

fn warnings(summary: &Value) -> Vec<String> {
    let is_false = |name: &str| summary.get(name) == Some(&Value::Bool(false));
    let count = |path: &str| at(summary, path).and_then(Value::as_f64).filter(|count| *count > 0.0);
    let told = summary.get("warnings").and_then(Value::as_array);
    let mut warnings: Vec<String> =
        told.into_iter().flatten().filter_map(Value::as_str).map(capital).collect();
    // A summary's own words say more.
    let is_told = |warnings: &[String], words: &str| warnings.iter().any(|warning| warning.contains(words));
    let says_why = ["does not describe the image", "too small for noise"];
    if is_false("good_fit") && !says_why.iter().any(|words| is_told(&warnings, words)) {
        warnings.push("Not a good fit: the model does not describe the image.".into());
    }
    if is_false("converged") && !is_told(&warnings, "not converged") {
        warnings.push("Not converged: R-hat is above 1.01 or ESS below 400 for some quantity.".into());
    }
    if at(summary, "number_kept").and_then(Value::as_f64) == Some(0.0) {
        warnings.push("No halo is left: see haloes.min_point_shear and haloes.max_kappa.".into());
    }
    if let Some(count) = count("number_above_kappa_warning") {
        warnings.push(format!(
            "Haloes of large κ_h on the axis: {} above diagnostics.kappa_warning; haloes.max_kappa leaves such haloes out.",
            number_text(count, DIGITS)
        ));
    }
    if let Some(count) = count("all_haloes.number_in_lens_plane") {
        warnings.push(format!(
            "Haloes at the redshift of the lens: {}. They are part of the lens, and left out of od, os, ds and LOS.",
            number_text(count, DIGITS)
        ));
    }
    if let Some(count) = count("number_failed") {
        let count = number_text(count, DIGITS);
        warnings.push(format!(
            "Sightlines that could not be computed: {count}; /failures of sightlines.h5 has the reasons."
        ));
    }
    if let (Some(all), Some(converged)) =
        (count("fits"), at(summary, "fits_converged").and_then(Value::as_f64))
        && converged < all
    {
        let (missing, all) = (number_text(all - converged, DIGITS), number_text(all, DIGITS));
        warnings.push(format!("{missing} of {all} fits have not converged."));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_of_a_fit_gives_warnings_facts_and_a_table_of_parameters() {
        let summary = serde_json::json!({
            "good_fit": false, "converged": true, "warnings": ["w"], "chi2_reduced": 2.09e1,
            "amplitudes": {"source": 3.5},
            "parameters": [{"r_hat": 1.0, "name": "gamma1_los", "unit": "", "median": -0.012,
                "hpd68_low": -0.02, "hpd68_high": -0.004}]
        });
        let numbers = Numbers::of(&summary);
        assert_eq!(numbers.warnings.len(), 2);
        let facts: Vec<&str> = numbers.facts.iter().map(|fact| fact.value.as_str()).collect();
        assert_eq!(facts, ["−0.012 [−0.020, −0.004]", "no", "yes", "20.90"]);
        let row: Vec<&str> = numbers.tables[0].rows[0].iter().map(|cell| cell.text.as_str()).collect();
        assert_eq!(row, ["gamma1_los", "", "−0.012000", "−0.020000", "−0.0040000", "1"]);
        assert!(numbers.tables[1].rows.iter().any(|row| row[3].text == "amplitudes"));
    }

    #[test]
    fn a_line_of_sight_without_haloes_is_warned_of() {
        let warnings = |kept: f64| Numbers::of(&serde_json::json!({"number_kept": kept})).warnings;
        assert_eq!(warnings(0.0), ["No halo is left: see haloes.min_point_shear and haloes.max_kappa."]);
        assert!(warnings(1.0).is_empty());
    }

    #[test]
    fn views_stand_beside_each_other_the_line_of_sight_first() {
        let view = serde_json::json!({"F1_os_per_arcsec": 0.1, "gamma1_los": 0.2, "delta_tot": null});
        let numbers = Numbers::of(&serde_json::json!({"all_haloes": view, "tidal_haloes": view}));
        let names: Vec<&str> = numbers.tables[0].rows.iter().map(|row| row[0].text.as_str()).collect();
        assert_eq!(names, ["gamma1_los", "delta_tot", "F1_os_per_arcsec"]);
        assert_eq!(numbers.tables[0].rows[1][1].text, "undefined");
    }

    #[test]
    fn an_ensemble_begins_with_its_scatter_and_tells_of_what_failed() {
        let column = serde_json::json!({"unit": "", "count": 6, "mean": 0.5, "standard_deviation": 0.25,
            "quantiles": [0.1, 0.2, 0.3, 0.4, 0.6], "range": [0.0, null]});
        let numbers = Numbers::of(&serde_json::json!({"number_of_sightlines": 7, "number_failed": 1,
            "rms_gamma_los": [0.027_61, 0.003_74], "columns": {"kappa_os": column, "gamma1_los": column}}));
        let facts: Vec<&str> = numbers.facts.iter().map(|fact| fact.value.as_str()).collect();
        assert_eq!(facts, ["7", "1", "0.0276 ± 0.0037"]);
        let row: Vec<&str> = numbers.tables[0].rows[0].iter().map(|cell| cell.text.as_str()).collect();
        assert_eq!(
            row,
            ["gamma1_los", "0.50000", "0.25000", "0.20000", "0.30000", "0.40000", "0", "undefined", ""]
        );
        assert!(numbers.warnings[0].starts_with("Sightlines that could not be computed: 1"));
    }
}
