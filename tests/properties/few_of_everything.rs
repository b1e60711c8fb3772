//! Fits of one to six free parameters, no light to three, on one to six pixels a side, with every sampler: a posterior, or a
//! refusal that names what is missing; never a crash.
//!
//! Matrix products of such sizes are where libraries take their special paths.

use haloray::imaging::{PixelSampling, Psf, SkyGrid};
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::inference::sample::{
    EnsembleSliceSettings, NestedSettings, NutsSettings, SamplerSettings, StretchSettings, ValleySettings,
};
use haloray::inference::{Fit, FitSettings, NoStore, Observation};
use haloray::monitor::Silent;
use rayon::prelude::*;

/// Free parameters in the order in which they become so, and what they are fixed to before.
const PARAMETERS: [(&str, &str, &str); 6] = [
    ("theta_E", "1.0", "{ normal = [1.0, 0.1], low = 0.1, high = 3.0 }"),
    ("e1", "0.05", "{ normal = [0.0, 0.1] }"),
    ("e2", "0.0", "{ normal = [0.0, 0.1] }"),
    ("R_sersic", "0.3", "{ log_normal = [0.3, 0.3] }"),
    ("n_sersic", "1.5", "{ uniform = [0.5, 4.0] }"),
    ("center_x", "0.02", "{ uniform = [-0.3, 0.3] }"),
];

fn model(free: usize, lights: usize) -> ModelDescription {
    let line = |i: usize| {
        let (name, fixed, prior) = PARAMETERS[i];
        format!("{name} = {}\n", if i < free { prior } else { fixed })
    };
    let lens: String = (0..3).map(line).collect();
    let source: String = (3..6).map(line).collect();
    let mut text = format!("name = \"few\"\n[[lens]]\nprofile = \"SIE\"\n[lens.parameters]\n{lens}");
    // The parameters of a source are free only where there is one.
    for number in 0..lights {
        let own = match number {
            0 => source.clone(),
            _ => format!("R_sersic = 0.{number}\nn_sersic = 1.0\n"),
        };
        let list = if number < 2 { "source" } else { "lens_light" };
        text += &format!("[[{list}]]\nprofile = \"SERSIC\"\n[{list}.parameters]\n{own}");
    }
    ModelDescription::parse(&text).unwrap()
}

fn observation(side: usize) -> Observation {
    let grid = SkyGrid::new(side, 0.4).unwrap();
    let ring = |[x, y]: [f64; 2]| (-0.5 * ((x.hypot(y) - 1.0) / 0.3).powi(2)).exp();
    let ripple = |k: usize| 0.05 * ((k * 7919 % 101) as f64 / 50.0 - 1.0);
    let data = grid.theta_arcsec().into_iter().enumerate().map(|(k, at)| ring(at) + ripple(k)).collect();
    Observation {
        grid,
        data_e_s: data,
        used: vec![true; side * side],
        background_rms_e_s: 0.05,
        exposure_s: 1000.0,
        psf: Psf::gaussian(0.4, 3.0, 0.4).unwrap(),
    }
}

fn samplers() -> Vec<SamplerSettings> {
    vec![
        SamplerSettings::Valley(ValleySettings { block_draws: 6, max_draws: 6, ..Default::default() }),
        SamplerSettings::Nuts(NutsSettings {
            warmup_draws: 20,
            block_draws: 6,
            max_draws: 6,
            ..Default::default()
        }),
        SamplerSettings::EnsembleSlice(EnsembleSliceSettings {
            block_steps: 8,
            max_steps: 8,
            ..Default::default()
        }),
        SamplerSettings::Stretch(StretchSettings { block_steps: 8, max_steps: 8, ..Default::default() }),
        SamplerSettings::Nested(NestedSettings { live_points: 30, ..Default::default() }),
    ]
}

/// What is wrong with one fit, if anything.
fn fault(free: usize, lights: usize, side: usize, sampler: SamplerSettings) -> Option<String> {
    let name = format!("{free} free, {lights} lights, {side}² pixels, {}", sampler.name());
    let model = match CompiledModel::new(&model(free, lights)) {
        Ok(model) => model,
        Err(error) => return (lights > 0).then(|| format!("{name}: {error}")),
    };
    let settings =
        FitSettings { pixel_sampling: PixelSampling::Point, sampler, seed: 1, ..FitSettings::default() };
    match Fit::run(observation(side), model, settings, &mut NoStore, &Silent) {
        Ok(fit) => {
            let numbers = fit.parameters.iter().flat_map(|p| [p.mean, p.median, p.best_fit]);
            let all = numbers.chain([
                fit.chi2_reduced(),
                fit.goodness.p_value,
                fit.goodness.largest_residual_sigma,
            ]);
            all.into_iter().any(|v| !v.is_finite()).then(|| format!("{name}: numbers that are none"))
        }
        Err(error) => (!error.is_bad_input()).then(|| format!("{name}: {error}")),
    }
}

fn check(cases: Vec<(usize, usize, usize, SamplerSettings)>) {
    let faults: Vec<String> = cases.into_par_iter().filter_map(|(f, l, s, k)| fault(f, l, s, k)).collect();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn fits_of_few_parameters_lights_and_pixels_end() {
    let samplers = samplers();
    let few = [(1, 1, 1), (2, 1, 3), (1, 0, 2), (3, 2, 2), (5, 3, 4), (6, 1, 6)];
    let cases = few.iter().enumerate().map(|(i, &(f, l, s))| (f, l, s, samplers[i % samplers.len()]));
    check(cases.collect());
}

#[test]
#[ignore = "slow: just nightly"]
fn fits_of_all_small_sizes_with_all_samplers_end() {
    let sizes = (1..=6).flat_map(|f| (0..=3).flat_map(move |l| (1..=6).map(move |s| (f, l, s))));
    check(sizes.flat_map(|(f, l, s)| samplers().into_iter().map(move |k| (f, l, s, k))).collect());
}
