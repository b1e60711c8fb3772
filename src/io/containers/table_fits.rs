//! Tables as FITS binary tables: TTYPE, TUNIT and TFORM for each column, f64 or text.

use std::path::Path;

use fitskit::{BinColumn, BinColumnType, BinTable, CompressedImage, Hdu, HduData, HeaderValue};

use super::column::{Column, Values};
use super::fits_file as fits;
use super::fits_units::column_units;
use super::provenance::Provenance;
use super::table::Table;
use crate::error::{Error, FileFault, Result};

/// Reads the binary table of that name; where it is missing, the only one.
pub(super) fn read(path: &Path, group: &str) -> Result<Table> {
    let units = fits::read(path)?;
    let is_table = |unit: &&Hdu| {
        unit.header.get_string("XTENSION") == Some("BINTABLE") && !CompressedImage::detect(&unit.header)
    };
    let tables: Vec<&Hdu> = units.iter().filter(is_table).collect();
    let unit = match (fits::extension(path, &units, group)?, tables.as_slice()) {
        (Some(named), _) if is_table(&named) => named,
        (_, [only]) => only,
        (_, []) => return Err(Error::file(FileFault::Content, path, "holds no binary table")),
        (_, several) => {
            let names = several.iter().map(|unit| unit.header.get_string("EXTNAME").unwrap_or("(unnamed)"));
            let names: Vec<&str> = names.collect();
            let problem = format!("holds no table {group}; the tables are {}", names.join(", "));
            return Err(Error::file(FileFault::Content, path, problem));
        }
    };
    let HduData::BinTable(table) = &unit.data else {
        return Err(Error::table(path, "table", "has no rows"));
    };
    let width: usize = table.columns.iter().map(|column| column.format.byte_size()).sum();
    let fits_in = |column: &BinColumn| column.format.byte_size() <= table.row_len;
    if width != table.row_len || !table.columns.iter().all(fits_in) {
        let problem = format!("the columns take {width} bytes a row, but NAXIS1 is {}", table.row_len);
        return Err(Error::file(FileFault::Damaged, path, problem));
    }
    let mut offset = 0;
    let (mut columns, mut left_out) = (Vec::with_capacity(table.columns.len()), Vec::new());
    let stated = column_units(path, &unit.header, &table.columns)?;
    for (i, (column, stated_unit)) in table.columns.iter().zip(stated).enumerate() {
        let size = column.format.byte_size();
        for name in ["TSCAL", "TZERO", "TNULL"] {
            fits::number(path, &unit.header, &format!("{name}{}", i + 1))?; // fitskit passes over what is no number
        }
        let null = unit.header.get_int(&format!("TNULL{}", i + 1));
        let cells = table.main_data.chunks_exact(width.max(1)).map(|row| &row[offset..offset + size]);
        let name = column.name.trim().to_string();
        match decode(column, null, cells) {
            Ok(values) => columns.push(Column { name, unit: stated_unit, values }),
            Err(problem) => left_out.push((name, problem)),
        }
        offset += size;
    }
    Table::from_file_without(path, columns, left_out)
}

/// The values of a column's cells.
pub(super) fn decode<'a>(
    column: &BinColumn,
    null: Option<i64>,
    cells: impl Iterator<Item = &'a [u8]>,
) -> std::result::Result<Values, String> {
    use BinColumnType as Type;
    let is_scaled = column.tscal != 1.0 || column.tzero != 0.0;
    let scale = |raw: f64| column.tzero + column.tscal * raw;
    let integers = |integers: Vec<i64>| match is_scaled {
        // Where a value is not known, the column is one of floats, which have a value for that.
        _ if integers.iter().any(|value| Some(*value) == null) => {
            let known = |value| if Some(value) == null { f64::NAN } else { scale(value as f64) };
            Values::F64(integers.into_iter().map(known).collect())
        }
        // The usual way to store unsigned integers: an offset of 2^(bits−1), exact as integers.
        true if column.tscal == 1.0 && column.tzero.fract() == 0.0 => {
            let offset = column.tzero as i128;
            Values::from_integers(&integers.into_iter().map(|v| i128::from(v) + offset).collect::<Vec<_>>())
        }
        true => Values::F64(integers.into_iter().map(|v| scale(v as f64)).collect()),
        false => Values::from_integers(&integers),
    };
    let values = match column.format {
        Type::D64(1) => Values::F64(cells.map(|cell| f64::from_be_bytes(bytes(cell))).map(scale).collect()),
        Type::E32(1) => {
            Values::F64(cells.map(|cell| f64::from(f32::from_be_bytes(bytes(cell)))).map(scale).collect())
        }
        Type::Byte(1) => integers(cells.map(|cell| i64::from(u8::from_be_bytes(bytes(cell)))).collect()),
        Type::I16(1) => integers(cells.map(|cell| i64::from(i16::from_be_bytes(bytes(cell)))).collect()),
        Type::J32(1) => integers(cells.map(|cell| i64::from(i32::from_be_bytes(bytes(cell)))).collect()),
        Type::K64(1) => integers(cells.map(|cell| i64::from_be_bytes(bytes(cell))).collect()),
        // No number, as in CSV: c200c stored as bytes with a sign comes back from astropy as logical values.
        Type::Logical(1) => Values::Text(cells.map(logical).collect()),
        Type::Char(_) => Values::Text(cells.map(trimmed).collect()),
        ref other => {
            let form = other.to_tform_string();
            return Err(format!("has the format {form}; only one number or one text a row is supported"));
        }
    };
    Ok(values)
}

fn logical(cell: &[u8]) -> String {
    match cell {
        b"T" => "true".into(),
        b"F" => "false".into(),
        _ => String::new(),
    }
}

/// The cell as an array; the caller's format fixes its length.
fn bytes<const N: usize>(cell: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(cell);
    array
}

/// Text up to the first NUL, without the blanks that fill the cell.
fn trimmed(cell: &[u8]) -> String {
    let end = cell.iter().position(|&byte| byte == 0).unwrap_or(cell.len());
    String::from_utf8_lossy(&cell[..end]).trim_end().into()
}

/// Characters of a text on one header card, quotes doubled.
const NAME_LENGTH_MAX: usize = 68;

/// Writes the table as the one extension of a new file at `path`.
pub(super) fn write(table: &Table, path: &Path, group: &str, provenance: &Provenance) -> Result<()> {
    let mut columns = Vec::new();
    for column in table.columns() {
        let refuse = |problem| Err(Error::table(path, format!("column {}", column.name), problem));
        let not_ascii =
            |text: &str| format!("FITS cannot hold {text:?}, only plain ASCII; write .h5 or .csv");
        if !is_printable_ascii(&column.name) {
            return refuse(not_ascii(&column.name));
        }
        if column.name.len() + column.name.matches('\'').count() > NAME_LENGTH_MAX {
            return refuse(format!(
                "FITS cannot hold names over {NAME_LENGTH_MAX} characters; write .h5 or .csv"
            ));
        }
        let format = match &column.values {
            Values::F64(_) => BinColumnType::D64(1),
            Values::Text(text) => match text.iter().find(|text| !is_printable_ascii(text)) {
                Some(bad) => return refuse(not_ascii(bad)),
                None => BinColumnType::Char(text.iter().map(String::len).max().unwrap_or(0).max(1)),
            },
        };
        let (name, tunit) = (column.name.clone(), column.unit.clone());
        columns.push(BinColumn { name, format, tscal: 1.0, tzero: 0.0, tunit });
    }
    let row_len = columns.iter().map(|column| column.format.byte_size()).sum();
    let mut main_data = Vec::with_capacity(row_len * table.row_count());
    for row in 0..table.row_count() {
        for (column, form) in table.columns().iter().zip(&columns) {
            match &column.values {
                Values::F64(values) => main_data.extend(values[row].to_be_bytes()),
                Values::Text(text) => {
                    main_data.extend(text[row].bytes());
                    main_data.extend(std::iter::repeat_n(b' ', form.format.byte_size() - text[row].len()));
                }
            }
        }
    }
    let data = BinTable { columns, nrows: table.row_count(), row_len, main_data, heap: Vec::new() };
    let mut extension = Hdu::bintable_extension(data);
    fits::push_text(&mut extension.header, "EXTNAME", &group.to_ascii_uppercase(), "name of the table");
    let mut primary = Hdu::primary_empty();
    primary.header.set("EXTEND", HeaderValue::Logical(true), Some("a table follows"));
    fits::push_provenance(&mut primary.header, provenance);
    fits::write(path, vec![primary, extension])
}

fn is_printable_ascii(text: &str) -> bool {
    text.bytes().all(|byte| (b' '..=b'~').contains(&byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Table {
        Table::new(vec![
            Column::f64("z", None, vec![0.5, 0.1 + 0.2]),
            Column::f64("theta_x_arcsec", Some("arcsec"), vec![-1e-300, 3e5]),
            Column::text("label", vec!["it's a halo".into(), String::new()]),
        ])
        .unwrap()
    }

    fn written(table: &Table) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.fits");
        write(table, &path, "haloes", &Provenance::new(Some(5), "key = 1\n")).unwrap();
        (folder, path)
    }

    fn fault(path: &Path) -> String {
        let error = read(path, "haloes").unwrap_err();
        assert!(error.is_bad_input());
        error.to_string().replace(path.to_str().unwrap(), "FILE")
    }

    #[test]
    fn a_table_survives_with_order_units_and_text_and_the_same_bytes() {
        let (_folder, path) = written(&sample());
        assert_eq!(read(&path, "haloes").unwrap().columns(), sample().columns());
        assert_eq!(read(&path, "points").unwrap().columns(), sample().columns(), "the only table is taken");
        let (_second, again) = written(&sample());
        assert!(std::fs::read(&path).unwrap() == std::fs::read(again).unwrap());
    }

    #[test]
    fn of_two_tables_of_a_name_none_is_guessed() {
        let (_folder, path) = written(&sample());
        let mut units = fits::read(&path).unwrap();
        let mut second = units[1].clone();
        second.header.set("EXTNAME", HeaderValue::String("Haloes".into()), None);
        units.push(second);
        fits::write(&path, units).unwrap();
        assert_eq!(fault(&path), "FILE: has 2 extensions called haloes, but may have one");
    }

    #[test]
    fn a_scale_that_is_no_number_is_refused() {
        let (_folder, path) = written(&sample());
        let sound = std::fs::read(&path).unwrap();
        let card = (0..sound.len()).step_by(80).find(|at| sound[*at..].starts_with(b"TUNIT2")).unwrap();
        for name in ["TSCAL2", "TZERO2", "TNULL2"] {
            let mut damaged = sound.clone();
            damaged[card..card + 80].copy_from_slice(format!("{name}  = {:<70}", "'0.01'").as_bytes());
            std::fs::write(&path, damaged).unwrap();
            assert!(
                fault(&path).contains(&format!("keyword {name} is '0.01', but must be a finite number")),
                "{}",
                fault(&path)
            );
        }
    }

    #[test]
    fn every_kind_of_number_is_read() {
        let column = |name: &str, format, tzero| BinColumn {
            name: name.into(),
            format,
            tscal: 1.0,
            tzero,
            tunit: None,
        };
        let columns = vec![
            column("e", BinColumnType::E32(1), 0.0),
            column("j", BinColumnType::J32(1), 0.0),
            column("u", BinColumnType::K64(1), 9_223_372_036_854_775_808.0),
            column("l", BinColumnType::Logical(1), 0.0),
            column("i", BinColumnType::I16(1), 0.5),
        ];
        let mut row = Vec::new();
        row.extend(1.5_f32.to_be_bytes());
        row.extend((-7_i32).to_be_bytes());
        row.extend(i64::MAX.to_be_bytes());
        row.push(b'T');
        row.extend(3_i16.to_be_bytes());
        let table = BinTable { columns, nrows: 1, row_len: row.len(), main_data: row, heap: vec![] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.fits");
        let mut unit = Hdu::bintable_extension(table);
        unit.header.set("TNULL2", HeaderValue::Integer(-7), None);
        let with_null = folder.path().join("null.fits");
        fits::write(&with_null, vec![Hdu::primary_empty(), unit.clone()]).unwrap();
        let null = read(&with_null, "haloes").unwrap().required_f64("j").unwrap_err().to_string();
        assert!(null.contains("column j: NaN is not allowed"), "{null}");
        unit.header.set("TNULL2", HeaderValue::Integer(7), None);
        fits::write(&path, vec![Hdu::primary_empty(), unit]).unwrap();
        let table = read(&path, "haloes").unwrap();
        let values: Vec<Values> = table.columns().iter().map(|column| column.values.clone()).collect();
        let number = |value| Values::F64(vec![value]);
        let long = Values::Text(vec!["18446744073709551615".into()]);
        assert_eq!(values, [number(1.5), number(-7.0), long, Values::Text(vec!["true".into()]), number(3.5)]);
    }

    #[test]
    fn unusable_tables_say_why() {
        let (_folder, path) = written(&sample());
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 2860]).unwrap();
        assert!(fault(&path).starts_with("FILE: HDU 1: the file is truncated"));
        fits::write(&path, vec![Hdu::primary_empty()]).unwrap();
        assert_eq!(fault(&path), "FILE: holds no binary table");
        let (_folder, path) = written(&Table::new(vec![Column::f64("z", None, vec![])]).unwrap());
        assert_eq!(fault(&path), "FILE: table: has no rows");
    }

    #[test]
    fn vector_columns_are_refused_by_name() {
        let format = BinColumnType::D64(3);
        let columns = vec![BinColumn { name: "xyz".into(), format, tscal: 1.0, tzero: 0.0, tunit: None }];
        let table = BinTable { columns, nrows: 1, row_len: 24, main_data: vec![0; 24], heap: vec![] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.fits");
        fits::write(&path, vec![Hdu::primary_empty(), Hdu::bintable_extension(table)]).unwrap();
        let expected = "FILE: column xyz: has the format 3D; only one number or one text a row is supported";
        assert_eq!(fault(&path), expected);
    }

    #[test]
    fn text_and_names_that_fits_cannot_hold_are_refused() {
        let long = "n".repeat(69);
        for (column, problem) in [
            (
                Column::text("label", vec!["γ".into()]),
                "column label: FITS cannot hold \"γ\", only plain ASCII; write .h5 or .csv".to_string(),
            ),
            (
                Column::f64("γ", None, vec![1.0]),
                "column γ: FITS cannot hold \"γ\", only plain ASCII; write .h5 or .csv".to_string(),
            ),
            (
                Column::f64(&long, None, vec![1.0]),
                format!("column {long}: FITS cannot hold names over 68 characters; write .h5 or .csv"),
            ),
        ] {
            let table = Table::new(vec![column]).unwrap();
            let error = write(&table, Path::new("t.fits"), "haloes", &Provenance::new(None, "")).unwrap_err();
            assert_eq!(error.to_string(), format!("t.fits: {problem}"));
        }
    }
}
