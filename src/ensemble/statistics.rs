//! Means, spreads, quantiles and covariances of the columns of an ensemble.

use serde::Serialize;

use crate::io::{SightlineColumn, SightlineTable};

/// One column over all sightlines that have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Sightlines that have it.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the sightlines, not of the mean.
    pub standard_deviation: f64,
    /// Values below which 2.5, 16, 50, 84 and 97.5 per cent of the sightlines lie.
    pub quantiles: [f64; 5],
    /// Smallest and largest.
    pub range: [f64; 2],
}

/// The quantities whose covariance is wanted.
const COVARIED: [&str; 10] = [
    "kappa_los",
    "gamma1_los",
    "gamma2_los",
    "kappa_os",
    "gamma1_os",
    "gamma2_os",
    "F1_os_per_arcsec",
    "F2_os_per_arcsec",
    "G1_os_per_arcsec",
    "G2_os_per_arcsec",
];

/// What an ensemble amounts to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EnsembleStatistics {
    /// Sightlines of the ensemble.
    pub number_of_sightlines: usize,
    /// Of these, the ones that could not be computed.
    pub number_failed: usize,
    /// Reasons of the first few that failed, by number.
    pub failures: Vec<(u64, String)>,
    /// √⟨|γ_LOS|²⟩ on the axis and along the beam of the ring, each with its standard error.
    pub rms_gamma_los: [f64; 2],
    /// The same along the beam of the Einstein ring.
    pub rms_gamma_los_ring: [f64; 2],
    /// Order of the rows and columns of `covariance`.
    pub covaried: Vec<String>,
    /// Covariance of the sightlines.
    pub covariance: Vec<Vec<f64>>,
    /// Every column by name.
    pub columns: serde_json::Map<String, serde_json::Value>,
}

impl EnsembleStatistics {
    /// Sums up a table.
    pub fn of(table: &SightlineTable) -> Self {
        /// Reasons told in the summary; all are in the table.
        const TOLD: usize = 20;
        let covaried: Vec<&SightlineColumn> = COVARIED
            .iter()
            .filter_map(|name| table.all_haloes.iter().find(|column| column.name == *name))
            .collect();
        let columns = table.all_haloes.iter().filter(|column| column.name != "failed").map(|column| {
            let value = serde_json::to_value(ColumnStatistics::of(column)).unwrap_or_default();
            (column.name.clone(), value)
        });
        Self {
            number_of_sightlines: table.numbers.len(),
            number_failed: table.failures.len(),
            failures: table.failures.iter().take(TOLD).cloned().collect(),
            rms_gamma_los: rms(table, ["gamma1_los", "gamma2_los"]),
            rms_gamma_los_ring: rms(table, ["gamma1_los_ring", "gamma2_los_ring"]),
            covariance: covariance(&covaried),
            covaried: covaried.iter().map(|column| column.name.clone()).collect(),
            columns: columns.collect(),
        }
    }
}

impl ColumnStatistics {
    /// Of one column.
    pub fn of(column: &SightlineColumn) -> Self {
        let mut sorted: Vec<f64> = column.values.iter().copied().filter(|v| v.is_finite()).collect();
        let (mean, standard_deviation) = mean_and_deviation(&sorted);
        sorted.sort_by(f64::total_cmp);
        Self {
            unit: column.unit.clone(),
            count: sorted.len(),
            mean,
            standard_deviation,
            quantiles: [0.025, 0.16, 0.5, 0.84, 0.975].map(|part| quantile(&sorted, part)),
            range: [0.0, 1.0].map(|part| quantile(&sorted, part)),
        }
    }
}

pub(super) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, square.sqrt())
}

/// The value below which a part of ascending values lies, between two by interpolation; not a number of none.
pub fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = part * last as f64;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    sorted[low] + (place - place.floor()) * (sorted[high.min(last)] - sorted[low])
}

/// √⟨|γ|²⟩ and its standard error.
fn rms(table: &SightlineTable, names: [&str; 2]) -> [f64; 2] {
    let [Some(x), Some(y)] = names.map(|name| table.column(name)) else { return [f64::NAN; 2] };
    let squares: Vec<f64> =
        x.iter().zip(y).map(|(x, y)| x * x + y * y).filter(|square| square.is_finite()).collect();
    let (mean, deviation) = mean_and_deviation(&squares);
    let rms = mean.sqrt();
    [rms, deviation / (squares.len() as f64).sqrt() / (2.0 * rms)]
}

/// Covariance over the rows in which all columns have a value.
fn covariance(columns: &[&SightlineColumn]) -> Vec<Vec<f64>> {
    let rows = columns.first().map_or(0, |column| column.values.len());
    let whole: Vec<usize> =
        (0..rows).filter(|&row| columns.iter().all(|column| column.values[row].is_finite())).collect();
    let n = whole.len() as f64;
    let mean = |column: &SightlineColumn| whole.iter().map(|&row| column.values[row]).sum::<f64>() / n;
    let means: Vec<f64> = columns.iter().map(|column| mean(column)).collect();
    let of = |a: usize, b: usize| {
        let product =
            |&row: &usize| (columns[a].values[row] - means[a]) * (columns[b].values[row] - means[b]);
        whole.iter().map(product).sum::<f64>() / (n - 1.0)
    };
    (0..columns.len()).map(|a| (0..columns.len()).map(|b| of(a, b)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Provenance;

    fn column(name: &str, values: &[f64]) -> SightlineColumn {
        let (unit, description) = (String::new(), String::new());
        SightlineColumn { name: name.into(), unit, description, values: values.into() }
    }

    #[test]
    fn gaps_are_left_out_and_known_numbers_found() {
        let statistics = ColumnStatistics::of(&column("a", &[4.0, f64::NAN, 1.0, 3.0, 2.0, 5.0]));
        assert_eq!((statistics.count, statistics.mean, statistics.range), (5, 3.0, [1.0, 5.0]));
        assert!((statistics.standard_deviation - 2.5_f64.sqrt()).abs() < 1e-15);
        assert!((statistics.quantiles[1] - 1.64).abs() < 1e-15 && statistics.quantiles[2] == 3.0);
        assert!(quantile(&[], 0.5).is_nan() && quantile(&[7.0], 0.3) == 7.0);
    }

    #[test]
    fn a_table_is_summed_up() {
        let table = SightlineTable {
            provenance: Provenance::new(None, ""),
            level: "scalars".into(),
            model: String::new(),
            inputs: String::new(),
            whole: 0..3,
            lenses: Vec::new(),
            numbers: vec![0, 1, 2],
            all_haloes: vec![
                column("failed", &[0.0, 1.0, 0.0]),
                column("gamma1_los", &[3.0, f64::NAN, -3.0]),
                column("gamma2_los", &[4.0, f64::NAN, 4.0]),
            ],
            tidal_haloes: Vec::new(),
            failures: vec![(1, "why".into())],
        };
        let statistics = EnsembleStatistics::of(&table);
        assert_eq!((statistics.number_of_sightlines, statistics.number_failed), (3, 1));
        assert_eq!(statistics.rms_gamma_los, [5.0, 0.0]);
        assert_eq!(statistics.covaried, ["gamma1_los", "gamma2_los"]);
        assert_eq!(statistics.covariance, [[18.0, 0.0], [0.0, 0.0]]);
        assert!(!statistics.columns.contains_key("failed"));
    }
}
