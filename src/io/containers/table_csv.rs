//! Tables as CSV: one header line, numbers in the shortest form that reads back to the same bits.

use std::collections::{HashMap, HashSet};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::atomic_file::{check_writable, folder_of};
use super::checkpoint_file::hash;
use super::column::{Column, Values, is_exact};
use super::csv_dialect::{Ecsv, Fields, comment_on_units, flush_comments, separator, without_nameless};
use super::input_file;
use super::manifest::Replace;
use super::provenance::Provenance;
use super::staging::Staging;
use super::table::Table;
use crate::error::{Error, FileFault, Result, shortest};

/// Reads a CSV table as people, pandas, spreadsheets and astropy (ECSV) write it.
///
/// Lines that start with `#`, indented or not, and empty lines are skipped; spaces around fields, CRLF, a byte-order
/// mark and commas after the last column are tolerated; double quotes may enclose a field; semicolons or tabs may
/// separate; a first column of integers without a name, pandas' index, is left out. What was done is logged.
pub(super) fn read(path: &Path) -> Result<Table> {
    let fault = |problem: &str| Err(Error::file(FileFault::UnknownFormat, path, problem));
    let bytes = input_file::read(path)?;
    if bytes.is_empty() {
        return fault("is empty; a header line with the column names is wanted first");
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return fault("is UTF-16 text; save it as CSV in UTF-8");
    }
    if bytes.contains(&0) {
        return fault("is not a CSV file: not text");
    }
    if bytes.trim_ascii_start().starts_with(b"<") {
        return fault("is not a CSV file: it begins as HTML, XML or a VOTable does");
    }
    let text = match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => return fault(&not_utf8(&error)),
    };
    let text = flush_comments(text.trim_start_matches('\u{feff}'));
    let ecsv = Ecsv::of(path, &text)?;
    if let (None, Some(comment)) = (&ecsv, comment_on_units(&text)) {
        log::warn!(
            "{}: its comment '{comment}' is not read; columns have the units that their names end in",
            path.display()
        );
    }
    let separator = ecsv.as_ref().map_or_else(|| separator(&text), |ecsv| ecsv.separator);
    let fields = split(path, &text, separator)?;
    let (names, fields, line_of_row) = without_nameless(path, fields, separator)?;
    let mut columns: Vec<Column> = names
        .into_par_iter()
        .zip(fields)
        .map(|(name, fields)| Column { name, unit: None, values: typed(fields) })
        .collect();
    let units = ecsv.map_or_else(HashMap::new, |ecsv| ecsv.units);
    for column in &mut columns {
        column.unit = units.get(&column.name).cloned().flatten();
    }
    Table::from_file(path, columns, line_of_row)
}

/// What is wrong with text in another encoding, with the first line that shows it.
fn not_utf8(error: &std::string::FromUtf8Error) -> String {
    let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
    format!("line {line} is not UTF-8 text; save the file in UTF-8")
}

fn split(path: &Path, text: &str, separator: u8) -> Result<Fields> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut lines = LineCounter { text, byte: 0, line: 1 };
    let mut names: Vec<String> = Vec::new();
    let mut fields: Vec<Vec<String>> = Vec::new();
    let mut line_of_row = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            Error::file(FileFault::UnknownFormat, path, format!("is not a CSV file: {error}"))
        })?;
        let start = record.position().map_or(0, csv::Position::byte) as usize;
        let line = lines.line_of_record(start);
        if record.iter().all(str::is_empty) && (record.len() != 1 || names.len() != 1) {
            continue; // a spreadsheet's empty row
        }
        if names.is_empty() {
            names = record.iter().map(String::from).collect();
            check_names(path, line, &names)?;
            fields.resize(names.len(), Vec::new());
            continue;
        }
        let surplus = record.iter().skip(names.len());
        if record.len() < names.len() || surplus.clone().any(|field| !field.is_empty()) {
            let problem = format!("has {} fields, but the header has {}", record.len(), names.len());
            return Err(Error::table(path, format!("line {line}"), problem));
        }
        record.iter().zip(&mut fields).for_each(|(field, column)| column.push(field.into()));
        line_of_row.push(line);
    }
    if names.is_empty() {
        return Err(Error::file(
            FileFault::UnknownFormat,
            path,
            "holds comments only; a header line with the column names is wanted",
        ));
    }
    Ok((names, fields, line_of_row))
}

/// Refuses a header of numbers, and two columns of one name.
pub(super) fn check_names(path: &Path, line: u64, names: &[String]) -> Result<()> {
    let fault = |problem: String| Err(Error::table(path, format!("line {line}"), problem));
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return fault(
            "the first line must hold the column names, without a leading '#', but holds numbers".into(),
        );
    }
    if let [name] = names
        && name.contains(char::is_whitespace)
    {
        let problem =
            "is one name with blanks in it; commas, semicolons or tabs separate columns, or blanks in ECSV";
        return fault(format!("the header, {name}, {problem}"));
    }
    let mut known = HashSet::new();
    match names.iter().find(|name| !name.is_empty() && !known.insert(name.as_str())) {
        Some(name) => fault(format!("two columns are called {name}")),
        None => Ok(()),
    }
}

/// Counts lines up to a record; the csv crate counts a record from the comments before it.
struct LineCounter<'a> {
    text: &'a str,
    byte: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// Line of the record whose text, or the comments and empty lines before it, begin at `start`.
    fn line_of_record(&mut self, start: usize) -> u64 {
        let count = |part: &str| part.bytes().filter(|&byte| byte == b'\n').count() as u64;
        self.line += self.text.get(self.byte..start).map_or(0, count);
        self.byte = start;
        while let Some((line, _)) = self.text.get(self.byte..).and_then(|rest| rest.split_once('\n')) {
            if !line.starts_with('#') && !line.trim_end_matches('\r').is_empty() {
                break;
            }
            self.line += 1;
            self.byte += line.len() + 1;
        }
        self.line
    }
}

/// Numbers where every field is one, else text; integers too long for an f64 stay text.
fn typed(fields: Vec<String>) -> Values {
    let integers: Option<Vec<i128>> = fields.iter().map(|field| field.parse().ok()).collect();
    if integers.is_some_and(|integers| !integers.into_iter().all(is_exact)) {
        return Values::Text(fields);
    }
    let numbers: Option<Vec<f64>> = fields.iter().map(|field| field.parse().ok()).collect();
    numbers.map_or(Values::Text(fields), Values::F64)
}

/// Writes the table and, beside it, `NAME.csv.provenance.toml`; both appear or neither.
pub(super) fn write(table: &Table, path: &Path, provenance: &Provenance) -> Result<()> {
    check_writable(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let staging = Staging::begin(folder_of(path), &[], Replace::Beside)?;
    staging.write(&name, |temporary| {
        write_rows(table, temporary).map_err(|error| Error::write(temporary, error))
    })?;
    let text = format!("{}{CSV_HASH} = \"{}\"\n", provenance.to_toml(), csv_hash(&staging.path(&name)));
    staging.write(provenance_file(Path::new(&name)), |temporary| {
        std::fs::write(temporary, text).map_err(|error| Error::write(temporary, error))
    })?;
    staging.commit().map(drop)
}

/// Where the provenance of a CSV stands.
pub(super) fn provenance_file(csv: &Path) -> PathBuf {
    let mut file = csv.as_os_str().to_owned();
    file.push(".provenance.toml");
    file.into()
}

/// Key of a provenance file: what the CSV held when it was written.
const CSV_HASH: &str = "csv_hash";

/// What a CSV holds, in sixteen digits.
pub(super) fn csv_hash(path: &Path) -> String {
    std::fs::read(path).map_or(String::new(), |bytes| format!("{:016x}", hash(&bytes)))
}

/// What a CSV held by the provenance of haloray beside it, if there is one.
pub(super) fn provenance_beside(path: &Path) -> Option<String> {
    let text = std::fs::read_to_string(provenance_file(path)).ok()?;
    Some(text.parse::<toml::Table>().ok()?.get(CSV_HASH)?.as_str()?.to_owned())
}

fn write_rows(table: &Table, path: &Path) -> csv::Result<()> {
    /// Rows that a thread puts into text at once, and blocks of them that are in memory together.
    const ROWS: usize = 8192;
    const BLOCKS: usize = 64;
    let mut file = std::fs::File::create(path)?;
    let mut header = csv::Writer::from_writer(vec![]);
    header.write_record(table.columns().iter().map(|column| &column.name))?;
    file.write_all(&text_of(header)?)?;
    let blocks: Vec<usize> = (0..table.row_count()).step_by(ROWS).collect();
    for blocks in blocks.chunks(BLOCKS) {
        let block = |first: &usize| rows_text(table, *first..(first + ROWS).min(table.row_count()));
        let texts: Vec<Vec<u8>> = blocks.par_iter().map(block).collect::<csv::Result<_>>()?;
        texts.iter().try_for_each(|text| file.write_all(text))?;
    }
    Ok(file.flush()?)
}

fn rows_text(table: &Table, rows: Range<usize>) -> csv::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(vec![]);
    for row in rows {
        for column in table.columns() {
            match &column.values {
                Values::F64(values) => writer.write_field(shortest(values[row]))?,
                Values::Text(values) => writer.write_field(&values[row])?,
            }
        }
        writer.write_record(None::<&[u8]>)?;
    }
    text_of(writer)
}

fn text_of(writer: csv::Writer<Vec<u8>>) -> csv::Result<Vec<u8>> {
    Ok(writer.into_inner().map_err(|error| error.into_error())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: impl AsRef<[u8]>) -> (std::path::PathBuf, Result<Table>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("haloes.csv");
        std::fs::write(&path, text).unwrap();
        let table = read(&path);
        (path, table)
    }

    fn fault(text: impl AsRef<[u8]>) -> String {
        let (path, table) = read_text(text);
        let error = table.and_then(|t| t.required_f64("z").map(drop)).unwrap_err();
        assert!(error.is_bad_input());
        error.to_string().replace(path.to_str().unwrap(), "haloes.csv")
    }

    #[test]
    fn comments_spaces_crlf_and_a_byte_order_mark_are_tolerated() {
        let text = "\u{feff}# made by hand\r\nz , theta_x_arcsec,id,label\r\n# more\r\n\r\n 0.5 ,\t-1e-3,7,\"a, b\"\r\n1,2.5,8,c";
        let (_, table) = read_text(text);
        let table = table.unwrap();
        assert_eq!(table.required_f64("z").unwrap(), [0.5, 1.0]);
        assert_eq!(table.required_f64("theta_x_arcsec").unwrap(), [-1e-3, 2.5]);
        assert_eq!(table.required_f64("id").unwrap(), [7.0, 8.0]);
        assert_eq!(table.columns()[3].values, Values::Text(vec!["a, b".into(), "c".into()]));
        assert_eq!((table.place_of(0), table.place_of(1)), ("line 5".into(), "line 6".into()));
    }

    #[test]
    fn tables_of_pandas_spreadsheets_and_astropy_are_read() {
        for text in [
            ",z,note\n0,0.5,a\n1,0.6,b\n",
            "z,note,\n0.5,a,\n0.6,b,\n",
            "z,note\n0.5,a,,\n0.6,b,\n",
            "z,note,,\n0.5,a,,\n0.6,b,,\n,,,\n",
            "  # made by hand, \"so\"\nz,note\n\t# more\n0.5,a\n0.6,b\n",
            "\"z\",\"note\"\r\n\"0.5\",\"a\"\r\n\"0.6\",\"b\"\r\n",
            "z;note\n0.5;a\n0.6;b\n",
            "z\tnote\n0.5\ta\n0.6\tb\n",
            "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: z, datatype: float64}\n# - {name: note, datatype: string}\nz note\n0.5 a\n0.6 b\n",
            "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n# - {name: z, datatype: float64}\nz,note\n0.5,a\n0.6,b\n",
        ] {
            let (_, table) = read_text(text);
            let table = table.unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(table.required_f64("z").unwrap(), [0.5, 0.6], "{text}");
            assert_eq!(table.columns()[1], Column::text("note", vec!["a".into(), "b".into()]), "{text}");
            assert_eq!(table.columns().len(), 2, "{text}");
        }
    }

    #[test]
    fn the_units_of_ecsv_are_kept() {
        let text = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: x_arcsec, unit: deg, datatype: float64}\nx_arcsec\n0.5\n";
        assert_eq!(read_text(text).1.unwrap().columns()[0].unit.as_deref(), Some("deg"));
        let (_, damaged) = read_text(text.replace("datatype:", "type:"));
        assert!(damaged.unwrap_err().to_string().contains("its ECSV header has no list datatype"));
    }

    #[test]
    fn a_hundred_thousand_columns_are_no_riddle() {
        let header: Vec<String> = (0..100_000).map(|i| format!("c{i}")).collect();
        let text = format!("{}\n{}\n", header.join(","), vec!["1"; header.len()].join(","));
        let message = fault(text);
        assert!(message.len() < 600 && message.ends_with("c39 and 99960 more"), "{message}");
    }

    #[test]
    fn every_fault_names_its_line_and_column() {
        let rows = "z,x\n0.1,1\n# note\n\n0.2,2\n";
        for (tail, expected) in [
            ("abc,3\n", "haloes.csv: line 6, column z: \"abc\" is not a number"),
            ("NaN,3\n", "haloes.csv: line 6, column z: NaN is not allowed; finite numbers only"),
            (
                "# more\r\n\r\n-inf,3",
                "haloes.csv: line 8, column z: -inf is not allowed; finite numbers only",
            ),
            (",3\n", "haloes.csv: line 6, column z: is empty; a number is wanted"),
            ("0.3\n", "haloes.csv: line 6: has 1 fields, but the header has 2"),
            ("0.3,3,3\n", "haloes.csv: line 6: has 3 fields, but the header has 2"),
        ] {
            assert_eq!(fault(format!("{rows}{tail}")), expected);
        }
    }

    #[test]
    fn unusable_files_say_what_is_wanted() {
        for (text, expected) in [
            (&b""[..], "is empty; a header line with the column names is wanted first"),
            (b"# only\n# comments\n", "holds comments only; a header line with the column names is wanted"),
            (b"z,x\n", "table: has no rows"),
            (b"x,y\n1,2\n", "column z: is missing; the columns present are x, y"),
            (b"z,x,z\n1,2,3\n", "line 1: two columns are called z"),
            (b"z,,x\n1,2,3\n", "header: column 2 has no name"),
            (b"\x89HDF\r\n\0\xff\xfe", "is not a CSV file: not text"),
            (b"z,name\n1,a\n2,\xe9t\xe9\n", "line 3 is not UTF-8 text; save the file in UTF-8"),
            (b"\xff\xfez\0,\0", "is UTF-16 text; save it as CSV in UTF-8"),
            (b"z;x\n0,5;1\n", "line 2, column z: \"0,5\" is not a number; write a decimal point"),
            (b",z\n0.1,2\n", "header: column 1 has no name"),
            (
                b"# z,x\n0.5,1\n",
                "line 2: the first line must hold the column names, without a leading '#', but holds numbers",
            ),
        ] {
            assert_eq!(fault(text), format!("haloes.csv: {expected}"));
        }
        let folder = tempfile::tempdir().unwrap();
        for path in [folder.path().join("missing.csv"), folder.path().to_path_buf()] {
            assert!(matches!(read(&path).unwrap_err(), Error::Read { .. }));
        }
    }

    #[test]
    fn numbers_survive_to_the_bit_and_text_to_the_letter() {
        let numbers = vec![0.1 + 0.2, -0.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, 1e-7, 1e16, 17.0, f64::NAN];
        let text: Vec<String> =
            ["a", "b,c", "say \"no\"", "two\nlines", "", "γ", "7", "0x1F", "123456789012345678901"]
                .map(String::from)
                .to_vec();
        let table =
            Table::new(vec![Column::f64("z", None, numbers.clone()), Column::text("label", text)]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        write(&table, &path, &Provenance::new(None, "")).unwrap();
        let back = read(&path).unwrap();
        let Values::F64(values) = &back.columns()[0].values else { panic!("not numbers") };
        assert!(values.iter().zip(&numbers).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(back.columns()[1], table.columns()[1]);
        assert_eq!((back.place_of(3), back.place_of(4)), ("line 5".into(), "line 7".into()));
    }

    #[test]
    fn the_provenance_lies_beside_the_table_and_nothing_else() {
        let table = Table::new(vec![Column::f64("z", None, vec![0.5, 6.2e-9])]).unwrap();
        let provenance = Provenance::new(Some(3), "");
        let folder = tempfile::tempdir().unwrap();
        write(&table, &folder.path().join("t.csv"), &provenance).unwrap();
        let text = |name| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(text("t.csv"), "z\n0.5\n6.2e-9\n");
        let beside = text("t.csv.provenance.toml");
        assert!(beside.starts_with(&provenance.to_toml()), "{beside}");
        assert_eq!(
            provenance_beside(&folder.path().join("t.csv")),
            Some(csv_hash(&folder.path().join("t.csv")))
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        let error = write(&table, &folder.path().join("missing/t.csv"), &provenance).unwrap_err();
        assert!(matches!(error, Error::OutputPlace { .. }));
    }
}
