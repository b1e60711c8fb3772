//! Loads reference tables from `data/reference`, refusing any whose origin is not stated.

use std::path::Path;

/// What every reference table must state before its first row.
pub const REQUIRED_HEADERS: [&str; 5] = ["oracle", "version", "command", "date", "units"];

/// A reference table: named columns of equal length.
#[derive(Debug)]
pub struct Reference {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Reference {
    /// Reads `data/reference/{name}.csv`.
    pub fn load(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/reference").join(format!("{name}.csv"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self::parse(&text).unwrap_or_else(|problem| panic!("{}: {problem}", path.display()))
    }

    /// Parses a table that begins with one `# key: value` line for each required header.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (comments, rows): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with('#'));
        for key in REQUIRED_HEADERS {
            let prefix = format!("# {key}:");
            let stated =
                comments.iter().filter_map(|line| line.strip_prefix(&prefix)).any(|v| !v.trim().is_empty());
            if !stated {
                return Err(format!("the header line \"{prefix} ...\" is missing or empty"));
            }
        }
        let (head, body) = rows.split_first().ok_or("no column names")?;
        let names: Vec<String> = head.split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for row in body {
            let cells: Vec<&str> = row.split(',').collect();
            if cells.len() != names.len() {
                return Err(format!("row \"{row}\" has {} cells, not {}", cells.len(), names.len()));
            }
            for (column, cell) in columns.iter_mut().zip(cells) {
                column.push(cell.parse().map_err(|_| format!("\"{cell}\" is not a number"))?);
            }
        }
        if body.is_empty() { Err("no rows".into()) } else { Ok(Self { names, columns }) }
    }

    /// The column of that name.
    pub fn column(&self, name: &str) -> &[f64] {
        let index = self.names.iter().position(|other| other == name);
        &self.columns[index.unwrap_or_else(|| panic!("no column {name}; there are {:?}", self.names))]
    }
}

/// Median, 99th percentile and maximum of the relative differences |a/b − 1|.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    pub q50: f64,
    pub q99: f64,
    pub max: f64,
}

impl Agreement {
    /// Compares `values` with `expected` and prints the result under `label`.
    pub fn of(label: &str, values: &[f64], expected: &[f64]) -> Self {
        assert_eq!(values.len(), expected.len(), "{label}: lengths differ");
        let mut differences: Vec<f64> = values
            .iter()
            .zip(expected)
            .map(|(value, exact)| if value == exact { 0.0 } else { (value / exact - 1.0).abs() })
            .collect();
        assert!(differences.iter().all(|d| d.is_finite()), "{label}: not a number");
        differences.sort_by(f64::total_cmp);
        let quantile = |q: f64| differences[((differences.len() - 1) as f64 * q).round() as usize];
        let agreement = Self { q50: quantile(0.5), q99: quantile(0.99), max: quantile(1.0) };
        println!(
            "{label}: {} points, q50 {:.1e}, q99 {:.1e}, max {:.1e}",
            differences.len(),
            agreement.q50,
            agreement.q99,
            agreement.max
        );
        agreement
    }

    /// Fails unless the largest difference is at most `tolerance`.
    pub fn require_max(self, tolerance: f64) -> Self {
        assert!(self.max <= tolerance, "{self:?} exceeds {tolerance:e}");
        self
    }
}
