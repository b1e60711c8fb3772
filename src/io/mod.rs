//! Files in and out: tables, images, runs; nothing half-written under its final name.

mod atomic_file;
mod checkpoint_file;
mod fits_file;
mod halo_table;
mod hdf5_objects;
mod image_fits;
mod image_table;
mod image_wcs;
mod lens_model;
mod netcdf_objects;
mod observation_file;
mod posterior_file;
mod provenance;
mod ray_table;
mod run_file;
mod simulation_file;
mod staging;
mod table;
mod table_csv;
mod table_fits;
mod table_hdf5;

pub use atomic_file::{check_writable, write_atomically};
pub use checkpoint_file::{read_checkpoint, write_checkpoint};
pub use halo_table::{halo_table, read_haloes, write_haloes};
pub use image_fits::{ExposureKeywords, ImageFile, PsfKernel};
pub use image_table::{curve_table, image_table, kind_name};
pub use lens_model::{LensModelFile, LensOfFile, read_lens_model};
pub use observation_file::read_observation;
pub use posterior_file::{PosteriorVariable, read_posterior, write_posterior};
pub use provenance::Provenance;
pub use ray_table::{Points, ray_table, read_points};
pub use run_file::{AttributeValue, RunFile};
pub use simulation_file::{write_maps, write_simulation};
pub use staging::Staging;
pub use table::{Column, HALOES_GROUP, POINTS_GROUP, RAYS_GROUP, RELATIONS_GROUP, Table, Values};
