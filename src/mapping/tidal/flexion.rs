//! The flexion models of the line of sight (Duboscq et al. 2024, arXiv:2405.12091).

use nalgebra::Complex;

use super::jet::Jet;
use super::tensor::Tidal;
use crate::profile::mass::MassModel;

/// F- and G-type flexion per arcsec, F = ∂γ, G = ∂*γ (half of Bacon's).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flexion {
    /// Spin 1.
    pub f: Complex<f64>,
    /// Spin 3.
    pub g: Complex<f64>,
}

impl Flexion {
    /// None.
    pub const NONE: Self = Self { f: Complex::new(0.0, 0.0), g: Complex::new(0.0, 0.0) };

    /// q(z; F, G) = ½(F̄z² + 2F|z|² + Gz̄²).
    pub(super) fn bend(&self, z: Jet) -> Jet {
        let bar = z.conj();
        (z * z * self.f.conj() + z * bar * (self.f * 2.0) + bar * bar * self.g) * 0.5
    }
}

/// The 26 numbers of the flexion model; no rotation but ω_os.
///
/// θ_d = (1−κ_od)θ − γ_od θ̄ − q(θ; od),
/// β = θ − [α(θ_d) + (κ_os + iω_os)θ + γ_os θ̄ + q(θ; os) − (κ_ds + F̄_2ds θ + F_2ds θ̄)α(θ)
///   − (γ_ds + F_2ds θ + G_2ds θ̄)ᾱ(θ) + q(α(θ); 1ds)].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlexionModel {
    /// Observer to lens.
    pub od: Tidal,
    /// Observer to source.
    pub os: Tidal,
    /// Lens to source.
    pub ds: Tidal,
    /// Flexion observer to lens.
    pub flexion_od: Flexion,
    /// Flexion observer to source.
    pub flexion_os: Flexion,
    /// Flexion lens to source, quadratic in the deflection.
    pub flexion_1ds: Flexion,
    /// Flexion lens to source, bilinear in position and deflection.
    pub flexion_2ds: Flexion,
}

impl FlexionModel {
    /// The flexion-minimal model: os := los, 1ds := 1los, ds := od, 2ds := od (19 numbers).
    pub fn minimal(
        od: Tidal,
        los: Tidal,
        flexion_od: Flexion,
        flexion_los: Flexion,
        flexion_1los: Flexion,
    ) -> Self {
        Self {
            od,
            os: los,
            ds: od,
            flexion_od,
            flexion_os: flexion_los,
            flexion_1ds: flexion_1los,
            flexion_2ds: flexion_od,
        }
    }

    /// Where the ray meets the lens, θ_d.
    pub(super) fn lens_position(&self, theta: Jet) -> Jet {
        theta * (1.0 - self.od.kappa) - theta.conj() * self.od.gamma - self.flexion_od.bend(theta)
    }

    pub(super) fn beta(&self, theta: Jet, lenses: &[MassModel]) -> Jet {
        let alpha_d = self.lens_position(theta).deflected_by(lenses);
        let alpha = theta.deflected_by(lenses);
        let bar = theta.conj();
        let two = &self.flexion_2ds;
        let own = theta * Complex::new(self.os.kappa, self.os.omega)
            + bar * self.os.gamma
            + self.flexion_os.bend(theta);
        let converged = (theta * two.f.conj() + bar * two.f) * alpha + alpha * self.ds.kappa;
        let sheared = (theta * two.f + bar * two.g) * alpha.conj() + alpha.conj() * self.ds.gamma;
        theta - (alpha_d + own - converged - sheared + self.flexion_1ds.bend(alpha))
    }
}
