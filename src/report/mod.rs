//! From a finished run to what a person looks at: its folder of files and its figures.

mod catalogue_report;
mod figures;
mod fit_folder;
mod lens_figure;
mod run_folder;

pub use catalogue_report::{CatalogueReport, contour_figure};
pub use figures::{cut_figure, draw_figures, exposure_figure, map_figures, tidal_residual_figure};
pub use fit_folder::{FitSummary, corner_figure, reconstruction_figure, write_fit};
pub use lens_figure::curve_figure;
pub use run_folder::{RUN_FILE, image_file, write_run};
