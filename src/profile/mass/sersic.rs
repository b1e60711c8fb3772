//! The Sérsic profile of the convergence (Cardone 2004).

use statrs::function::gamma::{digamma, gamma_lr, ln_gamma};

use super::radial::{Radial, RadialLaw, by_scale};
use crate::error::Result;
use crate::numerics::elementary::Elementary;
use crate::numerics::quadrature::integrate;
use crate::numerics::real::Real;
use crate::profile::light::{B_N_SLOPE, b_n};
use crate::profile::parameter::{Guess, Name, Parameter, PriorShape, Role, exactly, placed_ellipse};

/// Sérsic lens κ = k_eff·exp{−b_n[(r/R)^{1/n} − 1]}; with elliptical isopotentials lenstronomy's `SERSIC_ELLIPSE_POTENTIAL`.
///
/// |α|(r) = 2nRk_eff b^{−2n}e^bΓ(2n)·(R/r)·P(2n, b(r/R)^{1/n}), b = b_n = 1.9992n − 0.3271, P the regularised
/// incomplete gamma function. The potential is the integral of P(2n, t)/t.
///
/// With x = b(r/R)^{1/n} and a = 2n this is α = κ(r)·S(a, x)·θ, S = ₁F₁(1; a+1; x) = Σ xᵏ/(a+1)ₖ (DLMF 8.7.1): no gamma
/// function, all terms positive, and ∂S/∂a from the same recursion. Far out, where P = 1, the lens is a point mass.
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
    /// ∂ ln(total)/∂n.
    ln_total_by_index: f64,
}

/// Beyond this x all mass is inside: 1 − P(20, 100) = 3e-23.
const FAR_X: f64 = 100.0;

/// Convergence at the half-mass radius.
const K_EFF: Parameter = Parameter {
    name: "k_eff",
    label: "κ_{eff}",
    usual_prior: PriorShape::Uniform([0.0, 5.0]),
    role: Role::Strength,
    ..Parameter::NUMBER
};

impl RadialLaw for SersicLaw {
    const NAMES: &'static [Name] = &[
        Name { name: "SERSIC_ELLIPSE_POTENTIAL", held: &[] },
        Name { name: "SERSIC", held: &[("e1", 0.0), ("e2", 0.0)] },
    ];
    const PARAMETERS: &'static [Parameter] = &placed_ellipse![
        K_EFF,
        Parameter::SERSIC_RADIUS,
        Parameter { guess: Guess::Fixed(4.0), ..Parameter::SERSIC_INDEX }
    ];

    fn of_parameters(values: &[f64]) -> Result<SersicMass> {
        let [k_eff, radius, index, e1, e2, x, y] = exactly(values)?;
        SersicMass::new(k_eff, radius, index, [x, y])?.with_elliptical_potential([e1, e2])
    }

    #[inline(always)]
    fn radial<R: Real>(&self, u: R) -> [R; 3] {
        let at = self.at(u);
        let m = self.m_of(&at, self.series_sum(at.x, self.terms(at.x)));
        let p1 = at.kappa - m;
        [m, p1, -at.kappa * at.x / R::splat(2.0 * self.index) - p1 * 2.0]
    }

    /// ∫₀ᵘ m du′ = 2n·total·∫₀ˣ P(2n, t)/t dt, x = b(r/R)^{1/n}.
    fn potential(&self, u: f64) -> f64 {
        let x = self.b * u.powf(0.5 / self.index);
        2.0 * self.index * self.total * integral_of_p_over_t(2.0 * self.index, x)
    }

    #[inline(always)]
    fn m<R: Real>(&self, u: R) -> R {
        let at = self.at(u);
        self.m_of(&at, self.series_sum(at.x, self.terms(at.x)))
    }

    #[inline(always)]
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]) {
        let at = self.at(u);
        let series = self.series(at.x, self.terms(at.x));
        let m = self.m_of(&at, series[0]);
        let p1 = at.kappa - m;
        ([m, p1], [m, by_scale(p1, k, scale_arcsec), self.m_by_index(&at, series) * k])
    }
}

/// What m and its derivatives share at one radius.
struct SersicPlace<R> {
    u: R,
    /// ln(r/R)/n.
    exponent: R,
    /// (r/R)^{1/n}.
    s: R,
    /// b·s, no larger than [`FAR_X`] where it enters the series.
    x: R,
    /// κ/k_eff.
    kappa: R,
}

impl SersicLaw {
    #[inline(always)]
    fn at<R: Real>(&self, u: R) -> SersicPlace<R> {
        let exponent = u.ln() * (0.5 / self.index);
        let s = exponent.exp();
        SersicPlace { u, exponent, s, x: s * self.b, kappa: ((s + -1.0) * -self.b).exp() }
    }

    /// Terms of S that leave less than 1e-17 of it: the tail of a Poisson distribution of mean x beyond a + k. Lanes take
    /// those of the one that needs most; more than a lane needs change it by less than its rounding.
    #[inline(always)]
    fn terms<R: Real>(&self, x: R) -> usize {
        let x = x.extent()[1].min(FAR_X);
        (x + 9.0 * x.sqrt() + 20.0 - 2.0 * self.index).ceil().max(4.0) as usize
    }

    /// S alone.
    #[inline(always)]
    fn series_sum<R: Real>(&self, x: R, terms: usize) -> R {
        let x = R::splat(FAR_X).or_below(x, FAR_X, x);
        let mut s = R::splat(1.0);
        for k in (1..=terms).rev() {
            s = x * (1.0 / (2.0 * self.index + k as f64)) * s + 1.0;
        }
        s
    }

    /// S, ∂S/∂a and (S − 1)/x by S = 1 + x/(a+1)·(1 + x/(a+2)·(1 + …)).
    #[inline(always)]
    fn series<R: Real>(&self, x: R, terms: usize) -> [R; 3] {
        let x = R::splat(FAR_X).or_below(x, FAR_X, x);
        let (mut s, mut by_a, mut rest) = (R::splat(1.0), R::splat(0.0), R::splat(0.0));
        for k in (1..=terms).rev() {
            let c = 1.0 / (2.0 * self.index + k as f64);
            let y = x * c;
            by_a = y * (by_a - s * c);
            rest = s * c;
            s = y * s + 1.0;
        }
        [s, by_a, rest]
    }

    #[inline(always)]
    fn m_of<R: Real>(&self, at: &SersicPlace<R>, s: R) -> R {
        let far = R::splat(self.total) / at.u;
        select_far(at.x, far, at.kappa * s)
    }

    /// ∂m/∂n at fixed u: ∂s/∂n = −s ln s/n, ∂κ/∂n = κ[−b′(s−1) + b s ln s/n], ∂S/∂x = S − a(S−1)/x.
    #[inline(always)]
    fn m_by_index<R: Real>(&self, at: &SersicPlace<R>, [s, by_a, rest]: [R; 3]) -> R {
        let moved = at.s * at.exponent * (1.0 / self.index);
        let kappa_by_n = (at.s + -1.0) * -B_N_SLOPE + moved * self.b;
        let x_by_n = at.s * B_N_SLOPE - moved * self.b;
        let by_x = s - rest * (2.0 * self.index);
        let near = at.kappa * (kappa_by_n * s + by_a * 2.0 + by_x * x_by_n);
        let far = R::splat(self.total * self.ln_total_by_index) / at.u;
        select_far(at.x, far, near)
    }
}

/// `far` where x is at least [`FAR_X`], else `near`.
#[inline(always)]
fn select_far<R: Real>(x: R, far: R, near: R) -> R {
    far.or_below(x, FAR_X, near)
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
        K_EFF.domain.check("k_eff", k_eff)?;
        Parameter::SERSIC_RADIUS.domain.check("radius_arcsec", radius_arcsec)?;
        Parameter::SERSIC_INDEX.domain.check("sersic_index", index)?;
        let b = b_n(index);
        let total = (b - 2.0 * index * b.ln() + ln_gamma(2.0 * index)).exp() * 2.0 * index;
        // d/dn of b − 2n ln b + ln Γ(2n+1).
        let ln_total_by_index =
            B_N_SLOPE * (1.0 - 2.0 * index / b) - 2.0 * b.ln() + 2.0 * digamma(2.0 * index + 1.0);
        let law = SersicLaw { index, b, total, ln_total_by_index };
        Self::round(law, radius_arcsec, k_eff, centre_arcsec)
    }
}
