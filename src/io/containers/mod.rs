//! Formats that know nothing of lensing: tables, FITS, HDF5, netCDF; nothing half-written under its final name.

mod astropy_meta;
mod atomic_file;
mod attribute;
mod checkpoint_file;
mod csv_dialect;
pub(super) mod fits_file;
pub(super) mod hdf5_objects;
pub(super) mod hdf5_reading;
mod input_file;
mod manifest;
pub(super) mod netcdf_objects;
mod provenance;
mod record_log;
mod run_file;
mod run_file_reader;
mod staging;
mod table;
mod table_csv;
mod table_file;
mod table_fits;
mod table_hdf5;
mod temporaries;
mod unit;

pub use atomic_file::{check_writable, write_atomically, write_text};
pub use attribute::AttributeValue;
pub use checkpoint_file::{Saved, hash, read_checkpoint, write_checkpoint};
pub use input_file::read_text;
pub use manifest::Replace;
pub use provenance::Provenance;
pub use record_log::RecordLog;
pub use run_file::RunFile;
pub use run_file_reader::RunFileReader;
pub use staging::Staging;
pub use table::{Column, Table, Values};
pub use temporaries::{folders_written_to, remove_temporaries};
pub(super) use unit::arcsec_in;
