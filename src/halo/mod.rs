//! Haloes along the line of sight: relations, catalogue, draws, the shear cut.

mod catalogue;
pub mod concentration;
mod doubts;
mod draw;
mod expectation;
pub mod lightcone;
mod mass_conversion;
pub mod mass_definition;
pub mod mass_function;
mod mass_table;
mod mean_density;
mod nfw_parameters;
mod population;
mod shear_cut;
mod truncation;

pub use catalogue::{HaloCatalogue, HaloMasses, RowFault};
pub use doubts::{doubts, mass_doubt};
pub use draw::{DrawnHaloes, draw_brute_force, draw_direct};
pub use expectation::{HaloShapes, expected_sum};
pub use mass_conversion::{Halo200c, MassConverter};
pub use mass_definition::MassDefinition;
pub use mass_table::MassTable;
pub use mean_density::{convergence_over_disc, mean_density_sheets, smooth_convergences};
pub use nfw_parameters::NfwScaling;
pub use population::{Epoch, Population, PopulationLimits, SLABS};
pub use shear_cut::passes_shear_cut;
pub use truncation::Truncation;
