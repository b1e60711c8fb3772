//! `haloray lens`: evaluate a lens model in lenstronomy's form at points.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::{Column, Provenance, RAYS_GROUP, Table, read_lens_model, read_points};
use haloray::mapping::Order;

use crate::bars::Bars;
use crate::centres::warn_of_centres;
use crate::output::check_file;
use crate::settings::Cosmology;

/// Evaluate a lens model in lenstronomy's own form at points.
///
/// MODEL.json: {"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["LOS_MINIMAL", "EPL"], "kwargs_lens": [{…}, {…}]},
/// optionally "cosmology": {"H0": 67.4, "Om0": 0.315}. "lens_redshift_list": [0.5, …] in place of "z_lens" gives every
/// model its own redshift (multi-plane lensing; no LOS models). Adds beta_x_arcsec, beta_y_arcsec, f_xx, f_xy, f_yx,
/// f_yy (f_ij = δ_ij − ∂β_i/∂θ_j), fermat_arcsec2 (one plane only) and delay_days to the points.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray lens model.json --points points.csv -o lensed.csv")]
pub struct Args {
    /// Lens model.
    #[arg(value_name = "MODEL.json")]
    model: PathBuf,
    /// Points table (.csv, .h5, .fits): theta_x_arcsec, theta_y_arcsec. Other columns are kept.
    #[arg(long, value_name = "FILE")]
    points: PathBuf,
    /// Table to write: .csv, .h5 or .fits.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    cosmology: Cosmology,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let model = read_lens_model(&args.model, &args.cosmology.background()?)?;
    let points = read_points(&args.points)?;
    Table::check_target(&args.output)?;
    check_file(&args.output, &[Some(&args.model), Some(&args.points)], bars)?;
    for warning in &model.warnings {
        crate::terminal::warn(warning);
    }
    let (theta, mapping) = (&points.theta_arcsec, model.lens.mapping());
    let rays = mapping.map(theta, Order::Jacobian);
    let trace = |aside: &[[f64; 2]]| Ok(mapping.map(aside, Order::Jacobian).jacobian);
    warn_of_centres(theta, &rays.jacobian, &model.lens.lens_centres_arcsec(), trace)?;
    let beta = |i: usize| rays.beta_arcsec.iter().map(|b| b[i]).collect();
    let mut columns = vec![
        Column::f64("beta_x_arcsec", Some("arcsec"), beta(0)),
        Column::f64("beta_y_arcsec", Some("arcsec"), beta(1)),
    ];
    for (i, name) in ["f_xx", "f_xy", "f_yx", "f_yy"].into_iter().enumerate() {
        let own = if i % 3 == 0 { 1.0 } else { 0.0 };
        columns.push(Column::f64(name, None, rays.jacobian.iter().map(|a| own - a[i]).collect()));
    }
    if let Some(fermat) = model.lens.fermat_arcsec2(theta) {
        columns.push(Column::f64("fermat_arcsec2", Some("arcsec2"), fermat));
    }
    columns.push(Column::f64("delay_days", Some("d"), mapping.delay_days(theta)));
    points.with(columns)?.write(&args.output, RAYS_GROUP, &Provenance::new(None, ""))?;
    if !bars.is_quiet() {
        crate::terminal::print(&format!("{} rays written to {}\n", theta.len(), args.output.display()));
    }
    Ok(())
}
