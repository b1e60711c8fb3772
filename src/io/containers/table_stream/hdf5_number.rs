//! Elements of HDF5 datasets for reading in slices: any number as f64, and records as their bytes.

use hdf5_reader::error::{Error, Result};
use hdf5_reader::{Datatype, H5Type};

use super::super::hdf5_reading::{integer, signed};

/// A number of any type of HDF5.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number(pub(super) f64);

/// Whether [`number`] knows this type, and how many bytes it takes.
pub(super) fn number_bytes(kind: &Datatype) -> Option<usize> {
    match kind {
        Datatype::FloatingPoint { size: size @ (4 | 8), .. } => Some(usize::from(*size)),
        Datatype::FixedPoint { size: size @ 1..=8, .. } | Datatype::Bitfield { size: size @ 1..=8, .. } => {
            Some(usize::from(*size))
        }
        _ => None,
    }
}

/// The number in a cell of that type.
pub(super) fn number(cell: &[u8], kind: &Datatype) -> Option<f64> {
    Some(match kind {
        Datatype::FloatingPoint { size: 4, byte_order } => {
            f64::from(f32::from_bits(integer(cell, *byte_order) as u32))
        }
        Datatype::FloatingPoint { size: 8, byte_order } => f64::from_bits(integer(cell, *byte_order)),
        Datatype::FixedPoint { signed: true, byte_order, .. } => signed(cell, *byte_order) as f64,
        Datatype::FixedPoint { byte_order, .. } | Datatype::Bitfield { byte_order, .. } => {
            integer(cell, *byte_order) as f64
        }
        _ => return None,
    })
}

fn wrong_type(kind: &Datatype) -> Error {
    Error::TypeMismatch { expected: "a number".into(), actual: format!("{kind:?}") }
}

impl H5Type for Number {
    fn hdf5_type() -> Datatype {
        f64::hdf5_type()
    }

    fn from_bytes(bytes: &[u8], kind: &Datatype) -> Result<Self> {
        let cell = number_bytes(kind).and_then(|size| bytes.get(..size));
        cell.and_then(|cell| number(cell, kind)).map(Self).ok_or_else(|| wrong_type(kind))
    }

    fn element_size(kind: &Datatype) -> usize {
        number_bytes(kind).unwrap_or(0)
    }

    fn decode_vec(raw: &[u8], kind: &Datatype, count: usize) -> Option<Result<Vec<Self>>> {
        let size = number_bytes(kind)?;
        let cells = raw.get(..count.checked_mul(size)?)?.chunks_exact(size);
        let values: Option<Vec<Self>> = cells.map(|cell| number(cell, kind).map(Self)).collect();
        values.map(Ok)
    }
}

/// A record of several fields.
#[derive(Debug, Clone)]
pub(super) struct Record(pub(super) Vec<u8>);

impl H5Type for Record {
    fn hdf5_type() -> Datatype {
        Datatype::Opaque { size: 0, tag: String::new() }
    }

    fn from_bytes(bytes: &[u8], _: &Datatype) -> Result<Self> {
        Ok(Self(bytes.to_vec()))
    }

    fn element_size(kind: &Datatype) -> usize {
        match kind {
            Datatype::Compound { size, .. } => *size as usize,
            _ => 0,
        }
    }
}
