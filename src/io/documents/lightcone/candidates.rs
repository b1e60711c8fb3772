//! Sightlines that are centred on haloes: which ones, the same for any number that is asked for.

use std::collections::BinaryHeap;

use rand::RngExt;

use super::aim::Aim;
use super::gather::to_200c;
use super::reading::{ConeFiles, ConeRow};
use crate::config::{Config, LightconeConfig};
use crate::error::{Error, Result, shortest};
use crate::halo::lightcone::{Direction, Footprint, LensHalo};
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};
use crate::pipeline::MissingConcentrations;

/// A halo to centre on; the random key of its row decides its place among all.
struct Candidate {
    key: (u64, u64),
    direction: Direction,
    halo: LensHalo,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl Eq for Candidate {}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

/// Haloes of M200c in the range and near z_lens, put in a random order: sightline k is centred on the k-th.
pub(super) fn choose(
    config: &Config,
    cone: (&LightconeConfig, &ConeFiles),
    [mass_low, mass_high]: [f64; 2],
    footprint: Option<Footprint>,
    numbers: &[u64],
    monitor: &dyn Monitor,
) -> Result<Vec<Aim>> {
    let (cone, files) = cone;
    let concentrations = MissingConcentrations::of(config)?;
    let (z_lens, delta_z) = (config.line_of_sight.z_lens, cone.behind_delta_z());
    let wanted = numbers.iter().max().map_or(0, |last| last.saturating_add(1));
    let mut total = 0_u64;
    let mut nearest: BinaryHeap<Candidate> = BinaryHeap::new();
    let of_part = |definitions, rows: &[ConeRow]| {
        let near = rows.iter().filter(|row| (row.z - z_lens).abs() <= delta_z);
        let inside = near.filter(|row| footprint.is_none_or(|footprint| footprint.contains(row.direction)));
        let candidate = |row: &ConeRow| match to_200c(config, definitions, &concentrations, row) {
            Err(bad) => Some(Err((*row, bad))),
            Ok(halo) if (mass_low..=mass_high).contains(&halo.m200c_msun) => {
                let random: u64 = stream(config.seed, row.row, Stage::LightconeLens, 0).random();
                let halo = LensHalo { row: row.row, z: row.z, m200c_msun: halo.m200c_msun };
                Some(Ok(Candidate { key: (random, row.row), direction: row.direction, halo }))
            }
            Ok(_) => None,
        };
        inside.filter_map(candidate).collect()
    };
    let take = |candidate: Candidate| {
        total += 1;
        nearest.push(candidate);
        if nearest.len() as u64 > wanted {
            nearest.pop();
        }
        Ok(())
    };
    files.go_through("haloes to centre on", monitor, of_part, take)?;
    if total < wanted {
        let what = format!(
            "the number of haloes of M200c {mass_low:e} to {mass_high:e} Msun at z = {} to {}",
            shortest(z_lens - delta_z),
            shortest(z_lens + delta_z)
        );
        let allowed = format!(
            "at least {wanted}: ask for fewer sightlines, a wider range of mass or a larger behind_delta_z"
        );
        return Err(Error::out_of_range(&what, total, &allowed));
    }
    log::info!(
        "sightlines centred on {} of {total} haloes of M200c {mass_low:e} to {mass_high:e} Msun within {} of z = {}; the halo itself \
         is left out of its sightline: it is the main lens",
        numbers.len(),
        shortest(delta_z),
        shortest(z_lens)
    );
    let ordered = nearest.into_sorted_vec();
    let aim = |&number: &u64| {
        let Candidate { direction, halo, .. } = &ordered[number as usize];
        Aim { number, direction: *direction, lens_halo: Some(*halo) }
    };
    Ok(numbers.iter().map(aim).collect())
}
