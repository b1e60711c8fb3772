//! Fermat potentials of the tidal models.

use nalgebra::{Matrix2, Vector2};

use super::lens::TidalLens;
use super::model::{LineOfSightModel, los_jacobian};
use crate::mapping::{Mapping, Order};
use crate::profile::mass::MassProfile;

impl TidalLens {
    /// Fermat potential of a ray at its own β in arcsec²; for flexion models to first order in the perturbations.
    ///
    /// Not a number where a matrix is singular.
    pub fn ray_fermat_arcsec2(&self, theta: [f64; 2]) -> f64 {
        match &self.model {
            LineOfSightModel::Flexion(model) => model.fermat_arcsec2(theta[0], theta[1], &self.lenses),
            _ => {
                let beta_arcsec = self.map(&[theta], Order::Position).beta_arcsec;
                beta_arcsec.first().and_then(|&beta| self.fermat_arcsec2(theta, beta)).unwrap_or(f64::NAN)
            }
        }
    }

    /// Fermat potential φ(θ; β) in arcsec² of a tidal model, whose gradient in θ vanishes at the images of β.
    ///
    /// φ = ½(θ − A_os⁻¹β)ᵀ A_LOS (θ − A_os⁻¹β) − ψ(A_od θ); for the minimal model A_os := A_LOS and β := β̃
    /// (Fleury, Larena & Uzan 2021). A potential exists only where A_LOS is symmetric, as it is for the tensors of
    /// any real line of sight; a free ω_LOS ≠ 0 has none, and the form is then evaluated as it stands.
    ///
    /// `None` for flexion models (see [`Self::ray_fermat_arcsec2`]) and for singular matrices.
    pub fn fermat_arcsec2(&self, theta: [f64; 2], beta: [f64; 2]) -> Option<f64> {
        let (a_los, a_os) = match &self.model {
            LineOfSightModel::Full { od, os, ds } => (los_jacobian(od, os, ds)?, os.jacobian()),
            LineOfSightModel::Minimal { los, .. } => (los.jacobian(), los.jacobian()),
            LineOfSightModel::Flexion(_) => return None,
        };
        let unlensed: Matrix2<f64> = a_os.try_inverse()?;
        let difference = Vector2::new(theta[0], theta[1]) - unlensed * Vector2::new(beta[0], beta[1]);
        let [x, y] = self.at_lens(theta);
        let potential: f64 = self.lenses.iter().map(|lens| lens.potential(x, y)).sum();
        Some(0.5 * difference.dot(&(a_los * difference)) - potential)
    }
}
