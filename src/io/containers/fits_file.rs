//! FITS files as a list of header-data units, checked before decoding; exact numbers in headers.

use std::path::Path;

use fitskit::checksum::{checksum, encode_checksum};
use fitskit::{BinTable, CompressedImage, FitsFile, Hdu, HduData, Header, HeaderValue, ImageData, Keyword};

use super::fits_header::{CARD_BYTES, declared_bytes, parsed_header};
use super::input_file;
use super::packed_image::{decompress, other_method};
use super::provenance::Provenance;
use crate::error::{Error, FileFault, Result};

/// FITS files consist of blocks of this many bytes.
pub(super) const BLOCK_BYTES: usize = 2880;
/// The keyword of what haloray wrote.
const VERSION_KEYWORD: &str = "HALORAY";
/// Characters of a configuration line on one HISTORY card.
const HISTORY_WIDTH: usize = 70;

/// Reads all header-data units; images and binary tables are decoded, other extensions skipped.
///
/// fitskit trusts headers and takes a truncated extension for the end of the file, so sizes and
/// characters are checked here first.
pub(crate) fn read(path: &Path) -> Result<Vec<Hdu>> {
    let bytes = input_file::read(path)?;
    if bytes.is_empty() {
        return Err(Error::file(FileFault::UnknownFormat, path, "is empty, not a FITS file"));
    }
    if !bytes.starts_with(b"SIMPLE  =") {
        return Err(Error::file(
            FileFault::UnknownFormat,
            path,
            "is not a FITS file: it does not begin with SIMPLE",
        ));
    }
    let mut units = Vec::new();
    let mut rest = bytes.as_slice();
    while !is_padding(rest) {
        let (unit, length) = read_unit(rest, units.len()).map_err(|Problem { fault, text }| {
            Error::file(fault, path, format!("HDU {}: {text}", units.len()))
        })?;
        units.push(unit);
        rest = rest.get(length..).unwrap_or_default();
    }
    Ok(units)
}

/// True where nothing follows but what old tapes and copies fill up with.
fn is_padding(rest: &[u8]) -> bool {
    rest.iter().all(|byte| [0, b' '].contains(byte))
}

/// What is wrong with a unit: it is damaged, unless another kind is said.
struct Problem {
    fault: FileFault,
    text: String,
}

impl From<String> for Problem {
    fn from(text: String) -> Self {
        Self { fault: FileFault::Damaged, text }
    }
}

impl From<&str> for Problem {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

/// One unit from the front of `bytes`, and its length with padding.
fn read_unit(bytes: &[u8], index: usize) -> std::result::Result<(Hdu, usize), Problem> {
    let truncated = || String::from("the file is truncated");
    if index > 0 && !bytes.starts_with(b"XTENSION") {
        let text = format!("the last {} bytes of the file are no extension; cut them off", bytes.len());
        return Err(Problem { fault: FileFault::Content, text });
    }
    let cards = bytes.chunks_exact(CARD_BYTES);
    let end = cards.take_while(|card| card.trim_ascii_end() != b"END").count() * CARD_BYTES;
    let data_start = (end + CARD_BYTES).next_multiple_of(BLOCK_BYTES);
    let header = parsed_header(bytes.get(..data_start).ok_or_else(truncated)?)?;
    let declared = declared_bytes(&header)?;
    let left = bytes.len() - data_start;
    let length = usize::try_from(declared).ok().filter(|length| *length <= left).ok_or_else(|| {
        format!("the file is truncated, or its header wrong: {declared} bytes of data are declared, {left} are there")
    })?;
    let data = &bytes[data_start..data_start + length];
    let data = match header.get_string("XTENSION") {
        _ if length == 0 => HduData::Empty,
        None if index > 0 => return Err("an extension without XTENSION".into()),
        None | Some("IMAGE") => {
            HduData::Image(ImageData::from_header_and_data(&header, data).map_err(|error| error.to_string())?)
        }
        Some("BINTABLE") => {
            let table = BinTable::from_header_and_data(&header, data).map_err(|error| error.to_string())?;
            match CompressedImage::detect(&header) {
                true if other_method(&header).is_some() => HduData::Empty,
                true => HduData::Image(decompress(&header, &table, data.len())?),
                false => HduData::BinTable(table),
            }
        }
        Some(_) => HduData::Empty,
    };
    Ok((Hdu::new(header, data), (data_start + length).next_multiple_of(BLOCK_BYTES)))
}

/// Writes the units one after the other, each with the standard's DATASUM and CHECKSUM.
pub(crate) fn write(path: &Path, units: Vec<Hdu>) -> Result<()> {
    let bytes: fitskit::Result<Vec<Vec<u8>>> = units.into_iter().map(summed).collect();
    let bytes = bytes.map_err(|error| Error::write(path, error))?;
    std::fs::write(path, bytes.concat()).map_err(|error| Error::write(path, error))
}

/// The bytes of a unit with its sums; fitskit's own lays out the card of CHECKSUM otherwise than astropy, which then finds another sum.
fn summed(mut unit: Hdu) -> fitskit::Result<Vec<u8>> {
    const NOT_YET: &str = "0000000000000000";
    let sum = unit.datasum().to_string();
    push_text(&mut unit.header, "DATASUM", &sum, "of the words of the data");
    unit.header.push(Keyword::commentary(
        "CHECKSUM",
        &format!("= '{NOT_YET}'   / makes the words of all sum up to -0"),
    ));
    let mut bytes = FitsFile { hdus: vec![unit] }.to_bytes()?;
    let sum = encode_checksum(checksum(&bytes), true);
    let card = bytes.chunks_exact(CARD_BYTES).position(|card| card.starts_with(b"CHECKSUM="));
    if let Some(card) = card {
        let text = card * CARD_BYTES + "CHECKSUM= '".len();
        bytes[text..text + sum.len()].copy_from_slice(sum.as_bytes());
    }
    Ok(bytes)
}

/// Whether haloray wrote the file, and nobody changed it: each unit's CHECKSUM makes all its 32-bit words sum up to minus zero.
pub(super) fn is_own(path: &Path) -> bool {
    let is_marked = |units: Vec<Hdu>| units[0].header.find(VERSION_KEYWORD).is_some();
    let sums_up = |bytes: Vec<u8>| checksum(&bytes) == u32::MAX;
    read(path).is_ok_and(is_marked) && input_file::read(path).is_ok_and(sums_up)
}

/// Appends a number with all its digits (fitskit alone would keep 16 of 17).
pub(crate) fn push_f64(header: &mut Header, name: &str, value: f64, comment: &str) {
    push_number(header, name, &format!("{value:?}").to_ascii_uppercase(), comment);
}

/// Appends a number given by its digits: a card whose text after the name is laid out here.
fn push_number(header: &mut Header, name: &str, digits: &str, comment: &str) {
    debug_assert!(name.len() <= 8, "FITS keywords have at most 8 characters");
    header.push(Keyword::commentary(name, &format!("= {digits:>20} / {comment}")));
}

/// Appends a short text.
pub(crate) fn push_text(header: &mut Header, name: &str, value: &str, comment: &str) {
    debug_assert!(name.len() <= 8, "FITS keywords have at most 8 characters");
    header.push(Keyword::with_value(name, HeaderValue::String(ascii(value)), Some(comment)));
}

/// Appends the provenance: keywords `HALORAY` (version), `GITREV`, `SEED`, and the configuration
/// as HISTORY, one card a line; a longer line goes on after a card that ends in `\`.
pub(crate) fn push_provenance(header: &mut Header, provenance: &Provenance) {
    push_text(header, VERSION_KEYWORD, &provenance.version, "version of haloray");
    push_text(header, "GITREV", &provenance.git_revision, "git revision of haloray");
    if let Some(seed) = provenance.seed {
        push_number(header, "SEED", &seed.to_string(), "of the random streams");
    }
    for line in provenance.config_toml.lines() {
        let line = ascii(line);
        let mut rest = line.as_str();
        while rest.len() > HISTORY_WIDTH {
            let (card, tail) = rest.split_at(HISTORY_WIDTH);
            header.push(Keyword::commentary("HISTORY", &format!(" {card}\\")));
            rest = tail;
        }
        header.push(Keyword::commentary("HISTORY", &format!(" {rest}")));
    }
}

/// Printable ASCII, as FITS demands; other characters become TOML's `\uXXXX`.
fn ascii(text: &str) -> String {
    let escape = |c: char| match c {
        ' '..='~' => c.to_string(),
        '\t' => " ".into(),
        c if u32::from(c) <= 0xFFFF => format!("\\u{:04X}", u32::from(c)),
        c => format!("\\U{:08X}", u32::from(c)),
    };
    text.chars().map(escape).collect()
}

/// The number under a keyword, if it is there; it must be finite, and one.
pub(crate) fn number(path: &Path, header: &Header, name: &str) -> Result<Option<f64>> {
    let Some(keyword) = header.find(name) else { return Ok(None) };
    let others = header.iter().filter(|other| other.name == name && other.value != keyword.value);
    if let Some(two) = others.filter_map(|other| keyword.value.as_ref().zip(other.value.as_ref())).next() {
        let problem =
            format!("keyword {name} is {} and, on another card, {}; leave out the wrong one", two.0, two.1);
        return Err(Error::file(FileFault::Content, path, problem));
    }
    match keyword.value.as_ref().and_then(HeaderValue::as_float) {
        Some(value) if value.is_finite() => Ok(Some(value)),
        _ => {
            let value = keyword.value.as_ref().map_or_else(|| "empty".into(), ToString::to_string);
            Err(Error::file(
                FileFault::Content,
                path,
                format!("keyword {name} is {value}, but must be a finite number"),
            ))
        }
    }
}

/// The extension of that name, if there is one.
///
/// # Errors
/// [`Error::File`] where there are several: which is meant is not to be guessed.
pub(crate) fn extension<'a>(path: &Path, units: &'a [Hdu], name: &str) -> Result<Option<&'a Hdu>> {
    let called: Vec<&Hdu> = units.iter().skip(1).filter(|unit| is_called(unit, name)).collect();
    match called.as_slice() {
        [] => Ok(None),
        [only] => Ok(Some(only)),
        several => {
            let problem = format!("has {} extensions called {name}, but may have one", several.len());
            Err(Error::file(FileFault::Content, path, problem))
        }
    }
}

/// True for the extension of that name; FITS does not tell upper from lower case here.
pub(crate) fn is_called(unit: &Hdu, name: &str) -> bool {
    is_named(&unit.header, name)
}

/// Whether a header is that of an extension of this name.
pub(super) fn is_named(header: &Header, name: &str) -> bool {
    header.get_string("EXTNAME").is_some_and(|found| found.eq_ignore_ascii_case(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitskit::PixelData;

    /// A primary image and an extension, with `card` in the first header.
    fn sample(push: impl FnOnce(&mut Header)) -> Vec<u8> {
        let image = || ImageData::new(vec![20, 30], PixelData::F64(vec![1.0; 600]));
        let mut primary = Hdu::primary_image(image());
        push(&mut primary.header);
        FitsFile { hdus: vec![primary, Hdu::image_extension(image())] }.to_bytes().unwrap()
    }

    fn read_bytes(bytes: &[u8]) -> Result<Vec<Hdu>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.fits");
        std::fs::write(&path, bytes).unwrap();
        read(&path)
    }

    fn fault(bytes: &[u8]) -> String {
        let error = read_bytes(bytes).unwrap_err();
        assert!(error.is_bad_input());
        error.to_string().split_once("t.fits: ").unwrap().1.into()
    }

    #[test]
    fn a_keyword_on_two_cards_is_a_number_where_they_agree() {
        let mut header = Header::new();
        let card = |value| fitskit::Keyword::with_value("BKGRMS", HeaderValue::Float(value), None);
        header.push(card(0.01));
        header.push(card(0.01));
        let path = Path::new("i.fits");
        assert_eq!(number(path, &header, "BKGRMS").unwrap(), Some(0.01));
        header.push(card(0.05));
        let error = number(path, &header, "BKGRMS").unwrap_err();
        assert!(error.is_bad_input());
        assert!(error.to_string().contains("BKGRMS is 0.01 and, on another card, 0.05"), "{error}");
    }

    #[test]
    fn numbers_keep_every_bit_in_a_header() {
        for value in
            [0.1 + 0.2, 0.005919973387690837, 5e-324, -f64::MAX, 5400.0, 1e-7, 1.234_567_890_123_456_7e-5]
        {
            let bytes = sample(|header| push_f64(header, "BKGRMS", value, "e-/s"));
            let units = read_bytes(&bytes).unwrap();
            let back = number(Path::new(""), &units[0].header, "BKGRMS").unwrap().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{value:e}");
        }
    }

    #[test]
    fn truncation_is_noticed_wherever_it_happens() {
        let bytes = sample(|_| ());
        assert_eq!(read_bytes(&bytes).unwrap().len(), 2);
        for (length, expected) in [
            (1000, "HDU 0: the file is truncated"),
            (5000, "HDU 0: the file is truncated"),
            (bytes.len() - 6000, "HDU 1: the file is truncated"),
            (bytes.len() - 2880, "HDU 1: the file is truncated"),
        ] {
            assert!(fault(&bytes[..length]).starts_with(expected));
        }
    }

    #[test]
    fn letters_in_comments_and_padding_behind_the_end_do_no_harm() {
        let bytes = sample(|header| push_text(header, "OBSERVER", "Per ??", "name"));
        let padded = [&bytes[..], &[0; 700]].concat();
        assert_eq!(read_bytes(&padded).unwrap().len(), 2);
        let more = [&bytes[..], b"hello"].concat();
        assert_eq!(fault(&more), "HDU 2: the last 5 bytes of the file are no extension; cut them off");
        let at = bytes.windows(2).position(|part| part == b"??").unwrap();
        let with = |place: usize, byte: u8| {
            let mut edited = bytes.clone();
            edited[place] = byte;
            edited
        };
        let units = read_bytes(&with(at, 0xe9)).unwrap();
        assert_eq!(units[0].header.get_string("OBSERVER"), Some("Per ??"));
        let card = at / CARD_BYTES * CARD_BYTES;
        for (place, byte) in [(at, b'\t'), (card, 0xe9), (card + 9, 0xe9)] {
            assert!(fault(&with(place, byte)).contains("other than printable ASCII"));
        }
    }

    #[test]
    fn other_files_and_impossible_headers_are_refused() {
        assert_eq!(fault(b""), "is empty, not a FITS file");
        assert_eq!(fault(b"\x89HDF\r\n"), "is not a FITS file: it does not begin with SIMPLE");
        let edit = |from: &str, to: &str| {
            let bytes = sample(|_| ());
            let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
            let mut edited = bytes.clone();
            edited[at..at + to.len()].copy_from_slice(to.as_bytes());
            fault(&edited)
        };
        assert!(
            edit("NAXIS1  =                   20", "NAXIS1  =                  -20").starts_with("HDU 0: ")
        );
        assert!(
            edit("NAXIS1  =                   20", "NAXIS1  = 9223372036854775807  ").starts_with("HDU 0: ")
        );
        assert_eq!(
            edit("NAXIS   =                    2", "NAXIS   =                   -1"),
            "HDU 0: NAXIS is -1, but must lie between 0 and 999"
        );
        assert_eq!(
            edit("NAXIS   =", "NAXÏS  ="),
            "HDU 0: the header holds characters other than printable ASCII"
        );
    }

    #[test]
    fn the_configuration_can_be_put_together_again_from_history() {
        let config = format!("name = \"γ\"\n\nlong = \"{}\"\n", "x".repeat(150));
        let units =
            read_bytes(&sample(|h| push_provenance(h, &Provenance::new(Some(u64::MAX), &config)))).unwrap();
        let history: String = units[0]
            .header
            .iter()
            .filter(|card| card.name == "HISTORY")
            .map(|card| card.comment.as_deref().unwrap_or("").strip_prefix(' ').unwrap_or(""))
            .map(|line| line.strip_suffix('\\').map_or(format!("{line}\n"), String::from))
            .collect();
        assert_eq!(history, config.replace('γ', "\\u03B3"));
        let table: toml::Table = history.parse().unwrap();
        assert_eq!(table["name"].as_str(), Some("γ"));
        let seed = units[0].header.find("SEED").unwrap().value.as_ref().unwrap().as_float();
        assert_eq!(seed, Some(u64::MAX as f64));
    }
}
