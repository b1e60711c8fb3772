//! The whole chain as values: config → haloes → line of sight → diagnostics, maps, images.

mod advantage;
mod calibration;
mod catalogue;
mod cut_study;
mod fitted_shear;
mod halo_choices;
mod halo_counts;
mod haloes;
mod los_shears;
mod matter;
mod missing_concentrations;
mod one_core_each;
mod relations;
mod rows;
mod scalars;
mod shapes;
mod sightlines;
mod simulate;
mod summary;
mod tidal_study;
mod tidal_twin;
mod validity;
mod view;
mod view_fits;
mod which_shear;

pub use advantage::{Advantage, Table1Image, advantage, table1_image};
pub use calibration::{
    Calibration, CalibrationFit, ParameterCalibration, RANK_BINS, RANKED_DRAWS, calibration_of,
};
pub use catalogue::{CatalogueImage, CatalogueSettings, compiled_with_shear, fit_catalogue};
pub use cut_study::{CutRow, cut_study};
pub use fitted_shear::FittedShear;
pub use halo_choices::{HaloChoice, halo_choices};
pub use halo_counts::HaloCounts;
pub use haloes::{Haloes, MassFunctionCurve, SingleHaloes, line_of_sight, line_of_sight_of, sheets_of};
pub use los_shears::{BeamAverage, DEFINITIONS, LosShears};
pub use matter::{MatterBudget, Selection, end, expectation, mean_convergence};
pub use missing_concentrations::MissingConcentrations;
pub use one_core_each::one_core_each;
pub use relations::Relations;
pub use rows::{NoRows, RowStore};
pub use scalars::{SightScalars, lens_centre, source_centre};
pub use shapes::LensAndSource;
pub use sightlines::{ImportedSightlines, Sightlines, populate};
pub use simulate::{Inputs, Simulation, simulate};
pub use summary::{Quantities, Summary};
pub use tidal_study::{ImageResidual, TidalResidual, rms, tidal_residual, tidal_study};
pub use tidal_twin::TidalTwin;
pub use validity::{
    Biases, DefinitionSummary, Deviation, Estimate, FitGroup, FitPair, FitStart, GroupSummary, MIDDLE, Mock,
    NOTICED_EXCESS, PREFERRED_LOG_ODDS, SeenHaloes, Share, SingleHaloSummary, ValidityCase, ValidityFit,
    ValidityImage, ValidityPlan, ValiditySightline, ValiditySummary, ValidityView, VaryingHalo, WITHIN_68,
    rank_correlation, validity,
};
pub use view::{View, critical_curves, main_lens, maps, to_accuracy};
pub use view_fits::{ViewFit, fit_views};
pub use which_shear::{WhichShear, median_deviations, which_shear};
