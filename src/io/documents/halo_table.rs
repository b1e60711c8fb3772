//! Halo catalogues as tables, in both parametrisations, with every fault placed by file and line.

use std::path::Path;

use crate::config::LineOfSightConfig;
use crate::cosmology::Background;
use crate::error::{Result, TableKind};
use crate::halo::{HaloCatalogue, HaloMasses, doubts};
use crate::io::containers::{Column, Provenance, RunFileReader, Table, Values, stated_number};

/// Name of the HDF5 group or FITS extension with haloes.
pub const HALOES_GROUP: &str = "haloes";
/// Column of a run with mean-density sheets: the convergence that the sheet in each halo's plane takes away.
pub const SHEET_COLUMN: &str = "sheet_kappa";
/// The columns that mean something; all others are a user's own and are kept.
const KNOWN: [&str; 8] = [
    "z",
    "theta_x_arcsec",
    "theta_y_arcsec",
    "r_s_arcsec",
    "alpha_rs_arcsec",
    "r_trunc_arcsec",
    "m200c_msun",
    "c200c",
];

/// Reads a halo table (CSV, HDF5, FITS) for a source at `z_source`.
///
/// A unit that a column states is converted to the one in its name, or refused.
///
/// Haloes at or behind the source do nothing and are left out, which is logged.
///
/// Columns `z,theta_x_arcsec,theta_y_arcsec` and either `r_s_arcsec,alpha_rs_arcsec` (reduced to that source) or
/// `m200c_msun,c200c`; where both are present the angles are taken, and must agree with the masses.
///
/// # Errors
/// Missing columns, values outside their domain (with the line), angles that belong to another source.
pub fn read_haloes(path: &Path, z_source: f64, background: &Background) -> Result<HaloCatalogue> {
    read(path, z_source, background).map_err(|error| error.in_table(TableKind::Haloes))
}

fn read(path: &Path, z_source: f64, background: &Background) -> Result<HaloCatalogue> {
    let table = Table::read(path, HALOES_GROUP)?.in_own_units(&KNOWN)?;
    let table = without_haloes_behind(path, z_source, table)?;
    let column = |name: &str| table.required_f64(name).map(<[f64]>::to_vec);
    let optional = |name: &str| table.optional_f64(name).map(|c| c.map(<[f64]>::to_vec));
    let (m200c_msun, c200c) = (optional("m200c_msun")?, optional("c200c")?);
    let by_angles = table.has_column("r_s_arcsec") || table.has_column("alpha_rs_arcsec");
    let masses = match (by_angles, m200c_msun.clone(), c200c.clone()) {
        (false, Some(m200c_msun), Some(c200c)) => HaloMasses::Physical { m200c_msun, c200c },
        (false, ..) => {
            let problem = format!(
                "has neither r_s_arcsec,alpha_rs_arcsec nor m200c_msun,c200c; the columns present are {}",
                table.column_names()
            );
            return Err(table.fault("table", problem));
        }
        (true, ..) => HaloMasses::Angles {
            r_s_arcsec: column("r_s_arcsec")?,
            alpha_rs_arcsec: column("alpha_rs_arcsec")?,
        },
    };
    let theta = [column("theta_x_arcsec")?, column("theta_y_arcsec")?];
    let mut haloes =
        HaloCatalogue::new(z_source, background, column("z")?, theta, masses).map_err(|fault| {
            let problem = format!("{} is not allowed; must be {}", fault.value_or_missing(), fault.allowed);
            table.fault_in_row(fault.row, fault.column, problem)
        })?;
    haloes.r_trunc_arcsec = truncation_radii(&table)?;
    (haloes.m200c_msun, haloes.c200c) = (m200c_msun, c200c);
    match (by_angles, haloes.m200c_msun.is_some() && haloes.c200c.is_some()) {
        (true, true) => check_same_source(&table, &haloes)?,
        (true, false) => check_stated_source(path, z_source, &table)?,
        (false, _) => {}
    }
    for doubt in doubts(&haloes) {
        log::warn!("{}: {doubt}", path.display());
    }
    let own = |c: &&Column| !KNOWN.iter().any(|k| k.eq_ignore_ascii_case(&c.name));
    let unused: Vec<&str> = table.columns().iter().filter(own).map(|c| c.name.as_str()).collect();
    tell_of_unused(path, &unused);
    for own in table.columns().iter().filter(own) {
        match &own.values {
            Values::F64(values) => haloes.extra.push((own.name.clone(), values.clone())),
            Values::Text(values) => haloes.extra_text.push((own.name.clone(), values.clone())),
        }
    }
    Ok(haloes)
}

/// The haloes before the source: what is at its redshift or behind it deflects none of its light.
fn without_haloes_behind(path: &Path, z_source: f64, table: Table) -> Result<Table> {
    let is_behind = |z: f64| z.is_finite() && z >= z_source;
    let behind: Vec<bool> = table.required_f64("z")?.iter().map(|&z| is_behind(z)).collect();
    let count = behind.iter().filter(|behind| **behind).count();
    if count == 0 {
        return Ok(table);
    }
    log::warn!(
        "{}: left out are {count} of {} haloes at or behind the source (z ≥ {z_source}): they deflect none of its light",
        path.display(),
        behind.len()
    );
    Ok(table.filtered(|row| !behind[row]))
}

/// Says which columns a halo's lens might be expected to depend on, and does not.
fn tell_of_unused(path: &Path, names: &[&str]) {
    /// Parts of the names that others give to what haloray uses.
    const ALIKE: [&str; 12] =
        ["trunc", "tau", "mass", "m200", "m500", "mvir", "conc", "c200", "cvir", "radius", "alpha", "theta"];
    let is_alike = |name: &&&str| ALIKE.iter().any(|part| name.to_ascii_lowercase().contains(part));
    let alike: Vec<&str> = names.iter().filter(is_alike).copied().collect();
    if !alike.is_empty() {
        let (alike, known) = (alike.join(", "), KNOWN.join(", "));
        log::info!("{}: kept, but not used: {alike}; the columns that are used are {known}", path.display());
    }
}

/// The line of sight that the haloes of a file were simulated or drawn for, if it is an .h5 of haloray that says so.
pub fn read_line_of_sight(path: &Path) -> Option<LineOfSightConfig> {
    let extension = path.extension()?.to_str()?;
    if !["h5", "hdf5"].iter().any(|own| extension.eq_ignore_ascii_case(own)) {
        return None;
    }
    let config = RunFileReader::open(path).ok()?.provenance().ok()?.config_toml;
    config.parse::<toml::Table>().ok()?.remove("line_of_sight")?.try_into().ok()
}

fn truncation_radii(table: &Table) -> Result<Option<Vec<f64>>> {
    let radii = match table.column("r_trunc_arcsec").map(|column| &column.values) {
        Some(Values::F64(radii)) => radii,
        // Says what is wrong with it, if it is there.
        _ => return table.optional_f64("r_trunc_arcsec").map(|_| None),
    };
    match radii.iter().position(|r| r.is_nan() || *r <= 0.0) {
        None => Ok(Some(radii.clone())),
        Some(row) => {
            let problem =
                format!("{} is not allowed; must be positive, infinite (inf) without truncation", radii[row]);
            Err(table.fault_in_row(row, "r_trunc_arcsec", problem))
        }
    }
}

/// A table with angles and masses says twice what a halo does: refuse it when the two contradict each other.
fn check_same_source(table: &Table, haloes: &HaloCatalogue) -> Result<()> {
    let Some(median) = haloes.angles_against_masses() else { return Ok(()) };
    let problem = format!(
        "contradict each other for a source at z = {} (median ratio {median:.4}): the angles were reduced to \
         another source or cosmology; leave out either r_s_arcsec,alpha_rs_arcsec or m200c_msun,c200c",
        haloes.z_source()
    );
    Err(table.fault("columns alpha_rs_arcsec and m200c_msun", problem))
}

/// Reduced angles hold for one source: refuse a file that says another redshift of it.
fn check_stated_source(path: &Path, z_source: f64, table: &Table) -> Result<()> {
    /// Redshifts that differ by less are the same but for rounding.
    const TOLERANCE: f64 = 1e-6;
    let own = read_line_of_sight(path).map(|sight| sight.z_source);
    let Some(stated) = own.map_or_else(|| stated_number(path, HALOES_GROUP, "z_source"), |z| Ok(Some(z)))?
    else {
        return Ok(());
    };
    if (stated - z_source).abs() <= TOLERANCE {
        return Ok(());
    }
    let problem = format!(
        "says z_source = {stated}, but the source is at z = {z_source}: r_s_arcsec and alpha_rs_arcsec are reduced to another; \
         give m200c_msun,c200c, or take that source"
    );
    Err(table.fault("table", problem))
}

/// The catalogue as a table, a user's own columns last.
///
/// # Errors
/// When a user's column has the name of one of ours.
pub fn halo_table(haloes: &HaloCatalogue) -> Result<Table> {
    let table = Table::new(halo_columns(haloes))?;
    Ok(table.with_gaps_in(haloes.extra.iter().map(|(name, _)| name.as_str())))
}

pub(super) fn halo_columns(haloes: &HaloCatalogue) -> Vec<Column> {
    let mut columns = vec![
        Column::f64("z", None, haloes.z.clone()),
        Column::f64("theta_x_arcsec", Some("arcsec"), haloes.theta_x_arcsec.clone()),
        Column::f64("theta_y_arcsec", Some("arcsec"), haloes.theta_y_arcsec.clone()),
        Column::f64("r_s_arcsec", Some("arcsec"), haloes.r_s_arcsec.clone()),
        Column::f64("alpha_rs_arcsec", Some("arcsec"), haloes.alpha_rs_arcsec.clone()),
    ];
    let optional = [
        ("r_trunc_arcsec", Some("arcsec"), &haloes.r_trunc_arcsec),
        ("m200c_msun", Some("solMass"), &haloes.m200c_msun),
        ("c200c", None, &haloes.c200c),
    ];
    for (name, unit, values) in optional {
        columns.extend(values.as_ref().map(|values| Column::f64(name, unit, values.clone())));
    }
    columns.extend(haloes.extra.iter().map(|(name, values)| Column::f64(name, None, values.clone())));
    columns.extend(haloes.extra_text.iter().map(|(name, values)| Column::text(name, values.clone())));
    columns
}

/// Writes the catalogue, format by extension.
///
/// # Errors
/// As [`Table::write`].
pub fn write_haloes(haloes: &HaloCatalogue, path: &Path, provenance: &Provenance) -> Result<()> {
    halo_table(haloes)?.write(path, HALOES_GROUP, provenance)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<HaloCatalogue> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("haloes.csv");
        std::fs::write(&path, text).unwrap();
        read_haloes(&path, 1.5, &Background::paper())
    }

    #[test]
    fn both_parametrisations_are_read_and_own_columns_kept() {
        let by_mass =
            read_text("z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c,id,name\n0.5,1,2,1e12,8,7,halo a\n")
                .unwrap();
        assert_eq!(by_mass.extra, [("id".to_string(), vec![7.0])]);
        assert_eq!(by_mass.extra_text[0].1, ["halo a"]);
        let text = format!(
            "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.5,1,2,{},{}\n",
            by_mass.r_s_arcsec[0], by_mass.alpha_rs_arcsec[0]
        );
        assert_eq!(read_text(&text).unwrap().alpha_rs_arcsec, by_mass.alpha_rs_arcsec);
    }

    #[test]
    fn haloes_at_or_behind_the_source_do_nothing() {
        let read = |rows: &str| {
            read_text(&format!("z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c,id\n{rows}")).unwrap()
        };
        let all = read("1.5,0,1,1e12,8,1\n0.5,1,2,1e12,8,2\n3.5,2,1,1e12,8,3\n");
        assert_eq!(all, read("0.5,1,2,1e12,8,2\n"));
        assert_eq!(read("1.5,0,1,1e12,8,1\n").len(), 0);
        assert_eq!(read("1.5,0,1,heavy,8,1\n").len(), 0);
    }

    #[test]
    fn faults_name_line_column_and_domain() {
        let head = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n0.5,1,2,1e12,8\n";
        for (row, wanted) in [
            ("1.5,1,2,1e12,8\n-0.5,1,2,1e12,8", ["line 4, column z", "below 1.5 (z_source)"]),
            ("0.5,1,2,-1e12,8", ["line 3, column m200c_msun", "no negative mass"]),
            ("0.5,NaN,2,1e12,8", ["line 3, column theta_x_arcsec", "finite"]),
            ("0.5,abc,2,1e12,8", ["line 3, column theta_x_arcsec", "not a number"]),
        ] {
            let text = read_text(&format!("{head}{row}\n")).unwrap_err().to_string();
            assert!(wanted.iter().all(|w| text.contains(w)), "{text}");
        }
        let missing = read_text("z,theta_x_arcsec,theta_y_arcsec\n0.5,1,2\n").unwrap_err().to_string();
        assert!(missing.contains("neither r_s_arcsec,alpha_rs_arcsec nor m200c_msun,c200c"), "{missing}");
        let half =
            read_text("z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec\n0.5,1,2,1\n").unwrap_err().to_string();
        assert!(half.contains("alpha_rs_arcsec"), "{half}");
    }

    #[test]
    fn angles_alone_must_be_for_the_source_that_their_file_states() {
        let read = |stated: &str| {
            read_text(&format!(
                "# z_source = {stated}\nz,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.5,1,2,3,0.5\n"
            ))
        };
        assert!(read("1.5").is_ok());
        let error = read("2.5").unwrap_err().to_string();
        assert!(error.contains("says z_source = 2.5, but the source is at z = 1.5"), "{error}");
    }

    #[test]
    fn angles_reduced_to_another_source_are_refused() {
        let text = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec,m200c_msun,c200c\n\
                    0.5,1,2,3,0.5,1e12,8\n";
        let error = read_text(text).unwrap_err().to_string();
        assert!(error.contains("contradict each other for a source at z = 1.5"), "{error}");
    }
}
