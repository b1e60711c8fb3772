//! A table of lenses whose lines of sight are wanted: redshifts, perhaps Einstein radii and names.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Domain, Result};
use crate::io::containers::{Column, Table, Values};

/// HDF5 group and FITS extension of lenses.
pub const LENSES_GROUP: &str = "lenses";

/// One lens of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TabledLens {
    /// Its name; its number, from 1, where the table has no names.
    pub name: String,
    /// Redshift.
    pub z_lens: f64,
    /// Redshift of its source.
    pub z_source: f64,
    /// Einstein radius; the configuration's where the table has none.
    pub einstein_radius_arcsec: Option<f64>,
}

/// Reads columns `z_lens`, `z_source`, optionally `einstein_radius_arcsec` and `name`; others are of no concern.
///
/// # Errors
/// Those of [`Table::read`]; missing columns, names that stand there twice, redshifts that are not
/// 0 < z_lens < z_source ≤ 20.
pub fn read_lenses(path: &Path) -> Result<Vec<TabledLens>> {
    const RADIUS: &str = "einstein_radius_arcsec";
    let table = Table::read(path, LENSES_GROUP)?.in_own_units(&["z_lens", "z_source", RADIUS])?;
    let (z_lens, z_source) = (table.required_f64("z_lens")?, table.required_f64("z_source")?);
    let radius = table.optional_f64(RADIUS)?;
    let known = ["name", "z_lens", "z_source", RADIUS];
    let names = table.columns().iter().map(|column| column.name.as_str());
    let unused: Vec<&str> =
        names.filter(|name| !known.iter().any(|own| own.eq_ignore_ascii_case(name))).collect();
    if !unused.is_empty() {
        log::warn!(
            "{}: columns that are not used: {}; known are {}",
            path.display(),
            unused.join(", "),
            known.join(", ")
        );
    }
    let name = |row: usize| match table.column("name").map(|column| &column.values) {
        Some(Values::Text(names)) => names[row].clone(),
        Some(Values::F64(numbers)) => numbers[row].to_string(),
        None => (row + 1).to_string(),
    };
    let lens = |row: usize| {
        let checked = |column: &str, value: f64, domain: Domain| match domain.contains(value) {
            true => Ok(value),
            false => Err(table.fault_in_row(row, column, format!("is {value}, but must be {domain}"))),
        };
        let z_source = checked("z_source", z_source[row], Domain::above_to(0.0, 20.0))?;
        let radius =
            radius.map(|radius| checked(RADIUS, radius[row], Domain::from_to(0.0, 60.0))).transpose()?;
        Ok(TabledLens {
            name: name(row),
            z_lens: checked("z_lens", z_lens[row], Domain::inside(0.0, z_source))?,
            z_source,
            einstein_radius_arcsec: radius,
        })
    };
    let lenses = (0..table.row_count()).map(lens).collect::<Result<Vec<_>>>()?;
    for (row, TabledLens { name, .. }) in lenses.iter().enumerate() {
        if let Some(earlier) = lenses[..row].iter().position(|lens| lens.name == *name) {
            let problem =
                format!("{name:?} stands in {} too; give every lens its own name", table.place_of(earlier));
            return Err(table.fault_in_row(row, "name", problem));
        }
    }
    Ok(lenses)
}

/// The columns of a table of lenses; a radius that is missing is no number.
pub(super) fn lens_columns(lenses: &[TabledLens]) -> Vec<Column> {
    let column = |name: &str, unit: Option<&str>, of: fn(&TabledLens) -> f64| {
        Column::f64(name, unit, lenses.iter().map(of).collect())
    };
    vec![
        Column::text("name", lenses.iter().map(|lens| lens.name.clone()).collect()),
        column("z_lens", None, |lens| lens.z_lens),
        column("z_source", None, |lens| lens.z_source),
        column("einstein_radius_arcsec", Some("arcsec"), |lens| {
            lens.einstein_radius_arcsec.unwrap_or(f64::NAN)
        }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<TabledLens>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lenses.csv");
        std::fs::write(&path, text).unwrap();
        read_lenses(&path)
    }

    #[test]
    fn lenses_are_read_and_those_behind_their_sources_refused() {
        let lenses =
            read("name,z_lens,z_source,einstein_radius_arcsec\nB1608,0.63,1.394,0.8\nJ,0.3,0.7,1.2\n");
        let first = TabledLens {
            name: "B1608".into(),
            z_lens: 0.63,
            z_source: 1.394,
            einstein_radius_arcsec: Some(0.8),
        };
        assert_eq!(lenses.unwrap()[0], first);
        let plain = read("z_lens,z_source\n0.5,1.5\n").unwrap();
        assert_eq!((plain[0].name.as_str(), plain[0].einstein_radius_arcsec), ("1", None));
        let error = read("z_lens,z_source\n0.5,1.5\n0.9,0.7\n").unwrap_err();
        assert!(error.is_bad_input());
        let text = error.to_string();
        assert!(text.contains("line 3, column z_lens: is 0.9, but must be"), "{text}");
        let text = read("name,z_lens,z_source\nA,0.5,1.5\nB,0.5,1.5\nA,0.6,2\n").unwrap_err().to_string();
        assert!(text.contains("line 4, column name: \"A\" stands in line 2 too"), "{text}");
    }
}
