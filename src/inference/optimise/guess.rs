//! Guesses from which climbs begin: from the image alone, about the fit of a simpler model, or away from a known maximum.

use rand_distr::{Distribution, StandardNormal};

use super::climb::Maximum;
use crate::inference::likelihood::{ImageLikelihood, Observation};
use crate::inference::model::{CompiledModel, FreeParameter, Part};
use crate::numerics::random::{Stage, stream};
use crate::profile::mass::{einstein_radius_arcsec, mean_convergence};
use crate::profile::registry::{Guess, Role};

/// Random shapes of a guess for each Einstein radius.
pub(super) const SHAPES: u64 = 3;
/// Einstein radii tried in a round of guesses.
pub(super) const RADII: u64 = 10;
/// Spread of the guesses for what the image says nothing about beforehand, in latent standard deviations, and that in rounds
/// from `ROUNDS_NEAR` on.
const NEAR: f64 = 0.25;
const FAR: f64 = 1.0;
pub(super) const ROUNDS_NEAR: u64 = 3;
/// Scatter of the natural logarithms of the masses that share the Einstein radius of the simpler model.
const DIVISION: f64 = 1.0;

/// What the fit of a simpler model says beforehand.
#[derive(Debug)]
pub(super) struct Prepared {
    /// Values of the free parameters by name, but those of the lens.
    shared: Vec<(String, f64)>,
    einstein_radius_arcsec: f64,
}

impl Prepared {
    /// From the highest maximum of the simpler model; `None` if its lens has no Einstein radius.
    pub(super) fn new(simpler: &CompiledModel, highest: &Maximum) -> Option<Self> {
        let values = simpler.at_latent(&highest.latent).0;
        let einstein_radius_arcsec = einstein_radius(simpler, &values)?;
        let free = simpler.free.iter().zip(values);
        let shared =
            free.filter(|(own, _)| own.part != Part::Lens).map(|(own, value)| (own.name.clone(), value));
        Some(Self { shared: shared.collect(), einstein_radius_arcsec })
    }

    fn value_of(&self, name: &str) -> Option<f64> {
        self.shared.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
    }
}

/// Guess number `number` from the image, or, two times of three, from what has been prepared: line of sight and lights as
/// they were fitted, the Einstein radius shared by the masses in random parts.
pub(super) fn guess(
    likelihood: &ImageLikelihood,
    prepared: Option<&Prepared>,
    seed: u64,
    number: u64,
) -> Vec<f64> {
    let observation = likelihood.observation();
    let prepared = prepared.filter(|_| number % SHAPES != 0);
    let (pixel, edge) = (observation.grid.pixel_scale_arcsec(), 0.9 * observation.grid.half_width_arcsec());
    let step = (number / SHAPES % RADII) as f64 / (RADII - 1) as f64;
    let tried = 3.0 * pixel * (edge / (3.0 * pixel)).max(1.0).powf(step);
    let einstein_radius = prepared.map_or(tried, |prepared| prepared.einstein_radius_arcsec);
    let mut rng = stream(seed, number, Stage::Start, 0);
    let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
    let spread = if number / (RADII * SHAPES) >= ROUNDS_NEAR { FAR } else { NEAR };
    let free = likelihood.model().free.iter();
    let latent: Vec<f64> = free
        .map(|parameter| {
            let own_guess = match parameter.parameter.guess {
                Guess::Prior => None,
                Guess::EinsteinRadius => Some(einstein_radius),
                Guess::HalfLight => Some(half_light_radius(observation) * (0.3 * random()).exp()),
                Guess::SourceRadius => Some(0.25 * einstein_radius * (0.5 * random()).exp()),
                Guess::About([median, scatter]) => Some(median * (scatter * random()).exp()),
                Guess::Fixed(value) => Some(value),
            };
            let z = own_guess.map_or_else(|| spread * random(), |v| latent_of(parameter, v));
            let Some(prepared) = prepared else { return z };
            let mut divided =
                || latent_of(parameter, parameter.prior.at_latent(z)[0] * (DIVISION * random()).exp());
            match parameter.parameter.role {
                Role::Strength if parameter.part == Part::Lens => divided(),
                _ => prepared.value_of(&parameter.name).map_or(z, |v| latent_of(parameter, v)),
            }
        })
        .collect();
    with_einstein_radius(likelihood, latent, einstein_radius)
}

/// The maximum's place with its line of sight and its lens thrown elsewhere, the Einstein radius but kept.
pub(super) fn thrown(likelihood: &ImageLikelihood, from: &Maximum, seed: u64, number: u64) -> Vec<f64> {
    /// Latent standard deviations of throws, in turn.
    const THROWS: [f64; 3] = [0.3, 0.6, 1.2];
    let throw = THROWS[(number % THROWS.len() as u64) as usize];
    let model = likelihood.model();
    let radius = einstein_radius(model, &model.at_latent(&from.latent).0);
    let mut rng = stream(seed, number, Stage::Start, 1);
    let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
    let coordinates = from.latent.iter().zip(is_thrown(likelihood));
    let latent = coordinates.map(|(z, thrown)| if thrown { z + throw * random() } else { *z }).collect();
    match radius {
        Some(radius) => with_einstein_radius(likelihood, latent, radius),
        None => latent,
    }
}

/// The coordinates that [`thrown`] moves: those of line of sight and lens but Einstein radii.
pub(super) fn is_thrown(likelihood: &ImageLikelihood) -> Vec<bool> {
    let moves = |own: &FreeParameter| {
        matches!(own.part, Part::LineOfSight | Part::Lens) && own.parameter.guess != Guess::EinsteinRadius
    };
    likelihood.model().free.iter().map(moves).collect()
}

fn latent_of(parameter: &FreeParameter, value: f64) -> f64 {
    parameter.prior.to_latent(value).clamp(-5.0, 5.0)
}

fn einstein_radius(model: &CompiledModel, values: &[f64]) -> Option<f64> {
    einstein_radius_arcsec(&model.lenses(values).ok()?, [0.0, 0.0])
}

/// The guess with the strengths of its lenses scaled by one factor, so that the mean convergence inside
/// `einstein_radius` is one; lenses that have that radius as a parameter have it already.
fn with_einstein_radius(
    likelihood: &ImageLikelihood,
    mut latent: Vec<f64>,
    einstein_radius: f64,
) -> Vec<f64> {
    let model = likelihood.model();
    let values = model.at_latent(&latent).0;
    let Ok(lenses) = model.lenses(&values) else { return latent };
    let factor = 1.0 / mean_convergence(&lenses, [0.0, 0.0], einstein_radius);
    if !(factor.is_finite() && factor > 0.0) {
        return latent;
    }
    for ((parameter, value), z) in model.free.iter().zip(values).zip(&mut latent) {
        if parameter.parameter.role == Role::Strength {
            *z = parameter.prior.to_latent(factor * value).clamp(-3.0, 3.0);
        }
    }
    latent
}

/// Radius about the centre of the image that holds half of its light.
fn half_light_radius(observation: &Observation) -> f64 {
    let theta = observation.grid.theta_arcsec();
    let mut pixels: Vec<(f64, f64)> = theta
        .iter()
        .zip(observation.data_e_s.iter().zip(&observation.used))
        .map(|([x, y], (flux, used))| (x.hypot(*y), if *used { flux.max(0.0) } else { 0.0 }))
        .collect();
    pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * pixels.iter().map(|p| p.1).sum::<f64>();
    let mut sum = 0.0;
    let inside = pixels.iter().find(|(_, flux)| {
        sum += flux;
        sum >= half
    });
    inside.map_or(1.0, |(radius, _)| *radius).max(observation.grid.pixel_scale_arcsec())
}

/// Whether a parameter belongs to the line of sight or is the Sérsic index of a source.
pub(super) fn held_at_first(likelihood: &ImageLikelihood) -> Vec<bool> {
    let is_held = |parameter: &FreeParameter| match parameter.part {
        Part::LineOfSight => true,
        Part::Source => parameter.parameter.role == Role::Shape,
        Part::Lens | Part::LensLight => false,
    };
    likelihood.model().free.iter().map(is_held).collect()
}
