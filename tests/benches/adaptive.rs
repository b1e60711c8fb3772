//! Times of exact and adaptive tracing, set-up of the planes included, as CSV; `just bench-peers` reads them.
//!
//! Arguments: `peers HALOES.csv` times one cone; `scaling` times cones, rays and threads.

use std::time::Instant;

use haloray::config::Preset;
use haloray::cosmology::Background;
use haloray::mapping::multiplane::{Accuracy, Field, LineOfSight, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::pipeline::{Silent, populate};

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

/// Median, smallest and largest seconds of some runs.
fn times(repeats: usize, mut run: impl FnMut()) -> [f64; 3] {
    let mut seconds: Vec<f64> = (0..repeats)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    [seconds[repeats / 2], seconds[0], seconds[repeats - 1]]
}

/// One line of the table: haloes sorted into planes and rays traced, from columns in memory to β in memory.
fn line(
    haloes: &haloray::halo::HaloCatalogue,
    side: usize,
    order: usize,
    accuracy: Accuracy,
    threads: usize,
    repeats: usize,
) {
    let theta = grid(side, 3.6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut report = None;
    let [median, low, high] = pool.install(|| {
        times(repeats, || {
            let sight = LineOfSight::new(haloes, Background::paper(), &Sheets::OnAxis).unwrap();
            let mapping = sight.observer_to_source().adaptive(accuracy, Field::around(&theta), theta.len());
            std::hint::black_box(mapping.map(&theta, ORDERS[order]));
            report = Some(mapping.report());
        })
    });
    let report = report.unwrap();
    println!(
        "{},{},{order},{accuracy},{threads},{median:.4},{low:.4},{high:.4},{:.1e},{:.1e},{}",
        haloes.len(),
        theta.len(),
        report.bound_arcsec,
        report.measured_arcsec,
        report.rays_traced_exactly
    );
}

fn peers(file: &str) {
    let haloes = haloray::io::read_haloes(file.as_ref(), Z_SOURCE, &Background::paper()).unwrap();
    for threads in [1, 2] {
        for accuracy in ACCURACIES {
            line(&haloes, 64, 0, accuracy, threads, 9);
        }
        line(&haloes, 500, 0, ACCURACIES[1], threads, 9);
        line(&haloes, 101, 2, ACCURACIES[1], threads, 9);
    }
}

fn scaling() {
    let mut config = Preset::Paper.config().unwrap();
    for cut in [4e-6, 1e-6, 1e-7, 1e-8, 0.0] {
        config.haloes.min_point_shear = cut;
        let haloes = populate(&config, None, 0, &Silent).unwrap().catalogue;
        line(&haloes, 64, 0, ACCURACIES[1], 2, if haloes.len() < 1_000_000 { 5 } else { 1 });
    }
    config.haloes.min_point_shear = 1e-6;
    let haloes = populate(&config, None, 0, &Silent).unwrap().catalogue;
    for side in [32, 64, 128, 256, 512, 1024] {
        line(&haloes, side, 0, ACCURACIES[1], 2, 5);
    }
    for side in [32, 64, 128] {
        line(&haloes, side, 0, ACCURACIES[0], 2, 3);
    }
    for (side, accuracy) in [(64, ACCURACIES[0]), (512, ACCURACIES[1])] {
        let most = std::thread::available_parallelism().map_or(1, usize::from);
        for threads in (0..).map(|k| 1 << k).take_while(|threads| *threads <= most) {
            line(&haloes, side, 0, accuracy, threads, 5);
        }
    }
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
