//! A mass function on a grid, ready to be integrated and sampled.

use crate::numerics::elementary::{LEAST_OF_LN_1P, exp, ln_1p};

/// ln M grid of one mass function, log-linear between its points.
///
/// In each cell n(x) = n_i·e^{g(x−x_i)}, x = ln M; number and mass integrals and their inverses are then exact.
/// With cells of 0.016 e-folds the integral is good to 1e-6 (`integral_converges`).
#[derive(Debug, Clone)]
pub struct MassTable {
    start: f64,
    step: f64,
    /// Masses of the grid points, Msun, and dn/d ln M there, per comoving Mpc³.
    mass_msun: Vec<f64>,
    density: Vec<f64>,
    /// ∫n d ln M up to each grid point, per comoving Mpc³.
    number: Cumulative,
    /// ∫M n d ln M up to each grid point, Msun per comoving Mpc³.
    mass: Cumulative,
}

/// A cumulative integral with a guide table, so that its inverse costs a constant time.
#[derive(Debug, Clone)]
struct Cumulative {
    /// Added to the logarithmic slope: 0 for number, 1 for mass.
    power: f64,
    at: Vec<f64>,
    guide: Vec<u32>,
    cells: Vec<Cell>,
}

/// What the inverse needs of a cell, without a division.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// One over the integral across it.
    per_number: f64,
    /// By how much e^{g t} grows across it.
    growth: f64,
    /// 1/g = step/ln(1 + growth).
    e_fold: f64,
}

impl MassTable {
    /// Tabulates dn/d ln M (per comoving Mpc³) on `cells` equal steps of ln M.
    pub fn new(
        mass_min_msun: f64,
        mass_max_msun: f64,
        cells: usize,
        dn_dlnm_per_cmpc3: impl Fn(f64) -> f64,
    ) -> Self {
        /// Densities below this are zero for any halo ever drawn, but keep the logarithms finite.
        const DENSITY_FLOOR_PER_CMPC3: f64 = 1e-200;
        let start = mass_min_msun.ln();
        let step = (mass_max_msun.ln() - start) / cells as f64;
        let mass_msun: Vec<f64> = (0..=cells).map(|i| (start + step * i as f64).exp()).collect();
        let density: Vec<f64> =
            mass_msun.iter().map(|mass| dn_dlnm_per_cmpc3(*mass).max(DENSITY_FLOOR_PER_CMPC3)).collect();
        let number = Cumulative::new(0.0, start, step, &density);
        let mass = Cumulative::new(1.0, start, step, &density);
        Self { start, step, mass_msun, density, number, mass }
    }

    /// Number of haloes per comoving Mpc³.
    pub fn number_per_cmpc3(&self) -> f64 {
        self.number.total()
    }

    /// Mass in haloes, Msun per comoving Mpc³.
    pub fn mass_msun_per_cmpc3(&self) -> f64 {
        self.mass.total()
    }

    /// ∫M n w d ln M per comoving Mpc³ of a smooth function w(ln M), by the trapezium rule on the cells.
    pub fn mass_weighted(&self, weight: impl Fn(f64) -> f64) -> f64 {
        let last = self.density.len() - 1;
        let node = |i: usize| {
            let ln_mass = self.start + self.step * i as f64;
            let part = if i == 0 || i == last { 0.5 } else { 1.0 };
            part * self.density[i] * self.mass_msun[i] * weight(ln_mass)
        };
        self.step * (0..=last).map(node).sum::<f64>()
    }

    /// ∫n·min(1, M/M*) d ln M per comoving Mpc³, M* = `mass_star_msun`.
    pub fn limited_number_per_cmpc3(&self, mass_star_msun: f64) -> f64 {
        self.limited(mass_star_msun).number_per_cmpc3()
    }

    /// The two parts of the integral: below M* (∝ M) and above it.
    fn limited_parts(&self, mass_star_msun: f64) -> (f64, f64) {
        let x = mass_star_msun.ln();
        let light = self.mass.up_to(self, x) / mass_star_msun;
        (light, self.number.total() - self.number.up_to(self, x))
    }

    /// A mass drawn from n, by the uniform deviate `u` in [0, 1).
    #[inline]
    pub fn sample_msun(&self, u: f64) -> f64 {
        exp(self.number.inverse(self, u * self.number.total()))
    }

    /// A mass that [`MassTable::sample_msun`] does not exceed with this deviate, Msun: without a logarithm or exponential,
    /// as most haloes of a cylinder fail its cut even with so much mass.
    #[inline]
    pub fn at_most_msun(&self, u: f64) -> f64 {
        /// Roundings of the sample.
        const MARGIN: f64 = 1.0 + 1e-12;
        self.mass_msun[self.number.cell_at_most(u * self.number.total()) + 1] * MARGIN
    }

    /// n·min(1, M/M*), M* = `mass_star_msun`, ready to be sampled.
    pub fn limited(&self, mass_star_msun: f64) -> LimitedMasses<'_> {
        let (light, heavy) = self.limited_parts(mass_star_msun);
        LimitedMasses { table: self, mass_star_msun, light, heavy }
    }

    fn slope(&self, cell: usize) -> f64 {
        (self.density[cell + 1] / self.density[cell]).ln() / self.step
    }
}

/// The mass function n·min(1, M/M*).
#[derive(Debug, Clone, Copy)]
pub struct LimitedMasses<'a> {
    table: &'a MassTable,
    mass_star_msun: f64,
    /// The integral below M* and above it.
    light: f64,
    heavy: f64,
}

impl LimitedMasses<'_> {
    /// ∫n·min(1, M/M*) d ln M per comoving Mpc³.
    pub fn number_per_cmpc3(&self) -> f64 {
        self.light + self.heavy
    }

    /// A mass drawn by the uniform deviate `u` in [0, 1).
    pub fn sample_msun(&self, u: f64) -> f64 {
        let Self { table, mass_star_msun, light, heavy } = *self;
        let target = u * (light + heavy);
        let x = if target < light {
            table.mass.inverse(table, target * mass_star_msun)
        } else {
            table.number.inverse(table, table.number.total() - (light + heavy - target))
        };
        exp(x)
    }
}

/// ∫₀^d e^{g t} dt, also for g·d → 0.
fn exponential_integral(g: f64, d: f64) -> f64 {
    let y = g * d;
    if y.abs() < 1e-8 { d * (1.0 + 0.5 * y) } else { y.exp_m1() / g }
}

impl Cumulative {
    fn new(power: f64, start: f64, step: f64, density: &[f64]) -> Self {
        let (mut at, mut cells) = (vec![0.0], Vec::new());
        let mut sum = 0.0;
        for (i, pair) in density.windows(2).enumerate() {
            let g = (pair[1] / pair[0]).ln() / step + power;
            let weight = (power * (start + step * i as f64)).exp();
            let number = pair[0] * weight * exponential_integral(g, step);
            sum += number;
            at.push(sum);
            let growth = pair[1] / pair[0] * (power * step).exp() - 1.0;
            cells.push(Cell { per_number: number.recip(), growth, e_fold: step / growth.ln_1p() });
        }
        let count = cells.len();
        let guide = (0..count)
            .map(|j| {
                let target = sum * j as f64 / count as f64;
                (at.partition_point(|v| *v <= target).clamp(1, count) - 1) as u32
            })
            .collect();
        Self { power, at, guide, cells }
    }

    fn total(&self) -> f64 {
        self.at[self.at.len() - 1]
    }

    /// Integral up to x = ln M.
    fn up_to(&self, table: &MassTable, x: f64) -> f64 {
        let cells = self.at.len() - 1;
        let scaled = (x - table.start) / table.step;
        if scaled <= 0.0 {
            return 0.0;
        }
        if scaled >= cells as f64 {
            return self.total();
        }
        let cell = scaled as usize;
        let low = table.start + table.step * cell as f64;
        let weight = (self.power * low).exp();
        self.at[cell]
            + table.density[cell] * weight * exponential_integral(table.slope(cell) + self.power, x - low)
    }

    #[inline]
    fn guide_bin(&self, target: f64) -> usize {
        let cells = self.guide.len();
        ((target / self.total() * cells as f64) as usize).min(cells - 1)
    }

    /// A cell that is not below the one in which the integral is `target`.
    #[inline]
    fn cell_at_most(&self, target: f64) -> usize {
        // Two further: the division by which the bin is found rounds.
        self.guide.get(self.guide_bin(target) + 2).map_or(self.guide.len() - 1, |cell| *cell as usize)
    }

    /// The x = ln M up to which the integral is `target`.
    #[inline]
    fn inverse(&self, table: &MassTable, target: f64) -> f64 {
        let cells = self.guide.len();
        let mut cell = self.guide[self.guide_bin(target)] as usize;
        while cell + 1 < cells && self.at[cell + 1] <= target {
            cell += 1;
        }
        let low = table.start + table.step * cell as f64;
        let Cell { per_number, growth, e_fold } = self.cells[cell];
        let share = (target - self.at[cell]) * per_number;
        // Invert ∫e^{gt}: t = ln(1 + share·(e^{g·step} − 1))/g.
        if growth.abs() < 1e-8 {
            low + share * table.step
        } else if growth > LEAST_OF_LN_1P {
            low + ln_1p(share * growth) * e_fold
        } else {
            low + (share * growth).ln_1p() * e_fold
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power_law(cells: usize) -> MassTable {
        MassTable::new(1e8, 1e15, cells, |m| 1e3 * (m / 1e8).powf(-0.9) * (-m / 1e14).exp())
    }

    #[test]
    fn integral_converges() {
        let (coarse, fine) = (power_law(1000), power_law(16_000));
        assert!((coarse.number_per_cmpc3() / fine.number_per_cmpc3() - 1.0).abs() < 1e-6);
        assert!((coarse.mass_msun_per_cmpc3() / fine.mass_msun_per_cmpc3() - 1.0).abs() < 2e-5);
    }

    #[test]
    fn sampling_inverts_the_cumulative() {
        let table = power_law(1000);
        for u in [0.0, 1e-6, 0.3, 0.77, 0.999_999] {
            let m = table.sample_msun(u);
            let back = table.number.up_to(&table, m.ln()) / table.number_per_cmpc3();
            assert!((back - u).abs() < 1e-12, "{u} {back}");
        }
    }

    #[test]
    fn no_sample_exceeds_its_bound_which_is_near_for_all_but_the_rarest() {
        let table = power_law(1000);
        for i in 0..100_000 {
            let u = f64::from(i) / 1e5;
            let (mass, bound) = (table.sample_msun(u), table.at_most_msun(u));
            assert!(mass <= bound && (bound < 10.0 * mass || u > 0.99), "{u} {mass} {bound}");
        }
        let last = 1.0 - f64::EPSILON;
        assert!(table.sample_msun(last) <= table.at_most_msun(last));
    }

    #[test]
    fn limited_sampling_inverts_its_own_cumulative() {
        let (table, star) = (power_law(1000), 3e11);
        let total = table.limited_number_per_cmpc3(star);
        for u in [0.0, 0.01, 0.5, 0.9, 0.999] {
            let m = table.limited(star).sample_msun(u);
            let below = if m < star {
                table.mass.up_to(&table, m.ln()) / star
            } else {
                total - (table.number.total() - table.number.up_to(&table, m.ln()))
            };
            assert!((below / total - u).abs() < 1e-11, "{u}");
        }
    }

    #[test]
    fn limits_of_the_limited_number() {
        let table = power_law(1000);
        assert!((table.limited_number_per_cmpc3(1e8) / table.number_per_cmpc3() - 1.0).abs() < 1e-12);
        let far = table.limited_number_per_cmpc3(1e20) * 1e20;
        assert!((far / table.mass_msun_per_cmpc3() - 1.0).abs() < 1e-9);
    }
}
