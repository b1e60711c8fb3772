//! A table in columns, whatever the format of its file.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::column::{Column, Values, is_exact, no_number};
use super::unit;
use crate::error::{Error, Result};

/// Columns of equal length and different names, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
    /// The file it was read from; empty for other origins.
    path: PathBuf,
    /// Line of each row in the CSV file it was read from; empty for other origins.
    line_of_row: Vec<u64>,
    /// Where each row stood before rows were left out; empty where none was.
    kept_rows: Vec<usize>,
    /// Columns in which a value may be no number.
    with_gaps: Vec<String>,
    /// Columns of the file that hold more than one number or text a row, and what they hold.
    left_out: Vec<(String, String)>,
}

impl Table {
    /// A table from its columns.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when two columns share a name or differ in length.
    pub fn new(columns: Vec<Column>) -> Result<Self> {
        let mut names = HashSet::new();
        for column in &columns {
            if !names.insert(column.name.as_str()) {
                return Err(Error::out_of_range("a second column's name", &column.name, "different"));
            }
            let (length, first) = (column.values.len(), columns[0].values.len());
            if length != first {
                let what = format!("the length of column {}", column.name);
                return Err(Error::out_of_range(
                    &what,
                    length,
                    &format!("{first}, as that of {}", columns[0].name),
                ));
            }
        }
        Ok(Self {
            columns,
            path: PathBuf::new(),
            line_of_row: Vec::new(),
            kept_rows: Vec::new(),
            with_gaps: Vec::new(),
            left_out: Vec::new(),
        })
    }

    /// A table just read from `path`, which must be rectangular, with different names and rows.
    pub(super) fn from_file(path: &Path, columns: Vec<Column>, line_of_row: Vec<u64>) -> Result<Self> {
        let table = Self::new(columns).map_err(|error| Error::table(path, "table", error.to_string()))?;
        if table.row_count() == 0 {
            return Err(Error::table(path, "table", "has no rows"));
        }
        Ok(Self { path: path.into(), line_of_row, ..table })
    }

    /// As [`Self::from_file`], without the columns of which `left_out` says what they hold: they are missed only when they
    /// are asked for.
    pub(super) fn from_file_without(
        path: &Path,
        columns: Vec<Column>,
        left_out: Vec<(String, String)>,
    ) -> Result<Self> {
        match left_out.first() {
            Some((name, problem)) if columns.is_empty() => {
                return Err(Error::table(path, format!("column {name}"), problem));
            }
            Some(_) => {
                let list: Vec<String> =
                    left_out.iter().map(|(name, problem)| format!("{name} ({problem})")).collect();
                log::info!("{}: columns left out: {}", path.display(), list.join("; "));
            }
            None => {}
        }
        Ok(Self { left_out, ..Self::from_file(path, columns, Vec::new())? })
    }

    /// The table with one more column.
    ///
    /// # Errors
    /// As [`Table::new`].
    pub fn with(self, column: Column) -> Result<Self> {
        let table = Self::new(self.columns.into_iter().chain([column]).collect())?;
        Ok(Self { columns: table.columns, ..self })
    }

    /// The rows at which `keep` holds; faults go on naming their place in the file.
    pub fn filtered(mut self, keep: impl Fn(usize) -> bool) -> Self {
        let rows: Vec<usize> = (0..self.row_count()).filter(|row| keep(*row)).collect();
        for column in &mut self.columns {
            column.values = match &column.values {
                Values::F64(values) => Values::F64(rows.iter().map(|&row| values[row]).collect()),
                Values::Text(values) => Values::Text(rows.iter().map(|&row| values[row].clone()).collect()),
            };
        }
        let before = std::mem::take(&mut self.kept_rows);
        let place = |row: usize| before.get(row).copied().unwrap_or(row);
        Self { kept_rows: rows.into_iter().map(place).collect(), ..self }
    }

    /// The table with columns in which a value may be no number: a user's own, or what is not always known.
    pub fn with_gaps_in<'a>(mut self, names: impl Iterator<Item = &'a str>) -> Self {
        self.with_gaps.extend(names.map(String::from));
        self
    }

    /// Refuses to let a number leave that is none.
    ///
    /// # Errors
    /// [`Error::Table`] with row and column.
    pub(super) fn check_finite(&self, path: &Path) -> Result<()> {
        for column in self.columns.iter().filter(|column| !self.with_gaps.contains(&column.name)) {
            let Values::F64(values) = &column.values else { continue };
            refuse_non_finite(path, &column.name, values)?;
        }
        Ok(())
    }

    /// The columns in the order of the file.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The table with these columns in haloray's own units, which their names end in: arcsec, solar masses, or none.
    ///
    /// A column that states no unit is taken to have its own. What was converted is logged in one line.
    ///
    /// # Errors
    /// [`Error::Table`] for a unit that is not known or measures something else: column, unit and what is allowed.
    pub fn in_own_units(mut self, names: &[&str]) -> Result<Self> {
        let mut converted = Vec::new();
        for i in 0..self.columns.len() {
            let column = &self.columns[i];
            let Some(stated) = column.unit.clone() else { continue };
            if !names.iter().any(|name| name.eq_ignore_ascii_case(&column.name)) {
                continue;
            }
            let place = format!("column {}", column.name);
            let factor =
                unit::factor(&column.name, &stated).map_err(|problem| self.fault(&place, problem))?;
            let own = unit::own_unit(&column.name);
            let column = &mut self.columns[i];
            column.unit = Some(own.into()).filter(|own: &String| !own.is_empty());
            if let (Values::F64(values), true) = (&mut column.values, factor != 1.0) {
                values.iter_mut().for_each(|value| *value *= factor);
                converted.push(format!("{} from {} to {own}", column.name, stated.trim()));
            }
        }
        if !converted.is_empty() {
            log::info!("{}: converted {}", self.path.display(), converted.join(", "));
        }
        Ok(self)
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of that name; upper and lower case count as equal where no exact match exists.
    pub fn column(&self, name: &str) -> Option<&Column> {
        let exact = self.columns.iter().find(|column| column.name == name);
        exact.or_else(|| self.columns.iter().find(|column| column.name.eq_ignore_ascii_case(name)))
    }

    /// True where the file has a column of that name, be it one that cannot be used.
    pub fn has_column(&self, name: &str) -> bool {
        self.column(name).is_some() || self.problem_of(name).is_some()
    }

    /// Why a column of the file was left out.
    fn problem_of(&self, name: &str) -> Option<&str> {
        let left_out = self.left_out.iter().find(|(other, _)| other.eq_ignore_ascii_case(name));
        left_out.map(|(_, problem)| problem.as_str())
    }

    /// The names of the columns for a message; a few of very many.
    pub fn column_names(&self) -> String {
        /// Names that still can be read in one message.
        const LISTED: usize = 40;
        let names: Vec<&str> = self.columns.iter().take(LISTED).map(|column| column.name.as_str()).collect();
        match self.columns.len().saturating_sub(LISTED) {
            0 => names.join(", "),
            more => format!("{} and {more} more", names.join(", ")),
        }
    }

    /// The numbers of a column that must be there and finite.
    ///
    /// # Errors
    /// [`Error::Table`] with line (CSV) or row and column, and the columns present.
    pub fn required_f64(&self, name: &str) -> Result<&[f64]> {
        self.optional_f64(name)?.ok_or_else(|| {
            let problem = format!("is missing; the columns present are {}", self.column_names());
            self.fault(&format!("column {name}"), problem)
        })
    }

    /// Like [`required_f64`](Self::required_f64) for a column that may be absent.
    pub fn optional_f64(&self, name: &str) -> Result<Option<&[f64]>> {
        let Some(column) = self.column(name) else {
            return match self.problem_of(name) {
                Some(problem) => Err(self.fault(&format!("column {name}"), problem)),
                None => Ok(None),
            };
        };
        let is_alike = |other: &&Column| other.name.eq_ignore_ascii_case(name);
        if column.name != name && self.columns.iter().filter(is_alike).count() > 1 {
            let problem =
                format!("stands there more than once; the columns present are {}", self.column_names());
            return Err(self.fault(&format!("column {name}"), problem));
        }
        // astropy keeps values that are not known as numbers with a column of flags.
        let mask = self.column(&format!("{name}.mask")).map(|mask| &mask.values);
        let masked = mask.and_then(|mask| match mask {
            Values::F64(flags) => flags.iter().position(|&flag| flag != 0.0),
            Values::Text(flags) => flags.iter().position(|flag| flag == "true"),
        });
        if let Some(row) = masked {
            return Err(self.fault_in_row(row, name, "is masked; a number is wanted"));
        }
        let fault = match &column.values {
            Values::F64(values) => match values.iter().position(|value| !value.is_finite()) {
                None => return Ok(Some(values)),
                Some(row) => (row, format!("{} is not allowed; finite numbers only", values[row])),
            },
            Values::Text(values) if values.is_empty() => return Ok(Some(&[])),
            Values::Text(values) => match values.iter().position(|text| text.parse::<f64>().is_err()) {
                Some(row) if values[row].is_empty() => (row, "is empty; a number is wanted".into()),
                Some(row) => (row, no_number(&values[row])),
                None => match values.iter().position(|text| text.parse().is_ok_and(|i: i128| !is_exact(i))) {
                    Some(row) => (
                        row,
                        format!("{} has more digits than a number keeps; write it as 1.234e20", values[row]),
                    ),
                    None => (
                        0,
                        format!("{:?} is a number written as text; store the column as numbers", values[0]),
                    ),
                },
            },
        };
        Err(self.fault_in_row(fault.0, name, fault.1))
    }

    /// What is wrong with some place of this table.
    pub fn fault(&self, place: &str, problem: impl Into<String>) -> Error {
        Error::table(&self.path, place, problem)
    }

    /// What is wrong with a value of this table.
    pub fn fault_in_row(&self, row: usize, column: &str, problem: impl Into<String>) -> Error {
        self.fault(&format!("{}, column {column}", self.place_of(row)), problem)
    }

    /// `line 17` for a CSV file, `row 16` (counted from 1) otherwise.
    pub fn place_of(&self, row: usize) -> String {
        let row = self.kept_rows.get(row).copied().unwrap_or(row);
        match self.line_of_row.get(row) {
            Some(line) => format!("line {line}"),
            None => format!("row {}", row + 1),
        }
    }
}

/// Refuses to let a number leave that is none.
///
/// # Errors
/// [`Error::Table`] with row and column.
pub(crate) fn refuse_non_finite(path: &Path, column: &str, values: &[f64]) -> Result<()> {
    let Some(row) = values.iter().position(|value| !value.is_finite()) else { return Ok(()) };
    let problem = format!("the result is {}, no finite number; nothing is written", values[row]);
    Err(Error::table(path, format!("row {}, column {column}", row + 1), problem))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Table {
        let text = ["abc", "", "1e9"].map(String::from).to_vec();
        Table::new(vec![
            Column::f64("z", None, vec![0.5, f64::NAN, 1.0]),
            Column::f64("theta_x_arcsec", Some("arcsec"), vec![1.0, 2.0, 3.0]),
            Column::text("note", text),
        ])
        .unwrap()
    }

    fn message(name: &str) -> String {
        let error = Table { path: "haloes.h5".into(), ..sample() }.required_f64(name).map(drop).unwrap_err();
        assert!(error.is_bad_input());
        error.to_string()
    }

    #[test]
    fn faults_name_file_row_column_and_cure() {
        assert_eq!(message("z"), "haloes.h5: row 2, column z: NaN is not allowed; finite numbers only");
        assert_eq!(message("note"), "haloes.h5: row 1, column note: \"abc\" is not a number");
        assert_eq!(
            message("r_s_arcsec"),
            "haloes.h5: column r_s_arcsec: is missing; the columns present are z, theta_x_arcsec, note"
        );
    }

    #[test]
    fn a_good_column_is_returned_whatever_its_case() {
        let table = sample();
        assert_eq!(table.required_f64("THETA_X_ARCSEC").unwrap(), [1.0, 2.0, 3.0]);
        assert_eq!(table.optional_f64("m200c_msun").unwrap(), None);
    }

    #[test]
    fn of_two_columns_that_differ_in_case_none_is_taken_for_a_third_spelling() {
        let column = |name: &str| Column::f64(name, None, vec![1.0]);
        let table = Table::new(vec![column("Mass"), column("MASS"), column("Z")]).unwrap();
        assert!(table.optional_f64("Mass").unwrap().is_some() && table.optional_f64("z").unwrap().is_some());
        let error = table.optional_f64("mass").unwrap_err().to_string();
        assert!(
            error.contains("column mass: stands there more than once; the columns present are Mass"),
            "{error}"
        );
    }

    #[test]
    fn columns_must_differ_in_name_and_agree_in_length() {
        let z = || Column::f64("z", None, vec![0.5]);
        let twice = Table::new(vec![z(), z()]).unwrap_err().to_string();
        assert!(twice.contains("z, but must be different"), "{twice}");
        let ragged = Table::new(vec![z(), Column::f64("x", None, vec![])]).unwrap_err().to_string();
        assert!(ragged.contains("length of column x is 0, but must be 1"), "{ragged}");
    }

    #[test]
    fn numbers_written_as_text_are_named_as_such() {
        let fault = |texts: &[&str]| {
            let column = Column::text("z", texts.iter().map(|text| text.to_string()).collect());
            Table::new(vec![column]).unwrap().required_f64("z").map(drop).unwrap_err().to_string()
        };
        assert!(fault(&["0.5", "1"]).contains("row 1, column z: \"0.5\" is a number written as text"));
        assert!(fault(&["0,5"]).contains("\"0,5\" is not a number; write a decimal point"));
        assert!(fault(&["1", "1.5D+11"]).contains("\"1.5D+11\" is not a number; write the exponent"));
        assert!(
            fault(&["1", "123456789012345678901"])
                .contains("row 2, column z: 123456789012345678901 has more")
        );
    }

    #[test]
    fn a_masked_value_is_no_number() {
        let mask = |row: f64| Column::f64("z.mask", None, vec![0.0, row]);
        let table = |row| Table::new(vec![Column::f64("z", None, vec![0.5, 1e20]), mask(row)]).unwrap();
        assert!(table(0.0).required_f64("z").is_ok());
        let error = table(1.0).required_f64("z").unwrap_err().to_string();
        assert!(error.contains("row 2, column z: is masked"), "{error}");
    }

    #[test]
    fn only_the_columns_that_mean_something_are_converted() {
        let columns = || {
            vec![
                Column::f64("theta_x_arcsec", Some("deg"), vec![1.0, -0.5]),
                Column::f64("mine_arcsec", Some("furlong"), vec![1.0, 2.0]),
                Column::f64("z", None, vec![0.5, 0.6]),
            ]
        };
        let table = Table::new(columns()).unwrap().in_own_units(&["THETA_X_ARCSEC", "z"]).unwrap();
        assert_eq!(table.columns()[0], Column::f64("theta_x_arcsec", Some("arcsec"), vec![3600.0, -1800.0]));
        assert_eq!(table.columns()[1..], columns()[1..]);
        let error = Table::new(columns()).unwrap().in_own_units(&["mine_arcsec"]).unwrap_err().to_string();
        assert!(
            error.contains("column mine_arcsec: has the unit 'furlong', but must be arcsec, arcmin"),
            "{error}"
        );
    }

    #[test]
    fn a_result_that_is_no_number_is_not_written_but_a_gap_of_the_users_is() {
        let folder = tempfile::tempdir().unwrap();
        let provenance = crate::io::Provenance::new(None, "");
        for name in ["t.csv", "t.h5", "t.fits"] {
            let path = folder.path().join(name);
            let error = sample().write(&path, "rays", &provenance).unwrap_err().to_string();
            assert!(error.contains("row 2, column z: the result is NaN") && !path.exists(), "{error}");
            sample().with_gaps_in(["z"].into_iter()).write(&path, "rays", &provenance).unwrap();
            assert!(path.exists());
        }
    }
}
