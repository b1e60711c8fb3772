//! Tables of a mock catalogue: every drawn parameter, and the truths that a study of fits compares with.

use std::path::{Path, PathBuf};

use crate::error::{Result, TableKind};
use crate::io::containers::{Column, Table, Values};
use crate::mock::{MockSystem, Perturber};

/// HDF5 group and FITS extension of catalogues.
pub const CATALOGUE_GROUP: &str = "catalogue";

/// The most perturbers a system has.
const PERTURBERS: usize = 3;

/// One row a system, one column a parameter; `images` and `qualities` where images were made. Perturbers that a system
/// does not have are zeros.
///
/// # Errors
/// Never for lists of equal length.
pub fn catalogue_table(systems: &[MockSystem], images: Option<(&[String], &[f64])>) -> Result<Table> {
    let mut columns = Vec::new();
    if let Some((names, qualities)) = images {
        columns.push(Column::text("image", names.to_vec()));
        columns.push(Column::f64("quality", None, qualities.to_vec()));
    }
    let row = |system: &MockSystem| {
        let perturbers = (0..PERTURBERS)
            .flat_map(|i| Perturber::columns(system.perturbers.get(i), &format!("perturber{}", i + 1)));
        system.columns().into_iter().chain(perturbers).collect::<Vec<_>>()
    };
    let rows: Vec<_> = systems.iter().map(row).collect();
    for (i, (name, unit, _)) in rows.first().into_iter().flatten().enumerate() {
        columns.push(Column::f64(name, *unit, rows.iter().map(|row| row[i].2).collect()));
    }
    Table::new(columns)
}

/// One row an image: its file, its quality, and the true values of the fitted parameters under their names.
///
/// # Errors
/// Never for lists of equal length.
pub fn truth_table(systems: &[MockSystem], images: &[String], qualities: &[f64]) -> Result<Table> {
    let rows: Vec<Vec<(String, f64)>> = systems.iter().map(MockSystem::truths).collect();
    let mut columns =
        vec![Column::text("image", images.to_vec()), Column::f64("quality", None, qualities.to_vec())];
    for (i, (name, _)) in rows.first().into_iter().flatten().enumerate() {
        columns.push(Column::f64(name, None, rows.iter().map(|row| row[i].1).collect()));
    }
    Table::new(columns)
}

/// What is known of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueShear {
    /// Its file, relative to the table.
    pub image: String,
    /// (γ1, γ2) of the line of sight.
    pub gamma_los: [f64; 2],
    /// Q.
    pub quality: Option<f64>,
}

/// Reads a truth table: columns `image`, `gamma1_los`, `gamma2_los`, optionally `quality`; others are of no concern.
///
/// # Errors
/// Those of [`Table::read`]; columns that are missing, images that are named twice.
pub fn read_truth_table(path: &Path) -> Result<Vec<TrueShear>> {
    read(path).map_err(|error| error.in_table(TableKind::Truth))
}

fn read(path: &Path) -> Result<Vec<TrueShear>> {
    let table = Table::read(path, CATALOGUE_GROUP)?.in_own_units(&["gamma1_los", "gamma2_los", "quality"])?;
    let (gamma1, gamma2) = (table.required_f64("gamma1_los")?, table.required_f64("gamma2_los")?);
    let quality = table.optional_f64("quality")?;
    let images: Vec<String> = match table.column("image").map(|column| &column.values) {
        Some(Values::Text(names)) => names.clone(),
        Some(Values::F64(numbers)) => numbers.iter().map(f64::to_string).collect(),
        None => {
            return Err(table.fault("column image", "is missing; it names the FITS file of each row"));
        }
    };
    // `./a.fits` is `a.fits`.
    let file = |image: &String| Path::new(".").join(image).components().skip(1).collect::<PathBuf>();
    let files: Vec<PathBuf> = images.iter().map(file).collect();
    for (row, image) in images.iter().enumerate() {
        if files[..row].contains(&files[row]) {
            let problem = format!("{image:?} stands in an earlier row too");
            return Err(table.fault_in_row(row, "image", problem));
        }
    }
    let rows = images.into_iter().enumerate();
    Ok(rows
        .map(|(i, image)| TrueShear {
            image,
            gamma_los: [gamma1[i], gamma2[i]],
            quality: quality.map(|q| q[i]),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Provenance;
    use crate::mock::Protocol;

    #[test]
    fn truths_are_read_back_to_the_bit() {
        let systems = MockSystem::draw_all(&Protocol::paper(), 3, 4, 0.08).unwrap();
        let names: Vec<String> = (0..4).map(|i| format!("images/{i}.fits")).collect();
        let folder = tempfile::tempdir().unwrap();
        for file in ["truth.csv", "truth.h5"] {
            let path = folder.path().join(file);
            let table = truth_table(&systems, &names, &[1.0, 2.0, 3.0, 4.0]).unwrap();
            table.write(&path, CATALOGUE_GROUP, &Provenance::new(Some(3), "")).unwrap();
            let back = read_truth_table(&path).unwrap();
            for (truth, system) in back.iter().zip(&systems) {
                let los = system.line_of_sight_distortion().gamma;
                assert_eq!(truth.gamma_los, [los.re, los.im]);
            }
            assert_eq!((back[2].image.as_str(), back[2].quality), ("images/2.fits", Some(3.0)));
        }
    }

    #[test]
    fn a_table_that_names_no_images_or_one_twice_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("truth.csv");
        for (text, word) in [
            ("gamma1_los,gamma2_los\n0,0\n", "image"),
            ("image,gamma1_los\na,0\n", "gamma2_los"),
            ("image,gamma1_los,gamma2_los\na,0,0\na,0,0\n", "earlier"),
            ("image,gamma1_los,gamma2_los\na,0,0\n./a,0,0\n", "earlier"),
        ] {
            std::fs::write(&path, text).unwrap();
            let message = read_truth_table(&path).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
