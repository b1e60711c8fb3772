//! Files in and out: tables, images, runs; nothing half-written under its final name.

mod atomic_file;
mod provenance;
mod staging;

pub use atomic_file::{check_writable, write_atomically};
pub use provenance::Provenance;
pub use staging::Staging;
