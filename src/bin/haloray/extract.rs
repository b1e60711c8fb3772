//! `haloray extract`: sightlines from a light cone of an N-body simulation, a halo table each.

use std::path::PathBuf;

use haloray::config::{Config, LightconeConfig};
use haloray::halo::MassDefinition;
use haloray::io::{CONE_INDEX_FILE, ConeExtraction, extract_cone, write_cone};
use haloray::report::{grouped, stage_text};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{begin, commit, print_files};
use crate::settings::{Layers, provenance, whole};
use crate::summary::counted;
use crate::terminal::{print, warn};

/// Take sightlines from a light cone of haloes: at random directions, or centred on haloes of a mass near the lens.
///
/// A light cone has right ascension, declination, redshift, mass and, if known, concentration; it is read in parts, however
/// many haloes and files it has. A column's unit and definition stand in the file or are given here; nothing is guessed, and
/// what was understood is told. DIR/haloes/NNNNN.h5 is the halo table of a sightline (z, theta_x_arcsec to the west,
/// theta_y_arcsec to the north, m200c_msun, c200c, lightcone_row), for `haloes.catalogue` and --haloes; DIR/sightlines.csv says
/// where each points. `haloes.lightcone = "DIR"` gives them to `haloray ensemble`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray extract cone.h5 -n 500 --z-lens 0.5 --z-source 1.5 -o sightlines\n  \
                  haloray extract part.*.fits -n 500 --mass Mvir --mass-unit Msun/h --h 0.7 -o lines\n  \
                  haloray extract cone.h5 -n 100 --behind-mass 1e13,1e14 --footprint 350,10,-5,5 -o groups\n  \
                  haloray extract cone.h5 -n 1000 --set haloes.cut_imported=true -o cut\n  \
                  haloray ensemble -n 500 --set haloes.lightcone=sightlines -o ensemble"
)]
pub struct Args {
    /// The files of the light cone (.csv, .h5, .fits), all with the same columns; `haloes.lightcone` of --config when left out.
    #[arg(value_name = "LIGHTCONE")]
    files: Vec<PathBuf>,
    /// Sightlines.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", value_parser = whole::<u64>(1..=(1 << 32) - 1))]
    number: u64,
    /// Number of the first sightline; a number is the same sightline whichever are taken beside it.
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = whole::<u64>(0..=(1 << 32) - 1))]
    first: u64,
    /// Redshift of the lens, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "Z")]
    z_lens: Option<f64>,
    /// Redshift of the source, where the cylinders end, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "Z")]
    z_source: Option<f64>,
    /// Folder for the sightlines.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// TOML file of a configuration: radius of the cylinders, cosmology, concentrations, shear cut.
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    #[command(flatten)]
    layers: Layers,
    #[command(flatten)]
    cone: Cone,
}

/// What a light cone does not say itself.
#[derive(clap::Args)]
#[command(next_help_heading = "What the files do not say")]
struct Cone {
    /// Column of right ascensions; known are ra_deg, ra, ra_rad, right_ascension.
    #[arg(long, value_name = "COLUMN")]
    ra: Option<String>,
    /// Column of declinations; known are dec_deg, dec, dec_rad, declination.
    #[arg(long, value_name = "COLUMN")]
    dec: Option<String>,
    /// Column of redshifts; known are z, redshift.
    #[arg(long, value_name = "COLUMN")]
    redshift: Option<String>,
    /// Column of masses; known are m200c_msun, M200c, Mvir, m200m_msun_h ….
    #[arg(long, value_name = "COLUMN")]
    mass: Option<String>,
    /// Column of concentrations; known are c200c, cvir ….
    #[arg(long, value_name = "COLUMN")]
    concentration: Option<String>,
    /// Unit of both angles: deg, rad, hourangle, arcmin, arcsec.
    #[arg(long, value_name = "UNIT")]
    angle_unit: Option<String>,
    /// Unit of the masses: Msun, Msun/h, 1e10 Msun/h.
    #[arg(long, value_name = "UNIT")]
    mass_unit: Option<String>,
    /// H0/100 of the simulation, for masses in units with h.
    #[arg(long, allow_negative_numbers = true, value_name = "H")]
    h: Option<f64>,
    /// Definition of the masses: 200c, 200m, vir, 500c.
    #[arg(long, value_name = "DEFINITION")]
    mass_definition: Option<MassDefinition>,
    /// Definition of the concentrations.
    #[arg(long, value_name = "DEFINITION")]
    concentration_definition: Option<MassDefinition>,
    /// Where sightlines may point, degrees, through 0 where the first is larger; the box around the haloes when left out.
    #[arg(long, allow_hyphen_values = true, value_name = "full-sky|RA,RA,DEC,DEC", value_parser = footprint)]
    #[arg(help_heading = "Which sightlines")]
    footprint: Option<Corners>,
    /// Centre sightlines on haloes of M200c in this range near --z-lens, which are left out as the main lens.
    #[arg(long, value_name = "MSUN,MSUN", value_parser = masses, help_heading = "Which sightlines")]
    behind_mass: Option<Masses>,
    /// How far in redshift these may be from --z-lens; 0.02 when left out.
    #[arg(long, allow_negative_numbers = true, value_name = "DZ", help_heading = "Which sightlines")]
    behind_delta_z: Option<f64>,
    /// Leave out rows with values that no halo has, and say how many, instead of stopping there.
    #[arg(long)]
    skip_bad_rows: bool,
}

type Corners = [f64; 4];
type Masses = [f64; 2];

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn footprint(text: &str) -> std::result::Result<Corners, String> {
    match text {
        "full-sky" => Ok([0.0, 360.0, -90.0, 90.0]),
        _ => numbers(text).ok_or("must be full-sky or four numbers: RA,RA,DEC,DEC".into()),
    }
}

fn masses(text: &str) -> std::result::Result<Masses, String> {
    numbers(text).ok_or("must be two masses: 1e13,1e14".into())
}

impl Cone {
    /// The configured light cone, or that of `files`, with what the options say.
    fn over(&self, configured: Option<LightconeConfig>, files: &[PathBuf]) -> Result<LightconeConfig> {
        let mut cone = configured.unwrap_or_default();
        if !files.is_empty() {
            cone.files = files.to_vec();
        }
        if cone.files.is_empty() {
            return Err(Error::argument(
                "LIGHTCONE",
                "missing",
                "at least one file, or --config with haloes.lightcone",
            ));
        }
        let texts = [
            (&mut cone.ra, &self.ra),
            (&mut cone.dec, &self.dec),
            (&mut cone.redshift, &self.redshift),
            (&mut cone.mass, &self.mass),
            (&mut cone.concentration, &self.concentration),
            (&mut cone.angle_unit, &self.angle_unit),
            (&mut cone.mass_unit, &self.mass_unit),
        ];
        for (own, said) in texts {
            *own = said.clone().or(own.take());
        }
        cone.h = self.h.or(cone.h);
        cone.mass_definition = self.mass_definition.or(cone.mass_definition);
        cone.concentration_definition = self.concentration_definition.or(cone.concentration_definition);
        cone.footprint_deg = self.footprint.or(cone.footprint_deg);
        cone.behind_mass_msun = self.behind_mass.or(cone.behind_mass_msun);
        cone.behind_delta_z = self.behind_delta_z.or(cone.behind_delta_z);
        cone.skip_bad_rows |= self.skip_bad_rows;
        if let (Some(delta), None) = (self.behind_delta_z, cone.behind_mass_msun) {
            return Err(Error::argument("--behind-delta-z", delta, "left out without --behind-mass"));
        }
        Ok(cone)
    }
}

impl Args {
    fn resolve(&self) -> Result<(Config, LightconeConfig)> {
        let redshifts = [("z_lens", self.z_lens), ("z_source", self.z_source)];
        let set = |(key, z): (&str, Option<f64>)| z.map(|z| format!("line_of_sight.{key}={z:?}"));
        let set: Vec<String> = redshifts.into_iter().filter_map(set).collect();
        let mut config = self.layers.resolve(self.config.as_deref(), &set)?;
        let cone = self.cone.over(config.haloes.lightcone.take(), &self.files)?;
        (config.haloes.catalogue, config.haloes.lightcone) = (None, Some(cone.clone()));
        config.validate().map_err(|error| {
            let options = [
                ("h", "--h"),
                ("footprint_deg", "--footprint"),
                ("behind_mass_msun", "--behind-mass"),
                ("behind_delta_z", "--behind-delta-z"),
            ];
            options
                .iter()
                .fold(error, |error, (key, option)| error.named(&format!("haloes.lightcone.{key}"), option))
        })?;
        Ok((config, cone))
    }
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let (config, cone) = args.resolve()?;
    if let Some(folder) = cone.files.iter().find(|file| file.is_dir()) {
        let allowed = "a file of a light cone, not a folder";
        return Err(Error::argument("LIGHTCONE", folder.display(), allowed));
    }
    let provenance = provenance(&config, 0)?;
    let staging = begin(&args.output, &[CONE_INDEX_FILE, "config.toml"], bars)?;
    let numbers: Vec<u64> = (args.first..args.first + args.number).collect();
    let extraction = extract_cone(&config, &cone, &numbers, config.line_of_sight.z_source, bars)?;
    write_cone(&extraction.sightlines, &staging, &provenance, bars)?;
    stage_text(&staging, "config.toml", &provenance.config_toml)?;
    let files = bars.stage("files onto the disk", || commit(staging))?;
    tell(&extraction, bars);
    print_files(&files, bars)
}

fn tell(extraction: &ConeExtraction, bars: &Bars) {
    if extraction.bad_row_count > 0 {
        let bad = grouped(extraction.bad_row_count as f64);
        warn(format_args!("{bad} rows were left out: they hold values that no halo has"));
    }
    let counts: Vec<usize> = extraction.sightlines.iter().map(|sightline| sightline.haloes.len()).collect();
    let empty = counts.iter().filter(|count| **count == 0).count();
    if empty > 0 {
        warn(format_args!("{} without any halo", counted(empty, "sightline", "sightlines")));
    }
    if !bars.is_quiet() {
        let total: usize = counts.iter().sum();
        let (fewest, most) = (counts.iter().min().copied(), counts.iter().max().copied());
        print(&format!(
            "{} from {} haloes: {} in them, {} to {} each\n",
            counted(counts.len(), "sightline", "sightlines"),
            grouped(extraction.row_count as f64),
            grouped(total as f64),
            grouped(fewest.unwrap_or(0) as f64),
            grouped(most.unwrap_or(0) as f64),
        ));
    }
}
