//! HDF5 groups, datasets and attributes with fixed creation settings: same data, same bytes.

use std::path::Path;
use std::str::FromStr;

use hdf5::plist::group_create::LinkCreationOrder;
use hdf5::types::{FixedAscii, FixedUnicode, StringError, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Container, Dataset, File, Group, IndexType, IterationOrder, Location, MinorErrorCode};

use super::attribute::AttributeValue;
use super::provenance::Provenance;
use super::table::Values;
use crate::error::{Error, FileFault, Result};

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

/// Opens a file for reading.
pub(crate) fn open(path: &Path) -> Result<File> {
    let read_error = Error::read(path);
    let length = std::fs::File::open(path).and_then(|file| file.metadata()).map_err(read_error)?;
    if length.is_dir() {
        return Err(read_error(std::io::ErrorKind::IsADirectory.into()));
    }
    if length.len() == 0 {
        return Err(Error::file(FileFault::UnknownFormat, path, "is empty, not an HDF5 file"));
    }
    File::open(path).map_err(|error| damaged(path, &error))
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

/// Names in a group, in the order of creation where the file keeps it.
pub(crate) fn member_names(path: &Path, group: &Group) -> Result<Vec<String>> {
    group
        .member_names_by(IndexType::CreationOrder, IterationOrder::Increasing)
        .or_else(|_| group.member_names())
        .map_err(|error| damaged(path, &error))
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

/// The numbers or text in a dataset, in the order of the file.
pub(crate) fn read_values(path: &Path, container: &Container) -> Result<Values> {
    let kind = container.dtype().and_then(|dtype| dtype.to_descriptor());
    let values = match kind.map_err(|error| damaged(path, &error))? {
        TypeDescriptor::Float(_) => container.read_raw().map(Values::F64),
        TypeDescriptor::Integer(_) => container.read_raw::<i64>().map(|v| Values::from_integers(&v)),
        TypeDescriptor::Unsigned(_) => container.read_raw::<u64>().map(|v| Values::from_integers(&v)),
        TypeDescriptor::Boolean => {
            container.read_raw::<bool>().map(|v| Values::F64(v.into_iter().map(f64::from).collect()))
        }
        TypeDescriptor::VarLenUnicode => text::<VarLenUnicode>(container),
        TypeDescriptor::VarLenAscii => text::<VarLenAscii>(container),
        TypeDescriptor::FixedAscii(0..=32) => text::<FixedAscii<32>>(container),
        TypeDescriptor::FixedAscii(33..=128) => text::<FixedAscii<128>>(container),
        TypeDescriptor::FixedAscii(129..=LONGEST_FIXED) => text::<FixedAscii<LONGEST_FIXED>>(container),
        TypeDescriptor::FixedUnicode(0..=32) => text::<FixedUnicode<32>>(container),
        TypeDescriptor::FixedUnicode(33..=128) => text::<FixedUnicode<128>>(container),
        TypeDescriptor::FixedUnicode(129..=LONGEST_FIXED) => text::<FixedUnicode<LONGEST_FIXED>>(container),
        other => {
            let problem =
                format!("{} has type {other}; only numbers and text are supported", container.name());
            return Err(Error::file(FileFault::Content, path, problem));
        }
    };
    values.map_err(|error| damaged(path, &error))
}

/// Text may come from anywhere, so its bytes are checked, not trusted.
fn text<T: hdf5::H5Type + AsRef<[u8]>>(container: &Container) -> hdf5::Result<Values> {
    let raw = container.read_raw::<T>()?;
    let text = raw.iter().map(|t| String::from_utf8_lossy(t.as_ref()).into_owned());
    Ok(Values::Text(text.collect()))
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

/// The attribute of that name, if there is one.
pub(crate) fn read_attribute(path: &Path, of: &Location, name: &str) -> Result<Option<AttributeValue>> {
    let names = of.attr_names().map_err(|error| damaged(path, &error))?;
    if !names.iter().any(|present| present == name) {
        return Ok(None);
    }
    let attribute = of.attr(name).map_err(|error| damaged(path, &error))?;
    let kind = attribute.dtype().and_then(|dtype| dtype.to_descriptor());
    match kind.map_err(|error| damaged(path, &error))? {
        TypeDescriptor::Integer(_) => attribute.read_scalar().map(AttributeValue::I64),
        TypeDescriptor::Unsigned(_) => attribute.read_scalar().map(AttributeValue::U64),
        _ => match read_values(path, &attribute)? {
            Values::F64(values) if values.len() == 1 => Ok(AttributeValue::F64(values[0])),
            Values::Text(values) if values.len() == 1 => Ok(AttributeValue::Text(values[0].clone())),
            values => Err(format!("attribute {name} holds {} values, not one", values.len()).into()),
        },
    }
    .map(Some)
    .map_err(|error| damaged(path, &error))
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

/// What a reader is told when HDF5 cannot make sense of a file.
pub(crate) fn damaged(path: &Path, error: &hdf5::Error) -> Error {
    if error.contains_minor(MinorErrorCode::NotHdf5) {
        Error::file(FileFault::UnknownFormat, path, "is not an HDF5 file")
    } else if error.contains_minor(MinorErrorCode::Truncated) {
        Error::file(FileFault::Damaged, path, "is truncated: the end of the HDF5 file is missing")
    } else {
        Error::file(
            FileFault::Damaged,
            path,
            format!("is damaged or not readable as HDF5: {}", reason(error)),
        )
    }
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

    #[test]
    fn text_of_any_length_survives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        let file = create(&path).unwrap();
        for length in [0, 1, 16, 17, 64, 65, 512, 513, 40_000] {
            let text = vec!["λ".repeat(length), String::new(), " a b ".into()];
            let dataset = write_text(&path, &file, &format!("t{length}"), &text).unwrap();
            assert_eq!(read_values(&path, &dataset).unwrap(), Values::Text(text));
        }
        let error = write_text(&path, &file, "nul", &["a\0b".repeat(500)]).unwrap_err().to_string();
        assert!(error.contains("dataset nul: "), "{error}");
    }

    #[test]
    fn short_and_long_text_of_fixed_length_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        let file = create(&path).unwrap();
        let short = FixedAscii::<5>::from_ascii(b"short").unwrap();
        let long = FixedUnicode::<100>::from_str(&"λ".repeat(50)).unwrap();
        let short = file.new_dataset_builder().with_data(&[short]).create("short").unwrap();
        let long = file.new_dataset_builder().with_data(&[long]).create("long").unwrap();
        assert_eq!(read_values(&path, &short).unwrap(), Values::Text(vec!["short".into()]));
        assert_eq!(read_values(&path, &long).unwrap(), Values::Text(vec!["λ".repeat(50)]));
    }
}
