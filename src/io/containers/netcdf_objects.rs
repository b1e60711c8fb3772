//! netCDF-4 on top of HDF5: dimensions that the netCDF library recognises, and variables over them.
//!
//! netCDF-4 files are HDF5 files whose dimensions are dimension scales (HDF5 Dimension Scale Specification 1.0;
//! netCDF-4 file format, Unidata). The back references REFERENCE_LIST are left out: neither netCDF-C nor
//! h5netcdf reads them.

use std::io::Write as _;
use std::path::Path;

use hdf5::types::{FixedAscii, VarLenArray};
use hdf5::{Dataset, Datatype, Group, H5Type, ObjectReference1};
use ndarray::ArrayView2;

use super::hdf5_objects as objects;
use crate::error::{Error, Result};

/// A file with one attribute of the type that CLASS must have (see `data/netcdf/make_text16.py`).
const TEXT16: &[u8] = include_bytes!("../../../data/netcdf/text16.h5");

/// The type of CLASS: 16 bytes of ASCII that end in a null byte.
pub(crate) fn text16(path: &Path) -> Result<Datatype> {
    let failed = |problem: String| Error::write(path, format!("the type of a dimension: {problem}"));
    let mut template = tempfile::NamedTempFile::new().map_err(|error| failed(error.to_string()))?;
    template.write_all(TEXT16).and_then(|()| template.flush()).map_err(|error| failed(error.to_string()))?;
    hdf5::File::open(template.path())
        .and_then(|file| file.attr("CLASS")?.dtype())
        .map_err(|error| failed(error.to_string()))
}

/// A dimension of a group: its coordinates 0, 1, … and its number in the file.
pub(crate) fn write_dimension(
    path: &Path,
    group: &Group,
    text16: &Datatype,
    name: &str,
    length: usize,
    number: i32,
) -> Result<()> {
    let coordinates: Vec<i64> = (0..length as i64).collect();
    write_coordinates(path, group, text16, name, &coordinates, number)
}

/// A dimension of a group with its coordinates, and its number in the file.
pub(crate) fn write_coordinates<T: H5Type>(
    path: &Path,
    group: &Group,
    text16: &Datatype,
    name: &str,
    coordinates: &[T],
    number: i32,
) -> Result<()> {
    let failed = |error: String| Error::write(path, format!("dimension {name}: {error}"));
    let dataset = objects::write_numbers(path, group, name, coordinates, &[coordinates.len()])?;
    for (attribute, value) in [("CLASS", "DIMENSION_SCALE"), ("NAME", name)] {
        let value = FixedAscii::<16>::from_ascii(value).map_err(|error| failed(error.to_string()))?;
        let builder = dataset.new_attr_builder().empty_as(text16);
        let written = builder.create(attribute).and_then(|attribute| attribute.write_scalar(&value));
        written.map_err(|error| failed(error.to_string()))?;
    }
    let number_written = dataset
        .new_attr::<i32>()
        .create("_Netcdf4Dimid")
        .and_then(|attribute| attribute.write_scalar(&number));
    number_written.map_err(|error| failed(error.to_string()))
}

/// A variable over dimensions of its group, slowest first.
pub(crate) fn write_variable<T: H5Type>(
    path: &Path,
    group: &Group,
    name: &str,
    data: &[T],
    dimensions: &[(&str, usize)],
) -> Result<Dataset> {
    let shape: Vec<usize> = dimensions.iter().map(|(_, length)| *length).collect();
    let dataset = objects::write_numbers(path, group, name, data, &shape)?;
    attach(path, group, &dataset, name, dimensions)?;
    Ok(dataset)
}

/// An empty variable of single precision over three dimensions, a compressed chunk for each layer.
pub(crate) fn create_stack(
    path: &Path,
    group: &Group,
    name: &str,
    dimensions: &[(&str, usize); 3],
) -> Result<Dataset> {
    let dataset = objects::create_layers(path, group, name, dimensions.map(|(_, length)| length))?;
    attach(path, group, &dataset, name, dimensions)?;
    Ok(dataset)
}

/// Layer `row` of such a variable.
pub(crate) fn write_layer(
    path: &Path,
    dataset: &Dataset,
    row: usize,
    pixels: &[f32],
    [ny, nx]: [usize; 2],
) -> Result<()> {
    let failed = |error: String| Error::write(path, format!("layer {row} of {}: {error}", dataset.name()));
    let layer = ArrayView2::from_shape((ny, nx), pixels).map_err(|error| failed(error.to_string()))?;
    dataset.write_slice(layer, (row, .., ..)).map_err(|error| failed(error.to_string()))
}

/// Says over which dimensions of its group a variable is.
fn attach(
    path: &Path,
    group: &Group,
    dataset: &Dataset,
    name: &str,
    dimensions: &[(&str, usize)],
) -> Result<()> {
    let attach = || {
        let references: hdf5::Result<Vec<VarLenArray<ObjectReference1>>> = dimensions
            .iter()
            .map(|(dimension, _)| {
                Ok(VarLenArray::from_slice(&[group.reference::<ObjectReference1>(dimension)?]))
            })
            .collect();
        dataset
            .new_attr::<VarLenArray<ObjectReference1>>()
            .shape(dimensions.len())
            .create("DIMENSION_LIST")?
            .write_raw(&references?)
    };
    attach().map_err(|error| Error::write(path, format!("variable {name}: {error}")))
}
