//! The flexion models of the line of sight (Duboscq et al. 2024, arXiv:2405.12091).

use nalgebra::Complex;

use super::algebra::Algebra;
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
    #[inline(always)]
    pub(super) fn bend<C: Algebra>(&self, z: C) -> C {
        let bar = z.conj();
        (z.times(self.f.conj()) * z + z.times(self.f) * bar * 2.0 + bar.times(self.g) * bar) * 0.5
    }

    /// What a move of z does to q(z; F, G): the factors F̄z + Fz̄ of dz and Fz + Gz̄ of dz̄.
    #[inline(always)]
    pub(super) fn along<C: Algebra>(&self, z: C) -> [C; 2] {
        let bar = z.conj();
        [z.times(self.f.conj()) + bar.times(self.f), z.times(self.f) + bar.times(self.g)]
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

    /// The flexion-minimal model of this one: os := od + os − ds, 1ds := od + 1ds − 2ds (2ds for ds in flexions).
    ///
    /// To first order in the perturbations its β̃ is β − (κ_od−κ_ds)β − (γ_od−γ_ds)β̄ − q(β; od − 2ds), a source seen
    /// otherwise. The rotation stays as it is.
    pub fn to_minimal(&self) -> Self {
        let los = Tidal {
            kappa: self.od.kappa + self.os.kappa - self.ds.kappa,
            gamma: self.od.gamma + self.os.gamma - self.ds.gamma,
            omega: self.os.omega,
        };
        let beyond = |flexion: &Flexion| self.flexion_od.plus(flexion).minus(&self.flexion_2ds);
        Self::minimal(self.od, los, self.flexion_od, beyond(&self.flexion_os), beyond(&self.flexion_1ds))
    }

    /// Where the ray meets the lens, θ_d.
    #[inline(always)]
    pub(super) fn at_lens<C: Algebra>(&self, theta: C) -> C {
        theta * (1.0 - self.od.kappa) - theta.conj().times(self.od.gamma) - self.flexion_od.bend(theta)
    }

    /// What becomes of the deflection behind the lens: the factors κ_ds + F̄θ + Fθ̄ of α(θ) and γ_ds + Fθ + Gθ̄ of ᾱ(θ),
    /// F and G the 2ds flexion.
    #[inline(always)]
    pub(super) fn behind_lens<C: Algebra>(&self, theta: C) -> [C; 2] {
        let [direct, crossed] = self.flexion_2ds.along(theta);
        [direct.plus(self.ds.kappa.into()), crossed.plus(self.ds.gamma)]
    }

    /// θ − β from α(θ) and α(θ_d).
    #[inline(always)]
    pub(super) fn displacement<C: Algebra>(&self, theta: C, alpha: C, alpha_d: C) -> C {
        let own = theta.times(Complex::new(self.os.kappa, self.os.omega))
            + theta.conj().times(self.os.gamma)
            + self.flexion_os.bend(theta);
        let [direct, crossed] = self.behind_lens(theta);
        alpha_d + own - direct * alpha - crossed * alpha.conj() + self.flexion_1ds.bend(alpha)
    }

    /// Fermat potential in arcsec² of a ray at its own β (Duboscq et al. 2024), to first order in the perturbations.
    ///
    /// φ = ½Re{ᾱ_e[(1+κ_los)α_e + γ_los ᾱ_e]} + Re(F_1los α_e ᾱ_e²) + ⅓Re(G_1los ᾱ_e³)
    ///   − ψ(θ_d) − ½Re(F_los θθ̄²) − ⅙Re(G_los θ̄³),
    /// α_e = α(θ_d) − (κ_od + F̄_od θ + F_od θ̄)α(θ) − (γ_od + F_od θ + G_od θ̄)ᾱ(θ) + q(θ; F_los, G_los),
    /// with the numbers of [`Self::to_minimal`]. Rotation does not enter. The model's β is no gradient map beyond that
    /// order, so that no exact potential exists: Fermat's principle ∇φ = Ãᵀ∂φ/∂β̃ fails by the square of the perturbations.
    pub(super) fn fermat_arcsec2(&self, x: f64, y: f64, lenses: &[MassModel]) -> f64 {
        let minimal = self.to_minimal();
        let theta = Complex::new(x, y);
        let bar = theta.conj();
        let at_lens = self.at_lens(theta);
        let e = minimal.effective_deflection(x, y, lenses);
        let (cubic, one) = (e.conj() * e.conj() * e, &minimal.flexion_1ds);
        let geometry = 0.5 * (e.conj() * minimal.pull(e)).re
            + (one.f * cubic).re
            + (one.g * e.conj() * e.conj() * e.conj()).re / 3.0;
        let potential: f64 = lenses.iter().map(|l| l.potential(at_lens.re, at_lens.im)).sum();
        let los = &minimal.flexion_os;
        geometry - potential - 0.5 * (los.f * theta * bar * bar).re - (los.g * bar * bar * bar).re / 6.0
    }

    /// α_e of [`Self::fermat_arcsec2`], for a flexion-minimal model.
    fn effective_deflection(&self, x: f64, y: f64, lenses: &[MassModel]) -> Complex<f64> {
        let theta = Complex::new(x, y);
        let (alpha_d, alpha) = (deflection(self.at_lens(theta), lenses), deflection(theta, lenses));
        let [direct, crossed] = self.behind_lens(theta);
        alpha_d - direct * alpha - crossed * alpha.conj() + self.flexion_os.bend(theta)
    }

    /// (1 + κ_los)e + γ_los ē for a flexion-minimal model, −∂φ/∂β̃ at e = α_e.
    fn pull(&self, e: Complex<f64>) -> Complex<f64> {
        e * (1.0 + self.os.kappa) + self.os.gamma * e.conj()
    }
}

/// α_x + iα_y of all lenses.
fn deflection(at: Complex<f64>, lenses: &[MassModel]) -> Complex<f64> {
    lenses.iter().map(|lens| lens.deflection(at.re, at.im)).map(|[x, y]| Complex::new(x, y)).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{LineOfSightModel, TidalLens};
    use super::*;
    use crate::mapping::{Mapping, Order};
    use crate::numerics::differences::derivative;
    use crate::profile::mass::Epl;

    /// 25 numbers (no rotation) times `scale`.
    fn model(numbers: &[f64], scale: f64) -> FlexionModel {
        let pair = |i: usize| Complex::new(numbers[i], numbers[i + 1]) * scale;
        let tidal = |i: usize| Tidal { kappa: numbers[i] * scale, gamma: pair(i + 1), omega: 0.0 };
        let flexion = |i: usize| Flexion { f: pair(i), g: pair(i + 2) };
        FlexionModel {
            od: tidal(0),
            os: tidal(3),
            ds: tidal(6),
            flexion_od: flexion(9),
            flexion_os: flexion(13),
            flexion_1ds: flexion(17),
            flexion_2ds: flexion(21),
        }
    }

    fn lens() -> [MassModel; 1] {
        [MassModel::Epl(Epl::new(1.4, 2.2, [0.1, -0.05], [0.02, 0.03]).unwrap())]
    }

    /// β of a ray and its derivatives by x and y.
    fn ray(model: &FlexionModel, theta: [f64; 2]) -> [Complex<f64>; 3] {
        let lens = TidalLens::new(LineOfSightModel::Flexion(*model), lens().to_vec());
        let ray = lens.map(&[theta], Order::Jacobian);
        let ([x, y], [xx, xy, yx, yy]) = (ray.beta_arcsec[0], ray.jacobian[0]);
        [Complex::new(x, y), Complex::new(xx, yx), Complex::new(xy, yy)]
    }

    /// |∇φ − Ãᵀ∂φ/∂β̃| in arcsec, ∇φ by differences.
    fn fermat_gap(model: &FlexionModel, [x, y]: [f64; 2]) -> f64 {
        let (minimal, lenses) = (model.to_minimal(), lens());
        let phi = |x, y| model.fermat_arcsec2(x, y, &lenses);
        let gradient = Complex::new(derivative(|x| phi(x, y), x, 4e-3), derivative(|y| phi(x, y), y, 4e-3));
        let pull = -minimal.pull(minimal.effective_deflection(x, y, &lenses));
        let [_, d_x, d_y] = ray(&minimal, [x, y]);
        (gradient - Complex::new((d_x.conj() * pull).re, (d_y.conj() * pull).re)).norm()
    }

    /// |β̃ − (β − (κ_od−κ_ds)β − (γ_od−γ_ds)β̄ − q(β; od − 2ds))| in arcsec.
    fn source_gap(model: &FlexionModel, theta: [f64; 2]) -> f64 {
        let [beta, ..] = ray(model, theta);
        let convergence = model.od.kappa - model.ds.kappa;
        let shear = model.od.gamma - model.ds.gamma;
        let flexion = model.flexion_od.minus(&model.flexion_2ds);
        let seen = beta - beta * convergence - beta.conj() * shear - flexion.bend(beta);
        (ray(&model.to_minimal(), theta)[0] - seen).norm()
    }

    proptest! {
        #[test]
        fn fermats_principle_and_the_minimal_model_fail_only_by_the_square_of_the_perturbations(
            numbers in prop::collection::vec(-1.0..1.0_f64, 25), r in 0.6..2.0_f64, angle in 0.0..std::f64::consts::TAU,
        ) {
            let theta = [0.02 + r * angle.cos(), 0.03 + r * angle.sin()];
            for gap in [fermat_gap, source_gap] {
                let at = |scale| gap(&model(&numbers, scale), theta);
                // A term of second order leaves a hundredth, one of first order a tenth; differences leave 1e-10″.
                prop_assert!(at(1e-5) < 0.02 * at(1e-4) + 1e-9, "{:e} {:e}", at(1e-4), at(1e-5));
            }
        }
    }
}
