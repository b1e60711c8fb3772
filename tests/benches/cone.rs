//! What the benchmarks measure with: the paper's cone (seed 1), square bundles of rays, thread pools.

#![allow(dead_code, reason = "each benchmark uses its part")]

use haloray::config::{Config, Preset};
use haloray::mapping::multiplane::LineOfSight;
use haloray::monitor::Silent;
use haloray::pipeline::{Haloes, line_of_sight, populate};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Rays a side of the bundles.
pub const SIDE: usize = 64;

/// The preset `paper` with its own seed, 1.
pub fn config() -> Config {
    Preset::Paper.config().expect("the embedded preset resolves")
}

/// The 34,808 haloes of the preset.
pub fn haloes(config: &Config) -> Haloes {
    populate(config, None, 0, &Silent).expect("the preset draws")
}

/// Those haloes as planes, each with its sheet.
pub fn sight(config: &Config) -> LineOfSight {
    let haloes = haloes(config);
    line_of_sight(config, &haloes, &haloes.catalogue).expect("the preset traces")
}

/// 64×64 rays on the paper's pixels of 0.08″.
pub fn rays() -> Vec<[f64; 2]> {
    let at = |i: usize| 0.08 * (i as f64 - 0.5 * (SIDE - 1) as f64);
    (0..SIDE * SIDE).map(|k| [at(k % SIDE), at(k / SIDE)]).collect()
}

/// A pool of its own, so that the threads of a measurement are exactly those it names.
pub fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
}
