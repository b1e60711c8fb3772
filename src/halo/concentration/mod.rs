//! Concentration–mass relations c(M, z), each for the mass definitions it was calibrated with.

mod diemer15;
mod diemer19;
mod duffy08;
mod model;
mod relation;
mod table;

pub use diemer15::Diemer15;
pub use diemer19::Diemer19;
pub use duffy08::Duffy08;
pub use model::ConcentrationModel;
pub use relation::ConcentrationRelation;
pub use table::ConcentrationTable;
