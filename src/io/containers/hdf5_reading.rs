//! HDF5 as it is read: in Rust alone, since the C library crashes on damaged files; no more is read than a file can hold.

use std::path::Path;
use std::sync::Arc;

use hdf5_reader::error::Error as Hdf5Error;
use hdf5_reader::group::Group;
use hdf5_reader::{
    Attribute, ByteOrder, Dataset, Datatype, EnumMember, FileStorage, Hdf5File, OpenOptions, StringPadding,
    StringSize, VarLenKind,
};

use super::attribute::AttributeValue;
use super::column::Values;
use super::input_file;
use crate::error::{Error, FileFault, Result};

/// Opens a file; what its datasets and chunks declare is compared with its size before anything is allocated.
pub(crate) fn open(path: &Path) -> Result<Hdf5File> {
    let bytes = input_file::read(path)?;
    if bytes.is_empty() {
        return Err(Error::file(FileFault::UnknownFormat, path, "is empty, not an HDF5 file"));
    }
    let (length, limit) = (bytes.len() as u64, input_file::largest_content_bytes(bytes.len()));
    let options = OpenOptions::default().with_max_read_bytes(limit).with_max_chunk_bytes(limit);
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(|error| damaged(path, &error))?;
    check_whole(path, &file, length)?;
    Ok(file)
}

/// Opens a file of which parts are read, however long it is; no part may be larger than `PART_BYTES`.
pub(super) fn open_in_parts(path: &Path) -> Result<Hdf5File> {
    const PART_BYTES: usize = 1 << 30;
    let on_disk = input_file::open(path)?;
    let length = on_disk.metadata().map_err(Error::read(path))?.len();
    let options = OpenOptions::default().with_max_read_bytes(PART_BYTES).with_max_chunk_bytes(PART_BYTES);
    let storage = FileStorage::from_file(on_disk).map_err(|error| damaged(path, &error))?;
    let file = Hdf5File::from_storage_with_options(Arc::new(storage), options)
        .map_err(|error| damaged(path, &error))?;
    check_whole(path, &file, length)?;
    Ok(file)
}

fn check_whole(path: &Path, file: &Hdf5File, length: u64) -> Result<()> {
    if file.superblock().eof_address > length {
        let problem = "is truncated: the end of the HDF5 file is missing";
        return Err(Error::file(FileFault::Damaged, path, problem));
    }
    Ok(())
}

/// Groups and datasets in a group, in the order of creation where the file keeps it.
pub(crate) fn members(path: &Path, group: &Group) -> Result<(Vec<Group>, Vec<Dataset>)> {
    group.members().map_err(|error| damaged(path, &error))
}

/// What values of a type are, if they cannot be a column.
pub(super) fn problem_of(kind: &Datatype) -> Option<String> {
    match kind {
        Datatype::FixedPoint { size: 1..=8, .. }
        | Datatype::Bitfield { size: 1..=8, .. }
        | Datatype::FloatingPoint { size: 4 | 8, .. }
        | Datatype::String { .. }
        | Datatype::VarLen { kind: VarLenKind::String, .. } => None,
        Datatype::Enum { base, .. } if !matches!(**base, Datatype::Enum { .. }) => problem_of(base),
        other => Some(format!("holds {}; only one number or one text a row is supported", in_words(other))),
    }
}

/// The numbers or text in a dataset, in the order of the file.
pub(crate) fn read_values(path: &Path, dataset: &Dataset) -> Result<Values> {
    Records::read(path, dataset)?.values(dataset.name(), dataset.dtype(), 0)
}

/// Names and values of the fields of a dataset of records; in place of values that cannot be a column what they are.
pub(super) fn read_fields(
    path: &Path,
    dataset: &Dataset,
) -> Result<Vec<(String, std::result::Result<Values, String>)>> {
    let Datatype::Compound { fields, .. } = dataset.dtype() else { return Ok(Vec::new()) };
    let records = Records::read(path, dataset)?;
    let of_field = |field: &hdf5_reader::CompoundField| {
        let values = match problem_of(&field.datatype) {
            Some(problem) => Err(problem),
            None => Ok(records.values(&field.name, &field.datatype, field.byte_offset as usize)?),
        };
        Ok((field.name.clone(), values))
    };
    fields.iter().map(of_field).collect()
}

/// The bytes of a dataset, one element after the other.
struct Records<'a> {
    path: &'a Path,
    dataset: &'a Dataset,
    raw: Vec<u8>,
    /// Bytes of one element.
    width: usize,
}

impl<'a> Records<'a> {
    fn read(path: &'a Path, dataset: &'a Dataset) -> Result<Self> {
        let failed = |error: Hdf5Error| damaged(path, &error);
        let width = dataset.raw_element_size().map_err(failed)?;
        Ok(Self { path, dataset, raw: dataset.read_raw_bytes().map_err(failed)?, width })
    }

    /// The values of type `kind` that begin `offset` bytes into every element.
    fn values(&self, name: &str, kind: &Datatype, offset: usize) -> Result<Values> {
        let refuse = |problem: String| Error::table(self.path, format!("column {name}"), problem);
        let size = match kind {
            Datatype::FixedPoint { size: size @ 1..=8, .. }
            | Datatype::Bitfield { size: size @ 1..=8, .. } => usize::from(*size),
            Datatype::FloatingPoint { size: size @ (4 | 8), .. } => usize::from(*size),
            Datatype::String { size: StringSize::Fixed(size), .. } => *size as usize,
            Datatype::String { .. } | Datatype::VarLen { kind: VarLenKind::String, .. } => {
                self.dataset.vlen_reference_size()
            }
            Datatype::Enum { base, members } if !matches!(**base, Datatype::Enum { .. }) => {
                let values = self.values(name, base, offset)?;
                return Ok(if members.iter().all(is_logical) { in_words_of_logic(values) } else { values });
            }
            other => return Err(refuse(problem_of(other).unwrap_or_default())),
        };
        if self.width == 0 || offset.checked_add(size).is_none_or(|end| end > self.width) {
            return Err(refuse("lies outside the records of the dataset".into()));
        }
        let cells = self.raw.chunks_exact(self.width).map(|record| &record[offset..offset + size]);
        Ok(match kind {
            Datatype::FloatingPoint { size: 4, byte_order } => Values::F64(
                cells.map(|cell| f64::from(f32::from_bits(integer(cell, *byte_order) as u32))).collect(),
            ),
            Datatype::FloatingPoint { byte_order, .. } => {
                Values::F64(cells.map(|cell| f64::from_bits(integer(cell, *byte_order))).collect())
            }
            Datatype::FixedPoint { signed: true, byte_order, .. } => {
                Values::from_integers(&cells.map(|cell| signed(cell, *byte_order)).collect::<Vec<_>>())
            }
            Datatype::FixedPoint { byte_order, .. } | Datatype::Bitfield { byte_order, .. } => {
                Values::from_integers(&cells.map(|cell| integer(cell, *byte_order)).collect::<Vec<_>>())
            }
            Datatype::String { size: StringSize::Fixed(_), padding, .. } => {
                Values::Text(cells.map(|cell| text(cell, *padding)).collect())
            }
            _ => {
                let resolve = |cell| self.dataset.resolve_vlen_reference_bytes(cell, 1);
                let texts = cells.map(|cell| Ok(text(&resolve(cell)?, StringPadding::NullTerminate)));
                let texts: std::result::Result<_, Hdf5Error> = texts.collect();
                Values::Text(texts.map_err(|error| damaged(self.path, &error))?)
            }
        })
    }
}

/// As h5py and Julia store what is true or false.
fn is_logical(member: &EnumMember) -> bool {
    ["TRUE", "FALSE"].iter().any(|word| member.name.eq_ignore_ascii_case(word))
}

fn in_words_of_logic(values: Values) -> Values {
    match values {
        Values::F64(flags) => Values::Text(flags.into_iter().map(|flag| (flag != 0.0).to_string()).collect()),
        text @ Values::Text(_) => text,
    }
}

/// Bytes of at most eight as an integer without sign.
pub(super) fn integer(cell: &[u8], order: ByteOrder) -> u64 {
    let append = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    match order {
        ByteOrder::LittleEndian => cell.iter().rev().fold(0, append),
        ByteOrder::BigEndian => cell.iter().fold(0, append),
    }
}

/// The same with sign.
pub(super) fn signed(cell: &[u8], order: ByteOrder) -> i64 {
    let unused_bits = 64 - 8 * cell.len() as u32;
    (integer(cell, order) << unused_bits) as i64 >> unused_bits
}

/// Text may come from anywhere, so its bytes are checked, not trusted.
fn text(bytes: &[u8], padding: StringPadding) -> String {
    let kept = match padding {
        StringPadding::SpacePad => bytes.trim_ascii_end(),
        _ => bytes.split(|&byte| byte == 0).next().unwrap_or_default(),
    };
    String::from_utf8_lossy(kept).into_owned()
}

fn in_words(kind: &Datatype) -> String {
    match kind {
        Datatype::Compound { .. } => "records inside records".into(),
        Datatype::Array { dims, .. } => format!("arrays of shape {dims:?}"),
        Datatype::VarLen { .. } => "lists".into(),
        Datatype::Opaque { .. } => "opaque bytes".into(),
        Datatype::Reference { .. } => "references".into(),
        Datatype::FloatingPoint { size, .. } => format!("floating-point numbers of {size} bytes, not 4 or 8"),
        _ => "values of another type".into(),
    }
}

/// The texts of an attribute that is text, one or several.
pub(super) fn attribute_texts(path: &Path, attribute: &Attribute) -> Result<Vec<String>> {
    let is_text = matches!(
        attribute.datatype,
        Datatype::String { .. } | Datatype::VarLen { kind: VarLenKind::String, .. }
    );
    attribute.read_strings().map_err(|_| {
        let (fault, wrong) = if is_text {
            (FileFault::Damaged, "damaged")
        } else {
            (FileFault::Content, "no text, but must be")
        };
        Error::file(fault, path, format!("the attribute {} is {wrong}", attribute.name))
    })
}

/// The single value of an attribute.
pub(crate) fn attribute_value(path: &Path, attribute: &Attribute) -> Result<AttributeValue> {
    let raw = attribute.raw_data.as_slice();
    let value = match attribute.datatype {
        Datatype::FixedPoint { size, signed: is_signed, byte_order }
            if raw.len() == usize::from(size) && size <= 8 =>
        {
            match is_signed {
                true => Some(AttributeValue::I64(signed(raw, byte_order))),
                false => Some(AttributeValue::U64(integer(raw, byte_order))),
            }
        }
        Datatype::FloatingPoint { .. } => attribute.read_as_f64().ok().map(AttributeValue::F64),
        _ => match attribute_texts(path, attribute)?.as_slice() {
            [text] => Some(AttributeValue::Text(text.clone())),
            _ => None,
        },
    };
    value.ok_or_else(|| {
        let problem = format!("the attribute {} is no single number or text", attribute.name);
        Error::file(FileFault::Content, path, problem)
    })
}

/// What a reader is told when a file makes no sense as HDF5.
pub(crate) fn damaged(path: &Path, error: &Hdf5Error) -> Error {
    let mut inner = error;
    while let Hdf5Error::Context { source, .. } = inner {
        inner = source;
    }
    let (fault, problem) = match inner {
        Hdf5Error::InvalidMagic => (FileFault::UnknownFormat, "is not an HDF5 file".into()),
        Hdf5Error::UnsupportedFilter(_) | Hdf5Error::UnsupportedEncoding(_) => {
            (FileFault::Content, format!("cannot be read: {error}; gzip and no compression are supported"))
        }
        Hdf5Error::ResourceLimit(_) => {
            (FileFault::TooLarge, format!("declares more than it or memory can hold: {error}"))
        }
        _ => (FileFault::Damaged, format!("is damaged or not readable as HDF5: {error}")),
    };
    Error::file(fault, path, problem)
}

#[cfg(test)]
mod tests {
    use super::super::hdf5_objects as objects;
    use super::*;

    #[test]
    fn integers_of_every_width_and_order_are_read() {
        assert_eq!(integer(&[1, 2], ByteOrder::LittleEndian), 0x0201);
        assert_eq!(integer(&[1, 2], ByteOrder::BigEndian), 0x0102);
        assert_eq!(signed(&[0xfe, 0xff], ByteOrder::LittleEndian), -2);
        assert_eq!(signed(&[0x80, 0, 0, 0, 0, 0, 0, 0], ByteOrder::BigEndian), i64::MIN);
        assert_eq!(signed(&[0x7f], ByteOrder::LittleEndian), 127);
    }

    #[test]
    fn text_ends_where_its_padding_begins() {
        assert_eq!(text(b"ab\0\0", StringPadding::NullPad), "ab");
        assert_eq!(text(b"a b  ", StringPadding::SpacePad), "a b");
        assert_eq!(text(b"\xff", StringPadding::NullTerminate), "\u{fffd}");
    }

    #[test]
    fn text_of_any_length_survives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.h5");
        let texts = |length| vec!["λ".repeat(length), String::new(), " a b ".into()];
        let lengths = [0, 1, 16, 17, 64, 65, 512, 513, 40_000];
        let file = objects::create(&path).unwrap();
        for length in lengths {
            objects::write_text(&path, &file, &format!("t{length}"), &texts(length)).unwrap();
        }
        let error = objects::write_text(&path, &file, "nul", &["a\0b".repeat(500)]).unwrap_err().to_string();
        assert!(error.contains("dataset nul: "), "{error}");
        objects::close(&path, file).unwrap();
        let file = open(&path).unwrap();
        for length in lengths {
            let dataset = file.dataset(&format!("t{length}")).unwrap();
            assert_eq!(read_values(&path, &dataset).unwrap(), Values::Text(texts(length)));
        }
    }
}
