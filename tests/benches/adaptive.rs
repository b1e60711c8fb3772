//! Times of exact and adaptive tracing, set-up of the planes included, as CSV; `just bench-peers` reads them.
//!
//! Arguments: `peers HALOES.csv` times one cone; `scaling` times cones, rays and threads; `lenses` images through main lenses, as
//! the table of `just bench-lenses`.

use std::time::Instant;

use haloray::config::Preset;
use haloray::cosmology::Background;
use haloray::halo::HaloCatalogue;
use haloray::mapping::multiplane::{Accuracy, AccuracyReport, Field, LineOfSight, MainLens, Sheets};
use haloray::mapping::{Mapping, Order, RayBundle};
use haloray::monitor::Silent;
use haloray::pipeline::populate;
use haloray::profile::mass::{Epl, MassModel};

/// As the command has it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

const Z_SOURCE: f64 = 1.5;
const ACCURACIES: [Accuracy; 2] = [Accuracy::EXACT, Accuracy::WithinArcsec(1e-7)];
const ORDERS: [Order; 3] = [Order::Position, Order::Jacobian, Order::SecondDerivatives];

fn grid(side: usize, width_arcsec: f64) -> Vec<[f64; 2]> {
    let at = |i: usize| width_arcsec * ((i as f64 + 0.5) / side as f64 - 0.5);
    (0..side * side).map(|k| [at(k % side), at(k / side)]).collect()
}

const COLUMNS: &str = "haloes,rays,order,accuracy,threads,median_s,min_s,max_s,bound_arcsec,measured_arcsec,rays_traced_exactly";

/// Rays a side, order, accuracy, threads.
type Case = (usize, usize, Accuracy, usize);

/// Lines of the table: haloes sorted into planes and rays traced, from columns in memory to β in memory. The cases take
/// turns, so that a slower minute of the machine slows all of them.
fn lines(haloes: &HaloCatalogue, cases: &[Case], repeats: usize) {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let pools: Vec<rayon::ThreadPool> = cases.iter().map(|case| pool(case.3)).collect();
    let mut seconds = vec![Vec::with_capacity(repeats); cases.len()];
    let mut reports = vec![AccuracyReport::default(); cases.len()];
    for _ in 0..repeats {
        for (i, (side, order, accuracy, _)) in cases.iter().enumerate() {
            let theta = grid(*side, 3.6);
            let (elapsed, report) = pools[i].install(|| {
                let start = Instant::now();
                let sight = LineOfSight::new(haloes, &Sheets::OnAxis).unwrap();
                let field = Field::around(&theta);
                let mapping = sight.observer_to_source().adaptive(*accuracy, field, theta.len());
                std::hint::black_box(mapping.map(&theta, ORDERS[*order]));
                (start.elapsed().as_secs_f64(), mapping.report())
            });
            seconds[i].push(elapsed);
            reports[i] = report;
        }
    }
    for (((side, order, accuracy, threads), seconds), report) in cases.iter().zip(&mut seconds).zip(&reports)
    {
        seconds.sort_by(f64::total_cmp);
        println!(
            "{},{},{order},{accuracy},{threads},{:.4},{:.4},{:.4},{:.1e},{:.1e},{}",
            haloes.len(),
            side * side,
            seconds[repeats / 2],
            seconds[0],
            seconds[repeats - 1],
            report.bound_arcsec,
            report.measured_arcsec,
            report.rays_traced_exactly
        );
    }
}

fn peers(file: &str) {
    let haloes = haloray::io::read_haloes(file.as_ref(), Z_SOURCE, &Background::paper()).unwrap();
    let [exact, fine] = ACCURACIES;
    let cases = [(64, 0, exact), (64, 0, fine), (500, 0, fine), (101, 2, fine)];
    let with = |threads| cases.map(|(side, order, accuracy)| (side, order, accuracy, threads));
    lines(&haloes, &[with(1), with(2)].concat(), 15);
}

fn scaling() {
    let [exact, fine] = ACCURACIES;
    let mut config = Preset::Paper.config().unwrap();
    for cut in [4e-6, 1e-6, 1e-7, 1e-8, 0.0] {
        config.haloes.min_point_shear = cut;
        let haloes = populate(&config, None, 0, &Silent).unwrap().catalogue;
        lines(&haloes, &[(64, 0, fine, 2)], if haloes.len() < 1_000_000 { 5 } else { 1 });
    }
    config.haloes.min_point_shear = 1e-6;
    let haloes = populate(&config, None, 0, &Silent).unwrap().catalogue;
    for side in [32, 64, 128, 256, 512, 1024] {
        lines(&haloes, &[(side, 0, fine, 2)], 5);
    }
    for side in [32, 64, 128] {
        lines(&haloes, &[(side, 0, exact, 2)], 3);
    }
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (0..).map(|k| 1 << k).take_while(|threads| *threads <= most);
    let cases = threads.flat_map(|threads| [(64, 0, exact, threads), (512, 0, fine, threads)]);
    lines(&haloes, &cases.collect::<Vec<_>>(), 15);
}

/// Images through the main lens: exact and to two accuracies, on one thread, one table.
fn lenses() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let timed = |mapping: &(dyn Fn() -> (RayBundle, AccuracyReport) + Sync)| {
        let mut runs: Vec<(f64, (RayBundle, AccuracyReport))> = (0..3)
            .map(|_| {
                let start = Instant::now();
                let traced = pool.install(mapping);
                (start.elapsed().as_secs_f64(), traced)
            })
            .collect();
        runs.sort_by(|a, b| a.0.total_cmp(&b.0));
        runs.swap_remove(1)
    };
    println!(
        "| haloes | θ_E | slope | centre | rays | accuracy | exact, s | adaptive, s | ratio | bound | largest error of all | traced exactly |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let lenses =
        [(0.5, 2.0, [0.0; 2]), (1.0, 2.1, [0.1, -0.2]), (1.5, 2.6, [0.0; 2]), (2.0, 1.9, [-0.3, 0.2])];
    for (seed, (radius, slope, off)) in (101..).zip(lenses) {
        let mut config = Preset::Paper.config().unwrap();
        config.seed = seed;
        let haloes = populate(&config, None, 0, &Silent).unwrap();
        let sight = haloray::pipeline::line_of_sight(&config, &haloes, &haloes.catalogue).unwrap();
        let axis = sight.observer_to(0.5).unwrap().map(&[[0.0; 2]], Order::Position).beta_arcsec[0];
        let centre = [axis[0] + off[0], axis[1] + off[1]];
        let profile = MassModel::Epl(Epl::new(radius, slope, [0.1, -0.05], centre).unwrap());
        let segment = sight.through_lens(&MainLens { z: 0.5, profile }).unwrap();
        for side in [64, 320] {
            let theta = grid(side, 3.6);
            let (exact_s, (exact, _)) =
                timed(&|| (segment.map(&theta, Order::Position), AccuracyReport::default()));
            for arcsec in [1e-7, 1e-5] {
                let (seconds, (ours, report)) = timed(&|| {
                    let accuracy = Accuracy::WithinArcsec(arcsec);
                    let mapping = segment.adaptive(accuracy, Field::around(&theta), theta.len());
                    (mapping.map(&theta, Order::Position), mapping.report())
                });
                let gaps = ours.beta_arcsec.iter().zip(&exact.beta_arcsec);
                let worst = gaps.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
                println!(
                    "| {} | {radius}″ | {slope} | {off:?} | {} | {arcsec:.0e}″ | {exact_s:.3} | {seconds:.3} | {:.1} | {:.1e}″ | {worst:.1e}″ | {} |",
                    haloes.catalogue.len(),
                    theta.len(),
                    exact_s / seconds,
                    report.bound_arcsec,
                    report.rays_traced_exactly
                );
            }
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let words: Vec<&str> = arguments[1..].iter().map(String::as_str).filter(|a| *a != "--bench").collect();
    match words.as_slice() {
        ["peers", file] => {
            println!("{COLUMNS}");
            peers(file);
        }
        ["scaling"] => {
            println!("{COLUMNS}");
            scaling();
        }
        ["lenses"] => lenses(),
        _ => eprintln!("arguments: peers HALOES.csv | scaling | lenses"),
    }
}
