//! What is known of a parameter and of a profile as a function of its parameters: facts for all readers, stated once.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::constants::ARCSEC_RAD;
use crate::error::{Domain, Error, Result};

/// A parameter of a profile, or a number of a model of the line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// lenstronomy's name.
    pub name: &'static str,
    /// `arcsec`, `1/arcsec`, `rad` or empty.
    pub unit: &'static str,
    /// How it stands on an axis, with `_{…}` and `^{…}` for what is lowered and raised.
    pub label: &'static str,
    /// Its value in a fit that leaves it out; `None` if it must be given.
    pub default: Option<f64>,
    /// What it may be.
    pub domain: Domain,
    /// The prior of someone who knows that there is a galaxy-scale lens, and no more.
    pub usual_prior: PriorShape,
    /// Where a search for the best fit begins.
    pub guess: Guess,
    /// What it does.
    pub role: Role,
}

/// The shape of a prior before it is cut to edges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PriorShape {
    /// Uniform between two edges.
    Uniform([f64; 2]),
    /// Normal: mean and standard deviation.
    Normal([f64; 2]),
    /// Log-normal: median, and standard deviation of the natural logarithm.
    LogNormal([f64; 2]),
}

/// What a parameter does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Multiplies the deflection; one factor on all strengths moves the Einstein radius.
    Strength,
    /// A radius.
    Scale,
    /// The form of the radial profile or of its contours.
    Shape,
    /// Ellipticity.
    Ellipticity,
    /// Centre or origin; lenstronomy takes 0 where it is left out.
    Centre,
    /// Convergence, shear, rotation or flexion from outside.
    Field,
}

/// Where a search for the best fit begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Guess {
    /// About the median of its prior.
    Prior,
    /// The Einstein radius that is tried.
    EinsteinRadius,
    /// The radius that holds half of the light of the image.
    HalfLight,
    /// A fraction of the Einstein radius that is tried.
    SourceRadius,
    /// About a median, with a standard deviation of the natural logarithm.
    About([f64; 2]),
    /// This value.
    Fixed(f64),
}

const ARCSEC: &str = "arcsec";
/// The most that an Einstein radius may be: a radian. No plane stands for more of the sky, and in A = 1 − ∂α of 1e20 the 1 is lost.
pub(crate) const RADIAN_ARCSEC: f64 = 1.0 / ARCSEC_RAD;

impl Parameter {
    /// A finite number without unit that must be given, guessed from its prior; what a parameter is unless it says otherwise.
    pub(crate) const NUMBER: Self = Self {
        name: "",
        unit: "",
        label: "",
        default: None,
        domain: Domain::FINITE,
        usual_prior: PriorShape::Uniform([-0.5, 0.5]),
        guess: Guess::Prior,
        role: Role::Shape,
    };
    /// A number that stretches what lies behind: 0 unless given.
    pub(crate) const FIELD: Self = Self { default: Some(0.0), role: Role::Field, ..Self::NUMBER };
    /// A number that bends what lies behind: 0 unless given.
    pub(crate) const FLEXION: Self =
        Self { unit: "1/arcsec", usual_prior: PriorShape::Normal([0.0, 0.01]), ..Self::FIELD };
    /// A radius.
    pub(crate) const RADIUS: Self =
        Self { unit: ARCSEC, domain: Domain::POSITIVE, role: Role::Scale, ..Self::NUMBER };
    /// Einstein radius.
    pub(crate) const EINSTEIN_RADIUS: Self = Self {
        name: "theta_E",
        label: "θ_{E}",
        domain: Domain::from_to(0.0, RADIAN_ARCSEC),
        usual_prior: PriorShape::Uniform([0.01, 10.0]),
        guess: Guess::EinsteinRadius,
        ..Self::RADIUS
    };
    /// Logarithmic slope of the density of a power law.
    pub(crate) const SLOPE: Self = Self {
        name: "gamma",
        label: "γ",
        domain: Domain::inside(1.0, 3.0),
        usual_prior: PriorShape::Uniform([1.0, 3.0]),
        ..Self::NUMBER
    };
    /// First component of the ellipticity.
    pub(crate) const E1: Self = Self {
        name: "e1",
        label: "e_{1}",
        default: Some(0.0),
        domain: Domain::inside(-1.0, 1.0),
        role: Role::Ellipticity,
        ..Self::NUMBER
    };
    /// Second component of the ellipticity.
    pub(crate) const E2: Self = Self { name: "e2", label: "e_{2}", ..Self::E1 };
    /// First coordinate of the centre.
    pub(crate) const CENTRE_X: Self = Self {
        name: "center_x",
        unit: ARCSEC,
        label: "x",
        default: Some(0.0),
        usual_prior: PriorShape::Uniform([-0.1, 0.1]),
        role: Role::Centre,
        ..Self::NUMBER
    };
    /// Second coordinate of the centre.
    pub(crate) const CENTRE_Y: Self = Self { name: "center_y", label: "y", ..Self::CENTRE_X };
    /// Half-light or half-mass radius of a Sérsic profile.
    pub(crate) const SERSIC_RADIUS: Self = Self {
        name: "R_sersic",
        label: "R",
        usual_prior: PriorShape::Uniform([0.001, 10.0]),
        guess: Guess::HalfLight,
        ..Self::RADIUS
    };
    /// Sérsic index.
    pub(crate) const SERSIC_INDEX: Self = Self {
        name: "n_sersic",
        label: "n",
        domain: Domain::from_to(0.3, 10.0),
        usual_prior: PriorShape::Uniform([0.5, 10.0]),
        ..Self::NUMBER
    };
}

/// The parameters of a profile of its own followed by those of an ellipse: ellipticity and centre.
macro_rules! placed_ellipse {
    ($($own:expr),*) => {
        [$($own,)* Parameter::E1, Parameter::E2, Parameter::CENTRE_X, Parameter::CENTRE_Y]
    };
}
pub(crate) use placed_ellipse;

/// One of lenstronomy's names for a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Name {
    /// The name.
    pub name: &'static str,
    /// Parameters that lenstronomy's profile of this name does not have, and the values they then have.
    pub held: &'static [(&'static str, f64)],
}

/// A profile as a function of its parameters; `M` is what it builds.
#[derive(Debug)]
pub struct Description<M: 'static> {
    /// Its names.
    pub names: &'static [Name],
    /// Its parameters, in the order of [`Self::build`] and of every derivative by them.
    pub parameters: &'static [Parameter],
    /// Builds it from as many numbers as there are parameters, each in its domain.
    pub(crate) builder: fn(&[f64]) -> Result<M>,
}

impl<M> Description<M> {
    /// The profile of these values of its parameters.
    ///
    /// # Errors
    /// Another number of values than parameters, a value outside its domain, |e| ≥ 1.
    pub fn build(&self, values: &[f64]) -> Result<M> {
        if values.len() != self.parameters.len() {
            return Err(wrong_number(values, self.parameters.len()));
        }
        for (parameter, value) in self.parameters.iter().zip(values) {
            parameter.domain.check(parameter.name, *value)?;
        }
        (self.builder)(values)
    }
}

/// A profile under one of its names.
#[derive(Debug)]
pub struct Named<M: 'static> {
    /// The name.
    pub name: &'static Name,
    /// The profile.
    pub description: &'static Description<M>,
}

impl<M> Named<M> {
    /// The value of a parameter that lenstronomy's profile of this name does not have.
    pub fn held(&self, parameter: &Parameter) -> Option<f64> {
        self.name.held.iter().find(|(held, _)| *held == parameter.name).map(|(_, value)| *value)
    }

    /// The value of a parameter that a fit leaves out, if it may.
    pub fn default_of(&self, parameter: &Parameter) -> Option<f64> {
        self.held(parameter).or(parameter.default)
    }

    /// The keyword arguments of lenstronomy's profile of this name.
    pub fn arguments(&self) -> impl Iterator<Item = &'static Parameter> {
        self.description.parameters.iter().filter(|parameter| self.held(parameter).is_none())
    }

    /// The profile of lenstronomy's keyword arguments, whose values `value_of` gives.
    ///
    /// # Errors
    /// As [`Description::build`].
    pub fn build(&self, value_of: impl Fn(&'static Parameter) -> f64) -> Result<M> {
        let value = |parameter| self.held(parameter).unwrap_or_else(|| value_of(parameter));
        self.description.build(&self.description.parameters.iter().map(value).collect::<Vec<f64>>())
    }
}

/// `values` as an array of known length.
///
/// # Errors
/// Another length.
pub(crate) fn exactly<const N: usize>(values: &[f64]) -> Result<[f64; N]> {
    values.try_into().map_err(|_| wrong_number(values, N))
}

fn wrong_number(values: &[f64], wanted: usize) -> Error {
    Error::out_of_range("number of values of a profile's parameters", values.len(), &wanted.to_string())
}

/// |e| of an ellipticity, below 1.
pub(crate) fn checked_ellipticity(of: &str, ellipticity: [f64; 2]) -> Result<f64> {
    Domain::below(1.0).check(&format!("|e| of the {of}"), ellipticity[0].hypot(ellipticity[1]))
}

/// A finite centre.
pub(crate) fn checked_centre(centre_arcsec: [f64; 2]) -> Result<[f64; 2]> {
    Parameter::CENTRE_X.domain.check("centre_x_arcsec", centre_arcsec[0])?;
    Parameter::CENTRE_Y.domain.check("centre_y_arcsec", centre_arcsec[1])?;
    Ok(centre_arcsec)
}
