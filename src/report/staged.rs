//! Texts, JSON, figures and results of a study, staged beside the other files of a folder.

use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use serde::Serialize;

use super::number_text::true_minus;
use crate::error::{Error, Result};
use crate::io::{FigureFiles, Staging};
use crate::plot::{Figure, Style};

/// Stages a text file.
///
/// # Errors
/// [`Error::Write`] when the disk is full.
pub fn stage_text(staging: &Staging, name: &str, text: &str) -> Result<()> {
    staging.write(name, |path| std::fs::write(path, text).map_err(|error| Error::write(path, error)))
}

/// Stages a value as JSON.
///
/// # Errors
/// [`Error::Write`] when the disk is full.
pub fn stage_json(staging: &Staging, name: &str, value: &impl Serialize) -> Result<()> {
    let json =
        serde_json::to_string_pretty(value).map_err(|error| Error::write(&staging.path(name), error))?;
    stage_text(staging, name, &(json + "\n"))
}

/// Makes a figure, or none where there is nothing to show.
pub type Drawing<'a> = Box<dyn Fn() -> Result<Option<Figure>> + Send + Sync + 'a>;

/// Stages of `NAME.svg`, `NAME.png` and `NAME.pdf` those that are wanted, for each name and its drawing, on all cores.
/// What cannot be drawn is left out, and the staging folder remembers why: numbers are worth more than their picture.
///
/// # Errors
/// [`Error::OutOfRange`] for a name that leaves the folder.
pub fn stage_figures(staging: &Staging, figures: Vec<(String, Drawing)>) -> Result<()> {
    let drawn = figures.into_par_iter().map(|(name, draw)| try_figure(staging, &name, draw));
    let complaints = drawn.collect::<Result<Vec<_>>>()?;
    complaints.into_iter().flatten().for_each(|complaint| staging.complain(complaint));
    Ok(())
}

/// [`stage_figures`] for one.
///
/// # Errors
/// [`Error::OutOfRange`] for a name that leaves the folder.
pub fn stage_figure(
    staging: &Staging,
    name: &str,
    draw: impl FnOnce() -> Result<Option<Figure>>,
) -> Result<()> {
    try_figure(staging, name, draw)?.into_iter().for_each(|complaint| staging.complain(complaint));
    Ok(())
}

/// Stages a figure; what it cannot do, in words.
fn try_figure(
    staging: &Staging,
    name: &str,
    draw: impl FnOnce() -> Result<Option<Figure>>,
) -> Result<Option<String>> {
    let FigureFiles { extensions, style } = staging.figures();
    if extensions.is_empty() {
        return Ok(None);
    }
    let (style, svg) = (Style::named(style), format!("{name}.svg"));
    let drawn = catch_unwind(AssertUnwindSafe(|| match draw()? {
        None => Ok(()),
        Some(figure) => {
            staging.write(&svg, |path| figure.save_as(&path.with_extension(""), extensions, style).map(drop))
        }
    }));
    let why = match drawn {
        Ok(Ok(())) => return Ok(None),
        Ok(Err(error @ (Error::OutOfRange { .. } | Error::Cancelled))) => return Err(error),
        Ok(Err(error)) => error.to_string(),
        Err(_) => "drawing it failed".into(),
    };
    let files = extensions.iter().map(|extension| staging.path(format!("{name}.{extension}")));
    files.for_each(|file| drop(std::fs::remove_file(file)));
    Ok(Some(format!("there is no figure {name}: {why}")))
}

/// The result of a study in Markdown, for its page in `docs/`: tables, then figures by name with what they show.
pub fn result_text(tables: &str, figures: &[(&str, &str)]) -> String {
    let links = figures.iter().map(|(name, shows)| format!("\n![{shows}]({name}.png)\n"));
    tables.to_owned() + &links.collect::<String>()
}

/// A table in Markdown whose columns stand below each other, with true minus signs.
pub fn markdown_table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: Vec<String> = head.iter().map(|name| name.to_string()).collect();
    let rows: Vec<Vec<String>> =
        rows.iter().map(|line| line.iter().map(|cell| true_minus(cell)).collect()).collect();
    let width = |column: usize| {
        let cells = [&head].into_iter().chain(&rows).filter_map(|line| line.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |cells: &Vec<String>| {
        let padded = cells.iter().zip(&widths).map(|(cell, width)| format!(" {cell:<width$} |"));
        format!("|{}\n", padded.collect::<String>())
    };
    let rule: String = widths.iter().map(|width| format!("{:-<1$}|", "", width + 2)).collect();
    format!("{}|{rule}\n{}", line(&head), rows.iter().map(line).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_below_each_other() {
        let rows =
            [vec!["κ".to_string(), "-.1".to_string()], vec!["γ".to_string(), "-0.1 ± 0.2".to_string()]];
        let table = markdown_table(&["what", "x"], &rows);
        let lines = [
            "| what | x          |",
            "|------|------------|",
            "| κ    | -.1        |",
            "| γ    | −0.1 ± 0.2 |",
        ];
        assert_eq!(table, lines.join("\n") + "\n");
    }
}
