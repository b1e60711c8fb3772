//! How precisely and how truly would converged fits measure γ_LOS? Forecasts for catalogues of 64 systems, drawn as the paper
//! says, as its authors' code did, and without perturbers of the source.
//!
//! Noise-free images of the model `comprehensive` are followed from the truth to the maximum of the posterior, first without
//! perturbers, then with them. The Fisher matrix there gives σ; the shift that the perturbers cause, b in units of σ, and noise
//! make the χ² of the paper's Table 2 one of 1 + b² on average.
//!
//! cargo run --release --example catalogue_forecast

use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::{ImageLikelihood, Maximum, Observation, climb_from};
use haloray::mock::{MockImage, MockSystem, PerturberRule, Protocol, SourceRule};
use haloray::monitor::Silent;
use haloray::{Error, Result};
use rayon::prelude::*;

const SYSTEMS: u64 = 64;
const SEED: u64 = 1;
const SHEARS: [&str; 2] = ["gamma1_los", "gamma2_los"];

fn main() -> Result<()> {
    let paper = Protocol::paper();
    let flux = PerturberRule::Flux(0.01);
    // The code before the authors made sources larger and brighter, as the magnitudes of the released images have them.
    let fainter = Protocol {
        mass_median_msun: 6e10,
        source: SourceRule::Radius { median_kpc: 2.0, sd_ln: 0.5 * 2f64.ln(), magnitude_at_median: -21.0 },
        concentration_median: 17.0,
        ..paper.clone()
    };
    let protocols = [
        ("`paper`", paper.clone()),
        (
            "`paper` without perturbers",
            Protocol { perturber_brightness: PerturberRule::Flux(0.0), ..paper.clone() },
        ),
        (
            "1% of the flux, radii 0.5 to 1 (the code)",
            Protocol { perturber_brightness: flux, perturber_radius: [0.5, 1.0], ..paper.clone() },
        ),
        ("1% of the flux, radii 0.1 to 1", Protocol { perturber_brightness: flux, ..paper }),
        ("lighter lenses, fainter sources (the code in mid-2022)", fainter),
    ];
    println!("| catalogue | mean σ | median σ | χ² expected | median over images | > 2σ without noise |");
    println!("|---|---|---|---|---|---|");
    for (name, protocol) in protocols {
        let forecasts =
            (0..SYSTEMS).into_par_iter().map(|i| forecast(&protocol, i)).collect::<Result<Vec<_>>>()?;
        let sorted = |value: fn(&Forecast) -> f64| {
            let mut values: Vec<f64> = forecasts.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let (sigma, chi2) = (sorted(|f| f.sigma), sorted(|f| 1.0 + f.bias_squared));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let middle = forecasts.len() / 2;
        println!(
            "| {name} | {:.4} | {:.4} | {:.2} | {:.2} | {} |",
            mean(&sigma),
            sigma[middle],
            mean(&chi2),
            chi2[middle],
            forecasts.iter().filter(|f| f.bias_squared > 4.0).count()
        );
    }
    Ok(())
}

struct Forecast {
    /// Geometric mean over both components.
    sigma: f64,
    /// (shift/σ)², mean over both components.
    bias_squared: f64,
}

fn forecast(protocol: &Protocol, number: u64) -> Result<Forecast> {
    let camera = Instrument::default();
    let system = MockSystem::draw(protocol, SEED, number, camera.pixel_scale_arcsec)?;
    let alone = MockSystem { perturbers: vec![], ..system.clone() };
    let truths = system.truths();
    let model = CompiledModel::new(&ModelDescription::built_in("comprehensive")?)?;
    let truth_of =
        |name: &str| truths.iter().find(|(known, _)| *known == name).map_or(f64::NAN, |(_, value)| *value);
    let truth = model.free.iter().map(|p| p.prior.to_latent(truth_of(&p.name))).collect();
    let (before, start) = climb(&alone, &camera, &model, truth)?;
    let (after, _) = climb(&system, &camera, &model, start.latent)?;
    let squares = [0, 1].map(|a| ((after[a].0 - before[a].0) / after[a].1).powi(2));
    Ok(Forecast { sigma: (after[0].1 * after[1].1).sqrt(), bias_squared: 0.5 * (squares[0] + squares[1]) })
}

/// Value and σ of both shears at the maximum that is reached from `latent` for the image without noise.
fn climb(
    system: &MockSystem,
    camera: &Instrument,
    model: &CompiledModel,
    latent: Vec<f64>,
) -> Result<([(f64, f64); 2], Maximum)> {
    let psf = Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)?;
    let exposure = MockImage::expose(system, camera, &psf, PixelSampling::Point, SEED)?.exposure;
    let observation = Observation::of_camera(exposure.grid, exposure.noise_free_e_s, camera, psf);
    let likelihood = ImageLikelihood::new(observation, model.clone(), LikelihoodKind::Gaussian, &Silent)?;
    let start = climb_from(&likelihood, latent, &Silent)?;
    let (values, slopes) = model.at_latent(&start.latent);
    let singular = || Error::out_of_range("the Fisher matrix", "singular", "positive definite");
    let covariance = start.metric.clone().cholesky().ok_or_else(singular)?.inverse();
    let of = |name: &str| {
        let i = model.free.iter().position(|p| p.name == name).unwrap_or(0);
        (values[i], covariance[(i, i)].sqrt() * slopes[i])
    };
    Ok((SHEARS.map(of), start))
}
