//! Halo mass functions: dn/dlnM from a published multiplicity function f(σ).

mod model;
mod press74;
mod relation;
mod sheth99;
mod tinker08;

pub use model::MassFunctionModel;
pub use press74::Press74;
pub use relation::MassFunction;
pub use sheth99::Sheth99;
pub use tinker08::Tinker08;
