//! `haloray ensemble`: many sightlines into one table, in parts and with interruptions if need be.

use std::ops::Range;
use std::path::{Path, PathBuf};

use haloray::ensemble::{
    EnsembleStatistics, Level, Plan, Shard, SightlineStore, StoredStacks, assemble, run as compute, stacks_of,
};
use haloray::inference::model::ModelDescription;
use haloray::io::{Provenance, read_lenses};
use haloray::mapping::tidal::LineOfSightKind;
use haloray::report::{SIGHTLINES_FILE, number_text, with_error_text, write_ensemble};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{begin, commit, print_files};
use crate::saved::hidden_beside;
use crate::settings::{Settings, Tracing, check_many, provenance, psf, whole, with_named_files};
use crate::slurm;
use crate::terminal::{print, warn};

/// The model of fits where none is named.
const FIT_MODEL: &str = "tidal-minimal";

/// Many sightlines of a configuration, or of a table of lenses, into one table with statistics and figures.
///
/// Sightline K is that of `haloray simulate --sightline K` to the last bit, whatever is computed beside it: alone, in any
/// shard, on any number of threads. DIR/sightlines.h5 has one row a sightline (`xarray.open_dataset(…,
/// group="sightlines")`), summary.json means, quantiles and covariances, figures/ distributions. What has ended is kept:
/// the same command goes on where it was stopped and ends with the same bytes.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  haloray ensemble -n 10000 -o ensemble\n  \
                  haloray ensemble --preset consistent -n 1000 --level images -o images\n  \
                  haloray ensemble -n 200 --lenses lenses.csv -o lenses        # 200 of each lens\n  \
                  haloray ensemble -n 10000 --shard 2/8 -o parts/2             # then `haloray merge`\n  \
                  haloray ensemble -n 100000 --submit slurm --shards 50 --time 2:00:00 --memory 1G -o many\n  \
                  haloray ensemble -n 1 --first 123 -o one                     # sightline 123 alone")]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    tracing: Tracing,
    /// Sightlines, of each lens where there is a table of lenses.
    #[arg(
        long,
        short,
        allow_negative_numbers = true,
        value_name = "N",
        required_unless_present = "sightline"
    )]
    #[arg(value_parser = whole::<u64>(1..=(1 << 40) - 1))]
    number: Option<u64>,
    /// Table of lenses: columns z_lens, z_source, optionally einstein_radius_arcsec and name.
    #[arg(long, value_name = "FILE")]
    lenses: Option<PathBuf>,
    /// How much is computed: scalars; also maps; both images; fits of the image through all haloes.
    #[arg(long, value_name = "scalars|maps|images|fits", default_value_t = Level::Scalars)]
    level: Level,
    /// The built-in model of the fits.
    #[arg(long, value_name = "NAME", default_value = FIT_MODEL)]
    model: String,
    /// Radii of discs about the axis ray over which γ_LOS is averaged too, as smoothed maps have it.
    #[arg(long, value_name = "ARCSEC,…", value_delimiter = ',')]
    smoothing: Vec<f64>,
    /// Number of the first sightline.
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = whole::<u64>(0..=(1 << 40) - 1))]
    first: u64,
    /// Sightline K alone, as it stands in every ensemble of more than K of them.
    #[arg(long, value_name = "K", conflicts_with_all = ["number", "first", "shard"])]
    #[arg(value_parser = whole::<u64>(0..=(1 << 40) - 1))]
    sightline: Option<u64>,
    /// Part I of K of the ensemble; `haloray merge` puts the parts together.
    #[arg(long, value_name = "I/K", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// Folder for the results; made if missing, files of an earlier run are replaced.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    slurm: slurm::Args,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let mut config = args.settings.resolve()?;
    args.tracing.apply(&mut config);
    check_many(&config, "an ensemble")?;
    let description = ModelDescription::built_in(&args.model)?;
    if args.level == Level::Fits && description.line_of_sight.model == LineOfSightKind::Haloes {
        return Err(Error::argument("--model", &args.model, "one with gamma1_los and gamma2_los"));
    }
    if args.level != Level::Fits && args.model != FIT_MODEL {
        return Err(Error::argument("--model", &args.model, "left out without --level fits"));
    }
    let lenses = args.lenses.as_deref().map(read_lenses).transpose()?.unwrap_or_default();
    let (first, number) = match args.sightline {
        Some(sightline) => (sightline, 1),
        None => (args.first, args.number.unwrap_or(1) * lenses.len().max(1) as u64),
    };
    let (level, model, smoothing_arcsec) = (args.level, args.model.clone(), distinct(&args.smoothing));
    let plan = Plan { config, lenses, level, model, smoothing_arcsec, first, number };
    plan.check()?;
    if args.slurm.is_asked_for() {
        return args.slurm.submit(&plan, args.lenses.as_deref(), &args.output, bars);
    }
    let numbers = args.shard.numbers(&plan.numbers());
    if numbers.is_empty() {
        let allowed = format!("at most as many shards as sightlines ({number})");
        return Err(Error::argument("--shard", args.shard.to_string(), &allowed));
    }
    let provenance = provenance(&plan.config, 0)?;
    let staging = begin(&args.output, &[SIGHTLINES_FILE, "summary.json", "config.toml"], bars)?;
    let store = computed(&plan, numbers.clone(), &provenance, &args.output, bars)?;
    let stacks = stacks_of(&plan.config, plan.level);
    let statistics = bars.stage("files and figures", || {
        let table = assemble(&plan, numbers, &provenance, &store)?;
        write_ensemble(&table, &stacks, &StoredStacks { store: &store, specs: &stacks }, &staging)
    })?;
    let files = commit(staging)?;
    store.remove();
    tell(&statistics, &files, bars)
}

/// Radii of discs in ascending order, each once.
pub fn distinct(radii_arcsec: &[f64]) -> Vec<f64> {
    let mut radii = radii_arcsec.to_vec();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    radii
}

/// The store of an ensemble for `output` with every sightline of `numbers`: those that have ended before, and the others.
pub fn computed(
    plan: &Plan,
    numbers: Range<u64>,
    provenance: &Provenance,
    output: &Path,
    bars: &Bars,
) -> Result<SightlineStore> {
    let path = store_beside(output);
    bars.keeps("the sightlines that have ended", &path);
    let psf = psf(&plan.config)?;
    let identity = plan.identity(&with_named_files(&plan.config, &psf, &provenance.config_toml));
    let (store, replaced) = SightlineStore::open(&path, &identity, numbers.clone())?;
    if let Some(why) = replaced {
        warn(format_args!("{}: the saved state is {why}; the work begins anew", path.display()));
    }
    compute(plan, numbers, &psf, &store, bars)?;
    Ok(store)
}

/// Where the sightlines of an unfinished ensemble are kept.
pub fn store_beside(output: &Path) -> PathBuf {
    hidden_beside(output, "ensemble")
}

/// What an ensemble amounts to, in a few lines.
///
/// # Errors
/// Where a program does not get its JSON.
pub fn tell(statistics: &EnsembleStatistics, files: &[PathBuf], bars: &Bars) -> Result<()> {
    for (number, reason) in &statistics.failures {
        warn(format_args!("sightline {number} failed: {reason}"));
    }
    if !bars.is_quiet() {
        let with_error = |[value, error]: [f64; 2]| match error.is_finite() {
            true => with_error_text(value, error),
            false => number_text(value, 3),
        };
        print(&format!(
            "sightlines {}, failed {}\nrms |γ_LOS|  axis {}   ring {}\n\n",
            statistics.number_of_sightlines,
            statistics.number_failed,
            with_error(statistics.rms_gamma_los),
            with_error(statistics.rms_gamma_los_ring)
        ));
        let line = |(name, told): &(&str, &str)| -> Option<String> {
            let column = statistics.columns.get(*name)?;
            let numbers =
                [&column["mean"], &column["quantiles"][1], &column["quantiles"][2], &column["quantiles"][3]];
            let numbers: Option<Vec<String>> =
                numbers.into_iter().map(|number| Some(number_text(number.as_f64()?, 4))).collect();
            let cells: String = numbers?.iter().map(|number| format!("{number:>12}")).collect();
            Some(format!("{told:<14}{cells}\n"))
        };
        let heads: String = ["mean", "16%", "50%", "84%"].iter().map(|head| format!("{head:>12}")).collect();
        let names = [
            ("number_of_haloes", "haloes"),
            ("kappa_los", "κ_LOS"),
            ("delta_tot", "Δ_tot"),
            ("delta_tot_ring", "Δ_tot, ring"),
            ("largest_kappa_h", "largest κ_h"),
        ];
        print(&format!("{:<14}{heads}\n{}", "", names.iter().filter_map(line).collect::<String>()));
    }
    print_files(files, bars)
}
