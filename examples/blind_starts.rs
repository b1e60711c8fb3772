//! Do blind starts find the mode that holds the truth? A hundred mock images around Table 1, far wider than its own values,
//! fitted with `simple-minimal` and its flat priors.
//!
//! A fit is in the mode of the truth if every parameter lies within five posterior standard deviations of it.
//!
//! cargo run --release --example blind_starts

use haloray::imaging::{Instrument, PixelSampling, Psf, Scene, SkyGrid, expose};
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::inference::{Fit, FitSettings, NoStore, Observation};
use haloray::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use haloray::monitor::Silent;
use haloray::numerics::random::{Stage, StreamName, stream};
use haloray::profile::light::Sersic;
use haloray::profile::mass::{Epl, MassModel};
use haloray::{Error, Result};
use nalgebra::Complex;
use rand::RngExt;
use rayon::prelude::*;

const IMAGES: u64 = 100;
const SEED: u64 = 1;

/// Uniform ranges of what is drawn; `simple-minimal` fixes or ties the rest.
const DRAWN: [(&str, [f64; 2]); 17] = [
    ("gamma1_od", [-0.05, 0.05]),
    ("gamma2_od", [-0.05, 0.05]),
    ("gamma1_los", [-0.05, 0.05]),
    ("gamma2_los", [-0.05, 0.05]),
    ("omega_los", [-2e-3, 2e-3]),
    ("lens.theta_E", [0.7, 1.6]),
    ("lens.gamma", [1.8, 2.6]),
    ("lens.e1", [-0.15, 0.15]),
    ("lens.e2", [-0.15, 0.15]),
    ("source.R_sersic", [0.1, 0.4]),
    ("source.n_sersic", [1.0, 3.0]),
    ("source.e1", [-0.15, 0.15]),
    ("source.e2", [-0.15, 0.15]),
    ("source.center_x", [-0.08, 0.08]),
    ("source.center_y", [-0.08, 0.08]),
    ("lens_light.R_sersic", [0.3, 0.8]),
    ("lens_light.n_sersic", [2.0, 4.5]),
];
const SOURCE_MAGNITUDE: [f64; 2] = [23.0, 25.0];
const LENS_MAGNITUDE: [f64; 2] = [19.5, 21.0];
/// Half the width of an image in Einstein radii.
const HALF_WIDTH: f64 = 1.6;

fn main() -> Result<()> {
    let model = CompiledModel::new(&ModelDescription::built_in("simple-minimal")?)?;
    eprintln!(
        "| image | converged | in the mode of the truth | largest offset, σ | χ² per degree of freedom |"
    );
    eprintln!("|---|---|---|---|---|");
    let fits: Vec<(bool, f64)> = (0..IMAGES)
        .into_par_iter()
        .map(|number| {
            let (observation, truths) = mock(&model, number)?;
            let settings =
                FitSettings { pixel_sampling: PixelSampling::Point, seed: SEED, ..FitSettings::default() };
            let fit = Fit::run(observation, model.clone(), settings, &mut NoStore, &Silent)?;
            let offsets = fit.parameters.iter().zip(&truths);
            let worst =
                offsets.map(|(p, truth)| ((p.mean - truth) / p.standard_deviation).abs()).fold(0.0, f64::max);
            let converged = fit.status.is_converged;
            eprintln!(
                "| {number} | {converged} | {} | {worst:.1} | {:.3} |",
                worst < 5.0,
                fit.chi2_reduced()
            );
            Ok((converged, worst))
        })
        .collect::<Result<_>>()?;
    let count = |is: &dyn Fn(bool, f64) -> bool| fits.iter().filter(|(c, worst)| is(*c, *worst)).count();
    println!("{} of {IMAGES} converged in the mode of the truth;", count(&|c, worst| c && worst < 5.0));
    println!("{} converged elsewhere, {} did not converge", count(&|c, w| c && w >= 5.0), count(&|c, _| !c));
    Ok(())
}

/// An image of the camera with noise, and the true values of the free parameters.
fn mock(model: &CompiledModel, number: u64) -> Result<(Observation, Vec<f64>)> {
    let mut rng = stream(SEED, number, Stage::LensAndSource, 0);
    let mut uniform = |[low, high]: [f64; 2]| rng.random_range(low..high);
    let drawn: Vec<(&str, f64)> = DRAWN.iter().map(|(name, range)| (*name, uniform(*range))).collect();
    let magnitudes = [SOURCE_MAGNITUDE, LENS_MAGNITUDE].map(uniform);
    let of = |name: &str| drawn.iter().find(|(own, _)| *own == name).map(|(_, value)| *value);
    let truths = model.free.iter().map(|p| {
        of(&p.name).ok_or_else(|| Error::out_of_range("a free parameter", &p.name, "one that is drawn"))
    });
    let truths = truths.collect::<Result<Vec<f64>>>()?;
    let value = |name: &str| {
        model.value_of(name, &truths).ok_or_else(|| Error::out_of_range(name, "missing", "known"))
    };
    let pair = |a: &str, b: &str| -> Result<[f64; 2]> { Ok([value(a)?, value(b)?]) };
    let tidal = |[g1, g2]: [f64; 2], omega| Tidal { kappa: 0.0, gamma: Complex::new(g1, g2), omega };
    let (shape, centre) = (pair("lens.e1", "lens.e2")?, pair("lens.center_x", "lens.center_y")?);
    let lens = Epl::new(value("lens.theta_E")?, value("lens.gamma")?, shape, centre)?;
    let mapping = TidalLens::new(
        LineOfSightModel::Minimal {
            od: tidal(pair("gamma1_od", "gamma2_od")?, 0.0),
            los: tidal(pair("gamma1_los", "gamma2_los")?, value("omega_los")?),
        },
        vec![MassModel::Epl(lens)],
    );
    let camera = Instrument::default();
    let light = |part: &str, magnitude: f64, shape, centre| {
        let size = |name: &str| value(&format!("{part}.{name}"));
        Sersic::with_flux(camera.flux_e_s(magnitude), size("R_sersic")?, size("n_sersic")?, shape, centre)
    };
    let source_centre = pair("source.center_x", "source.center_y")?;
    let source = light("source", magnitudes[0], pair("source.e1", "source.e2")?, source_centre)?;
    let lens_light = light("lens_light", magnitudes[1], shape, centre)?;
    let scene = Scene { mapping: &mapping, source: &source, lens_light: Some(&lens_light) };
    let pixels = (2.0 * HALF_WIDTH * value("lens.theta_E")? / camera.pixel_scale_arcsec).ceil() as usize;
    let grid = SkyGrid::new(pixels, camera.pixel_scale_arcsec)?;
    let psf = Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)?;
    let noise = StreamName { seed: SEED, realisation: number, stage: Stage::NoiseImage };
    let exposure = expose(&scene, grid, &camera, &psf, PixelSampling::Point, noise, &Silent)?;
    let observation = Observation::of_camera(grid, exposure.noisy_e_s, &camera, psf);
    Ok((observation, truths))
}
