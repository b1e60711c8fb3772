//! Guesses from which climbs begin: from the image alone, or with what a fit before has found.

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

/// What a fit says beforehand.
#[derive(Debug)]
pub(super) struct Known {
    /// Values of free parameters by name.
    values: Vec<(String, f64)>,
    einstein_radius_arcsec: f64,
    /// The maximum of the model itself from which it is known: no other Einstein radius is tried.
    maximum: Option<Vec<f64>>,
}

impl Known {
    /// From the fit of a simpler model: line of sight, lights, Einstein radius.
    pub(super) fn from_simpler(simpler: &CompiledModel, highest: &Maximum) -> Option<Self> {
        Self::new(simpler, highest, &[Part::LineOfSight, Part::Source, Part::LensLight])
    }

    /// From a maximum of the model itself, lens and line of sight to be guessed anew: lights and Einstein radius.
    pub(super) fn from_maximum(model: &CompiledModel, highest: &Maximum) -> Option<Self> {
        let known = Self::new(model, highest, &[Part::Source, Part::LensLight])?;
        Some(Self { maximum: Some(highest.latent.clone()), ..known })
    }

    /// `None` if the lens has no Einstein radius.
    fn new(model: &CompiledModel, highest: &Maximum, parts: &[Part]) -> Option<Self> {
        let values = model.at_latent(&highest.latent).0;
        let einstein_radius_arcsec = einstein_radius_arcsec(&model.lenses(&values).ok()?, [0.0; 2])?;
        let known = model.free.iter().zip(values).filter(|(own, _)| parts.contains(&own.part));
        let values = known.map(|(own, value)| (own.name.clone(), value)).collect();
        Some(Self { values, einstein_radius_arcsec, maximum: None })
    }

    /// Whether guess number `number` is the maximum itself with its lens turned.
    pub(super) fn turns(&self, number: u64) -> bool {
        self.maximum.is_some() && number % SHAPES == 2
    }

    /// Whether a climb has come back to the maximum that is known.
    pub(super) fn is_near(&self, latent: &[f64]) -> bool {
        /// Distance in units of the priors' widths.
        const NEAR: f64 = 0.05;
        let is_near = |maximum: &Vec<f64>| maximum.iter().zip(latent).all(|(a, b)| (a - b).abs() < NEAR);
        self.maximum.as_ref().is_some_and(is_near)
    }

    fn value_of(&self, name: &str) -> Option<f64> {
        self.values.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
    }
}

/// Guess number `number` from the image, or, two times of three, from what is known, the Einstein radius shared by the masses
/// in random parts. Every other of those from a maximum of the model itself is that maximum with its lens turned.
pub(super) fn guess(likelihood: &ImageLikelihood, known: Option<&Known>, seed: u64, number: u64) -> Vec<f64> {
    let observation = likelihood.observation();
    let (pixel, edge) = (observation.grid.pixel_scale_arcsec(), 0.9 * observation.grid.half_width_arcsec());
    let step = (number / SHAPES % RADII) as f64 / (RADII - 1) as f64;
    let tried = 3.0 * pixel * (edge / (3.0 * pixel)).max(1.0).powf(step);
    let takes_all = !number.is_multiple_of(SHAPES);
    let radius = known.filter(|known| takes_all || known.maximum.is_some());
    let einstein_radius = radius.map_or(tried, |known| known.einstein_radius_arcsec);
    let known = known.filter(|_| takes_all);
    let mut rng = stream(seed, number, Stage::Start, 0);
    let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
    let spread = if number / (RADII * SHAPES) >= ROUNDS_NEAR { FAR } else { NEAR };
    if let Some(maximum) = known.filter(|known| known.turns(number)).and_then(|known| known.maximum.as_ref())
    {
        let scatter = if (number / SHAPES).is_multiple_of(2) { NEAR } else { FAR };
        let latent = turned(likelihood.model(), maximum, scatter, &mut random);
        return with_einstein_radius(likelihood, latent, einstein_radius);
    }
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
            let Some(known) = known else { return z };
            let mut divided =
                || latent_of(parameter, parameter.prior.at_latent(z)[0] * (DIVISION * random()).exp());
            match parameter.parameter.role {
                Role::Strength if parameter.part == Part::Lens => divided(),
                _ => known.value_of(&parameter.name).map_or(z, |v| latent_of(parameter, v)),
            }
        })
        .collect();
    with_einstein_radius(likelihood, latent, einstein_radius)
}

/// A maximum with its lens's ellipticities times one number about −1 (a turn by 90°), the slopes as scattered, and nothing along
/// the line of sight.
///
/// Ellipticity and foreground shear make nearly the same images in several ways, between which climbs find no path.
fn turned(
    model: &CompiledModel,
    maximum: &[f64],
    scatter: f64,
    random: &mut impl FnMut() -> f64,
) -> Vec<f64> {
    let factor = -1.0 + scatter * random();
    let value = |(parameter, z): (&FreeParameter, &f64)| match (parameter.part, parameter.parameter.role) {
        (Part::Lens, Role::Ellipticity) => latent_of(parameter, factor * parameter.prior.at_latent(*z)[0]),
        (Part::Lens, Role::Shape) => *z + scatter * random(),
        (Part::LineOfSight, _) => match parameter.parameter.guess {
            Guess::Fixed(value) => latent_of(parameter, value),
            _ => 0.0,
        },
        _ => *z,
    };
    model.free.iter().zip(maximum).map(value).collect()
}

fn latent_of(parameter: &FreeParameter, value: f64) -> f64 {
    parameter.prior.to_latent(value).clamp(-5.0, 5.0)
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

/// What the first climb from guess number `number` holds: the line of sight and the Sérsic indices of the sources, or, of a lens
/// that was turned, its ellipticities, to which the line of sight is to adapt.
pub(super) fn held_at_first(likelihood: &ImageLikelihood, known: Option<&Known>, number: u64) -> Vec<bool> {
    let is_turned = known.is_some_and(|known| known.turns(number));
    let is_held = |parameter: &FreeParameter| match (parameter.part, parameter.parameter.role) {
        (Part::Lens, Role::Ellipticity) => is_turned,
        (Part::LineOfSight, _) | (Part::Source, Role::Shape) => !is_turned,
        _ => false,
    };
    likelihood.model().free.iter().map(is_held).collect()
}
