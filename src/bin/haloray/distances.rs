//! `haloray distances`: distances of flat ΛCDM to given redshifts.

use std::fmt::Write;

use haloray::error::Domain;
use haloray::{Error, Result};

use crate::settings::{Cosmology, of_option};

/// Print distances between us, given redshifts and, if one is given, a source.
///
/// CSV on stdout: z, comoving and angular diameter distance from us and, with --z-source, to the source, in Mpc.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray distances 0.5 1.0 --z-source 1.5")]
pub struct Args {
    /// Redshifts.
    #[arg(value_name = "Z", required = true)]
    z: Vec<f64>,
    /// Also print the distances from each redshift to this one.
    #[arg(long, value_name = "Z")]
    z_source: Option<f64>,
    #[command(flatten)]
    cosmology: Cosmology,
}

pub fn run(args: &Args) -> Result<()> {
    let background = args.cosmology.background()?;
    for &z in args.z.iter().chain(&args.z_source) {
        of_option(Domain::from_to(0.0, 1100.0), "redshift", z, "from 0 to 1100")?;
    }
    if let Some(source) = args.z_source
        && let Some(behind) = args.z.iter().find(|z| **z > source)
    {
        return Err(Error::argument(
            "--z-source",
            source,
            &format!("at least every other redshift: {behind} is one"),
        ));
    }
    let mut text = String::from("z,comoving_mpc,angular_diameter_mpc");
    if args.z_source.is_some() {
        text += ",comoving_to_source_mpc,angular_diameter_to_source_mpc";
    }
    text.push('\n');
    for &z in &args.z {
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{z},{},{}",
            background.comoving_distance_mpc(z),
            background.angular_diameter_distance_mpc(z)
        );
        if let Some(source) = args.z_source {
            let comoving = background.comoving_distance_between_mpc(z, source);
            let _ =
                write!(text, ",{comoving},{}", background.angular_diameter_distance_between_mpc(z, source));
        }
        text.push('\n');
    }
    crate::terminal::print_result(&text)
}
