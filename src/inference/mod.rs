//! Fitting an image: parameters and priors, forward model, likelihood, optimisation, samplers, convergence, posterior.
//!
//! Folders stand in one order, each using those before it: [`parameter`] → [`model`] → [`likelihood`] → [`optimise`] →
//! [`sample`] → [`diagnose`]; a [`SamplerRun`] and a [`Fit`], which keeps its state in a [`FitStore`], stand above them.
//!
//! Samplers work in *latent* coordinates z: each parameter is p = F⁻¹(Φ(z)) with F the distribution function of its
//! prior and Φ the standard normal one, so that every prior is N(0, 1) in z and nothing has an edge. The
//! log-posterior density in z is ln L(z) − ½|z|²; u = Φ(z) are the coordinates of the unit cube.

pub mod diagnose;
mod fit;
mod fit_settings;
pub mod likelihood;
pub mod model;
pub mod optimise;
pub mod parameter;
mod profile;
mod run;
pub mod sample;
mod store;
mod top;

pub(crate) use diagnose::negative_lights;
pub use diagnose::{DrawStatistics, HPD_FRACTION};
pub use fit::{Fit, ParameterSummary, UnsampledMaximum};
pub use fit_settings::FitSettings;
pub use likelihood::{
    Counter, Curvature, ImageLikelihood, LatentLikelihood, ModelImage, NoCurvature, Observation,
};
pub use optimise::{Maximum, StartSearch, climb_from, find_start};
pub use parameter::{Prior, PriorShape};
pub use profile::Profile;
pub use run::{Quantities, RunStatus, SamplerRun};
pub use store::{FitState, FitStore, NoStore};
pub use top::{Top, normal_pair};
