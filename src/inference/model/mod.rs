//! The forward model: a description in TOML, compiled to numbered parameters, evaluated with derivatives.

mod brightness;
mod compiled;
mod description;
mod likelihood_kind;
mod mesh;
mod simpler;
mod slots;

pub(crate) use brightness::Evaluation;
pub use compiled::{CompiledModel, Quantity};
pub use description::{BUILT_IN, LightDescription, ModelDescription, ParameterRule, ProfileDescription};
pub use likelihood_kind::LikelihoodKind;
pub use mesh::Mesh;
pub use slots::{FreeParameter, Part};
