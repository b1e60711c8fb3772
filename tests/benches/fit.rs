//! The likelihood of the paper's Table 1 image (49×49 pixels), one core: value, value with gradient, Fisher matrix; and what a
//! kernel of 41×41 pixels costs beside a Gaussian of three on an image of 120×120.
//!
//! `cargo bench --bench fit`.

use divan::Bencher;
use haloray::imaging::{Psf, SkyGrid};
use haloray::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::{ImageLikelihood, LatentLikelihood, Observation, find_start};
use haloray::monitor::Silent;
use haloray::pipeline::{Table1Image, table1_image};

/// As the command has it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() {
    divan::main();
}

const KINDS: [&str; 2] = ["gaussian", "lenstronomy"];

fn likelihood(kind: &str) -> (ImageLikelihood, Vec<f64>) {
    let Table1Image { exposure, instrument, .. } = table1_image(1).expect("the table is valid");
    let psf = Psf::gaussian(0.08, 3.0, 0.08).expect("a Gaussian");
    let observation = Observation {
        grid: exposure.grid,
        used: vec![true; exposure.noisy_e_s.len()],
        data_e_s: exposure.noisy_e_s,
        background_rms_e_s: instrument.background_rms_e_s(),
        exposure_s: instrument.exposure_s,
        psf,
    };
    let description = ModelDescription::built_in("simple-minimal").expect("built in");
    let model = CompiledModel::new(&description).expect("a model");
    let kind = if kind == "gaussian" { LikelihoodKind::Gaussian } else { LikelihoodKind::Lenstronomy };
    let likelihood = ImageLikelihood::new(observation, model, kind, &Silent).expect("an image");
    let start = find_start(&likelihood, 1, &Silent).expect("a start");
    (likelihood, start.latent)
}

#[divan::bench(args = KINDS)]
fn value(bencher: Bencher, kind: &str) {
    let (likelihood, z) = likelihood(kind);
    bencher.bench_local(|| likelihood.log_likelihood(&z));
}

#[divan::bench(args = KINDS)]
fn value_and_gradient(bencher: Bencher, kind: &str) {
    let (likelihood, z) = likelihood(kind);
    let mut gradient = vec![0.0; z.len()];
    bencher.bench_local(|| likelihood.log_likelihood_gradient(&z, &mut gradient));
}

#[divan::bench(args = KINDS)]
fn fisher_matrix(bencher: Bencher, kind: &str) {
    let (likelihood, z) = likelihood(kind);
    bencher.bench_local(|| likelihood.curvature(&z));
}

/// Table 1's model on 120×120 pixels of 0.05″ behind a Gaussian of three pixels, or its 41×41 pixels as a kernel.
fn behind(psf: &str) -> (ImageLikelihood, Vec<f64>) {
    let grid = SkyGrid::new(120, 0.05).expect("a grid");
    let gaussian = Psf::gaussian(0.15, 5.0, 0.05).expect("a Gaussian");
    let distance = |i: usize| ((i % 41) as f64 - 20.0).hypot((i / 41) as f64 - 20.0);
    let weights = (0..41 * 41).map(|i| (-4.0 * 2.0_f64.ln() * (distance(i) / 3.0).powi(2)).exp()).collect();
    let kernel = Psf::kernel(41, 41, weights, 1).expect("a kernel");
    let observation = Observation {
        grid,
        used: vec![true; 120 * 120],
        data_e_s: vec![0.01; 120 * 120],
        background_rms_e_s: 0.006,
        exposure_s: 5400.0,
        psf: if psf == "kernel" { kernel } else { gaussian },
    };
    let description = ModelDescription::built_in("tidal-minimal").expect("built in");
    let model = CompiledModel::new(&description).expect("a model");
    let likelihood =
        ImageLikelihood::new(observation, model, LikelihoodKind::Gaussian, &Silent).expect("an image");
    let z = vec![0.0; likelihood.dimension()];
    (likelihood, z)
}

#[divan::bench(args = ["gaussian", "kernel"])]
fn gradient_of_120_pixels(bencher: Bencher, psf: &str) {
    let (likelihood, z) = behind(psf);
    let mut gradient = vec![0.0; z.len()];
    bencher.bench_local(|| likelihood.log_likelihood_gradient(&z, &mut gradient));
}

#[divan::bench(args = ["gaussian", "kernel"])]
fn fisher_matrix_of_120_pixels(bencher: Bencher, psf: &str) {
    let (likelihood, z) = behind(psf);
    bencher.bench_local(|| likelihood.curvature(&z).is_ok());
}
