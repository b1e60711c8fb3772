//! Tables that are longer than memory: chosen columns of numbers, some rows at a time.

mod csv_rows;
mod fits_rows;
mod hdf5_number;
mod hdf5_rows;
mod stream;
mod title;

pub(in crate::io) use stream::{TableStream, degrees_in};
pub(in crate::io) use title::ColumnTitle;
