//! The tables of a run for its page: CSV files, and those of `result.md`.

use std::path::Path;

use super::model::{Cell, Label, PageTable};
use super::words::label;
use crate::io::{Table, Values};
use crate::report::{number_text, true_minus};

/// Significant digits in tables.
pub(super) const DIGITS: usize = 5;
/// More cells than these are left to the file.
const MOST_CELLS: usize = 8_000;

/// The table of a CSV file, folded as it may be long.
pub(super) fn of_csv(folder: &Path, file: &str) -> Option<(PageTable, Table)> {
    let table = Table::read(&folder.join(file), "").ok()?;
    let (columns, all) = (table.columns(), table.row_count());
    let rows = all.min(MOST_CELLS / columns.len().max(1));
    let cell = |row: usize, values: &Values| match values {
        Values::F64(values) => number_cell(values[row]),
        Values::Text(texts) => text_cell(&texts[row]),
    };
    let note = if rows < all { format!("The first {rows} of {all} rows.") } else { format!("{all} rows.") };
    let shown = PageTable {
        id: format!("table-{}", file.trim_end_matches(".csv")),
        title: file.into(),
        note,
        columns: columns.iter().map(|column| label(&column.name)).collect(),
        rows: (0..rows).map(|row| columns.iter().map(|c| cell(row, &c.values)).collect()).collect(),
        is_folded: true,
    };
    Some((shown, table))
}

/// A number as it is read and as it is sorted.
pub(super) fn number_cell(value: f64) -> Cell {
    // What is whole but for rounding is written whole, as its neighbours in the column are.
    let whole = value.round();
    let shown = if (value - whole).abs() < 1e-12 * whole.abs() { whole } else { value };
    let text = if value.is_nan() { "–".into() } else { number_text(shown, DIGITS) };
    Cell { text, value: value.is_finite().then_some(value), label: None }
}

/// A word.
pub(super) fn text_cell(text: &str) -> Cell {
    Cell { text: text.into(), value: None, label: None }
}

/// The name of a quantity.
pub(super) fn name_cell(name: &str) -> Cell {
    Cell { text: name.into(), value: None, label: Some(label(name)) }
}

/// Paragraphs and tables of a result in Markdown; its figures stand elsewhere.
pub(super) fn of_markdown(text: &str) -> (Vec<String>, Vec<PageTable>) {
    let (mut paragraphs, mut tables): (Vec<String>, Vec<PageTable>) = (Vec::new(), Vec::new());
    let mut inside = false;
    for line in text.lines().map(str::trim) {
        let Some(cells) = line.strip_prefix('|').and_then(|line| line.strip_suffix('|')) else {
            inside = false;
            if !line.is_empty() && !line.starts_with("![") {
                paragraphs.push(line.trim_start_matches('#').trim().into());
            }
            continue;
        };
        let cells: Vec<&str> = cells.split('|').map(str::trim).collect();
        if !inside {
            let id = format!("result-{}", tables.len() + 1);
            // A head without a word could not be pressed by its name.
            let text = |head: &str| if head.is_empty() { "quantity".to_owned() } else { head.to_owned() };
            let columns = cells.iter().map(|head| Label { text: text(head), ..Label::default() });
            // Several words above the first column say what the table is of.
            let title = match cells.first().filter(|head| head.contains(' ')) {
                Some(head) => capital(head),
                None if tables.is_empty() => "Result".into(),
                None => format!("Result, {}", tables.len() + 1),
            };
            tables.push(PageTable { id, title, columns: columns.collect(), ..PageTable::default() });
            inside = true;
        } else if let Some(table) = tables.last_mut()
            && !cells.iter().all(|cell| !cell.is_empty() && cell.chars().all(|c| "-: ".contains(c)))
        {
            let cell = |text: &&str| match is_name(text) {
                true => name_cell(text),
                false => Cell { value: leading_number(text), ..text_cell(&true_minus(text)) },
            };
            table.rows.push(cells.iter().map(cell).collect());
        }
    }
    (paragraphs, tables)
}

/// Words with their first letter large; Γ is not what γ is.
pub(super) fn capital(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(characters).collect()
}

/// Whether a word is the name of a quantity in files, such as `gamma1_los`.
fn is_name(text: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || "_.".contains(c);
    text.contains('_') && text.chars().all(is_letter)
}

/// The number that a cell begins with, however it is written.
fn leading_number(text: &str) -> Option<f64> {
    let text = text.replace(',', "").replace('−', "-");
    let word = text.split([' ', '%', '×']).next()?;
    let value: f64 = word.parse().ok().filter(|value: &f64| value.is_finite())?;
    let power = text.split_once("×10").map_or(0, |(_, raised)| {
        let digit = |c: char| match c {
            '⁻' => Some('-'),
            '¹' => Some('1'),
            '²' => Some('2'),
            '³' => Some('3'),
            '⁰' | '⁴'..='⁹' => char::from_digit(c as u32 - '⁰' as u32, 10),
            _ => None,
        };
        raised.chars().map_while(digit).collect::<String>().parse().unwrap_or(0)
    });
    Some(value * 10f64.powi(power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_letter_that_is_a_symbol_stays_as_it_is() {
        assert_eq!([capital("views"), capital("γ_LOS of"), capital("")], ["Views", "γ_LOS of", ""]);
    }

    #[test]
    fn a_result_gives_its_words_and_tables_and_leaves_its_figures() {
        let text = "100 sightlines.\n\n| what | x |\n|---|---:|\n| κ | −2.1×10⁻⁴ |\n| γ | 1,200 |\n\n![shows](cut.png)\n";
        let (paragraphs, tables) = of_markdown(text);
        assert_eq!(paragraphs, ["100 sightlines."]);
        let values: Vec<Option<f64>> = tables[0].rows.iter().map(|row| row[1].value).collect();
        assert_eq!((tables.len(), tables[0].columns[1].text.as_str()), (1, "x"));
        assert!((values[0].unwrap() + 2.1e-4).abs() < 1e-18 && values[1] == Some(1200.0), "{values:?}");
        assert_eq!(tables[0].rows[0][0].value, None);
        let (_, tables) = of_markdown("| | full |\n|---|---|\n| gamma1_los | -0.01, 68% in [-0.02, 0.1] |\n");
        let [name, value] = &tables[0].rows[0][..] else { panic!() };
        assert_eq!(tables[0].columns[0].text, "quantity");
        assert_eq!(name.label.as_ref().map(|label| label.sub.as_str()), Some("LOS"));
        assert_eq!((value.text.as_str(), value.value), ("−0.01, 68% in [−0.02, 0.1]", Some(-0.01)));
    }
}
