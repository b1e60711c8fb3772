//! The simpler model that prepares the fit of another: one elliptical power law in place of several masses, a tidal line of
//! sight in place of one with flexions.

use super::description::{ModelDescription, ParameterRule, ProfileDescription};
use super::slots::Part;
use crate::inference::parameter::Prior;
use crate::profile::registry::{PriorShape, Role, mass};

/// Priors of the power law, wide enough for any lens.
const POWER_LAW: [(&str, PriorShape); 6] = [
    ("theta_E", PriorShape::LogNormal([1.0, 1.0])),
    ("gamma", PriorShape::Uniform([1.05, 2.95])),
    ("e1", PriorShape::Uniform([-0.6, 0.6])),
    ("e2", PriorShape::Uniform([-0.6, 0.6])),
    ("center_x", PriorShape::Normal([0.0, 0.1])),
    ("center_y", PriorShape::Normal([0.0, 0.1])),
];

impl ModelDescription {
    /// The model whose best fit prepares that of this one, simpler by one step; `None` where there is nothing to simplify.
    pub(super) fn simpler(&self) -> Option<Self> {
        self.with_one_power_law().or_else(|| self.without_flexions())
    }

    /// The same with the flexions of the line of sight that are free at zero; `None` where none is.
    fn without_flexions(&self) -> Option<Self> {
        let mut simpler = self.clone();
        for (name, rule) in &mut simpler.line_of_sight.parameters {
            if name.starts_with(['F', 'G']) && matches!(rule, ParameterRule::Free(_)) {
                *rule = ParameterRule::Fixed(0.0);
            }
        }
        (simpler != *self).then_some(simpler)
    }

    /// The same with one elliptical power law in place of the masses of the lens; `None` where the lens is a single mass.
    ///
    /// External fields stay. What was tied to a parameter of the lens takes over the rule of that parameter.
    fn with_one_power_law(&self) -> Option<Self> {
        let is_field = |lens: &ProfileDescription| {
            let of_fields = |role: Role| matches!(role, Role::Field | Role::Centre);
            mass(&lens.profile).is_ok_and(|own| own.description.parameters.iter().all(|p| of_fields(p.role)))
        };
        let (fields, masses): (Vec<_>, Vec<_>) = self.lens.iter().cloned().partition(is_field);
        if masses.len() < 2 {
            return None;
        }
        let mut simpler = self.clone();
        simpler.lens = fields;
        let of_lenses = simpler.lens.iter_mut().map(|lens| &mut lens.parameters);
        let of_lights =
            simpler.source.iter_mut().chain(&mut simpler.lens_light).map(|light| &mut light.parameters);
        let of_sight = std::iter::once(&mut simpler.line_of_sight.parameters);
        for rule in of_sight.chain(of_lenses).chain(of_lights).flat_map(|rules| rules.values_mut()) {
            if let Some(own) = self.rule_in_the_lens(rule) {
                *rule = own.clone();
            }
        }
        let rule = |shape: PriorShape| ParameterRule::Free(Prior { shape, low: None, high: None });
        let parameters = POWER_LAW.map(|(name, shape)| (name.to_owned(), rule(shape)));
        simpler.lens.insert(0, ProfileDescription { profile: "EPL".into(), parameters: parameters.into() });
        Some(simpler)
    }

    /// The rule of the lens's parameter that `rule` is tied to.
    fn rule_in_the_lens(&self, rule: &ParameterRule) -> Option<&ParameterRule> {
        let ParameterRule::Tied(target) = rule else { return None };
        self.lens.iter().enumerate().find_map(|(i, lens)| {
            target.strip_prefix(&Part::Lens.prefix(i)).and_then(|name| lens.parameters.get(name))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::model::CompiledModel;

    #[test]
    fn several_masses_become_one_power_law_and_all_else_stays() {
        let composite = ModelDescription::built_in("comprehensive").unwrap();
        let simpler = composite.with_one_power_law().unwrap();
        assert_eq!(simpler.lens.len(), 1);
        assert_eq!((&simpler.source, &simpler.lens_light), (&composite.source, &composite.lens_light));
        assert_eq!(simpler.line_of_sight, composite.line_of_sight);
        assert!(CompiledModel::new(&simpler).is_ok());
        assert!(simpler.with_one_power_law().is_none());
    }

    #[test]
    fn free_flexions_are_left_out_after_masses_have_become_one() {
        let flexion = ModelDescription::built_in("tidal-flexion").unwrap();
        let model = CompiledModel::new(&flexion).unwrap();
        let tidal = CompiledModel::new(&ModelDescription::built_in("tidal-minimal").unwrap()).unwrap();
        let names = |model: &CompiledModel| model.free.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(model.simpler().unwrap()), names(&tidal));
        assert!(tidal.simpler().is_none());
        let composite = ModelDescription::built_in("comprehensive").unwrap();
        let both = ModelDescription { line_of_sight: flexion.line_of_sight, ..composite };
        let both = CompiledModel::new(&both).unwrap();
        let one_mass = both.simpler().unwrap();
        assert_eq!((one_mass.lenses.len(), one_mass.has_the_lenses_of(&both)), (1, false));
        let no_flexion = one_mass.simpler().unwrap();
        assert!(no_flexion.has_the_lenses_of(one_mass) && no_flexion.simpler().is_none());
    }

    #[test]
    fn what_was_tied_to_a_mass_takes_over_its_rule_and_fields_stay() {
        let mut model = ModelDescription::built_in("comprehensive").unwrap();
        let shear = [
            ("gamma1".to_owned(), ParameterRule::Tied("lens2.e1".into())),
            ("gamma2".to_owned(), ParameterRule::Fixed(0.0)),
        ];
        model.lens.insert(1, ProfileDescription { profile: "SHEAR".into(), parameters: shear.into() });
        let halo = model.lens[2].parameters["e1"].clone();
        model.lens[1].parameters.insert("gamma1".into(), ParameterRule::Tied("lens3.e1".into()));
        let simpler = model.with_one_power_law().unwrap();
        assert_eq!(simpler.lens[1].profile, "SHEAR");
        assert_eq!(simpler.lens[1].parameters["gamma1"], halo);
        assert!(CompiledModel::new(&simpler).is_ok());
    }
}
