//! Haloes along the line of sight: relations, catalogue, draws, the shear cut.

mod catalogue;
pub mod concentration;
mod draw;
pub mod mass_definition;
pub mod mass_function;
mod mass_table;
mod mean_density;
mod nfw_parameters;
mod population;
mod shear_cut;

pub use catalogue::{HaloCatalogue, HaloMasses, RowFault};
pub use draw::{DrawnHaloes, draw_brute_force, draw_direct};
pub use mass_definition::MassDefinition;
pub use mass_table::MassTable;
pub use mean_density::mean_density_sheets;
pub use nfw_parameters::NfwScaling;
pub use population::{Epoch, Population, PopulationLimits, SLABS};
pub use shear_cut::passes_shear_cut;
