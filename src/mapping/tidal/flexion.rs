//! The flexion models of the line of sight (Duboscq et al. 2024, arXiv:2405.12091).

use nalgebra::Complex;

use super::jet::Jet;
use super::tensor::Tidal;
use crate::profile::mass::{MassModel, MassProfile};

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

    fn plus(&self, other: &Self) -> Self {
        Self { f: self.f + other.f, g: self.g + other.g }
    }

    fn minus(&self, other: &Self) -> Self {
        Self { f: self.f - other.f, g: self.g - other.g }
    }

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

    /// Fermat potential of a ray at its own β in arcsec² (Duboscq et al. 2024), to first order in the perturbations.
    ///
    /// φ = ½Re{ᾱ_e[(1+κ_los)α_e + γ_los ᾱ_e + ⅔(F̄_1los α_e² + 2F_1los|α_e|² + G_1los ᾱ_e²)]}
    ///   − ψ(θ_d) − ½Re(F_los θθ̄²) − ⅙Re(G_los θ̄³), los := od + os − ds (2ds in the flexions, 1los := od + 1ds − 2ds),
    /// α_e = α(θ_d) − (κ_od + F̄_od θ + F_od θ̄)α(θ) − (γ_od + F_od θ + G_od θ̄)ᾱ(θ) + q(θ; F_los, G_los).
    /// Rotation does not enter.
    pub(super) fn fermat_arcsec2(&self, x: f64, y: f64, lenses: &[MassModel]) -> f64 {
        let theta = Complex::new(x, y);
        let bar = theta.conj();
        let los = self.flexion_od.plus(&self.flexion_os).minus(&self.flexion_2ds);
        let one = self.flexion_od.plus(&self.flexion_1ds).minus(&self.flexion_2ds);
        let kappa = self.od.kappa + self.os.kappa - self.ds.kappa;
        let gamma = self.od.gamma + self.os.gamma - self.ds.gamma;
        let at_lens = self.lens_position(Jet::theta(x, y));
        let alpha_d = at_lens.deflected_by(lenses).value;
        let alpha = Jet::theta(x, y).deflected_by(lenses).value;
        let od = &self.flexion_od;
        let effective = alpha_d
            - (od.f.conj() * theta + od.f * bar + self.od.kappa) * alpha
            - (od.f * theta + od.g * bar + self.od.gamma) * alpha.conj()
            + los.bend(Jet::theta(x, y)).value;
        let e = effective;
        let cubic = one.f.conj() * e * e + one.f * (2.0 * e.norm_sqr()) + one.g * e.conj() * e.conj();
        let geometry = e.conj() * (e * (1.0 + kappa) + gamma * e.conj() + cubic * (2.0 / 3.0));
        let potential: f64 = lenses.iter().map(|l| l.potential(at_lens.value.re, at_lens.value.im)).sum();
        0.5 * geometry.re
            - potential
            - 0.5 * (los.f * theta * bar * bar).re
            - (los.g * bar * bar * bar).re / 6.0
    }
}
