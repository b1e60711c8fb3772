//! The likelihood of the paper's Table 1 image (49×49 pixels), one core: value, value with gradient, Fisher matrix.
//!
//! `cargo bench --bench fit`.

use divan::Bencher;
use haloray::imaging::Psf;
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
