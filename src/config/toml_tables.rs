//! Tables of TOML laid one over the other, where their keys stand in a user's text, and what serde says of them in plain words.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, LineColumn, Result};

/// An assignment as a line of TOML; what is no value of TOML is text.
pub(super) fn line_of(assignment: &str) -> Result<String> {
    let refuse = || {
        Error::argument("--set", assignment, "KEY=VALUE with the section in the key, as haloes.draw=direct")
    };
    let (key, value) = assignment.split_once('=').ok_or_else(refuse)?;
    let is_name =
        |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    let (key, value) = (key.trim(), value.trim());
    if !key.split('.').all(is_name) || value.is_empty() || value.contains('\n') {
        return Err(refuse());
    }
    let is_toml = DeTable::parse(&format!("value = {value}")).is_ok();
    let value = if is_toml { value.to_owned() } else { toml::Value::from(value).to_string() };
    Ok(format!("{key} = {value}"))
}

/// Whether a table has a dotted key.
pub(super) fn holds(table: &DeTable, dotted: &str) -> bool {
    let (first, rest) = dotted.split_once('.').unwrap_or((dotted, ""));
    table.get(first).is_some_and(|value| {
        rest.is_empty() || value.get_ref().as_table().is_some_and(|inner| holds(inner, rest))
    })
}

/// Lays the user's sections over the preset's key by key; a value such as `epoch = { … }` replaces the preset's.
///
/// Spans become the user's, so that no error points into the text of the preset.
pub(super) fn overlay<'i>(base: &mut DeTable<'i>, top: &DeTable<'i>) {
    for (key, value) in top {
        let below = base.remove(key.get_ref().as_ref()).map(Spanned::into_inner);
        let merged = match (below, value.get_ref()) {
            (Some(DeValue::Table(mut below)), DeValue::Table(above)) => {
                for (key, value) in above {
                    replaced_by(key.get_ref(), value.get_ref())
                        .iter()
                        .for_each(|key| drop(below.remove(*key)));
                }
                for (key, value) in above {
                    below.remove(key.get_ref().as_ref());
                    below.insert(key.clone(), value.clone());
                }
                Spanned::new(value.span(), DeValue::Table(below))
            }
            _ => value.clone(),
        };
        base.insert(key.clone(), merged);
    }
}

/// The keys of a preset that a user's key takes the place of: of the truncations of haloes there is one at most.
fn replaced_by(key: &str, value: &DeValue) -> &'static [&'static str] {
    const TRUNCATIONS: &[&str] = &["truncation_over_r_s", "truncation_over_r_200c", "total_mass_over_m200c"];
    let is_plain = key == "profile" && value.as_str() == Some("nfw");
    if is_plain || TRUNCATIONS.contains(&key) { TRUNCATIONS } else { &[] }
}

/// The message of serde without the names of Rust's types, with the key or name that a misspelt one was to be.
///
/// `preset` says in which section a key belongs that stands in a wrong one.
pub(super) fn plain_words(error: &toml::de::Error, preset: &str) -> String {
    let mut message = error.message().trim().replace('\n', "; ");
    if let Some(meant) = meant(&message, preset) {
        message = format!("did you mean `{meant}`? {message}");
    }
    if let Some((before, _)) = message.split_once("expected struct ") {
        message = format!("{before}expected a section with keys");
    }
    for (ours, plain) in [
        (" as i128", ""),
        ("expected f64", "expected a number"),
        ("expected u64", "expected a whole number, zero or more"),
        ("expected usize", "expected a whole number, zero or more"),
    ] {
        message = message.replace(ours, plain);
    }
    message
}

/// What was meant, of a message as "unknown field `a`, expected one of `b`, `c`": a key of that name in another section,
/// or the likest of those that are expected.
fn meant(message: &str, preset: &str) -> Option<String> {
    let is_key = message.starts_with("unknown field");
    let mut quoted = message.strip_prefix("unknown ")?.split('`').skip(1).step_by(2);
    let unknown = quoted.next()?;
    let elsewhere = DeTable::parse(preset).ok().filter(|_| is_key).and_then(|preset| {
        let holds_it = |section: &DeValue| section.as_table().is_some_and(|keys| keys.contains_key(unknown));
        let (section, _) = preset.get_ref().iter().find(|(_, value)| holds_it(value.get_ref()))?;
        Some(format!("{}.{unknown}", section.get_ref()))
    });
    let likeness = |name: &str| strsim::normalized_damerau_levenshtein(unknown, name);
    let likest = quoted.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    elsewhere.or_else(|| likest.filter(|name| likeness(name) > 0.6).map(String::from))
}

/// Where the value of a dotted key, or the innermost section that holds it, begins in the user's text.
pub(super) fn start_of(table: &DeTable, dotted: &str) -> Option<usize> {
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
    found
}

/// The place of a byte of a text, counted from one.
pub(super) fn line_and_column(text: &str, start: usize) -> Option<LineColumn> {
    let before = text.get(..start)?;
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
    Some(LineColumn { line, column })
}
