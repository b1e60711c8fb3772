//! κ_h, γ_h, F_h, G_h and Δ_h of every halo on its own.

use nalgebra::Complex;
use rayon::prelude::*;

use super::variation::ShearVariation;
use crate::halo::HaloCatalogue;
use crate::profile::mass::{MassModel, MassProfile};

/// Distortions that each halo alone causes on a ray (os), column by column, in catalogue order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HaloTidal {
    /// Convergence κ_h.
    pub kappa: Vec<f64>,
    /// Shear γ_h.
    pub gamma: Vec<Complex<f64>>,
    /// F-type flexion per arcsec.
    pub f_per_arcsec: Vec<Complex<f64>>,
    /// G-type flexion per arcsec.
    pub g_per_arcsec: Vec<Complex<f64>>,
    /// Relative variation Δ_h of the shear across the scale asked for.
    pub delta: Vec<f64>,
}

impl HaloTidal {
    /// Evaluates every halo at 0, θ_E x̂ and θ_E ŷ; all derivatives are analytic.
    ///
    /// # Errors
    /// When a halo of the catalogue has parameters that no profile allows.
    pub fn of(haloes: &HaloCatalogue, theta_e_arcsec: f64) -> crate::Result<Self> {
        Self::along(haloes, theta_e_arcsec, |_| [0.0; 2])
    }

    /// As [`Self::of`], where a ray meets the plane of halo `i` in the direction `ray(i)` instead of 0.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn along(
        haloes: &HaloCatalogue,
        theta_e_arcsec: f64,
        ray: impl Fn(usize) -> [f64; 2] + Sync,
    ) -> crate::Result<Self> {
        let rows: Vec<_> = (0..haloes.len())
            .into_par_iter()
            .map(|i| Ok(row(&haloes.profile(i)?, ray(i), theta_e_arcsec)))
            .collect::<crate::Result<_>>()?;
        let mut columns = Self::default();
        for (kappa, f, g, variation) in rows {
            columns.kappa.push(kappa);
            columns.gamma.push(variation.gamma);
            columns.f_per_arcsec.push(f);
            columns.g_per_arcsec.push(g);
            columns.delta.push(variation.delta);
        }
        Ok(columns)
    }

    /// True for haloes with Δ_h below `threshold`: those in the tidal regime.
    pub fn within(&self, threshold: f64) -> Vec<bool> {
        self.delta.iter().map(|delta| *delta < threshold).collect()
    }
}

type Row = (f64, Complex<f64>, Complex<f64>, ShearVariation);

fn row(profile: &MassModel, [x, y]: [f64; 2], theta_e: f64) -> Row {
    let [xx, _, yy] = profile.hessian(x, y);
    let t = profile.third_derivatives(x, y);
    // F = ∂*κ; G = ∂*γ.
    let f = Complex::new(t[0] + t[2], t[1] + t[3]) * 0.25;
    let g = Complex::new(t[0] - 3.0 * t[2], 3.0 * t[1] - t[3]) * 0.25;
    let shears = [(x, y), (x + theta_e, y), (x, y + theta_e)].map(|(x, y)| shear(profile, x, y));
    (0.5 * (xx + yy), f, g, ShearVariation::of_shears(shears[0], shears[1], shears[2]))
}

fn shear(profile: &MassModel, x: f64, y: f64) -> Complex<f64> {
    let [xx, xy, yy] = profile.hessian(x, y);
    Complex::new(0.5 * (xx - yy), xy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::Nfw;

    fn halo() -> MassModel {
        MassModel::Nfw(Nfw::new(0.7, 0.02, [3.0, -1.0]).unwrap())
    }

    #[test]
    fn flexion_regime_needs_two_not_one_half() {
        // Δ²/(θ_E²(|F|²+|G|²)/|γ|²) → 2 as θ_E → 0, to 1e-6; the printed ½ is off by a factor 4.
        let theta_e = 1e-7;
        let (_, f, g, variation) = row(&halo(), [0.0; 2], theta_e);
        let flexion = (f.norm_sqr() + g.norm_sqr()) / variation.gamma.norm_sqr();
        let factor = (variation.delta / theta_e).powi(2) / flexion;
        assert!((factor - 2.0).abs() < 2e-6, "{factor}");
        assert!((factor / 0.5 - 4.0).abs() < 1e-5);
    }

    #[test]
    fn flexion_equals_differences_of_shear_and_convergence() {
        let (_, f, g, _) = row(&halo(), [0.0; 2], 1.0);
        let h = 1e-4;
        let d = |x: f64, y: f64| (shear(&halo(), x, y) - shear(&halo(), -x, -y)) / (2.0 * h);
        let (dx, dy) = (d(h, 0.0), d(0.0, h));
        let i = Complex::<f64>::i();
        assert!(((dx - i * dy) * 0.5 - f).norm() < 1e-8 * f.norm());
        assert!(((dx + i * dy) * 0.5 - g).norm() < 1e-8 * g.norm());
    }
}
