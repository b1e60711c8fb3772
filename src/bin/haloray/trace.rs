//! `haloray trace`: trace given rays through given haloes.

use std::path::PathBuf;

use clap::ValueEnum;
use haloray::Result;
use haloray::diagnostics::HaloTidal;
use haloray::error::Domain;
use haloray::io::{
    Column, Provenance, RAYS_GROUP, Table, ray_table, read_haloes, read_line_of_sight, read_points,
};
use haloray::mapping::multiplane::{Accuracy, Field, LineOfSight, Reference, Segment, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::monitor::Monitor;

use crate::bars::Bars;
use crate::centres::warn_of_centres;
use crate::output::check_file;
use crate::settings::{Cosmology, of_option, whole};
use crate::sheets;
use crate::summary::{counted, print_accuracy};

/// Trace rays through a halo table, one plane a halo.
///
/// Adds beta_x_arcsec, beta_y_arcsec to the points; with --order 1 also the Jacobian a_xx, a_xy, a_yx, a_yy
/// (a_ij = ∂β_i/∂θ_j), with --order 2 also b_xxx … b_yyy (b_ijk = ∂²β_i/∂θ_j∂θ_k, per arcsec). All analytic.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  haloray populate -o haloes.h5\n  haloray trace --haloes haloes.h5 --points points.csv \
                  --z-source 1.5 --order 1 -o rays.csv"
)]
pub struct Args {
    /// Halo table (.csv, .h5, .fits): z, theta_x_arcsec, theta_y_arcsec and r_s_arcsec, alpha_rs_arcsec (reduced to
    /// the source) or m200c_msun, c200c. A unit that a column states (deg, mas, 1e10 Msun) is converted, or refused.
    #[arg(long, value_name = "FILE")]
    haloes: PathBuf,
    /// Points table (.csv, .h5, .fits): theta_x_arcsec, theta_y_arcsec. Other columns are kept.
    #[arg(long, value_name = "FILE")]
    points: PathBuf,
    /// Redshift of the source; all haloes must be nearer.
    #[arg(long, allow_negative_numbers = true, value_name = "Z")]
    z_source: f64,
    /// Table to write: .csv, .h5 or .fits.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Compensating sheet in each halo's plane: −κ_h on the axis (where its ray passes, if the haloes' file was made so), or
    /// none.
    #[arg(long, value_enum, default_value_t = SheetArg::OnAxis)]
    sheets: SheetArg,
    /// What positions are measured from: `bent`, a line that the axis ray leaves, or `straight`, the axis ray itself, its
    /// deflection subtracted in every plane. Left out: what the haloes' file says (an .h5 of haloray), else bent.
    #[arg(long, value_enum)]
    reference: Option<ReferenceArg>,
    /// Largest error of β in arcsec, or `exact`: every ray through every plane. Away from halo centres errors of the
    /// Jacobian stay below 10 times the number, those of second derivatives below 1000 times. Delays are exact.
    #[arg(long, allow_negative_numbers = true, value_name = "exact|ARCSEC", default_value = "1e-7")]
    accuracy: Accuracy,
    /// Derivatives to add: 0 none, 1 the Jacobian, 2 also second derivatives.
    #[arg(long, allow_negative_numbers = true, value_name = "0|1|2", default_value_t = 0)]
    #[arg(value_parser = whole::<u8>(0..=2))]
    order: u8,
    /// Start from this redshift instead of the observer, about the ray seen on the axis.
    #[arg(long, allow_negative_numbers = true, value_name = "Z")]
    from_z: Option<f64>,
    /// Stop at this redshift instead of the source.
    #[arg(long, allow_negative_numbers = true, value_name = "Z")]
    to_z: Option<f64>,
    /// Also add delay_days, the arrival-time delay against the straight path to the same β.
    #[arg(long)]
    delay: bool,
    #[command(flatten)]
    cosmology: Cosmology,
}

#[derive(Clone, Copy, ValueEnum)]
enum SheetArg {
    OnAxis,
    None,
}

#[derive(Clone, Copy, ValueEnum)]
enum ReferenceArg {
    Bent,
    Straight,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    check_redshifts(args)?;
    let background = args.cosmology.background()?;
    let haloes = read_haloes(&args.haloes, args.z_source, &background)?;
    let points = read_points(&args.points)?;
    Table::check_target(&args.output)?;
    check_file(&args.output, &[Some(&args.haloes), Some(&args.points)], bars)?;
    let made_for = read_line_of_sight(&args.haloes);
    let reference = match args.reference {
        Some(ReferenceArg::Bent) => Reference::Bent,
        Some(ReferenceArg::Straight) => Reference::Straight,
        None => made_for.as_ref().map_or(Reference::Bent, |sight| sight.reference),
    };
    let sheets = match args.sheets {
        SheetArg::OnAxis if made_for.is_some_and(|sight| sight.is_beside_axis()) => Sheets::OnRay,
        SheetArg::OnAxis => Sheets::OnAxis,
        SheetArg::None => Sheets::None,
    };
    let sight = LineOfSight::along(reference, &haloes, &sheets)?;
    let ray = match sheets {
        Sheets::OnRay => sight.axis_ray_arcsec(&haloes.chi_cmpc),
        _ => vec![[0.0; 2]; haloes.len()],
    };
    let effects = match sheets {
        Sheets::None => Vec::new(),
        _ => HaloTidal::along(&haloes, 1.0, |i| ray[i])?.kappa,
    };
    let segment = segment(args, &sight)?;
    let order = [Order::Position, Order::Jacobian, Order::SecondDerivatives][args.order as usize];
    let monitor: &dyn Monitor = bars;
    let task = monitor.task("trace rays", Some(points.theta_arcsec.len() as u64));
    let field = Field::around(&points.theta_arcsec);
    let mapping = segment.adaptive(args.accuracy, field, points.theta_arcsec.len());
    let rays = mapping.trace(&points.theta_arcsec, order, monitor)?;
    if order != Order::Position && args.from_z.is_none() {
        let centres: Vec<[f64; 2]> =
            haloes.theta_x_arcsec.iter().zip(&haloes.theta_y_arcsec).map(|(&x, &y)| [x, y]).collect();
        let trace = |aside: &[[f64; 2]]| Ok(mapping.trace(aside, Order::Jacobian, monitor)?.jacobian);
        warn_of_centres(&points.theta_arcsec, &rays.jacobian, &centres, trace)?;
    }
    drop(task);
    let mut table = ray_table(&points, &rays)?;
    if args.delay {
        let delays = bars.stage("arrival times", || segment.delay_days(&points.theta_arcsec));
        table = table.with(Column::f64("delay_days", Some("d"), delays))?;
    }
    bars.stage("write table", || table.write(&args.output, RAYS_GROUP, &Provenance::new(None, "")))?;
    if !bars.is_quiet() {
        let rays = counted(points.theta_arcsec.len(), "ray", "rays");
        let planes = counted(sight.len(), "plane", "planes");
        crate::terminal::print(&format!("{rays} through {planes} written to {}\n", args.output.display()));
        print_accuracy(&mapping.report(), bars);
    }
    let name = match sheets {
        Sheets::OnRay => "on-ray",
        Sheets::None => "none",
        _ => "on-axis",
    };
    sheets::tell(name, &effects, bars);
    Ok(())
}

fn check_redshifts(args: &Args) -> Result<()> {
    let (source, end) = (args.z_source, args.to_z.unwrap_or(args.z_source));
    of_option(Domain::above_to(0.0, 1100.0), "--z-source", source, "above 0 and at most 1100")?;
    let allowed = format!("above 0 and at most --z-source = {source}");
    of_option(Domain::above_to(0.0, source), "--to-z", end, &allowed)?;
    let Some(from) = args.from_z else { return Ok(()) };
    let allowed = format!("above 0 and below the redshift where the rays end, {end}");
    of_option(Domain::inside(0.0, end), "--from-z", from, &allowed)
}

fn segment(args: &Args, sight: &LineOfSight) -> Result<Segment> {
    match (args.from_z, args.to_z) {
        (None, None) => Ok(sight.observer_to_source()),
        (None, Some(to)) => sight.observer_to(to),
        (Some(from), to) => sight.between(from, to.unwrap_or(args.z_source)),
    }
}
