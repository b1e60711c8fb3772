//! The haloes in the cylinders of many sightlines, in one pass through a light cone.

use super::aim::Aim;
use super::reading::{BadValue, ConeFiles, ConeRow, Definitions, OfPart, RowCounts};
use crate::config::Config;
use crate::constants::ARCSEC_RAD;
use crate::error::{Error, Result};
use crate::halo::lightcone::{ConeHaloes, ConeSightline, Cylinders, Direction, Member};
use crate::halo::{Halo200c, MassConverter, NfwScaling};
use crate::io::containers::memory_limit_bytes;
use crate::monitor::Monitor;
use crate::pipeline::MissingConcentrations;

/// A halo in the cylinder of a sightline.
struct Found {
    member: Member,
    row: u64,
    z: f64,
    halo: Halo200c,
}

/// The haloes of every sightline, out to `z_source`.
pub(super) fn gather(
    config: &Config,
    files: &ConeFiles,
    aims: &[Aim],
    z_source: f64,
    monitor: &dyn Monitor,
) -> Result<(Vec<ConeSightline>, RowCounts)> {
    let background = config.cosmology;
    let directions: Vec<Direction> = aims.iter().map(|aim| aim.direction).collect();
    let cylinders = Cylinders::new(&directions, config.haloes.radius_cmpc, z_source, background)?;
    let concentrations = MissingConcentrations::of(config)?;
    let scaling = NfwScaling::new(&background, z_source);
    let cut = if config.haloes.cut_imported { config.haloes.min_point_shear } else { 0.0 };
    let mut sightlines: Vec<ConeSightline> = aims
        .iter()
        .map(|&Aim { number, direction, lens_halo }| ConeSightline {
            number,
            direction,
            lens_halo,
            haloes: ConeHaloes::default(),
        })
        .collect();

    let of_part = |definitions, rows: &[ConeRow]| {
        let (mut members, mut found): (Vec<Member>, Vec<OfPart<Found>>) = (Vec::new(), Vec::new());
        for row in rows.iter().filter(|row| row.z < z_source) {
            members.clear();
            cylinders.members(row.direction.unit_vector(), row.z, &mut members);
            let is_lens =
                |member: &Member| aims[member.cylinder].lens_halo.is_some_and(|lens| lens.row == row.row);
            members.retain(|member| !is_lens(member));
            if members.is_empty() {
                continue;
            }
            let halo = match to_200c(config, definitions, &concentrations, row) {
                Ok(halo) => halo,
                Err(bad) => {
                    found.push(Err((*row, bad)));
                    continue;
                }
            };
            let chi = background.comoving_distance_mpc(row.z);
            let r_e2 = halo.m200c_msun * scaling.einstein_radius_squared_per_msun(chi, row.z);
            for &member in &members {
                // As `halo::passes_shear_cut`.
                let r = chi * member.theta_arcsec[0].hypot(member.theta_arcsec[1]) * ARCSEC_RAD;
                if r_e2 >= cut * r * r {
                    found.push(Ok(Found { member, row: row.row, z: row.z, halo }));
                }
            }
        }
        found
    };
    let most = memory_limit_bytes() / ConeHaloes::BYTES_PER_HALO;
    let mut total = 0_u64;
    let take = |found: Found| {
        total += 1;
        if total > most {
            let allowed = format!(
                "at most {most}, half of the free memory: ask for fewer sightlines, a smaller haloes.radius_cmpc, or set haloes.cut_imported"
            );
            return Err(Error::out_of_range("the number of haloes in the cylinders", total, &allowed));
        }
        let haloes = &mut sightlines[found.member.cylinder].haloes;
        haloes.row.push(found.row);
        haloes.z.push(found.z);
        haloes.theta_x_arcsec.push(found.member.theta_arcsec[0]);
        haloes.theta_y_arcsec.push(found.member.theta_arcsec[1]);
        haloes.m200c_msun.push(found.halo.m200c_msun);
        haloes.c200c.push(found.halo.c200c);
        Ok(())
    };
    let counts = files.go_through("haloes of the light cone", monitor, of_part, take)?;
    Ok((sightlines, counts))
}

/// M200c and c200c of a row; the configured relation gives the concentration where it has none.
pub(super) fn to_200c(
    config: &Config,
    (mass, concentration): Definitions,
    missing: &MissingConcentrations,
    row: &ConeRow,
) -> std::result::Result<Halo200c, BadValue> {
    let own = row.concentration;
    let refuse = || match own.is_nan() {
        true => BadValue {
            column: 3,
            value: row.mass_msun,
            allowed: "a mass for which haloes.concentration has a concentration".into(),
        },
        false => {
            BadValue { column: 4, value: own, allowed: "a concentration that an NFW halo may have".into() }
        }
    };
    let halo = MassConverter::new(config.cosmology, mass, concentration).ok().and_then(|converter| {
        if !own.is_nan() {
            return converter.from_concentration(row.mass_msun, own, row.z);
        }
        let over_median = missing.over_median(row.row);
        converter.from_relation(row.mass_msun, row.z, |m| over_median * missing.median(m, row.z))
    });
    halo.ok_or_else(refuse)
}
