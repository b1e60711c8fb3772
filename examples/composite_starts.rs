//! Do blind starts of composite lenses end as high as climbs from the truth, and meet the modes that are nearly as high? Systems
//! of `haloray mock`, model `comprehensive`, each started with two seeds.
//!
//! A start is on a wrong maximum if its ln p is more than 1 below that of a climb that begins at the truth. Modes are maxima within 3 of the
//! highest that any start of the image has met, with another ellipticity of the halo.
//!
//! cargo run --release --example composite_starts -- 64 101 102 103    # 64 systems of each of the seeds
//! cargo run --release --example composite_starts -- integrated 64 101 # pixels integrated, not sampled at their centres

use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::inference::{FitSettings, Observation, Top};
use haloray::mock::{MockImage, MockSystem, Protocol};
use haloray::monitor::Silent;
use haloray::{Error, Result};
use rayon::prelude::*;

fn main() -> Result<()> {
    let number = |text: String| {
        text.parse::<u64>()
            .map_err(|_| Error::out_of_range("argument", &text, "a number of systems, then seeds"))
    };
    let mut words = std::env::args().skip(1).peekable();
    let pixel_sampling = match words.next_if(|word| word == "integrated") {
        Some(_) => PixelSampling::Adaptive,
        None => PixelSampling::Point,
    };
    let numbers: Vec<u64> = words.map(number).collect::<Result<_>>()?;
    let (systems, seeds) = numbers.split_first().map_or((64, [101].as_slice()), |(n, seeds)| (*n, seeds));
    let all: Vec<(u64, u64)> = seeds.iter().flat_map(|seed| (0..systems).map(move |k| (*seed, k))).collect();
    let ends: Vec<End> = all
        .into_par_iter()
        .map(|(seed, system)| {
            let (observation, model, truth) = mock(seed, system, pixel_sampling)?;
            let top = |seed, from| {
                let settings = FitSettings { pixel_sampling, seed, ..FitSettings::default() };
                Top::find(observation.clone(), model.clone(), &settings, from, &Silent)
            };
            let (from_truth, blind, again) =
                (top(seed, Some(truth))?, top(seed, None)?, top(seed + 1, None)?);
            let modes = modes(&[&blind, &again]);
            let missed = |start: usize| modes.iter().filter(|met| !met[start]).count();
            let likelihood = &blind.likelihood;
            let values = likelihood.model().at_latent(&blind.maximum().latent).0;
            let chi2 =
                likelihood.image(&values).map_or(f64::INFINITY, |image| likelihood.chi2_reduced(&image));
            let gain = blind.maximum().log_posterior - from_truth.maximum().log_posterior;
            let modes = (modes.len(), [missed(0), missed(1)]);
            let end = End { seed, system, gain, chi2, modes, evaluations: blind.evaluations };
            eprintln!("{}", end.row());
            Ok(end)
        })
        .collect::<Result<_>>()?;
    println!(
        "| seed | systems | on a wrong maximum | more than 1 higher | of several modes | modes missed by one of two starts | largest χ² | median evaluations |"
    );
    println!("|---:|---:|---:|---:|---:|---:|---:|---:|");
    for seed in seeds {
        let own: Vec<&End> = ends.iter().filter(|end| end.seed == *seed).collect();
        let count = |is: &dyn Fn(&End) -> bool| own.iter().filter(|end| is(end)).count();
        let mut evaluations: Vec<u64> = own.iter().map(|end| end.evaluations).collect();
        evaluations.sort_unstable();
        println!(
            "| {seed} | {} | {} | {} | {} | {} of {} | {:.3} | {} |",
            own.len(),
            count(&|end| end.gain < -SAME),
            count(&|end| end.gain > SAME),
            count(&|end| end.modes.0 > 1),
            own.iter().flat_map(|end| end.modes.1).sum::<usize>(),
            own.iter().map(|end| 2 * end.modes.0).sum::<usize>(),
            own.iter().map(|end| end.chi2).fold(0.0, f64::max),
            evaluations.get(own.len() / 2).copied().unwrap_or_default()
        );
    }
    println!("\nWhere both climbs end apart:\n");
    println!("| seed | system | ln p of the start less that from the truth | χ² | evaluations |");
    println!("|---:|---:|---:|---:|---:|");
    ends.iter().filter(|end| end.gain.abs() > SAME).for_each(|end| println!("{}", end.row()));
    Ok(())
}

/// Ends that differ by less in ln p are of one maximum.
const SAME: f64 = 1.0;

/// Where the start of a system ended.
struct End {
    seed: u64,
    system: u64,
    /// ln p less that of the climb from the truth.
    gain: f64,
    /// Per degree of freedom.
    chi2: f64,
    /// Modes that both starts have met together, and how many of them each has missed.
    modes: (usize, [usize; 2]),
    evaluations: u64,
}

impl End {
    fn row(&self) -> String {
        let Self { seed, system, gain, chi2, evaluations, .. } = self;
        format!("| {seed} | {system} | {gain:.2} | {chi2:.3} | {evaluations} |")
    }
}

/// The modes of an image that starts have met together, and for each by which of them it was met.
fn modes(starts: &[&Top]) -> Vec<Vec<bool>> {
    /// By so much in ln p a mode may lie below the highest.
    const BELOW: f64 = 3.0;
    /// Ellipticities e1 + i e2 of the halo that differ by less are of one mode.
    const APART: f64 = 0.03;
    let met = starts
        .iter()
        .enumerate()
        .flat_map(|(start, top)| top.modes.iter().map(move |mode| (start, top, mode)));
    let highest = starts.iter().map(|top| top.maximum().log_posterior).fold(f64::NEG_INFINITY, f64::max);
    let mut modes: Vec<([f64; 2], Vec<bool>)> = vec![];
    for (start, top, mode) in met.filter(|(.., mode)| mode.log_posterior > highest - BELOW) {
        let model = top.likelihood.model();
        let values = model.at_latent(&mode.latent).0;
        let ellipticity =
            ["lens2.e1", "lens2.e2"].map(|name| model.value_of(name, &values).unwrap_or(f64::NAN));
        let is_near = |other: &[f64; 2]| (other[0] - ellipticity[0]).hypot(other[1] - ellipticity[1]) < APART;
        let place = modes.iter().position(|(other, _)| is_near(other)).unwrap_or_else(|| {
            modes.push((ellipticity, vec![false; starts.len()]));
            modes.len() - 1
        });
        modes[place].1[start] = true;
    }
    modes.into_iter().map(|(_, met)| met).collect()
}

/// An image, its model and the truth in the model's latent coordinates.
fn mock(seed: u64, system: u64, sampling: PixelSampling) -> Result<(Observation, CompiledModel, Vec<f64>)> {
    let camera = Instrument::default();
    let system = MockSystem::draw(&Protocol::paper(), seed, system, camera.pixel_scale_arcsec)?;
    let psf = Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)?;
    let exposure = MockImage::expose(&system, &camera, &psf, sampling, seed)?.exposure;
    let observation = Observation::of_camera(exposure.grid, exposure.noisy_e_s, &camera, psf);
    let model = CompiledModel::new(&ModelDescription::built_in("comprehensive")?)?;
    let truths = system.truths();
    let latent_of = |(name, prior): (&String, &haloray::inference::Prior)| {
        let truth = truths.iter().find(|(known, _)| known == name);
        let (_, value) =
            truth.ok_or_else(|| Error::out_of_range("a free parameter", name, "one of the mock's"))?;
        Ok(prior.to_latent(*value))
    };
    let free = model.free.iter().map(|p| (&p.name, &p.prior));
    let truth = free.map(latent_of).collect::<Result<_>>()?;
    Ok((observation, model, truth))
}
