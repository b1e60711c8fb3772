//! The Sérsic profile of the convergence (Cardone 2004).

use statrs::function::gamma::{gamma_lr, ln_gamma};

use super::radial::{Amplitude, Radial, RadialLaw};
use crate::error::{Result, require};
use crate::numerics::quadrature::integrate;
use crate::profile::light::{B_N_SLOPE, b_n};

/// Sérsic lens κ = k_eff·exp{−b_n[(r/R)^{1/n} − 1]}; with elliptical isopotentials lenstronomy's `SERSIC_ELLIPSE_POTENTIAL`.
///
/// |α|(r) = 2nRk_eff b^{−2n}e^bΓ(2n)·(R/r)·P(2n, b(r/R)^{1/n}), b = b_n = 1.9992n − 0.3271, P the regularised
/// incomplete gamma function. The potential is the integral of P(2n, t)/t.
///
/// ```
/// use haloray::profile::mass::{MassProfile, SersicMass};
/// let lens = SersicMass::new(0.2, 0.5, 4.0, [0.0, 0.0]).unwrap();
/// let [xx, _, yy] = lens.hessian(0.5, 0.0);
/// assert!((0.5 * (xx + yy) - 0.2).abs() < 1e-12); // κ at the half-light radius
/// ```
pub type SersicMass = Radial<SersicLaw>;

/// The radial law of the Sérsic lens for κ(R) = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SersicLaw {
    index: f64,
    b: f64,
    /// 2n b^{−2n} e^b Γ(2n): the deflection of the whole mass at R.
    total: f64,
}

impl RadialLaw for SersicLaw {
    fn radial(&self, u: f64) -> [f64; 3] {
        let s = u.powf(0.5 / self.index);
        let kappa = (-self.b * (s - 1.0)).exp();
        let m = self.total * gamma_lr(2.0 * self.index, self.b * s) / u;
        let p1 = kappa - m;
        [m, p1, -kappa * self.b * s / (2.0 * self.index) - 2.0 * p1]
    }

    /// ∫₀ᵘ m du′ = 2n·total·∫₀ˣ P(2n, t)/t dt, x = b(r/R)^{1/n}.
    fn potential(&self, u: f64) -> f64 {
        let x = self.b * u.powf(0.5 / self.index);
        2.0 * self.index * self.total * integral_of_p_over_t(2.0 * self.index, x)
    }

    const PARAMETERS: &'static [&'static str] =
        &["k_eff", "R_sersic", "n_sersic", "e1", "e2", "center_x", "center_y"];

    fn by_parameter(&self, at: &Amplitude) -> [f64; 3] {
        [at.m, at.by_scale(), at.k * self.m_by_index(at.u)]
    }
}

impl SersicLaw {
    /// ∂m/∂n: u·m = ∫₀ᵘκ du′ with κ = exp{−b(s−1)}, s = u^{1/2n}, so that
    /// ∂(u·m)/∂n = ∫κ[−b′(s−1) + b·s·ln s/n]du′ with du′ = 2n s^{2n−1}ds, by quadrature in ln s.
    fn m_by_index(&self, u: f64) -> f64 {
        /// Below e⁻⁴⁰ of the integral.
        const SMALLEST: f64 = 40.0;
        const PANELS: usize = 8;
        let (n, b) = (self.index, self.b);
        let high = u.ln() / (2.0 * n);
        let low = high.min(0.0) - SMALLEST / (2.0 * n);
        let integrand = |y: f64| {
            let s = y.exp();
            (2.0 * n * y - b * (s - 1.0)).exp() * (-B_N_SLOPE * (s - 1.0) + b * s * y / n) * 2.0 * n
        };
        integrate(low, high, PANELS, integrand) / u
    }
}

/// ∫₀ˣ P(a, t)/t dt: below t = 1 by the series Σ(−1)^k t^{a+k}/[k!(a+k)²Γ(a)], above by quadrature in ln t.
fn integral_of_p_over_t(a: f64, x: f64) -> f64 {
    /// The first term left out is below 1/20!.
    const TERMS: u32 = 20;
    const PANELS: usize = 4;
    let low = x.min(1.0);
    let (mut power, mut sum) = ((a * low.ln() - ln_gamma(a)).exp(), 0.0);
    for k in 0..TERMS {
        let ak = a + f64::from(k);
        sum += power / (ak * ak);
        power *= -low / f64::from(k + 1);
    }
    if x > 1.0 { sum + integrate(0.0, x.ln(), PANELS, |y| gamma_lr(a, y.exp())) } else { sum }
}

impl SersicMass {
    /// Lens of convergence `k_eff` at the half-mass radius `radius_arcsec`, Sérsic index 0.3 to 10.
    ///
    /// # Errors
    /// When a parameter lies outside its domain.
    pub fn new(k_eff: f64, radius_arcsec: f64, index: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        require(true, "k_eff", k_eff, "finite")?;
        require(radius_arcsec > 0.0, "radius_arcsec", radius_arcsec, "positive")?;
        require((0.3..=10.0).contains(&index), "sersic_index", index, "from 0.3 to 10")?;
        let b = b_n(index);
        let total = (b - 2.0 * index * b.ln() + ln_gamma(2.0 * index)).exp() * 2.0 * index;
        Self::round(SersicLaw { index, b, total }, radius_arcsec, k_eff, centre_arcsec)
    }
}

#[cfg(test)]
mod tests {
    use super::super::derivative_checks::{assert_consistent, assert_parameter_derivatives};
    use super::*;
    use proptest::prelude::*;

    /// Richardson differences with a step of 2% of the radius, and gamma_lr's 3e-14.
    const DIFFERENCES: f64 = 1e-8;

    proptest! {
        #[test]
        fn derivatives_are_consistent(
            index in 0.5..8.0_f64, e1 in -0.3..0.3_f64, e2 in -0.3..0.3_f64,
            r in 0.03..4.0_f64, phi in 0.0..std::f64::consts::TAU,
        ) {
            let round = SersicMass::new(0.4, 0.6, index, [0.05, 0.1]).unwrap();
            let lens = round.with_elliptical_potential([e1, e2]).unwrap();
            assert_consistent(&lens, 0.05 + r * phi.cos(), 0.1 + r * phi.sin(), 0.02 * r, DIFFERENCES);
        }
    }

    proptest! {
        #[test]
        fn parameter_derivatives_are_those_of_the_deflection(
            shape in 0.0..1.0_f64, e1 in -0.3..0.3_f64, e2 in -0.3..0.3_f64,
            r in 0.02..3.0_f64, phi in 0.0..std::f64::consts::TAU,
        ) {
            let build = |p: &[f64]| SersicMass::new(p[0], p[1], p[2], [p[5], p[6]]).unwrap().with_elliptical_potential([p[3], p[4]]).unwrap();
            let at = [0.05 + r * phi.cos(), -0.1 + r * phi.sin()];
            for e in [[e1, e2], [0.0, 0.0]] {
                assert_parameter_derivatives(build, &[0.4, 0.6, 0.6 + 8.0 * shape, e[0], e[1], 0.05, -0.1], at, 1e-7);
            }
        }
    }
}
