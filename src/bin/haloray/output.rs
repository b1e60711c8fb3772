//! Where a command that makes a folder, or on request one file of it, puts its results.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use haloray::error::FileFault;
use haloray::io::{Column, Replace, Staging, Table, Values, check_own, check_writable, plain_name};
use haloray::report::{PAGE_FILE, RunRecord, stage_page, stage_text};
use haloray::{Error, Result};

use crate::bars::Bars;

/// A folder of results, or the one file that stands for it.
pub enum Output {
    /// One file, written atomically.
    File(PathBuf),
    /// A staged folder.
    Folder(Staging),
}

/// A list of files ends about here.
const LINE_WIDTH: usize = 88;

/// Extensions of files; a folder is not meant by them.
const FILES: [&str; 10] = ["csv", "h5", "hdf5", "fits", "fit", "png", "svg", "pdf", "json", "toml"];

impl Output {
    /// Decides by the extension of `path`, and checks that it can be written before any work is done.
    pub fn begin(
        path: &Path,
        file_extensions: &[&str],
        inputs: &[Option<&Path>],
        names: &[&str],
        bars: &Bars,
    ) -> Result<Self> {
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if file_extensions.contains(&extension.as_str()) {
            check_writable(path)?;
            check_file(path, inputs, bars)?;
            return Ok(Self::File(path.into()));
        }
        if FILES.contains(&extension.as_str()) && !path.is_dir() {
            let problem = format!("-o takes a folder or a file ending in .{}", file_extensions.join(" or ."));
            return Err(Error::file(FileFault::UnknownFormat, path, problem));
        }
        Ok(Self::Folder(begin(path, names, bars)?))
    }
}

/// Refuses to replace one of the files that the command reads, and a user's own unless `--overwrite` is given.
pub fn check_file(output: &Path, inputs: &[Option<&Path>], bars: &Bars) -> Result<()> {
    check_not_an_input(output, inputs)?;
    if bars.overwrites() { Ok(()) } else { check_own(output) }
}

/// Refuses to replace one of the files that the command reads.
pub fn check_not_an_input(output: &Path, inputs: &[Option<&Path>]) -> Result<()> {
    let Ok(target) = output.canonicalize() else { return Ok(()) };
    if inputs.iter().flatten().any(|input| input.canonicalize().is_ok_and(|input| input == target)) {
        let source = io::Error::new(io::ErrorKind::AlreadyExists, "it is an input of this command");
        return Err(Error::OutputPlace { path: output.into(), source });
    }
    Ok(())
}

/// A staged folder for results of those names; a user's own files there are safe unless `--overwrite` is given.
pub fn begin(folder: &Path, names: &[&str], bars: &Bars) -> Result<Staging> {
    let figures = bars.figures();
    // A list has the names of SVGs and PNGs.
    let is_written = |name: &str| match name.rsplit_once('.') {
        Some((_, extension @ ("svg" | "png"))) => figures.extensions.contains(&extension),
        _ => true,
    };
    let is_pdf_written = figures.extensions.contains(&"pdf");
    let pdfs = names.iter().filter(|_| is_pdf_written).filter_map(|name| name.strip_suffix(".svg"));
    let pdfs: Vec<String> = pdfs.map(|stem| format!("{stem}.pdf")).collect();
    let names = names.iter().copied().filter(|name| is_written(name)).chain(pdfs.iter().map(String::as_str));
    let names: Vec<&str> = names.chain([PAGE_FILE, "report.json"]).collect();
    let replace = if bars.overwrites() { Replace::Any } else { Replace::Own };
    Ok(Staging::begin(folder, &names, replace)?.with_figures(figures))
}

/// Puts the results in their place, and warns of those that could not be made.
pub fn commit(staging: Staging) -> Result<Vec<PathBuf>> {
    staging.complaints().into_iter().for_each(crate::terminal::warn);
    staging.commit()
}

/// Stages the result of a study beside its other files, commits its folder and prints what there is.
pub fn finish_study(staging: Staging, result: &str, record: &RunRecord, bars: &Bars) -> Result<()> {
    stage_text(&staging, "result.md", result)?;
    stage_page(&staging, "", record)?;
    let files = commit(staging)?;
    if !bars.is_quiet() {
        // Pictures are for pages.
        let lines = result.trim_end().lines().filter(|line| !line.starts_with("!["));
        let told = lines.map(|line| format!("{line}\n")).collect::<String>();
        crate::terminal::print(&(told.trim_end().to_owned() + "\n"));
    }
    print_files(&files, bars)
}

/// Refuses two of one name, or of names that become one in the name of a file.
pub fn one_of_a_name<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen: BTreeMap<String, &str> = BTreeMap::new();
    for name in names {
        if let Some(other) = seen.insert(plain_name(name), name) {
            let allowed = format!(
                "unlike \"{other}\" in more than signs that no file name has: both would be one file"
            );
            return Err(Error::out_of_range(&format!("name of the {what}"), name, &allowed));
        }
    }
    Ok(())
}

/// Says in one line which files were written; for programs all that they hold in short.
///
/// # Errors
/// Where a program does not get its JSON.
pub fn print_files(files: &[PathBuf], bars: &Bars) -> Result<()> {
    if bars.is_json() {
        return crate::terminal::print_result(&format!("{:#}\n", json(files)));
    }
    if !bars.is_quiet() {
        crate::terminal::print(&listed(files));
    }
    Ok(())
}

/// One file by its path; several by their folder and as many names as a line holds, with folders in it as one entry.
fn listed(files: &[PathBuf]) -> String {
    let folder = common_folder(files);
    if let ([file], _) | ([file, ..], None) = (files, &folder) {
        return format!("{}\n", file.display());
    }
    let Some(folder) = folder else { return String::new() };
    let mut entries: Vec<(String, usize)> = Vec::new();
    for file in files {
        let inner = file.strip_prefix(&folder).unwrap_or(file);
        let mut parts = inner.components().map(|part| part.as_os_str().to_string_lossy().into_owned());
        let name = parts.next().unwrap_or_default() + if parts.next().is_some() { "/" } else { "" };
        match entries.last_mut().filter(|(last, _)| *last == name) {
            Some((_, count)) => *count += 1,
            None => entries.push((name, 1)),
        }
    }
    // The page first, then what holds numbers; last what says where a table comes from.
    let ends_with = |name: &str, ends: &[&str]| ends.iter().any(|end| name.ends_with(end));
    entries.sort_by_key(|(name, _)| match name.as_str() {
        PAGE_FILE => 0,
        name if ends_with(name, &[".h5", ".nc", ".csv", "summary.json", "/"]) => 1,
        name if ends_with(name, &[".provenance.toml", "report.json"]) => 3,
        _ => 2,
    });
    let entry = |(name, count): &(String, usize)| match name.ends_with('/') {
        true => format!("{name} ({count})"),
        false => name.clone(),
    };
    let mut line = format!("files in {}: ", folder.display());
    for (i, told) in entries.iter().map(entry).enumerate() {
        let left = entries.len() - i;
        if i > 0 && line.chars().count() + told.chars().count() > LINE_WIDTH {
            return format!("{line} and {left} more\n");
        }
        line += &if i > 0 { format!(", {told}") } else { told };
    }
    line + "\n"
}

/// The deepest folder that holds all files.
fn common_folder(files: &[PathBuf]) -> Option<PathBuf> {
    let shortest =
        files.iter().filter_map(|file| file.parent()).min_by_key(|folder| folder.components().count())?;
    let is_common = |folder: &&Path| files.iter().all(|file| file.starts_with(folder));
    shortest.ancestors().find(is_common).map(Path::to_path_buf)
}

/// Folder, files, and the contents of the summary, the scores and the tables among them.
fn json(files: &[PathBuf]) -> serde_json::Value {
    let folder = common_folder(files).unwrap_or_default();
    let top = |file: &&PathBuf| file.parent() == Some(&folder);
    let mut object = serde_json::json!({ "folder": folder, "files": files });
    for file in files.iter().filter(top) {
        let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let value = match file.extension().and_then(|extension| extension.to_str()) {
            Some("json") if stem == "summary" || stem == "scores" => {
                std::fs::read_to_string(file).ok().and_then(|text| serde_json::from_str(&text).ok())
            }
            Some("csv") => Table::read(file, "").ok().map(|table| columns(&table)),
            _ => None,
        };
        if let Some(value) = value {
            object[stem] = value;
        }
    }
    object
}

/// A table by its columns; JSON has no numbers that are none.
fn columns(table: &Table) -> serde_json::Value {
    let column = |column: &Column| {
        let values = match &column.values {
            Values::F64(values) => serde_json::json!(values),
            Values::Text(values) => serde_json::json!(values),
        };
        (column.name.clone(), values)
    };
    table.columns().iter().map(column).collect::<serde_json::Map<_, _>>().into()
}
