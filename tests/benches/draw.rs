//! Drawing the paper's population: ten million haloes and the cut, the direct draw, and the whole of `populate`.
//!
//! `cargo bench --bench draw`.

mod cone;

use divan::Bencher;
use haloray::halo::{draw_brute_force, draw_direct};
use haloray::monitor::Silent;
use haloray::pipeline::populate;

fn main() {
    divan::main();
}

#[divan::bench(args = [1, 2], sample_count = 9, sample_size = 1)]
fn brute_force_draw_and_cut(bencher: Bencher, threads: usize) {
    let population = cone::haloes(&cone::config()).population;
    let pool = cone::pool(threads);
    bencher.bench_local(|| pool.install(|| draw_brute_force(&population, 1, 0, &Silent).unwrap()));
}

#[divan::bench(args = [1, 2], sample_count = 30, sample_size = 1)]
fn direct_draw(bencher: Bencher, threads: usize) {
    let population = cone::haloes(&cone::config()).population;
    let pool = cone::pool(threads);
    bencher.bench_local(|| pool.install(|| draw_direct(&population, 1, 0, &Silent).unwrap()));
}

/// σ(M), mass function, direct draw, redshifts, concentrations, angles.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn populate_directly(bencher: Bencher) {
    let config = cone::config();
    bencher.bench_local(|| populate(&config, None, 0, &Silent));
}
