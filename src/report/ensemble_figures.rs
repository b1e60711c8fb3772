//! The figures of an ensemble, drawn from its saved table.

use crate::ensemble::{ExpectedShear, Smoothing};
use crate::error::Result;
use crate::io::SightlineTable;
use crate::plot::Figure;
use crate::plot::figures::{
    CornerParameter, CornerPosterior, Distributions, corner, cumulative, distributions, settling, smoothing,
};

/// The modulus of a quantity of two components; empty where the table has none.
fn modulus(table: &SightlineTable, quantity: &str, rest: &str) -> Vec<f64> {
    let parts = ["1", "2"].map(|component| table.column(&format!("{quantity}{component}_{rest}")));
    let [Some(x), Some(y)] = parts else { return Vec::new() };
    x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect()
}

fn values(table: &SightlineTable, name: &str) -> Vec<f64> {
    table.column(name).map(<[f64]>::to_vec).unwrap_or_default()
}

/// Distributions of γ_LOS, κ, Δ_tot, F and G.
pub fn distribution_figure(table: &SightlineTable) -> Figure {
    let own = |name: &str| values(table, name);
    let kinds = [
        Distributions {
            label: "γ^{LOS}",
            is_log: false,
            sets: vec![
                ("γ_{1}, axis", own("gamma1_los")),
                ("γ_{2}, axis", own("gamma2_los")),
                ("γ_{1}, ring", own("gamma1_los_ring")),
                ("γ_{2}, ring", own("gamma2_los_ring")),
            ],
        },
        Distributions {
            label: "κ",
            is_log: false,
            sets: vec![
                ("κ_{LOS}, axis", own("kappa_los")),
                ("κ_{LOS}, ring", own("kappa_los_ring")),
                ("κ_{os}, axis", own("kappa_os")),
            ],
        },
        Distributions {
            label: "Δ_{tot}",
            is_log: true,
            sets: vec![
                ("two points", own("delta_tot")),
                ("ring", own("delta_tot_ring")),
                ("disc", own("delta_tot_disc")),
            ],
        },
        Distributions {
            label: "|F_{os}|, |G_{os}| [arcsec^{−1}]",
            is_log: true,
            sets: vec![
                ("F, axis", modulus(table, "F", "os_per_arcsec")),
                ("G, axis", modulus(table, "G", "os_per_arcsec")),
                ("F, disc", modulus(table, "F", "os_disc_per_arcsec")),
                ("G, disc", modulus(table, "G", "os_disc_per_arcsec")),
            ],
        },
    ];
    distributions(&kinds)
}

/// The joint distribution of γ_LOS, κ_LOS along the ring, Δ_tot, F and G.
pub fn joint_figure(table: &SightlineTable) -> Figure {
    let log = |values: Vec<f64>| -> Vec<f64> { values.into_iter().map(f64::log10).collect() };
    let columns = [
        ("γ_{1}^{LOS}, ring", values(table, "gamma1_los_ring")),
        ("γ_{2}^{LOS}, ring", values(table, "gamma2_los_ring")),
        ("κ_{LOS}, ring", values(table, "kappa_los_ring")),
        ("log_{10} Δ_{tot}", log(values(table, "delta_tot"))),
        ("log_{10} |F|, disc", log(modulus(table, "F", "os_disc_per_arcsec"))),
        ("log_{10} |G|, disc", log(modulus(table, "G", "os_disc_per_arcsec"))),
    ];
    let is_whole = |row: &usize| columns.iter().all(|(_, v)| v.get(*row).is_some_and(|v| v.is_finite()));
    let whole: Vec<usize> = (0..table.numbers.len()).filter(is_whole).collect();
    let draws: Vec<Vec<f64>> =
        columns.iter().map(|(_, values)| whole.iter().map(|&row| values[row]).collect()).collect();
    let parameters: Vec<CornerParameter> =
        columns.iter().map(|(label, _)| CornerParameter { label, unit: "", values: Vec::new() }).collect();
    let all = CornerPosterior { legend: "", draws: draws.iter().map(Vec::as_slice).collect() };
    corner(&parameters, &[all], &[])
}

/// How √⟨|γ_LOS|²⟩ settles with the number of sightlines.
pub fn settling_figure(table: &SightlineTable) -> Result<Figure> {
    let curve = |rest: &str| running_rms(&modulus(table, "gamma", rest));
    Ok(settling("√⟨|γ_{LOS}|^{2}⟩", &[("axis", curve("los")), ("ring", curve("los_ring"))]))
}

/// Distributions of |γ_LOS| of the first lenses, one panel each; `rows` are those of [`expected_shears`].
///
/// [`expected_shears`]: crate::ensemble::expected_shears
pub fn expected_figure(rows: &[ExpectedShear]) -> Figure {
    let lenses = by_lens(rows);
    let labels: Vec<String> = lenses.iter().map(|(name, _)| format!("|γ^{{LOS}}|{name}")).collect();
    let names: Vec<Vec<String>> =
        lenses.iter().map(|(_, rows)| rows.iter().map(|row| row.smoothing.name()).collect()).collect();
    let panel = |i: usize| Distributions {
        label: &labels[i],
        is_log: false,
        sets: names[i]
            .iter()
            .zip(lenses[i].1)
            .map(|(name, row)| (name.as_str(), row.sizes.clone()))
            .collect(),
    };
    cumulative(&(0..lenses.len().min(DRAWN_LENSES)).map(panel).collect::<Vec<_>>())
}

/// How the spread of γ_LOS of the first lenses falls with the radius over which it is averaged, from the Einstein ring on.
pub fn smoothing_figure(rows: &[ExpectedShear]) -> Figure {
    let lenses = by_lens(rows);
    let curve = |rows: &[ExpectedShear]| {
        let beside_axis = rows.iter().filter(|row| row.radius_arcsec > 0.0);
        beside_axis.map(|row| [row.radius_arcsec, row.sigma[0], row.sigma[1]]).collect()
    };
    let drawn = lenses.iter().take(DRAWN_LENSES);
    let name =
        |rows: &'_ [ExpectedShear]| rows[0].lens.as_ref().map_or(String::new(), |lens| lens.name.clone());
    let curves: Vec<(String, Vec<[f64; 3]>)> = drawn.map(|(_, rows)| (name(rows), curve(rows))).collect();
    smoothing(&curves.iter().map(|(name, curve)| (name.as_str(), curve.clone())).collect::<Vec<_>>())
}

/// Lenses that are drawn; all are in the table.
const DRAWN_LENSES: usize = 6;

/// The rows of each lens, with its name and redshifts in words.
fn by_lens(rows: &[ExpectedShear]) -> Vec<(String, &[ExpectedShear])> {
    let lens = |rows: &ExpectedShear| match &rows.lens {
        Some(lens) => format!(", {} ({}, {})", lens.name, lens.z_lens, lens.z_source),
        None => String::new(),
    };
    let each = rows.chunk_by(|_, next| next.smoothing != Smoothing::Axis);
    each.map(|rows| (rows.first().map_or(String::new(), lens), rows)).collect()
}

/// (N, rms of the first N, its standard error) at about forty N a decade, from ten on.
fn running_rms(values: &[f64]) -> Vec<[f64; 3]> {
    const PER_DECADE: f64 = 40.0;
    const FIRST: f64 = 10.0;
    let (mut n, mut sum, mut square, mut next) = (0.0, 0.0, 0.0, FIRST);
    let mut steps = Vec::new();
    for value in values.iter().filter(|value| value.is_finite()) {
        let power = value * value;
        (n, sum, square) = (n + 1.0, sum + power, square + power * power);
        if n >= next {
            let (mean, variance) = (sum / n, (square / n - (sum / n).powi(2)).max(0.0));
            let rms = mean.sqrt();
            steps.push([n, rms, (variance / n).sqrt() / (2.0 * rms)]);
            next = (next * 10f64.powf(1.0 / PER_DECADE)).max(n + 1.0);
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_running_rms_is_that_of_the_first_values() {
        let values: Vec<f64> = (0..1000).map(|i| f64::from(i % 7)).collect();
        let steps = running_rms(&values);
        for [n, rms, error] in &steps {
            let first = &values[..*n as usize];
            let wanted = (first.iter().map(|v| v * v).sum::<f64>() / n).sqrt();
            assert!((rms - wanted).abs() < 1e-12 && *error > 0.0);
        }
        assert!(steps[0][0] == 10.0 && steps.len() > 60);
    }
}
