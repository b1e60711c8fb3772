//! How people, pandas, spreadsheets and astropy write CSV: separators, comments, units, columns without a name.

use std::collections::HashMap;
use std::path::Path;

use super::astropy_meta;
use crate::error::{Error, FileFault, Result};

/// What the comments before an ECSV table say.
pub(super) struct Ecsv {
    pub(super) separator: u8,
    pub(super) units: HashMap<String, Option<String>>,
}

impl Ecsv {
    pub(super) fn of(path: &Path, text: &str) -> Result<Option<Self>> {
        let comments = text.lines().map_while(|line| line.strip_prefix('#'));
        let lines: Vec<&str> = comments.map(|line| line.strip_prefix(' ').unwrap_or(line)).collect();
        if !lines.first().is_some_and(|line| line.starts_with("%ECSV")) {
            return Ok(None);
        }
        let units = astropy_meta::column_units(&lines)
            .map_err(|problem| Error::file(FileFault::Damaged, path, format!("its ECSV header {problem}")))?;
        let has_comma = lines.iter().any(|line| line.starts_with("delimiter:") && line.contains(','));
        Ok(Some(Self { separator: if has_comma { b',' } else { b' ' }, units: units.into_iter().collect() }))
    }
}

/// The first comment before the header that speaks of units.
pub(super) fn comment_on_units(text: &str) -> Option<&str> {
    let is_unit = |word: &str| ["unit", "units"].iter().any(|unit| word.eq_ignore_ascii_case(unit));
    let mut comments = text.lines().map_while(|line| line.strip_prefix('#')).map(str::trim);
    comments.find(|comment| comment.split(|c: char| !c.is_alphanumeric()).any(is_unit))
}

/// True for the line by which spreadsheets tell each other the separator, `sep=;`.
pub(super) fn states_separator(line: &str) -> bool {
    let line = line.trim_end_matches(['\r', '\n']);
    line.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("sep=")) && line.chars().count() == 5
}

/// The same text with indented comments, and a first line that states the separator, made comments at the start of their
/// lines, where the csv crate looks for them.
pub(super) fn flush_comments(text: &str) -> String {
    let mut flushed = String::with_capacity(text.len());
    let mut is_quoted = false;
    for (i, line) in text.split_inclusive('\n').enumerate() {
        if i == 0 && states_separator(line) {
            flushed.push('#');
            flushed.push_str(&line[1..]);
            continue;
        }
        let rest = line.trim_start_matches([' ', '\t']);
        if !is_quoted && rest.starts_with('#') {
            flushed.push('#');
            flushed.push_str(&line[..line.len() - rest.len()]);
            flushed.push_str(&rest[1..]);
        } else {
            flushed.push_str(line);
            is_quoted ^= line.matches('"').count() % 2 == 1;
        }
    }
    flushed
}

/// The character between fields: a comma unless the header has none, but semicolons or else tabs.
pub(super) fn separator(text: &str) -> u8 {
    let header =
        text.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap_or_default();
    [b',', b';', b'\t'].into_iter().find(|&byte| header.contains(char::from(byte))).unwrap_or(b',')
}

/// Column names, the fields by column, and the line of each row.
pub(super) type Fields = (Vec<String>, Vec<Vec<String>>, Vec<u64>);

/// The table without columns that have no name: empty ones at the end, and pandas' index at the start.
pub(super) fn without_nameless(
    path: &Path,
    (mut names, mut fields, line_of_row): Fields,
    separator: u8,
) -> Result<Fields> {
    let mut done = Vec::new();
    match separator {
        b';' => done.push("semicolons separate its columns"),
        b'\t' => done.push("tabs separate its columns"),
        _ => {}
    }
    let is_empty = |column: &Vec<String>| column.iter().all(String::is_empty);
    while names.len() > 1 && names.last().is_some_and(String::is_empty) && fields.last().is_some_and(is_empty)
    {
        names.pop();
        fields.pop();
        done.push("the empty column at the end was left out");
    }
    let is_index = |column: &Vec<String>| column.iter().all(|field| field.parse::<i64>().is_ok());
    if names.len() > 1 && names[0].is_empty() && is_index(&fields[0]) {
        names.remove(0);
        fields.remove(0);
        done.push("the first column, an index without a name, was left out");
    }
    done.dedup();
    if !done.is_empty() {
        log::info!("{}: {}", path.display(), done.join("; "));
    }
    match names.iter().position(String::is_empty) {
        Some(i) => Err(Error::table(path, "header", format!("column {} has no name", i + 1))),
        None => Ok((names, fields, line_of_row)),
    }
}
