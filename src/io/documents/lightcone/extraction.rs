//! The sightlines of some numbers, taken from a light cone or from a folder of such.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::aim::Aim;
use super::reading::ConeFiles;
use super::{candidates, folder, gather};
use crate::config::{Config, LightconeConfig};
use crate::error::{Error, Result, TableKind};
use crate::halo::lightcone::{ConeHaloes, ConeSightline, Footprint};
use crate::halo::mass_doubt;
use crate::monitor::Monitor;
use crate::pipeline::ImportedSightlines;

/// What a light cone gave.
#[derive(Debug, Clone)]
pub struct ConeExtraction {
    /// The sightlines, by ascending number.
    pub sightlines: Vec<ConeSightline>,
    /// Where they may point.
    pub footprint: Footprint,
    /// Rows that were read.
    pub row_count: u64,
    /// Rows that were left out because of a value that no halo has.
    pub bad_row_count: u64,
}

/// Takes the sightlines of those numbers from the configured light cone, which is read in parts: memory holds what lies in
/// their cylinders. Cylinders have the configured comoving radius and end at `z_source`; with `haloes.cut_imported` the shear
/// cut is applied at once. A sightline is the same whichever are taken beside it.
///
/// # Errors
/// Columns or units that are not clear; values that no halo has, with their place; too few haloes to centre on; more haloes
/// than memory holds; when cancelled.
pub fn extract_cone(
    config: &Config,
    cone: &LightconeConfig,
    numbers: &[u64],
    z_source: f64,
    monitor: &dyn Monitor,
) -> Result<ConeExtraction> {
    extract(config, cone, numbers, z_source, monitor).map_err(|error| error.in_table(TableKind::Lightcone))
}

fn extract(
    config: &Config,
    cone: &LightconeConfig,
    numbers: &[u64],
    z_source: f64,
    monitor: &dyn Monitor,
) -> Result<ConeExtraction> {
    let (given, files) = (cone.footprint()?, ConeFiles::open(cone)?);
    let (aims, footprint) = match cone.behind_mass_msun {
        Some(masses) => {
            let aims = candidates::choose(config, (cone, &files), masses, given, numbers, monitor)?;
            (aims, given.unwrap_or(Footprint::FULL_SKY))
        }
        None => {
            let footprint = match given {
                Some(footprint) => footprint,
                None => files.footprint(monitor)?,
            };
            let aim = |&number: &u64| {
                let direction = footprint.random_direction(config.seed, number);
                Aim { number, direction, lens_halo: None }
            };
            (numbers.iter().map(aim).collect(), footprint)
        }
    };
    let (sightlines, rows) = gather::gather(config, &files, &aims, z_source, monitor)?;
    let masses = sightlines.iter().flat_map(|sightline| &sightline.haloes.m200c_msun);
    if let (Some(file), Some(doubt)) = (cone.files.first(), mass_doubt(masses)) {
        log::warn!("{}: {doubt}", file.display());
    }
    Ok(ConeExtraction { sightlines, footprint, row_count: rows.read, bad_row_count: rows.bad })
}

/// The haloes of those sightlines from the configured light cone, or from the folder of one that `haloray extract` made.
///
/// # Errors
/// As [`extract_cone`]; a number that the folder does not have.
pub fn read_cone(
    config: &Config,
    cone: &LightconeConfig,
    numbers: &[u64],
    z_source: f64,
    monitor: &dyn Monitor,
) -> Result<ImportedSightlines> {
    let background = config.cosmology;
    if let [folder] = cone.files.as_slice()
        && folder.is_dir()
    {
        let folder = folder.clone();
        let counts = folder::counts(&folder, numbers)?;
        return Ok(Arc::new(move |number, z_source| {
            match counts.get(&number) {
                Some(0) | None => ConeHaloes::default(),
                Some(_) => folder::read_sightline(&folder, number)?,
            }
            .catalogue(z_source, &background)
        }));
    }
    let extraction = extract_cone(config, cone, numbers, z_source, monitor)?;
    let haloes: BTreeMap<u64, _> =
        extraction.sightlines.into_iter().map(|sightline| (sightline.number, sightline.haloes)).collect();
    Ok(Arc::new(move |number, z_source| match haloes.get(&number) {
        Some(haloes) => haloes.catalogue(z_source, &background),
        None => Err(Error::out_of_range("number of the sightline", number, "one of those that were read")),
    }))
}
