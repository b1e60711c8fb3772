//! Times of exact and adaptive tracing, set-up of the planes included, as CSV; `just bench-peers` reads them.
//!
//! Arguments: `peers HALOES.csv` times one cone; `scaling` times cones, rays and threads.

use std::time::Instant;

use haloray::config::Preset;
use haloray::cosmology::Background;
use haloray::halo::HaloCatalogue;
use haloray::mapping::multiplane::{Accuracy, AccuracyReport, Field, LineOfSight, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::monitor::Silent;
use haloray::pipeline::populate;

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

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let words: Vec<&str> = arguments[1..].iter().map(String::as_str).filter(|a| *a != "--bench").collect();
    println!(
        "haloes,rays,order,accuracy,threads,median_s,min_s,max_s,bound_arcsec,measured_arcsec,rays_traced_exactly"
    );
    match words.as_slice() {
        ["peers", file] => peers(file),
        ["scaling"] => scaling(),
        _ => eprintln!("arguments: peers HALOES.csv | scaling"),
    }
}
