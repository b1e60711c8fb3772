//! Haloes along the line of sight: relations, catalogue, draws, the shear cut.

pub mod concentration;
pub mod mass_definition;
pub mod mass_function;

pub use mass_definition::MassDefinition;
