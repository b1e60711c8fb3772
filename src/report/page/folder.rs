//! From the folder of a run to the model of its page: whatever documents are there are read, whatever was run.

use std::collections::BTreeMap;
use std::path::Path;

use super::citations::citations;
use super::figures::figures;
use super::glossary::terms;
use super::grids::grids;
use super::model::{Page, Term};
use super::numbers::Numbers;
use super::posterior::posterior;
use super::record::{PAGE_FILE, RECORD_FILE, RunRecord};
use super::render::words_of;
use super::tables::{of_csv, of_markdown};
use crate::error::{Error, FileFault, Result};
use crate::io::{Table, files_of_run, read_text};

/// Tables of files that are shown; `catalogue.csv` and `curves.csv` are for programs.
const NOT_SHOWN: [&str; 2] = ["catalogue.csv", "curves.csv"];

/// A table of more rows is folded.
const MOST_ROWS_OPEN: usize = 40;

/// What the files of a folder are.
const FILES: [(&str, &str); 31] = [
    ("run.h5", "everything: haloes, maps, images, diagnostics"),
    ("maps.h5", "the maps"),
    ("sightlines.h5", "one row a sightline; xarray.open_dataset(…, group=\"sightlines\") opens it"),
    ("summary.json", "the numbers of this page"),
    ("report.json", "what was run, for this page"),
    ("config.toml", "the resolved configuration; feed it back to repeat the run"),
    ("model.toml", "the model as it was fitted"),
    ("posterior.nc", "every draw that counts; arviz.from_netcdf opens it"),
    ("reconstruction.h5", "data, best fit and residual"),
    ("timings.json", "how long it took"),
    ("result.md", "tables and figures in Markdown"),
    ("table.md", "the paper's Table 2 beside the paper's numbers"),
    ("scores.json", "scores of every model"),
    ("fits.csv", "one row a fit"),
    ("recovered_shears.csv", "expected and recovered shears"),
    ("residuals.csv", "one row a sightline"),
    ("cut.csv", "one row a cut"),
    ("haloes.csv", "one row a choice"),
    ("which_shear.csv", "one row a sightline"),
    ("expected.csv", "one row a lens and average"),
    ("validity.csv", "one row a fit: sightline, case, haloes seen, image, model, start"),
    ("validity.h5", "the same in HDF5"),
    ("ranks.csv", "one row a fit"),
    ("catalogue.csv", "every drawn parameter, one row a system"),
    ("catalogue.h5", "the same in HDF5"),
    ("image.fits", "the image with noise"),
    ("image_noise_free.fits", "the image before noise"),
    ("curves.csv", "critical curves and caustics, vertex by vertex"),
    ("truth.csv", "true γ_LOS and quality of each image"),
    ("images", "FITS images"),
    ("figures", "the figures as files"),
];

/// Reads a folder.
///
/// # Errors
/// [`Error::File`] when nothing in it is of a run.
pub(super) fn read(folder: &Path) -> Result<Page> {
    let files: Vec<String> =
        files_of_run(folder)?.into_iter().filter(|file| file.rsplit('/').next() != Some(PAGE_FILE)).collect();
    let has = |name: &str| files.iter().any(|file| file == name);
    if ![RECORD_FILE, "summary.json", "run.h5", "result.md"].into_iter().any(has) {
        let problem = "holds no results of haloray";
        return Err(Error::file(FileFault::Content, folder, problem));
    }
    let mut is_imaged = true;
    let mut page = Page { title: "haloray".into(), grids: grids(folder, &files), ..Page::default() };
    if has(RECORD_FILE) {
        let record = RunRecord::read(folder)?;
        page.title = format!("haloray {}", record.command);
        page.about = record.about;
        page.repeat = record.repeat;
        page.warnings = record.warnings;
        page.versions =
            vec![["haloray".into(), record.version], ["git revision".into(), record.git_revision]];
        page.versions.extend(record.seed.map(|seed| ["seed".into(), seed.to_string()]));
        page.configuration = record.configuration;
        is_imaged = record.makes_images;
    } else if has("config.toml") {
        page.configuration = read_text(&folder.join("config.toml"))?;
    }
    if is_imaged {
        page.warnings.extend(of_configuration(&page.configuration));
    }
    if has("summary.json") {
        let numbers = numbers(folder)?;
        page.facts = numbers.facts;
        page.tables = numbers.tables;
        page.warnings.extend(numbers.warnings);
    }
    if has("result.md") {
        let (paragraphs, tables) = of_markdown(&read_text(&folder.join("result.md"))?);
        page.paragraphs = paragraphs;
        page.tables.splice(0..0, tables);
    }
    for file in files.iter().filter(|file| file.ends_with(".csv") && !NOT_SHOWN.contains(&file.as_str())) {
        if let Some((shown, table)) = of_csv(folder, file).filter(|_| !file.contains('/')) {
            page.warnings.extend(of_table(file, &table));
            page.tables.push(shown);
        }
    }
    // Where a table is all there is to read, it is open.
    if let [only] = page.tables.as_mut_slice()
        && page.facts.is_empty()
    {
        only.is_folded = only.rows.len() > MOST_ROWS_OPEN;
    }
    page.posterior = posterior(folder);
    let left_out;
    (page.figures, left_out) = figures(folder, &files);
    if !left_out.is_empty() {
        page.figures_left_out = format!("Too large for this page: {}.", left_out.join(", "));
    }
    for part in files.iter().filter_map(|file| file.strip_suffix(&format!("/{RECORD_FILE}"))) {
        let part_folder = folder.join(part);
        let doubts = numbers(&part_folder).map_or(0, |numbers| numbers.warnings.len());
        let told = match doubts {
            0 => String::new(),
            1 => " (1 warning)".into(),
            many => format!(" ({many} warnings)"),
        };
        page.parts.push([part.into(), format!("{}{told}", part.replace('_', " "))]);
    }
    page.files = listed(&files);
    page.citations = citations(&page.configuration);
    page.glossary = used(&page);
    Ok(page)
}

fn numbers(folder: &Path) -> Result<Numbers> {
    let path = folder.join("summary.json");
    let value = serde_json::from_str(&read_text(&path)?);
    let value = value.map_err(|e| Error::file(FileFault::Content, &path, format!("is no JSON: {e}")))?;
    Ok(Numbers::of(&value))
}

/// What the choices of a configuration cost.
fn of_configuration(toml: &str) -> Option<String> {
    let image = toml.parse::<toml::Table>().ok()?.get("image")?.get("pixel_sampling")?.as_str()? == "point";
    image.then(|| {
        "One point stands for each pixel, as in the paper; of steep sources that misplaces flux by more than the noise. \
         image.pixel_sampling = \"adaptive\" integrates them."
            .into()
    })
}

/// What the rows of a study say against it.
fn of_table(file: &str, table: &Table) -> Vec<String> {
    let column = |name: &str| table.optional_f64(name).ok().flatten().unwrap_or_default();
    let mut warnings = Vec::new();
    let converged = column("converged");
    let missing = converged.iter().filter(|is| **is == 0.0).count();
    if missing > 0 {
        warnings.push(format!("{file}: {missing} of {} fits have not converged.", converged.len()));
    }
    let missed = column("missed_by").iter().filter(|by| **by > 0.0).count();
    if missed > 0 {
        warnings.push(format!("{file}: {missed} fits ended below a climb from the truth."));
    }
    // The last cut is what the others are compared with.
    if let [.., last_but_one, _] = column("image_chi2")
        && *last_but_one > 1.0
    {
        let chi2 = crate::report::number_text(*last_but_one, 3);
        warnings.push(format!(
            "The cut has not converged: the last step changes the image by χ² = {chi2}; a lower cut would change it further."
        ));
    }
    warnings
}

/// Files, folders as one entry, with what they are.
fn listed(files: &[String]) -> Vec<[String; 2]> {
    let mut entries: BTreeMap<&str, usize> = BTreeMap::new();
    for file in files {
        *entries.entry(file.split('/').next().unwrap_or(file)).or_default() += 1;
    }
    let entry = |(name, count): (&str, usize)| {
        let is_folder = !files.iter().any(|file| file == name);
        let told = FILES.iter().find(|(own, _)| *own == name).map(|(_, told)| *told);
        let told = told.unwrap_or(match name.rsplit('.').next() {
            Some("svg" | "png" | "pdf") => "a figure",
            Some("fits") => "an image",
            Some("toml") => "where the table beside it comes from",
            _ if is_folder => "a part of the run",
            _ => "",
        });
        let name = if is_folder { format!("{name}/ ({count} files)") } else { name.into() };
        [name, told.into()]
    };
    entries.into_iter().map(entry).collect()
}

/// The terms to which a label leads, and those whose name the page holds as a word.
fn used(page: &Page) -> Vec<Term> {
    let text = words_of(page);
    let is_used = |term: &Term| text.contains(&format!("\"{}\"", term.id)) || is_word_of(&term.name, &text);
    terms().into_iter().filter(is_used).collect()
}

fn is_word_of(name: &str, text: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(name).any(|(start, found)| {
        let before = text.get(..start).and_then(|text| text.chars().next_back());
        let after = text.get(start + found.len()..).and_then(|text| text.chars().next());
        !before.is_some_and(joins) && !after.is_some_and(joins)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_results_is_refused_and_one_with_a_result_is_a_page() {
        let folder = tempfile::tempdir().unwrap();
        let refused = read(folder.path()).unwrap_err();
        assert!(refused.to_string().contains("no results of haloray"), "{refused}");
        std::fs::write(
            folder.path().join("result.md"),
            "3 sightlines.\n\n| γ_LOS | R-hat |\n|--|--|\n| 1 | 2 |\n",
        )
        .unwrap();
        let page = read(folder.path()).unwrap();
        assert_eq!(
            (page.paragraphs.as_slice(), page.tables.len()),
            (["3 sightlines.".to_string()].as_slice(), 1)
        );
        let terms: Vec<&str> = page.glossary.iter().map(|term| term.name.as_str()).collect();
        assert_eq!(terms, ["R-hat"]);
    }

    #[test]
    fn a_cut_that_still_changes_the_image_is_warned_of() {
        let chi2 =
            |values: Vec<f64>| Table::new(vec![crate::io::Column::f64("image_chi2", None, values)]).unwrap();
        assert_eq!(of_table("cut.csv", &chi2(vec![9.0, 0.3, 0.0])).len(), 0);
        assert!(of_table("cut.csv", &chi2(vec![9.0, 1.3, 0.0]))[0].contains("has not converged"));
    }
}
