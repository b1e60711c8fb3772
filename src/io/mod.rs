//! Files in and out: tables, images, runs; nothing half-written under its final name.

mod atomic_file;
mod fits_file;
mod hdf5_objects;
mod image_fits;
mod image_wcs;
mod provenance;
mod run_file;
mod staging;
mod table;
mod table_csv;
mod table_fits;
mod table_hdf5;

pub use atomic_file::{check_writable, write_atomically};
pub use image_fits::{ExposureKeywords, ImageFile, PsfKernel};
pub use provenance::Provenance;
pub use run_file::{AttributeValue, RunFile};
pub use staging::Staging;
pub use table::{Column, HALOES_GROUP, POINTS_GROUP, RAYS_GROUP, Table, Values};
