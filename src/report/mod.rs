//! From a finished run to what a person looks at: its folder of files and its figures.

mod catalogue_report;
mod curve_figure;
mod ensemble_figures;
mod ensemble_folder;
mod exposure_figure;
mod fit_folder;
mod fit_warnings;
mod number_text;
mod page;
mod run_figures;
mod run_folder;
mod staged;
mod study_figures;
mod validity_figures;
mod validity_table;

pub use catalogue_report::{CatalogueReport, NamedFigure, contour_figure};
pub use curve_figure::curve_figure;
pub use ensemble_figures::{expected_figure, smoothing_figure};
pub use ensemble_folder::{SIGHTLINES_FILE, write_ensemble};
pub use exposure_figure::exposure_figure;
pub use fit_folder::{FitSummary, NamedTruths, corner_figure, reconstruction_figure, write_fit};
pub use number_text::{
    decimals_text, grouped, interval_text, number_text, probability_text, signed_text, true_minus,
    with_error_text,
};
pub use page::{PAGE_FILE, RunRecord, page, stage_page};
pub use run_figures::{map_figures, run_figures};
pub use run_folder::{RUN_FILE, image_file, write_run};
pub use staged::{Drawing, markdown_table, result_text, stage_figure, stage_figures, stage_json, stage_text};
pub use study_figures::{cut_figure, tidal_residual_figure, which_shear_figure};
pub use validity_figures::validity_figures;
pub use validity_table::{validity_result, validity_table};
