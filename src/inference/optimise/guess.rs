//! Guesses from which climbs begin: from the image alone, or with what a fit before has found.

use nalgebra::Complex;
use rand_distr::{Distribution, StandardNormal};

use super::climb::Maximum;
use crate::inference::likelihood::{ImageLikelihood, Observation};
use crate::inference::model::{CompiledModel, FreeParameter, Part};
use crate::numerics::random::{Stage, stream};
use crate::profile::mass::{MassModel, MassProfile, einstein_radius_arcsec, mean_convergence};
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
/// Foreground shear of a usual line of sight, and a component of a usual ellipticity.
const SHEAR: f64 = 0.05;
const ELLIPTICITY: f64 = 0.1;

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
    /// From the fit of a simpler model: line of sight, lights, Einstein radius, and the lens if that is wanted.
    pub(super) fn from_simpler(simpler: &CompiledModel, highest: &Maximum, takes_lens: bool) -> Option<Self> {
        let parts = [Part::LineOfSight, Part::Source, Part::LensLight, Part::Lens];
        Self::new(simpler, highest, if takes_lens { &parts } else { &parts[..3] })
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

    /// Whether guess number `number` is the maximum itself with another ellipticity of its lens or another foreground shear.
    pub(super) fn changes(&self, number: u64) -> bool {
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
/// in random parts. Every other of those from a maximum of the model itself is that maximum with another ellipticity of its lens or
/// another foreground shear.
pub(super) fn guess(likelihood: &ImageLikelihood, known: Option<&Known>, seed: u64, number: u64) -> Vec<f64> {
    let observation = likelihood.observation();
    // Of a ring as wide as this the corners show a piece.
    let widest = 0.9 * std::f64::consts::SQRT_2 * observation.grid.half_width_arcsec();
    let pixel = observation.grid.pixel_scale_arcsec();
    let step = (number / SHAPES % RADII) as f64 / (RADII - 1) as f64;
    let tried = 3.0 * pixel * (widest / (3.0 * pixel)).max(1.0).powf(step);
    let takes_all = !number.is_multiple_of(SHAPES);
    let radius = known.filter(|known| takes_all || known.maximum.is_some());
    let einstein_radius = radius.map_or(tried, |known| known.einstein_radius_arcsec);
    let known = known.filter(|_| takes_all);
    let mut rng = stream(seed, number, Stage::Start, 0);
    let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
    let spread = if number / (RADII * SHAPES) >= ROUNDS_NEAR { FAR } else { NEAR };
    if let Some(maximum) =
        known.filter(|known| known.changes(number)).and_then(|known| known.maximum.as_ref())
    {
        let mut normal = |scale: f64| Complex::new(scale * random(), scale * random());
        let (change, scatter) = match number / SHAPES % RADII {
            0 => (Change::turned(-Complex::ONE), 0.0),
            shape if shape % 4 == 2 => (Change::turned(normal(NEAR) - 1.0), NEAR),
            shape if shape % 4 == 3 => (Change::sheared(normal(SHEAR)), FAR),
            _ => (Change::to_ellipticity(normal(ELLIPTICITY)), FAR),
        };
        let latent = changed(likelihood.model(), maximum, (einstein_radius, change), || scatter * random());
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
            match (known.value_of(&parameter.name), parameter.parameter.role) {
                (Some(value), _) => latent_of(parameter, value),
                (None, Role::Strength) if parameter.part == Part::Lens => divided(),
                (None, _) => z,
            }
        })
        .collect();
    with_einstein_radius(likelihood, latent, einstein_radius)
}

/// What becomes of the ellipticities e = e1 + i e2 of a maximum's lens, `turn` e + `ellipticity` (a turn of −1 is one by 90°), and of
/// the foreground shear besides what makes up for that.
#[derive(Debug, Clone, Copy)]
struct Change {
    turn: Complex<f64>,
    ellipticity: Complex<f64>,
    shear: Complex<f64>,
}

impl Change {
    fn turned(turn: Complex<f64>) -> Self {
        Self { turn, ellipticity: Complex::ZERO, shear: Complex::ZERO }
    }

    fn to_ellipticity(ellipticity: Complex<f64>) -> Self {
        Self { ellipticity, ..Self::turned(Complex::ZERO) }
    }

    fn sheared(shear: Complex<f64>) -> Self {
        Self { shear, ..Self::turned(Complex::ONE) }
    }
}

/// A maximum with the ellipticities of its lens changed, the slopes scattered, and the foreground shear that leaves the lens its
/// quadrupole, or one that differs from it.
///
/// Ellipticity and foreground shear make nearly the same images in several ways, between which climbs find no path. Behind
/// a shear γ_od the potential of a lens is ψ(θ) − θ_E² Re(γ_od e^(−2iφ)) on its Einstein ring: if its quadrupole there
/// changes by δψ₂, a change δγ_od = δψ₂/θ_E² takes that back, (3 − γ)/(5 − γ) of the change of e for a power law. The
/// line-of-sight shear, which an image knows best, stays. Where no foreground shear is free the line of sight begins empty.
fn changed(
    model: &CompiledModel,
    maximum: &[f64],
    (einstein_radius, change): (f64, Change),
    mut scattered: impl FnMut() -> f64,
) -> Vec<f64> {
    let values = model.at_latent(maximum).0;
    let value = |(parameter, z): (&FreeParameter, &f64)| match (parameter.part, parameter.parameter.role) {
        (Part::Lens, Role::Ellipticity) => {
            let (stem, component) = parameter.name.split_at(parameter.name.len() - 1);
            let of = |component| model.value_of(&format!("{stem}{component}"), &values).unwrap_or(0.0);
            let e = change.turn * Complex::new(of(1), of(2)) + change.ellipticity;
            latent_of(parameter, if component == "1" { e.re } else { e.im })
        }
        (Part::Lens, Role::Shape) => *z + scattered(),
        _ => *z,
    };
    let mut latent: Vec<f64> = model.free.iter().zip(maximum).map(value).collect();
    let has_foreground = model.free.iter().any(|parameter| FOREGROUND.contains(&parameter.name.as_str()));
    let quadrupole = |values: &[f64]| Some(quadrupole(&model.lenses(values).ok()?, einstein_radius));
    let shear = [change.shear.re, change.shear.im];
    let foreground = quadrupole(&values)
        .zip(quadrupole(&model.at_latent(&latent).0))
        .map(|(before, after)| [0, 1].map(|c| shear[c] + (after[c] - before[c]) / einstein_radius.powi(2)));
    for ((parameter, value), z) in model.free.iter().zip(values).zip(&mut latent) {
        if parameter.part != Part::LineOfSight {
            continue;
        }
        let name = parameter.name.as_str();
        let place = |names: [&str; 2]| names.iter().position(|own| *own == name);
        *z = match (foreground, place(FOREGROUND), place(BACKGROUND)) {
            (Some(shear), Some(c), _) => latent_of(parameter, value + shear[c]),
            // γ_LOS = γ_od + γ_os − γ_ds.
            (Some(shear), _, Some(c)) if has_foreground => latent_of(parameter, value - shear[c]),
            (Some(_), ..) if has_foreground => *z,
            _ => match parameter.parameter.guess {
                Guess::Fixed(value) => latent_of(parameter, value),
                _ => 0.0,
            },
        };
    }
    latent
}

/// Components of the shears between observer and lens, and observer and source.
const FOREGROUND: [&str; 2] = ["gamma1_od", "gamma2_od"];
const BACKGROUND: [&str; 2] = ["gamma1_os", "gamma2_os"];

/// (ψ₂, χ₂) of a potential that varies on the circle of that radius about the origin as ψ₂ cos 2φ + χ₂ sin 2φ, arcsec².
fn quadrupole(lenses: &[MassModel], radius_arcsec: f64) -> [f64; 2] {
    /// Of the trapezium rule on the circle.
    const POINTS: u32 = 64;
    let mut sum = [0.0; 2];
    for i in 0..POINTS {
        let phi = std::f64::consts::TAU * f64::from(i) / f64::from(POINTS);
        let (sin, cos) = phi.sin_cos();
        let tangential: f64 = lenses
            .iter()
            .map(|lens| lens.deflection(radius_arcsec * cos, radius_arcsec * sin))
            .map(|[x, y]| y * cos - x * sin)
            .sum();
        sum[0] -= tangential * (2.0 * phi).sin();
        sum[1] += tangential * (2.0 * phi).cos();
    }
    sum.map(|sum| sum * radius_arcsec / f64::from(POINTS))
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

/// What the first climb from guess number `number` holds: the line of sight and the Sérsic indices of the sources; nothing of a
/// lens that was changed, whose line of sight goes with it.
pub(super) fn held_at_first(likelihood: &ImageLikelihood, known: Option<&Known>, number: u64) -> Vec<bool> {
    let is_changed = known.is_some_and(|known| known.changes(number));
    let is_held = |parameter: &FreeParameter| match (parameter.part, parameter.parameter.role) {
        (Part::LineOfSight, _) | (Part::Source, Role::Shape) => !is_changed,
        _ => false,
    };
    likelihood.model().free.iter().map(is_held).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::model::ModelDescription;

    #[test]
    fn a_changed_power_law_has_the_quadrupole_it_had_and_the_line_of_sight_shear() {
        let model = CompiledModel::new(&ModelDescription::built_in("tidal-minimal").unwrap()).unwrap();
        let place = |name: &str| model.free.iter().position(|own| own.name == name).unwrap();
        let mut values = model.at_latent(&vec![0.0; model.free.len()]).0;
        for (name, value) in [
            ("lens.theta_E", 1.5),
            ("lens.gamma", 2.4),
            ("lens.e1", 0.02),
            ("lens.e2", -0.015),
            ("lens.center_x", 0.0),
            ("lens.center_y", 0.0),
            ("gamma1_od", 0.01),
            ("gamma2_od", 0.03),
            ("gamma1_los", -0.02),
        ] {
            values[place(name)] = value;
        }
        let latent: Vec<f64> =
            model.free.iter().zip(&values).map(|(own, value)| own.prior.to_latent(*value)).collect();
        let some = Complex::new(0.02, -0.01);
        let by_all =
            Change { turn: Complex::new(0.3, -0.8), ellipticity: Complex::new(-0.01, 0.02), shear: some };
        for change in [Change::turned(-Complex::ONE), by_all] {
            let changed = model.at_latent(&changed(&model, &latent, (1.5, change), || 0.0)).0;
            let number = |values: &[f64], names: [&str; 2]| {
                let [re, im] = names.map(|name| values[place(name)]);
                Complex::new(re, im)
            };
            let [e, e_changed] = [&values, &changed].map(|values| number(values, ["lens.e1", "lens.e2"]));
            let [shear, shear_changed] = [&values, &changed].map(|values| number(values, FOREGROUND));
            assert!((e_changed - change.turn * e - change.ellipticity).norm() < 1e-9);
            // To first order in e.
            let of_shear = (shear_changed - shear - change.shear) / (e_changed - e);
            assert!((of_shear + (3.0 - 2.4) / (5.0 - 2.4)).norm() < 2e-3, "{change:?} {of_shear}");
            for same in ["gamma1_los", "gamma2_los", "omega_los", "lens.gamma", "lens.theta_E"] {
                assert!((changed[place(same)] - values[place(same)]).abs() < 1e-12, "{same}");
            }
        }
    }
}
