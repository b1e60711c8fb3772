//! A whole run in one HDF5 file; the layout is documented in `docs/FILES.md`.

use std::path::Path;

use super::halo_table::{SHEET_COLUMN, halo_columns};
use super::image_table::curve_table;
use crate::config::Config;
use crate::diagnostics::{
    Averaged, CriticalCurve, CriticalCurves, CurveKind, HaloTidal, RingAndDisc, TidalMaps,
};
use crate::error::Result;
use crate::imaging::Exposure;
use crate::io::containers::{Column, Provenance, RunFile, RunFileReader, Values};
use crate::mapping::multiplane::Sheets;
use crate::pipeline::{Quantities, Simulation, Summary, View};

/// Writes config, haloes, mass function, diagnostics, maps and images of a run.
///
/// # Errors
/// [`crate::Error::Write`] when the disk is full.
pub fn write_simulation(run: &Simulation, path: &Path, provenance: &Provenance) -> Result<()> {
    let file = RunFile::create(path, provenance)?;
    write_haloes(&file, run)?;
    write_mass_function(&file, run)?;
    write_distances(&file, &run.config)?;
    write_maps(&file, "maps", &run.maps)?;
    let summary = Summary::of(run);
    for (name, view, quantities) in
        [("all_haloes", &run.all, &summary.all_haloes), ("tidal_haloes", &run.tidal, &summary.tidal_haloes)]
    {
        write_quantities(&file, &format!("diagnostics/{name}"), quantities)?;
        write_view(&file, &format!("images/{name}"), run, view)?;
    }
    file.close()
}

fn write_columns(file: &RunFile, group: &str, columns: &[Column]) -> Result<()> {
    for column in columns {
        match &column.values {
            Values::F64(values) => {
                let unit = column.unit.as_deref().unwrap_or("");
                file.write_1d(group, &column.name, values, unit, &description(&column.name))?;
            }
            Values::Text(values) => file.write_text(group, &column.name, values, "")?,
        }
    }
    Ok(())
}

/// What a column of haloes or of their mass function holds; a user's own columns have no description.
fn description(name: &str) -> String {
    const WHOLE: [(&str, &str); 11] = [
        ("z", "redshift"),
        ("theta_x_arcsec", "angle from the axis along x"),
        ("theta_y_arcsec", "angle from the axis along y"),
        ("r_s_arcsec", "scale radius"),
        ("alpha_rs_arcsec", "deflection at the scale radius, reduced to z_source"),
        ("r_trunc_arcsec", "radius of truncation; inf without one"),
        ("m200c_msun", "mass within the radius inside which the density is 200 times the critical one"),
        ("c200c", "concentration: that radius over the scale radius"),
        ("chi_cmpc", "comoving distance"),
        ("dn_dlnm_per_cmpc3", "haloes per comoving volume and unit of ln m200c"),
        (SHEET_COLUMN, "convergence that the sheet in the plane of the halo takes away"),
    ];
    const QUANTITIES: [(&str, &str); 8] = [
        ("kappa", "convergence"),
        ("gamma1", "shear, real part"),
        ("gamma2", "shear, imaginary part"),
        ("F1", "flexion F = ∂γ, real part"),
        ("F2", "flexion F = ∂γ, imaginary part"),
        ("G1", "flexion G = ∂*γ, real part"),
        ("G2", "flexion G = ∂*γ, imaginary part"),
        ("delta", "Δ, change of the shear across theta_e_arcsec over the shear"),
    ];
    if let Some((_, text)) = WHOLE.iter().find(|(own, _)| *own == name) {
        return (*text).into();
    }
    let places = [
        ("_ring_h", "averaged over the ring of theta_e_arcsec"),
        ("_disc_h", "averaged over the disc inside the ring"),
        ("_h_on_ray", "where the axis ray passes its plane"),
        ("_h", "at the centre of its plane"),
    ];
    let found = places.iter().find_map(|(end, place)| Some((name.strip_suffix(end)?, place)));
    let known = found.and_then(|(stem, place)| {
        QUANTITIES
            .iter()
            .find(|(own, _)| *own == stem)
            .map(|(_, text)| format!("{text}, of the halo alone {place}"))
    });
    known.unwrap_or_default()
}

fn write_haloes(file: &RunFile, run: &Simulation) -> Result<()> {
    let (haloes, single) = (&run.haloes, &run.single_haloes);
    let mut columns = halo_columns(&haloes.catalogue);
    let mut results = vec![Column::f64("chi_cmpc", Some("Mpc"), haloes.catalogue.chi_cmpc.clone())];
    results.extend(tidal_columns(&single.on_axis, "h"));
    results.extend(single.on_ray.iter().flat_map(|on_ray| tidal_columns(on_ray, "h_on_ray")));
    if let Sheets::Expected(kappa) = &run.sheets {
        results.push(Column::f64(SHEET_COLUMN, None, kappa.clone()));
    }
    columns.retain(|own| !results.iter().any(|r| r.name == own.name));
    file.group("haloes")?;
    for column in &columns {
        match &column.values {
            // A radius of truncation may be infinite, and a user's own columns are kept as they are.
            Values::F64(values) => {
                let unit = column.unit.as_deref().unwrap_or("");
                let about = description(&column.name);
                file.write_with_gaps("haloes", &column.name, values, &[values.len()], unit, &about)?;
            }
            Values::Text(values) => file.write_text("haloes", &column.name, values, "")?,
        }
    }
    write_columns(file, "haloes", &results)?;
    file.attribute("haloes", "z_source", haloes.catalogue.z_source())
}

/// The columns of what haloes do on their own, `place` at the end of every name.
fn tidal_columns(tidal: &HaloTidal, place: &str) -> Vec<Column> {
    let per_arcsec = Some("arcsec^-1");
    let part = |values: &[nalgebra::Complex<f64>], real: bool| -> Vec<f64> {
        values.iter().map(|v| if real { v.re } else { v.im }).collect()
    };
    let averaged = |of: fn(&RingAndDisc) -> Averaged, value: fn(&Averaged) -> f64| -> Vec<f64> {
        tidal.averages.iter().map(|averages| value(&of(averages))).collect()
    };
    let mut columns = vec![
        ("kappa".to_string(), None, tidal.kappa.clone()),
        ("gamma1".into(), None, part(&tidal.gamma, true)),
        ("gamma2".into(), None, part(&tidal.gamma, false)),
        ("F1".into(), per_arcsec, part(&tidal.f_per_arcsec, true)),
        ("F2".into(), per_arcsec, part(&tidal.f_per_arcsec, false)),
        ("G1".into(), per_arcsec, part(&tidal.g_per_arcsec, true)),
        ("G2".into(), per_arcsec, part(&tidal.g_per_arcsec, false)),
        ("delta".into(), None, tidal.delta.clone()),
    ];
    type Region = fn(&RingAndDisc) -> Averaged;
    let (ring, disc): (Region, Region) = (|a| a.ring, |a| a.disc);
    let regions = [("ring", ring), ("disc", disc)];
    for (region, of) in regions.into_iter().filter(|_| tidal.averages.len() == tidal.kappa.len()) {
        columns.extend([
            (format!("F1_{region}"), per_arcsec, averaged(of, |a| a.f_per_arcsec.re)),
            (format!("F2_{region}"), per_arcsec, averaged(of, |a| a.f_per_arcsec.im)),
            (format!("G1_{region}"), per_arcsec, averaged(of, |a| a.g_per_arcsec.re)),
            (format!("G2_{region}"), per_arcsec, averaged(of, |a| a.g_per_arcsec.im)),
            (format!("delta_{region}"), None, averaged(of, |a| a.delta)),
        ]);
    }
    let column = |(name, unit, values)| Column::f64(&format!("{name}_{place}"), unit, values);
    columns.into_iter().map(column).collect()
}

fn write_mass_function(file: &RunFile, run: &Simulation) -> Result<()> {
    /// Bins a decade of the drawn haloes.
    const BINS_A_DECADE: f64 = 4.0;
    let curve = &run.haloes.mass_function;
    let columns = [
        Column::f64("m200c_msun", Some("solMass"), curve.m200c_msun.clone()),
        Column::f64("dn_dlnm_per_cmpc3", Some("Mpc^-3"), curve.dn_dlnm_per_cmpc3.clone()),
    ];
    write_columns(file, "mass_function", &columns)?;
    file.attribute("mass_function", "name", curve.name.as_str())?;
    file.attribute("mass_function", "z", curve.z)?;
    let Some(masses) = run.haloes.catalogue.m200c_msun.as_ref() else { return Ok(()) };
    if run.config.haloes.is_imported() {
        return Ok(());
    }
    let limits = run.config.haloes.limits();
    let start = limits.mass_min_msun.log10();
    let bins = ((limits.mass_max_msun.log10() - start) * BINS_A_DECADE).ceil() as usize;
    let edges: Vec<f64> = (0..=bins).map(|i| 10f64.powf(start + i as f64 / BINS_A_DECADE)).collect();
    let mut counts = vec![0.0; bins];
    for mass in masses {
        let bin = ((mass.log10() - start) * BINS_A_DECADE) as usize;
        counts[bin.min(bins - 1)] += 1.0;
    }
    let middle = |edge: &[f64]| (edge[0] * edge[1]).sqrt();
    let volumes: Vec<f64> =
        edges.windows(2).map(|edge| run.haloes.population.kept_volume_cmpc3(middle(edge))).collect();
    let group = "mass_function/drawn";
    file.write_1d(group, "m200c_edges_msun", &edges, "solMass", "edges of the mass bins")?;
    file.write_1d(group, "counts", &counts, "", "haloes kept in each mass bin")?;
    let description = "comoving volume in which a halo of the bin passes the shear cut";
    file.write_1d(group, "kept_volume_cmpc3", &volumes, "Mpc^3", description)
}

fn write_distances(file: &RunFile, config: &Config) -> Result<()> {
    let z_source = config.line_of_sight.z_source;
    let z: Vec<f64> = (0..=200).map(|i| z_source * f64::from(i) / 200.0).collect();
    let chi: Vec<f64> = z.iter().map(|&z| config.cosmology.comoving_distance_mpc(z)).collect();
    file.write_1d("distances", "z", &z, "", "redshift")?;
    file.write_1d("distances", "chi_cmpc", &chi, "Mpc", "comoving distance")?;
    let lens = config.cosmology.comoving_distance_mpc(config.line_of_sight.z_lens);
    file.attribute("distances", "lens_cmpc", lens)?;
    file.attribute("distances", "source_cmpc", config.cosmology.comoving_distance_mpc(z_source))
}

/// Writes the maps of κ, γ1, γ2, ω, |F|, |G| and Δ into `group`.
///
/// # Errors
/// [`crate::Error::Write`].
pub fn write_maps(file: &RunFile, group: &str, maps: &TidalMaps) -> Result<()> {
    let n = maps.grid.points;
    for (name, unit, values) in maps.columns() {
        let order = "row-major (y, x), bottom row first";
        match name {
            // Undefined where there is no shear on the axis.
            "delta" => file.write_with_gaps(group, name, values, &[n, n], unit, order)?,
            _ => file.write_2d(group, name, values, (n, n), unit, order)?,
        }
    }
    let axis = &maps.on_axis.tidal;
    file.attribute(group, "kappa_on_axis", axis.kappa)?;
    file.attribute(group, "gamma1_on_axis", axis.gamma.re)?;
    file.attribute(group, "gamma2_on_axis", axis.gamma.im)?;
    file.attribute(group, "half_width_arcsec", maps.grid.half_width_arcsec)
}

/// Writes critical curves and caustics into `group`, one entry a vertex, with the centre of the source.
///
/// # Errors
/// [`crate::Error::Write`].
pub fn write_curves(
    file: &RunFile,
    group: &str,
    curves: &CriticalCurves,
    source_centre_arcsec: [f64; 2],
) -> Result<()> {
    file.group(group)?;
    write_columns(file, group, curve_table(curves)?.columns())?;
    file.attribute(group, "source_x_arcsec", source_centre_arcsec[0])?;
    file.attribute(group, "source_y_arcsec", source_centre_arcsec[1])
}

/// Reads what [`write_curves`] wrote.
///
/// # Errors
/// [`crate::Error::File`] when the group is not of that form.
pub fn read_curves(file: &RunFileReader, group: &str) -> Result<CriticalCurves> {
    let column = |name: &str| file.read_1d(group, name);
    let pair = |a: &str, b: &str| -> Result<Vec<[f64; 2]>> {
        Ok(column(a)?.into_iter().zip(column(b)?).map(|(x, y)| [x, y]).collect())
    };
    let (theta, beta) = (pair("theta_x_arcsec", "theta_y_arcsec")?, pair("beta_x_arcsec", "beta_y_arcsec")?);
    let (number, closed, kind) = (column("curve")?, column("closed")?, file.read_text(group, "kind")?);
    let mut curves: Vec<CriticalCurve> = Vec::new();
    let rows = number.into_iter().zip(closed).zip(kind).zip(theta.into_iter().zip(beta));
    for (((n, closed), kind), (theta, beta)) in rows {
        if n as usize == curves.len() {
            let tangential = kind == CurveKind::Tangential.name();
            curves.push(CriticalCurve {
                kind: if tangential { CurveKind::Tangential } else { CurveKind::Radial },
                closed: closed == 1.0,
                theta_arcsec: Vec::new(),
                beta_arcsec: Vec::new(),
            });
        }
        if let Some(curve) = curves.last_mut() {
            curve.theta_arcsec.push(theta);
            curve.beta_arcsec.push(beta);
        }
    }
    Ok(CriticalCurves { curves })
}

fn write_quantities(file: &RunFile, group: &str, quantities: &Quantities) -> Result<()> {
    file.group(group)?;
    quantities.0.iter().try_for_each(|(name, _, value)| file.attribute(group, name, *value))
}

fn write_view(file: &RunFile, group: &str, run: &Simulation, view: &View) -> Result<()> {
    write_exposure(file, group, &view.exposure)?;
    if let Some(curves) = &view.curves {
        write_curves(file, &format!("{group}/curves"), curves, view.source_centre_arcsec)?;
    }
    let [lens1, lens2] = run.shapes.lens_ellipticity;
    let [source1, source2] = run.shapes.source_ellipticity;
    for (name, value) in
        [("lens_e1", lens1), ("lens_e2", lens2), ("source_e1", source1), ("source_e2", source2)]
    {
        file.attribute(group, name, value)?;
    }
    file.attribute(group, "background_rms_e_s", run.config.instrument.background_rms_e_s())
}

fn write_exposure(file: &RunFile, group: &str, exposure: &Exposure) -> Result<()> {
    let n = exposure.grid.pixels();
    let unit = "electron/s";
    file.write_2d(
        group,
        "noise_free",
        &exposure.noise_free_e_s,
        (n, n),
        unit,
        "after the PSF, before noise",
    )?;
    file.write_2d(group, "noisy", &exposure.noisy_e_s, (n, n), unit, "with background and shot noise")?;
    file.attribute(group, "pixel_scale_arcsec", exposure.grid.pixel_scale_arcsec())
}
