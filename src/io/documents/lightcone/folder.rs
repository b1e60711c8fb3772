//! The folder of sightlines that were taken from a light cone: an index, and a halo table for each.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::error::{Error, FileFault, Result};
use crate::halo::lightcone::{ConeHaloes, ConeSightline};
use crate::io::containers::{Column, Provenance, Staging, Table};
use crate::io::documents::HALOES_GROUP;
use crate::monitor::Monitor;

/// The index of a folder of sightlines.
pub const CONE_INDEX_FILE: &str = "sightlines.csv";

/// Group of the index, were it HDF5.
const INDEX_GROUP: &str = "sightlines";

/// The halo table of a sightline inside its folder.
fn file_of(number: u64) -> PathBuf {
    PathBuf::from(format!("haloes/{number:05}.h5"))
}

/// Stages the index and the halo tables, each with `provenance`.
///
/// # Errors
/// [`Error::Write`]; when cancelled.
pub fn write_cone(
    sightlines: &[ConeSightline],
    staging: &Staging,
    provenance: &Provenance,
    monitor: &dyn Monitor,
) -> Result<()> {
    let task = monitor.task("halo tables", Some(sightlines.len() as u64));
    for sightline in sightlines {
        task.check()?;
        staging.write(file_of(sightline.number), |path| {
            haloes_table(&sightline.haloes)?.write_staged_hdf5(path, HALOES_GROUP, provenance)
        })?;
        task.advance(1);
    }
    staging.write(CONE_INDEX_FILE, |path| index_table(sightlines)?.write(path, INDEX_GROUP, provenance))
}

fn haloes_table(haloes: &ConeHaloes) -> Result<Table> {
    Table::new(vec![
        Column::f64("z", None, haloes.z.clone()),
        Column::f64("theta_x_arcsec", Some("arcsec"), haloes.theta_x_arcsec.clone()),
        Column::f64("theta_y_arcsec", Some("arcsec"), haloes.theta_y_arcsec.clone()),
        Column::f64("m200c_msun", Some("solMass"), haloes.m200c_msun.clone()),
        Column::f64("c200c", None, haloes.c200c.clone()),
        Column::f64("lightcone_row", None, haloes.row.iter().map(|&row| row as f64).collect()),
    ])
}

fn index_table(sightlines: &[ConeSightline]) -> Result<Table> {
    let column = |name: &str, unit: Option<&str>, of: &dyn Fn(&ConeSightline) -> f64| {
        Column::f64(name, unit, sightlines.iter().map(of).collect())
    };
    let mut columns = vec![
        column("number", None, &|s| s.number as f64),
        column("ra_deg", Some("deg"), &|s| s.direction.ra_deg),
        column("dec_deg", Some("deg"), &|s| s.direction.dec_deg),
        column("number_of_haloes", None, &|s| s.haloes.len() as f64),
    ];
    if sightlines.iter().any(|sightline| sightline.lens_halo.is_some()) {
        let of_lens = |of: fn(&crate::halo::lightcone::LensHalo) -> f64| {
            move |s: &ConeSightline| s.lens_halo.as_ref().map_or(f64::NAN, of)
        };
        columns.push(column("lens_halo_row", None, &of_lens(|halo| halo.row as f64)));
        columns.push(column("lens_halo_z", None, &of_lens(|halo| halo.z)));
        columns.push(column("lens_halo_m200c_msun", Some("solMass"), &of_lens(|halo| halo.m200c_msun)));
    }
    let files = sightlines.iter().map(|s| file_of(s.number).to_string_lossy().into_owned()).collect();
    columns.push(Column::text("file", files));
    Table::new(columns)
}

/// How many haloes the sightlines of a folder have, by number; each of `numbers` must be there.
pub(super) fn counts(folder: &Path, numbers: &[u64]) -> Result<BTreeMap<u64, u64>> {
    let index = folder.join(CONE_INDEX_FILE);
    if !index.is_file() {
        let problem =
            format!("holds no {CONE_INDEX_FILE}: a folder made by `haloray extract` is wanted, or files");
        return Err(Error::file(FileFault::Content, folder, problem));
    }
    let table = Table::read(&index, INDEX_GROUP)?;
    let (there, haloes) = (table.required_f64("number")?, table.required_f64("number_of_haloes")?);
    let counts: BTreeMap<u64, u64> =
        there.iter().zip(haloes).map(|(number, count)| (*number as u64, *count as u64)).collect();
    match numbers.iter().find(|number| !counts.contains_key(number)) {
        None => Ok(counts),
        Some(number) => {
            let range =
                format!("{} sightlines from {} on", there.len(), there.first().copied().unwrap_or(0.0));
            let problem = format!("has no sightline {number}; it holds {range}");
            Err(Error::file(FileFault::Content, folder, problem))
        }
    }
}

/// The haloes of a sightline of a folder.
pub(super) fn read_sightline(folder: &Path, number: u64) -> Result<ConeHaloes> {
    let path = folder.join(file_of(number));
    let table = Table::read(&path, HALOES_GROUP)?;
    let column = |name: &str| table.required_f64(name).map(<[f64]>::to_vec);
    Ok(ConeHaloes {
        row: column("lightcone_row")?.into_iter().map(|row| row as u64).collect(),
        z: column("z")?,
        theta_x_arcsec: column("theta_x_arcsec")?,
        theta_y_arcsec: column("theta_y_arcsec")?,
        m200c_msun: column("m200c_msun")?,
        c200c: column("c200c")?,
    })
}
