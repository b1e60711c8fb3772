//! The numbers of a model while it is compiled: one slot each, which is fixed, tied, or filled by a free parameter.

use std::collections::BTreeMap;

use super::description::ParameterRule;
use crate::error::{Domain, Error, Result};
use crate::inference::parameter::Prior;
use crate::profile::registry::{Description, Named, Parameter};

/// The parts of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The line of sight, whose parameters have no prefix.
    LineOfSight,
    /// Mass of the lens.
    Lens,
    /// Light of the source.
    Source,
    /// Light of the lens.
    LensLight,
}

/// A parameter that is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// `gamma1_los`, `lens.theta_E`, `source.R_sersic`, …; numbered (`lens2.…`) from the second component on.
    pub name: String,
    /// The part it belongs to.
    pub part: Part,
    /// What is known of it.
    pub parameter: &'static Parameter,
    /// Its prior.
    pub prior: Prior,
}

impl FreeParameter {
    /// What is to be said of a prior with an edge beyond what the parameter may be: models there do not exist.
    pub fn cut_prior(&self) -> Option<String> {
        let ([low, high], domain) = (self.prior.edges(), self.parameter.domain);
        let [least, most] = domain.edges();
        let is_beyond = low.is_finite() && low < least || high.is_finite() && high > most;
        // Of a prior that leaves nothing the fit itself says so.
        let is_cut = is_beyond && low < most && high > least;
        is_cut.then(|| format!("the prior of {} is from {low} to {high}, but is cut to {domain}", self.name))
    }

    /// How it stands on an axis.
    pub fn label(&self) -> String {
        let label = self.parameter.label;
        match self.part {
            Part::LineOfSight | Part::Lens => label.into(),
            Part::Source => format!("{label}^{{s}}"),
            Part::LensLight => format!("{label}^{{l}}"),
        }
    }
}

impl Part {
    /// `lens.` for the first component, `lens2.` for the second.
    pub(super) fn prefix(self, i: usize) -> String {
        let part = match self {
            Self::LineOfSight => return String::new(),
            Self::Lens => "lens",
            Self::Source => "source",
            Self::LensLight => "lens_light",
        };
        if i == 0 { format!("{part}.") } else { format!("{part}{}.", i + 1) }
    }
}

/// Where the value of a slot comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Origin {
    Fixed(f64),
    Free(usize),
}

/// One number of a model.
#[derive(Debug, Clone)]
pub(super) struct Slot {
    pub name: String,
    part: Part,
    parameter: &'static Parameter,
    rule: ParameterRule,
}

/// The slots while they are collected.
#[derive(Default)]
pub(super) struct Slots(pub Vec<Slot>);

impl Slots {
    /// Slots for all parameters of a profile, which is returned.
    pub fn add_profile<M>(
        &mut self,
        place: (Part, usize),
        profile: &Named<M>,
        given: &BTreeMap<String, ParameterRule>,
    ) -> Result<&'static Description<M>> {
        let parameters = profile.description.parameters;
        self.add(place, profile.name.name, parameters, given, |parameter| profile.default_of(parameter))?;
        Ok(profile.description)
    }

    /// Slots for all `parameters` of one component, in order.
    pub fn add(
        &mut self,
        (part, i): (Part, usize),
        component: &str,
        parameters: &'static [Parameter],
        given: &BTreeMap<String, ParameterRule>,
        default: impl Fn(&Parameter) -> Option<f64>,
    ) -> Result<()> {
        if let Some(unknown) = given.keys().find(|key| parameters.iter().all(|own| own.name != key.as_str()))
        {
            let names: Vec<&str> = parameters.iter().map(|own| own.name).collect();
            let allowed = match names.as_slice() {
                [] => format!("left out: {component} has no parameters"),
                names => format!("one of {}", names.join(", ")),
            };
            return Err(Error::out_of_range(&format!("parameter of {component}"), unknown, &allowed));
        }
        for parameter in parameters {
            let name = part.prefix(i) + parameter.name;
            let rule = given.get(parameter.name).cloned().or(default(parameter).map(ParameterRule::Fixed));
            let allowed = "a number, a prior or the name of another parameter";
            let missing = || Error::out_of_range(&format!("{name} of {component}"), "missing", allowed);
            let rule = rule.ok_or_else(missing)?;
            self.0.push(Slot { name, part, parameter, rule });
        }
        Ok(())
    }

    pub fn resolve(&self) -> Result<(Vec<FreeParameter>, Vec<Origin>)> {
        let mut free = Vec::new();
        let mut origins: Vec<Option<Origin>> = Vec::new();
        for Slot { name, part, parameter, rule } in &self.0 {
            origins.push(match rule {
                ParameterRule::Fixed(value) => Some(Origin::Fixed(Domain::FINITE.check(name, *value)?)),
                ParameterRule::Free(prior) => {
                    prior.validate(name)?;
                    free.push(FreeParameter { name: name.clone(), part: *part, parameter, prior: *prior });
                    Some(Origin::Free(free.len() - 1))
                }
                ParameterRule::Tied(_) => None,
            });
        }
        let resolved = self.0.iter().zip(&origins).map(|(slot, origin)| match (&slot.rule, origin) {
            (_, Some(origin)) => Ok(*origin),
            (ParameterRule::Tied(other), None) => {
                let target = self.0.iter().position(|own| own.name == *other).and_then(|i| origins[i]);
                let allowed = "the name of a parameter that is a number or has a prior, such as lens.e1";
                target.ok_or_else(|| Error::out_of_range(&slot.name, other, allowed))
            }
            (_, None) => Err(Error::out_of_range(&slot.name, "without a rule", "a rule")),
        });
        Ok((free, resolved.collect::<Result<_>>()?))
    }
}
