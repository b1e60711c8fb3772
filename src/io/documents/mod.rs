//! What haloray's files say: haloes, rays, lens models, images and observations, runs, posteriors, catalogues.

mod exposure_keywords;
mod flux_unit;
mod halo_table;
mod image_fits;
mod image_pixels;
mod image_reading;
mod image_table;
mod image_wcs;
mod lens_model;
mod lens_table;
mod lightcone;
mod mock_table;
mod numbers_by_name;
mod observation_file;
mod posterior_file;
mod psf_reading;
mod ray_table;
mod recovery_file;
mod sightline_file;
mod simulation_file;

pub use exposure_keywords::ExposureKeywords;
pub use halo_table::{HALOES_GROUP, SHEET_COLUMN, halo_table, read_haloes, read_line_of_sight, write_haloes};
pub use image_fits::{ImageFile, PsfKernel};
pub use image_table::{curve_table, image_table, kind_name};
pub use lens_model::{
    LensModelFile, LensModelParts, LensOfFile, LensRedshifts, lens_argument_unit, lens_model_names,
    read_lens_model,
};
pub use lens_table::{LENSES_GROUP, TabledLens, read_lenses};
pub use lightcone::{CONE_INDEX_FILE, ConeExtraction, extract_cone, read_cone, write_cone};
pub use mock_table::{CATALOGUE_GROUP, TrueShear, catalogue_table, read_truth_table, truth_table};
pub use numbers_by_name::NumbersByName;
pub use observation_file::read_observation;
pub use posterior_file::{PosteriorVariable, read_posterior, write_posterior};
pub use ray_table::{Points, RAYS_GROUP, ray_table, read_points};
pub use recovery_file::{plain_name, read_recovery, recovery_path, write_recovery};
pub use sightline_file::{
    SIGHTLINES_GROUP, SavedStacks, SightlineColumn, SightlineTable, StackRows, StackSpec, TIDAL_GROUP,
};
pub use simulation_file::{read_curves, write_curves, write_maps, write_simulation};
