//! A description compiled to numbered slots: which are free, fixed or tied, and how they become lenses and lights.

use std::sync::Arc;

use super::description::{LightDescription, ModelDescription, ProfileDescription};
use super::slots::{FreeParameter, Origin, Part, Slot, Slots};
use crate::error::{Error, Result};
use crate::mapping::HaloSight;
use crate::mapping::tidal::{LineOfSightKind, LineOfSightModel};
use crate::profile::light::Sersic;
use crate::profile::mass::MassModel;
use crate::profile::registry::{Description, lens_light, mass, source};

/// A number that a fit tells of.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// How it stands on an axis.
    pub label: String,
    /// The edges of its prior; `None` if it is computed from the fitted parameters.
    pub edges: Option<[f64; 2]>,
}

/// A model ready to be evaluated: every number of it is a slot; free parameters fill one or more slots.
#[derive(Debug, Clone)]
pub struct CompiledModel {
    /// Parameters to fit, in the order of the description.
    pub free: Vec<FreeParameter>,
    pub(super) line_of_sight: LineOfSightKind,
    pub(super) lenses: Vec<&'static Description<MassModel>>,
    pub(super) sources: usize,
    pub(super) lens_lights: usize,
    /// Normal prior of each light's amplitude, sources first.
    pub(crate) amplitude_priors: Vec<[f64; 2]>,
    slots: Vec<Slot>,
    origins: Vec<Origin>,
    /// The haloes of [`LineOfSightKind::Haloes`].
    haloes: Option<Arc<HaloSight>>,
    /// The model whose fit prepares that of this one.
    simpler: Option<Arc<Self>>,
}

/// Amplitudes without a prior of their own: as good as flat for any image in electrons per second.
const WIDE_AMPLITUDE: [f64; 2] = [0.0, 1e6];

impl CompiledModel {
    /// Compiles a description.
    ///
    /// # Errors
    /// Unknown profiles or parameters, missing ones, ties to nothing, priors without room, no lens, no source, nothing free.
    pub fn new(description: &ModelDescription) -> Result<Self> {
        if description.line_of_sight.model == LineOfSightKind::Haloes {
            return Err(Error::out_of_range("the haloes of the model", "missing", "a halo table"));
        }
        Self::compile(description, None)
    }

    /// Compiles a description whose line of sight is that of given haloes.
    ///
    /// # Errors
    /// As [`Self::new`]; a description without `line_of_sight.model = "haloes"`.
    pub fn through_haloes(description: &ModelDescription, haloes: HaloSight) -> Result<Self> {
        if description.line_of_sight.model != LineOfSightKind::Haloes {
            let allowed = "one with line_of_sight.model = \"haloes\" where haloes are given";
            return Err(Error::out_of_range("the model", &description.name, allowed));
        }
        Self::compile(description, Some(Arc::new(haloes)))
    }

    fn compile(description: &ModelDescription, haloes: Option<Arc<HaloSight>>) -> Result<Self> {
        let mut slots = Slots::default();
        let los = &description.line_of_sight;
        los.validate()?;
        let numbers = los.model.parameters();
        slots.add((Part::LineOfSight, 0), "line_of_sight", numbers, &los.parameters, |p| p.default)?;
        let mut lenses = Vec::new();
        for (i, ProfileDescription { profile, parameters }) in description.lens.iter().enumerate() {
            lenses.push(slots.add_profile((Part::Lens, i), &mass(profile)?, parameters)?);
        }
        let mut amplitude_priors = Vec::new();
        for (i, light) in description.source.iter().enumerate() {
            slots.add_profile((Part::Source, i), &source(&light.profile)?, &light.parameters)?;
            amplitude_priors.push(amplitude_prior(light)?);
        }
        for (i, light) in description.lens_light.iter().enumerate() {
            slots.add_profile((Part::LensLight, i), &lens_light(&light.profile)?, &light.parameters)?;
            amplitude_priors.push(amplitude_prior(light)?);
        }
        for (part, count) in [("lens", lenses.len()), ("source", description.source.len())] {
            if count == 0 || count > 8 {
                return Err(Error::out_of_range(&format!("number of [[{part}]]"), count, "from 1 to 8"));
            }
        }
        let (free, origins) = slots.resolve()?;
        if free.is_empty() {
            return Err(Error::out_of_range("number of parameters with a prior", 0, "at least 1"));
        }
        let simpler = description.simpler().and_then(|simpler| Self::compile(&simpler, haloes.clone()).ok());
        Ok(Self {
            free,
            line_of_sight: los.model,
            lenses,
            sources: description.source.len(),
            lens_lights: description.lens_light.len(),
            amplitude_priors,
            slots: slots.0,
            origins,
            haloes,
            simpler: simpler.map(Arc::new),
        })
    }

    /// The model whose fit prepares that of this one: one elliptical power law in place of several masses.
    pub(in crate::inference) fn simpler(&self) -> Option<&Self> {
        self.simpler.as_deref()
    }

    /// Whether the lens is made of the same masses.
    pub(in crate::inference) fn has_the_lenses_of(&self, other: &Self) -> bool {
        let is_same =
            |(own, other): (&&Description<MassModel>, &&Description<MassModel>)| std::ptr::eq(*own, *other);
        self.lenses.len() == other.lenses.len() && self.lenses.iter().zip(&other.lenses).all(is_same)
    }

    /// Number of amplitudes, one a light.
    pub fn lights(&self) -> usize {
        self.sources + self.lens_lights
    }

    /// Names of the amplitudes, in the order of [`Self::lights`].
    pub fn amplitude_names(&self) -> Vec<String> {
        let parts = [(Part::Source, self.sources), (Part::LensLight, self.lens_lights)];
        parts.iter().flat_map(|(part, n)| (0..*n).map(move |i| part.prefix(i) + "amp")).collect()
    }

    /// Values of the free parameters at latent coordinates, and their derivatives.
    pub fn at_latent(&self, latent: &[f64]) -> (Vec<f64>, Vec<f64>) {
        self.free.iter().zip(latent).map(|(p, z)| p.prior.at_latent(*z)).map(|[v, d]| (v, d)).unzip()
    }

    /// Where the free parameter of that name stands among all.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a name that is none of theirs.
    pub fn place_of_free(&self, name: &str) -> Result<usize> {
        self.free.iter().position(|free| free.name == name).ok_or_else(|| {
            let names: Vec<&str> = self.free.iter().map(|free| free.name.as_str()).collect();
            Error::out_of_range("name of a free parameter", name, &names.join(", "))
        })
    }

    /// Latent coordinates of values of the free parameters.
    pub fn to_latent(&self, values: &[f64]) -> Vec<f64> {
        self.free.iter().zip(values).map(|(p, v)| p.prior.to_latent(*v)).collect()
    }

    /// Value of the named slot (free, fixed or tied) for the values of the free parameters.
    pub fn value_of(&self, name: &str, free: &[f64]) -> Option<f64> {
        let slot = self.slots.iter().position(|own| own.name == name)?;
        Some(self.slot_value(slot, free))
    }

    fn slot_value(&self, slot: usize, free: &[f64]) -> f64 {
        match self.origins[slot] {
            Origin::Fixed(value) => value,
            Origin::Free(i) => free[i],
        }
    }

    /// True for the full line of sight, from which γ_LOS and ω_LOS follow.
    pub fn has_implied_minimal(&self) -> bool {
        self.line_of_sight == LineOfSightKind::Full
    }

    /// What a fit tells of: the free parameters and, for the full line of sight, the minimal quantities it implies.
    pub fn quantities(&self) -> Vec<Quantity> {
        let free = self.free.iter().map(|p| Quantity {
            name: p.name.clone(),
            unit: p.parameter.unit,
            label: p.label(),
            edges: Some(p.prior.edges()),
        });
        let minimal = LineOfSightKind::Minimal.parameters().iter();
        let implied = minimal.filter(|p| self.has_implied_minimal() && IMPLIED.contains(&p.name));
        let implied = implied.map(|p| Quantity {
            name: p.name.into(),
            unit: p.unit,
            label: p.label.into(),
            edges: None,
        });
        free.chain(implied).collect()
    }

    /// Values of [`Self::quantities`] at latent coordinates.
    pub fn quantities_at(&self, latent: &[f64]) -> Vec<f64> {
        let (mut values, _) = self.at_latent(latent);
        if let Some(LineOfSightModel::Minimal { los, .. }) = self.implied_minimal(&values) {
            values.extend([los.gamma.re, los.gamma.im, los.omega]);
        }
        values
    }

    /// The minimal model that the numbers of a full line of sight imply, A_LOS = A_odᵀ A_ds⁻¹ A_os.
    pub fn implied_minimal(&self, free: &[f64]) -> Option<LineOfSightModel> {
        if !self.has_implied_minimal() {
            return None;
        }
        let numbers: Vec<f64> =
            (0..self.line_of_sight.parameters().len()).map(|slot| self.slot_value(slot, free)).collect();
        self.line_of_sight.build(&numbers).minimal()
    }

    /// The haloes that carry rays past the lens, if the line of sight is made of haloes.
    pub(in crate::inference) fn haloes(&self) -> Option<&HaloSight> {
        self.haloes.as_deref()
    }

    /// Values of all slots.
    pub(super) fn slots(&self, free: &[f64]) -> Vec<f64> {
        (0..self.origins.len()).map(|slot| self.slot_value(slot, free)).collect()
    }

    /// Sums derivatives by slot into derivatives by free parameter.
    pub(super) fn gather(&self, by_slot: &[f64]) -> Vec<f64> {
        let mut by_free = vec![0.0; self.free.len()];
        for (origin, derivative) in self.origins.iter().zip(by_slot) {
            if let Origin::Free(i) = origin {
                by_free[*i] += derivative;
            }
        }
        by_free
    }

    /// For every slot, the free parameter that fills it.
    pub(super) fn free_of_slots(&self) -> impl Iterator<Item = Option<usize>> {
        self.origins.iter().map(|origin| match origin {
            Origin::Free(i) => Some(*i),
            Origin::Fixed(_) => None,
        })
    }

    /// Slots of the line of sight and of all lenses, which shape β; the lights' follow.
    pub(super) fn mapping_slots(&self) -> usize {
        self.line_of_sight.parameters().len() + self.lenses.iter().map(|l| l.parameters.len()).sum::<usize>()
    }

    /// The lenses at values of the free parameters.
    ///
    /// # Errors
    /// When a parameter lies outside the domain of its profile.
    pub fn lenses(&self, free: &[f64]) -> Result<Vec<MassModel>> {
        Ok(self.build(&self.slots(free))?.0)
    }

    /// Line of sight, lenses and lights (sources first, amplitude 1) at values of the free parameters.
    ///
    /// # Errors
    /// When a parameter lies outside the domain of its profile.
    pub(crate) fn parts(&self, free: &[f64]) -> Result<(LineOfSightModel, Vec<MassModel>, Vec<Sersic>)> {
        let slots = self.slots(free);
        let (lenses, lights) = self.build(&slots)?;
        Ok((self.line_of_sight.build(&slots), lenses, lights))
    }

    /// The lenses and lights (sources first, amplitude 1) of the slot values.
    ///
    /// # Errors
    /// When a parameter lies outside the domain of its profile.
    pub(super) fn build(&self, slots: &[f64]) -> Result<(Vec<MassModel>, Vec<Sersic>)> {
        let mut at = self.line_of_sight.parameters().len();
        let mut lenses = Vec::with_capacity(self.lenses.len());
        for lens in &self.lenses {
            let end = at + lens.parameters.len();
            lenses.push(lens.build(&slots[at..end])?);
            at = end;
        }
        let (lights, _) = slots[at..].as_chunks();
        Ok((lenses, lights.iter().map(|light| Sersic::of_unit_amplitude(*light)).collect::<Result<_>>()?))
    }
}

/// What the minimal model has of the full one beside its foreground.
const IMPLIED: [&str; 3] = ["gamma1_los", "gamma2_los", "omega_los"];

fn amplitude_prior(light: &LightDescription) -> Result<[f64; 2]> {
    match light.amplitude {
        Some([mean, sd]) if !(mean.is_finite() && sd.is_finite() && sd > 0.0) => {
            Err(Error::out_of_range("amplitude of a light", format!("[{mean}, {sd}]"), "[mean, positive sd]"))
        }
        own => Ok(own.unwrap_or(WIDE_AMPLITUDE)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::BUILT_IN;
    use super::*;

    #[test]
    fn ties_follow_and_gradients_gather() {
        let text = "name = \"t\"\n[[lens]]\nprofile = \"SIE\"\nparameters = { theta_E = { uniform = [0.5, 2] } }\n\
                    [[source]]\nprofile = \"SERSIC_ELLIPSE\"\nparameters = { R_sersic = 0.3, n_sersic = 1, e2 = \"lens.theta_E\" }\n";
        let model = CompiledModel::new(&ModelDescription::parse(text).unwrap()).unwrap();
        assert_eq!(model.free.len(), 1);
        assert_eq!(model.value_of("source.e2", &[0.7]), Some(0.7));
        assert_eq!(model.value_of("lens.gamma", &[0.7]), Some(2.0));
        assert_eq!(model.gather(&vec![1.0; model.origins.len()]), [2.0]);
    }

    #[test]
    fn priors_beyond_what_a_parameter_may_be_are_told_of_and_those_of_built_in_models_are_not() {
        let cut =
            |model: CompiledModel| model.free.iter().filter_map(FreeParameter::cut_prior).collect::<Vec<_>>();
        for (name, _) in BUILT_IN {
            let description = ModelDescription::built_in(name).unwrap();
            if description.line_of_sight.model != LineOfSightKind::Haloes {
                assert_eq!(cut(CompiledModel::new(&description).unwrap()), [""; 0], "{name}");
            }
        }
        let text = "name = \"t\"\n[[lens]]\nprofile = \"SIE\"\nparameters = { theta_E = { uniform = [-3, 2] } }\n\
                    [[source]]\nprofile = \"SERSIC_ELLIPSE\"\nparameters = { R_sersic = 0.3, n_sersic = 1 }\n";
        let told = cut(CompiledModel::new(&ModelDescription::parse(text).unwrap()).unwrap());
        assert!(
            told[0].starts_with("the prior of lens.theta_E is from -3 to 2, but is cut to from 0"),
            "{told:?}"
        );
    }
}
