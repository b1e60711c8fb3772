//! `haloray study expected`: the γ_LOS that is to be expected of real lenses.

use std::path::PathBuf;

use haloray::ensemble::{EnsembleStatistics, StoredStacks};
use haloray::ensemble::{ExpectedShear, Level, Plan, assemble, expected_shears, stacks_of};
use haloray::io::{Column, RAYS_GROUP, Table, read_lenses};
use haloray::report::{
    SIGHTLINES_FILE, expected_figure, markdown_table, number_text, result_text, smoothing_figure,
    stage_figure, with_error_text,
};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::ensemble::{computed, distinct};
use crate::output::{begin, finish_study};
use crate::record::{configured, option};
use crate::settings::{Settings, Tracing, check_many, provenance, whole};
use crate::terminal::warn;

/// Which shear of the line of sight is to be expected for each lens of a table, and what smoothing hides of it.
///
/// N sightlines of each lens are drawn; γ_LOS is that of the axis ray, averaged along the beam of the Einstein ring, and
/// averaged over discs, as maps of simulations are that are smoothed over arcseconds to arcminutes. Writes expected.csv (one
/// row a lens and average), sightlines.h5 (one row a sightline), figures and result.md. What has ended is kept: the same
/// command goes on where it was stopped.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray study expected --preset consistent --lenses lenses.csv -o expected\n  \
                  haloray study expected --lenses lenses.csv -n 5000 --smoothing 5,20,60,180 -o expected\n\n\
                  On a cluster: haloray ensemble --lenses lenses.csv --smoothing 10,30,60 --submit slurm … has the same sightlines."
)]
pub struct ExpectedArgs {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    tracing: Tracing,
    /// Table of lenses: columns z_lens, z_source, optionally einstein_radius_arcsec and name.
    #[arg(long, value_name = "FILE")]
    lenses: PathBuf,
    /// Sightlines of each lens.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 1000)]
    #[arg(value_parser = whole::<u64>(2..=(1 << 30) - 1))]
    number: u64,
    /// Radii of the discs over which γ_LOS is averaged.
    #[arg(long, value_name = "ARCSEC,…", value_delimiter = ',', default_value = "10,30,60")]
    smoothing: Vec<f64>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

const FILES: [&str; 8] = [
    SIGHTLINES_FILE,
    "expected.csv",
    "expected.svg",
    "expected.png",
    "smoothing.svg",
    "smoothing.png",
    "config.toml",
    "result.md",
];

pub fn run(args: &ExpectedArgs, bars: &Bars) -> Result<()> {
    let mut config = args.settings.resolve()?;
    args.tracing.apply(&mut config);
    check_many(&config, "study expected")?;
    let lenses = read_lenses(&args.lenses)?;
    if lenses.is_empty() {
        return Err(Error::argument("--lenses", args.lenses.display(), "a table with at least one lens"));
    }
    let number = args.number * lenses.len() as u64;
    let (level, model, smoothing_arcsec) = (Level::Scalars, String::new(), distinct(&args.smoothing));
    let plan = Plan { config, lenses, level, model, smoothing_arcsec, first: 0, number };
    plan.check()?;
    let provenance = provenance(&plan.config, 0)?;
    let staging = begin(&args.output, &FILES, bars)?;
    let store = computed(&plan, plan.numbers(), &provenance, &args.output, bars)?;
    let sightlines = assemble(&plan, plan.numbers(), &provenance, &store)?;
    for (number, reason) in EnsembleStatistics::of(&sightlines).failures {
        warn(format_args!("sightline {number} failed: {reason}"));
    }
    let stacks = stacks_of(&plan.config, level);
    let rows = StoredStacks { store: &store, specs: &stacks };
    staging.write(SIGHTLINES_FILE, |path| sightlines.write(path, &stacks, &rows))?;
    let expected = expected_shears(&sightlines, plan.config.lens.einstein_radius_arcsec);
    let table = table(&expected)?;
    staging.write("expected.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    stage_figure(&staging, "expected", || Ok(Some(expected_figure(&expected))))?;
    stage_figure(&staging, "smoothing", || Ok(Some(smoothing_figure(&expected))))?;
    let about =
        "γ_LOS that is to be expected for each lens, and what is left of it when it is averaged over discs.";
    let lenses = ["--lenses".to_string(), "lenses.csv".into()];
    let options =
        [option("-n", args.number, 1000), option("--smoothing", listed(&args.smoothing), "10,30,60"), lenses];
    let record = configured(&staging, "study expected", &options.concat(), about, &provenance)?;
    let shows = [
        ("expected", "distributions of the size of γ_LOS, lens by lens"),
        ("smoothing", "the spread of γ_LOS against the radius over which it is averaged"),
    ];
    finish_study(staging, &result_text(&summary(&expected), &shows), &record, bars)?;
    store.remove();
    Ok(())
}

fn listed(radii: &[f64]) -> String {
    radii.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

fn table(rows: &[ExpectedShear]) -> Result<Table> {
    let text = |of: &dyn Fn(&ExpectedShear) -> String| rows.iter().map(of).collect();
    let column = |name: &str, unit: Option<&str>, of: &dyn Fn(&ExpectedShear) -> f64| {
        Column::f64(name, unit, rows.iter().map(of).collect())
    };
    let lens = |of: fn(&haloray::io::TabledLens) -> f64| {
        move |row: &ExpectedShear| row.lens.as_ref().map_or(f64::NAN, of)
    };
    let mut columns = vec![
        Column::text("name", text(&|row| row.lens.as_ref().map_or(String::new(), |lens| lens.name.clone()))),
        column("z_lens", None, &lens(|lens| lens.z_lens)),
        column("z_source", None, &lens(|lens| lens.z_source)),
        Column::text("averaged_over", text(&|row| row.smoothing.name().trim_end_matches('″').into())),
        column("radius_arcsec", Some("arcsec"), &|row| row.radius_arcsec),
        column("number_of_sightlines", None, &|row| row.sizes.len() as f64),
        column("sigma_gamma_los", None, &|row| row.sigma[0]),
        column("sigma_gamma_los_error", None, &|row| row.sigma[1]),
    ];
    for (i, part) in ["16", "50", "84", "97_5"].into_iter().enumerate() {
        columns.push(column(&format!("abs_gamma_los_{part}_per_cent"), None, &|row| row.quantiles[i]));
    }
    Table::new(columns)
}

fn summary(rows: &[ExpectedShear]) -> String {
    let line = |row: &ExpectedShear| {
        let (name, redshifts) = match &row.lens {
            Some(lens) => (lens.name.clone(), format!("{}, {}", lens.z_lens, lens.z_source)),
            None => Default::default(),
        };
        let numbers = row.quantiles.map(|value| number_text(value, 3));
        let own = [name, redshifts, row.smoothing.name(), with_error_text(row.sigma[0], row.sigma[1])];
        own.into_iter().chain(numbers).collect()
    };
    let head = [
        "lens",
        "z_l, z_s",
        "averaged over",
        "σ of a component",
        "size of γ_LOS: 16%",
        "50%",
        "84%",
        "97.5%",
    ];
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let each = rows.first().map_or(0, |row| row.sizes.len());
    format!("{each} sightlines of each lens.\n\n{}", markdown_table(&head, &lines))
}
