//! What a table's file says beside the table: attributes of HDF5, keywords of FITS, comments of CSV.

use std::path::Path;

use hdf5_reader::{Attribute, Dataset};

use super::fits_file as fits;
use super::hdf5_reading as reading;
use super::input_file;
use super::table_file::Format;
use crate::error::{Error, FileFault, Result};

/// The number of that name that the file of a table states, if it does; lower and upper case and `_` are the same.
///
/// # Errors
/// Files that cannot be read; several numbers of that name, or something else under it.
pub(in crate::io) fn stated_number(path: &Path, group: &str, name: &str) -> Result<Option<f64>> {
    let found = match Format::of(path)? {
        Format::Csv => in_comments(&String::from_utf8_lossy(&input_file::read(path)?), name),
        Format::Hdf5 => in_attributes(path, group, name)?,
        Format::Fits => in_keywords(path, name)?,
    };
    let Some(first) = found.first().copied() else { return Ok(None) };
    match found.iter().find(|other| **other != first) {
        None => Ok(Some(first)),
        Some(other) => {
            let problem = format!("says {name} = {first} and {name} = {other}; leave out the wrong one");
            Err(Error::file(FileFault::Content, path, problem))
        }
    }
}

fn is_called(own: &str, name: &str) -> bool {
    let letters = |text: &str| text.to_ascii_lowercase().replace('_', "");
    letters(own) == letters(name)
}

/// `# z_source = 1.5` or, in the YAML of ECSV, `# - {z_source: 1.5}`.
fn in_comments(text: &str, name: &str) -> Vec<f64> {
    let comments = text.lines().map(str::trim).take_while(|line| line.is_empty() || line.starts_with('#'));
    let value = |comment: &str| {
        let (before, after) = comment.split_once(['=', ':'])?;
        let own = before.trim_matches(|c: char| !c.is_alphanumeric());
        let number = after.trim_matches(|c: char| c.is_whitespace() || c == '}');
        is_called(own, name).then(|| number.parse().ok()).flatten()
    };
    comments.filter_map(value).collect()
}

fn in_attributes(path: &Path, group: &str, name: &str) -> Result<Vec<f64>> {
    let file = reading::open(path)?;
    let root = file.root_group().map_err(|error| reading::damaged(path, &error))?;
    let (groups, datasets) = reading::members(path, &root)?;
    let mut attributes: Vec<Attribute> = Vec::new();
    for holder in std::iter::once(&root).chain(groups.iter().filter(|own| own.name() == group)) {
        attributes.extend(holder.attributes().map_err(|error| reading::damaged(path, &error))?);
    }
    let records = datasets.iter().filter(|own| own.name() == group);
    attributes.extend(records.flat_map(Dataset::attributes));
    let number = |attribute: &Attribute| {
        attribute.read_as_f64().map_err(|_| {
            let problem = format!("the attribute {} is no number", attribute.name);
            Error::file(FileFault::Content, path, problem)
        })
    };
    attributes.iter().filter(|attribute| is_called(&attribute.name, name)).map(number).collect()
}

fn in_keywords(path: &Path, name: &str) -> Result<Vec<f64>> {
    let mut found = Vec::new();
    for unit in &fits::read(path)? {
        for card in unit.header.iter().filter(|card| is_called(&card.name, name)) {
            found.extend(fits::number(path, &unit.header, &card.name)?);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use fitskit::{Hdu, HeaderValue};

    use super::*;

    #[test]
    fn every_format_may_state_a_number_beside_its_table() {
        let folder = tempfile::tempdir().unwrap();
        let [csv, h5, image] = ["t.csv", "t.h5", "t.fits"].map(|name| folder.path().join(name));
        let of = |path: &Path| stated_number(path, "haloes", "z_source").unwrap();

        std::fs::write(&csv, "# by hand\n# Z_source = 2.5\nz,z_source\n0.5,3\n").unwrap();
        assert_eq!(of(&csv), Some(2.5));
        std::fs::write(&csv, "# %ECSV 1.0\n# ---\n# meta: !!omap\n# - {z_source: 1.25}\nz\n0.5\n").unwrap();
        assert_eq!(of(&csv), Some(1.25));
        std::fs::write(&csv, "# the z_source is not known\nz\n0.5\n").unwrap();
        assert_eq!(of(&csv), None);

        let file = hdf5::File::create(&h5).unwrap();
        let haloes = file.create_group("haloes").unwrap();
        haloes.new_attr::<f64>().create("z_source").unwrap().write_scalar(&1.5).unwrap();
        drop((haloes, file));
        assert_eq!(of(&h5), Some(1.5));

        let mut primary = Hdu::primary_empty();
        primary.header.set("ZSOURCE", HeaderValue::Float(2.0), None);
        fits::write(&image, vec![primary]).unwrap();
        assert_eq!(of(&image), Some(2.0));
    }

    #[test]
    fn of_two_numbers_none_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, "# z_source: 2\n# z_source: 3\nz\n0.5\n").unwrap();
        let error = stated_number(&path, "haloes", "z_source").unwrap_err();
        assert!(
            error.is_bad_input() && error.to_string().contains("z_source = 2 and z_source = 3"),
            "{error}"
        );
    }
}
