//! HDF5 groups, datasets and attributes as they are written, with fixed creation settings: same data, same bytes.

use std::path::Path;
use std::str::FromStr;

use hdf5::plist::group_create::LinkCreationOrder;
use hdf5::types::{FixedUnicode, StringError, TypeDescriptor, VarLenUnicode};
use hdf5::{Dataset, File, Group, Location};

use super::attribute::AttributeValue;
use super::provenance::Provenance;
use crate::error::{Error, Result};

/// Values in one compressed chunk: 1 MiB of f64.
const CHUNK_LENGTH: usize = 1 << 17;
/// zlib level; 6 and 9 differ by less than 1% on halo tables.
const DEFLATE_LEVEL: u8 = 4;
/// Bytes of the longest text stored with fixed length.
const LONGEST_FIXED: usize = 1024;

/// Creates an empty file without times in it, replacing a former one.
pub(crate) fn create(path: &Path) -> Result<File> {
    File::with_options()
        .with_fcpl(|p| p.obj_track_times(false).link_creation_order(LinkCreationOrder::Indexed))
        .create(path)
        .map_err(|error| Error::write(path, reason(&error)))
}

/// Flushes and closes a file; a full disk must not go unseen in a destructor.
pub(crate) fn close(path: &Path, file: File) -> Result<()> {
    file.flush().and_then(|()| file.close()).map_err(|error| Error::write(path, reason(&error)))
}

/// The group of that name (`"a/b"` for one inside another), created where missing.
pub(crate) fn group_or_new(path: &Path, file: &File, name: &str) -> Result<Group> {
    let failed = |error: hdf5::Error| Error::write(path, format!("group {name}: {}", reason(&error)));
    let mut group = file.group("/").map_err(failed)?;
    for part in name.split('/').filter(|part| !part.is_empty()) {
        group = if group.link_exists(part) {
            group.group(part)
        } else {
            let builder = group.create_group_builder().obj_track_times(false);
            builder.with_gcpl(|p| p.link_creation_order(LinkCreationOrder::Indexed)).create(part)
        }
        .map_err(failed)?;
    }
    Ok(group)
}

/// Writes numbers of the given shape (rows first), shuffled and deflated.
pub(crate) fn write_f64(
    path: &Path,
    group: &Group,
    name: &str,
    data: &[f64],
    shape: &[usize],
) -> Result<Dataset> {
    write_numbers(path, group, name, data, shape)
}

/// Writes numbers of any type of the given shape (rows first), shuffled and deflated.
pub(crate) fn write_numbers<T: hdf5::H5Type>(
    path: &Path,
    group: &Group,
    name: &str,
    data: &[T],
    shape: &[usize],
) -> Result<Dataset> {
    if shape.iter().product::<usize>() != data.len() {
        let what = format!("the number of values for dataset {name}");
        return Err(Error::out_of_range(&what, data.len(), &format!("that of the shape {shape:?}")));
    }
    refuse_name(path, group, name)?;
    let mut builder = group.new_dataset_builder().obj_track_times(false);
    if !data.is_empty() {
        builder = builder.chunk(chunk_shape(shape)).shuffle().deflate(DEFLATE_LEVEL);
    }
    builder
        .empty::<T>()
        .shape(shape)
        .create(name)
        .and_then(|dataset| {
            dataset.write_raw(data)?;
            // While the dataset is open: its destructor would hide that the disk is full.
            dataset.file()?.flush()?;
            Ok(dataset)
        })
        .map_err(|error| Error::write(path, format!("dataset {name}: {}", reason(&error))))
}

/// Creates an empty dataset of single precision, shuffled and deflated, one chunk a layer of its first dimension.
pub(crate) fn create_layers(path: &Path, group: &Group, name: &str, shape: [usize; 3]) -> Result<Dataset> {
    refuse_name(path, group, name)?;
    let [_, ny, nx] = shape;
    let builder = group.new_dataset_builder().obj_track_times(false).chunk([1, ny, nx]);
    let builder = builder.shuffle().deflate(DEFLATE_LEVEL).empty::<f32>().shape(shape);
    builder.create(name).map_err(|error| Error::write(path, format!("dataset {name}: {}", reason(&error))))
}

/// Names a doubled dataset, since HDF5's own reason is lost when creation fails, and a name that would be a path.
fn refuse_name(path: &Path, group: &Group, name: &str) -> Result<()> {
    if name.contains('/') || name == "." {
        let problem = "HDF5 cannot hold '/' in a name; rename the column or write .csv";
        return Err(Error::table(path, format!("column {name}"), problem));
    }
    if group.link_exists(name) {
        return Err(Error::write(path, format!("dataset {name} exists already in {}", group.name())));
    }
    Ok(())
}

/// Whole rows, about [`CHUNK_LENGTH`] values.
fn chunk_shape(shape: &[usize]) -> Vec<usize> {
    let mut left = CHUNK_LENGTH;
    let mut chunk: Vec<usize> = Vec::with_capacity(shape.len());
    for &length in shape.iter().rev() {
        chunk.push(length.min(left).max(1));
        left = (left / length.max(1)).max(1);
    }
    chunk.reverse();
    chunk
}

/// Writes text, one value a row, as UTF-8 of fixed length; only texts over [`LONGEST_FIXED`] bytes
/// are stored with variable length, which libhdf5 1.10 can crash on when the file is damaged.
pub(crate) fn write_text(path: &Path, group: &Group, name: &str, text: &[String]) -> Result<Dataset> {
    refuse_name(path, group, name)?;
    let width = text.iter().map(String::len).max().unwrap_or(0).max(1);
    let is_fixed = width <= LONGEST_FIXED;
    let kind = if is_fixed { TypeDescriptor::FixedUnicode(width) } else { TypeDescriptor::VarLenUnicode };
    let mut builder = group.new_dataset_builder().obj_track_times(false);
    if is_fixed && !text.is_empty() {
        builder = builder.chunk(chunk_shape(&[text.len()])).shuffle().deflate(DEFLATE_LEVEL);
    }
    builder
        .empty_as(&kind)
        .shape(text.len())
        .create(name)
        .and_then(|dataset| {
            match width {
                0..=32 => put_text::<FixedUnicode<32>>(&dataset, text),
                33..=128 => put_text::<FixedUnicode<128>>(&dataset, text),
                129..=LONGEST_FIXED => put_text::<FixedUnicode<LONGEST_FIXED>>(&dataset, text),
                _ => put_text::<VarLenUnicode>(&dataset, text),
            }?;
            dataset.file()?.flush()?;
            Ok(dataset)
        })
        .map_err(|error| Error::write(path, format!("dataset {name}: {}", reason(&error))))
}

fn put_text<T>(dataset: &Dataset, text: &[String]) -> hdf5::Result<()>
where
    T: hdf5::H5Type + FromStr<Err = StringError>,
{
    let converted: std::result::Result<Vec<T>, _> = text.iter().map(|text| text.parse()).collect();
    dataset.write_raw(&converted.map_err(|error| error.to_string())?)
}

/// Attaches an attribute to a file, group or dataset.
pub(crate) fn write_attribute(path: &Path, to: &Location, name: &str, value: &AttributeValue) -> Result<()> {
    let failed = |problem: String| Error::write(path, format!("attribute {name}: {problem}"));
    let written = match value {
        AttributeValue::F64(value) => to.new_attr::<f64>().create(name).and_then(|a| a.write_scalar(value)),
        AttributeValue::I64(value) => to.new_attr::<i64>().create(name).and_then(|a| a.write_scalar(value)),
        AttributeValue::U64(value) => to.new_attr::<u64>().create(name).and_then(|a| a.write_scalar(value)),
        AttributeValue::Text(value) => {
            let value = VarLenUnicode::from_str(value).map_err(|error| failed(error.to_string()))?;
            to.new_attr::<VarLenUnicode>().create(name).and_then(|a| a.write_scalar(&value))
        }
    };
    written.map_err(|error| failed(reason(&error)))
}

/// Stores the provenance as attributes of the root group.
pub(crate) fn write_provenance(path: &Path, file: &File, provenance: &Provenance) -> Result<()> {
    let text = |value: &String| AttributeValue::Text(value.clone());
    write_attribute(path, file, "haloray_version", &text(&provenance.version))?;
    write_attribute(path, file, "git_revision", &text(&provenance.git_revision))?;
    if let Some(seed) = provenance.seed {
        write_attribute(path, file, "seed", &AttributeValue::U64(seed))?;
    }
    write_attribute(path, file, "config_toml", &text(&provenance.config_toml))
}

/// HDF5's innermost message, the one nearest to the cause.
///
/// A failed write is told with time, buffer and offset; only the system's words are kept of that.
fn reason(error: &hdf5::Error) -> String {
    match (error, error.stack().as_ref().and_then(|stack| stack.last())) {
        (_, Some(frame)) => {
            let system =
                frame.desc().split_once("error message = '").and_then(|(_, rest)| rest.split_once('\''));
            system.map_or(frame.desc(), |(words, _)| words).into()
        }
        (hdf5::Error::Internal(message), _) => message.clone(),
        _ => "HDF5 gave no reason; a full disk is likely".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_whole_rows_of_about_a_mebibyte() {
        assert_eq!(chunk_shape(&[100]), [100]);
        assert_eq!(chunk_shape(&[1 << 20]), [1 << 17]);
        assert_eq!(chunk_shape(&[4000, 1000]), [131, 1000]);
        assert_eq!(chunk_shape(&[3, 1 << 20]), [1, 1 << 17]);
    }

    #[test]
    fn an_impossible_shape_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        let file = create(&path).unwrap();
        let group = group_or_new(&path, &file, "a/b").unwrap();
        let error = write_f64(&path, &group, "map", &[1.0, 2.0, 3.0], &[2, 2]).unwrap_err().to_string();
        assert!(error.contains("is 3, but must be that of the shape [2, 2]"), "{error}");
    }
}
