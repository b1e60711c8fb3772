//! The shear of the line of sight that is to be expected for each lens of an ensemble.

use super::columns::{GAMMA1_IN_DISC, disc_radii};
use super::statistics::{mean_and_deviation, quantile};
use crate::io::{SightlineTable, TabledLens};

/// What is averaged over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smoothing {
    /// Nothing: the axis ray.
    Axis,
    /// The beam of the Einstein ring.
    Ring,
    /// A disc of that radius in arcsec, to first order.
    Disc(f64),
}

impl Smoothing {
    /// The name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Axis => "axis".into(),
            Self::Ring => "ring".into(),
            Self::Disc(radius) => format!("disc {radius}″"),
        }
    }

    /// What the columns of an ensemble end in, after `gamma1_` and `gamma2_`.
    fn column(self) -> String {
        match self {
            Self::Axis => "los".into(),
            Self::Ring => "los_ring".into(),
            Self::Disc(radius) => format!("{GAMMA1_IN_DISC}{radius}").replace("gamma1_", ""),
        }
    }
}

/// How γ_LOS is distributed over the sightlines of one lens.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedShear {
    /// The lens; none where an ensemble has no table of lenses.
    pub lens: Option<TabledLens>,
    /// What is averaged over.
    pub smoothing: Smoothing,
    /// Radius of the disc or the Einstein ring, arcsec; 0 on the axis.
    pub radius_arcsec: f64,
    /// |γ_LOS| of every sightline that has it.
    pub sizes: Vec<f64>,
    /// σ of one component, √(⟨|γ_LOS|²⟩/2), and its standard error.
    pub sigma: [f64; 2],
    /// |γ_LOS| below which 16, 50, 84 and 97.5 per cent of the sightlines lie.
    pub quantiles: [f64; 4],
}

impl ExpectedShear {
    fn of(lens: Option<&TabledLens>, theta_e_arcsec: f64, smoothing: Smoothing, mut sizes: Vec<f64>) -> Self {
        let radius_arcsec = match smoothing {
            Smoothing::Axis => 0.0,
            Smoothing::Ring => lens.and_then(|lens| lens.einstein_radius_arcsec).unwrap_or(theta_e_arcsec),
            Smoothing::Disc(radius) => radius,
        };
        sizes.retain(|size| size.is_finite());
        sizes.sort_by(f64::total_cmp);
        let squares: Vec<f64> = sizes.iter().map(|size| 0.5 * size * size).collect();
        let (mean, deviation) = mean_and_deviation(&squares);
        let sigma = mean.sqrt();
        Self {
            lens: lens.cloned(),
            smoothing,
            radius_arcsec,
            sigma: [sigma, deviation / (squares.len() as f64).sqrt() / (2.0 * sigma)],
            quantiles: [0.16, 0.5, 0.84, 0.975].map(|part| quantile(&sizes, part)),
            sizes,
        }
    }
}

/// One distribution for every lens and everything that the table averages γ_LOS over, lens by lens; `theta_e_arcsec` is the
/// Einstein radius of lenses whose table has none.
pub fn expected_shears(table: &SightlineTable, theta_e_arcsec: f64) -> Vec<ExpectedShear> {
    let discs = disc_radii(table).into_iter().map(Smoothing::Disc);
    let kinds: Vec<Smoothing> = [Smoothing::Axis, Smoothing::Ring].into_iter().chain(discs).collect();
    let lens_of = table.column("lens");
    let of_lens = |number: usize| -> Vec<ExpectedShear> {
        let is_own = |row: &usize| lens_of.is_none_or(|lens| lens[*row] == number as f64);
        let rows: Vec<usize> = (0..table.numbers.len()).filter(is_own).collect();
        let distribution = |&kind: &Smoothing| {
            let parts = ["gamma1", "gamma2"].map(|name| table.column(&format!("{name}_{}", kind.column())));
            let size = |&row: &usize| match parts {
                [Some(x), Some(y)] => x[row].hypot(y[row]),
                _ => f64::NAN,
            };
            ExpectedShear::of(table.lenses.get(number), theta_e_arcsec, kind, rows.iter().map(size).collect())
        };
        kinds.iter().map(distribution).collect()
    };
    (0..table.lenses.len().max(1)).flat_map(of_lens).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{Provenance, SightlineColumn};

    #[test]
    fn each_lens_has_its_own_sightlines() {
        let column = |name: &str, values: &[f64]| SightlineColumn {
            name: name.into(),
            unit: String::new(),
            description: String::new(),
            values: values.into(),
        };
        let lens =
            |z_lens| TabledLens { name: "a".into(), z_lens, z_source: 2.0, einstein_radius_arcsec: None };
        let table = SightlineTable {
            provenance: Provenance::new(None, ""),
            level: "scalars".into(),
            model: String::new(),
            inputs: String::new(),
            whole: 0..4,
            lenses: vec![lens(0.3), lens(0.6)],
            numbers: vec![0, 1, 2, 3],
            all_haloes: vec![
                column("lens", &[0.0, 1.0, 0.0, f64::NAN]),
                column("gamma1_los", &[3.0, 0.6, -3.0, f64::NAN]),
                column("gamma2_los", &[4.0, 0.8, 4.0, f64::NAN]),
                column("gamma1_los_ring", &[3.0, 0.6, -3.0, f64::NAN]),
                column("gamma2_los_ring", &[4.0, 0.8, 4.0, f64::NAN]),
                column("gamma1_los_disc_7.5", &[0.3, 0.0, 0.5, f64::NAN]),
                column("gamma2_los_disc_7.5", &[0.4, 0.0, 1.2, f64::NAN]),
            ],
            tidal_haloes: Vec::new(),
            failures: vec![(3, "why".into())],
        };
        let rows = expected_shears(&table, 1.5);
        let names: Vec<String> = rows.iter().map(|row| row.smoothing.name()).collect();
        assert_eq!(names, ["axis", "ring", "disc 7.5″", "axis", "ring", "disc 7.5″"]);
        assert_eq!(rows[0].sizes, [5.0, 5.0]);
        assert_eq!(rows[0].sigma, [12.5_f64.sqrt(), 0.0]);
        assert_eq!(rows[2].sizes, [0.5, 1.3]);
        assert_eq!(rows.iter().map(|row| row.radius_arcsec).collect::<Vec<_>>()[..3], [0.0, 1.5, 7.5]);
        assert_eq!((rows[3].sizes.as_slice(), rows[3].lens.as_ref().unwrap().z_lens), (&[1.0][..], 0.6));
    }
}
