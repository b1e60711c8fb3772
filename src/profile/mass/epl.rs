//! The elliptical power law (Tessore & Metcalf 2015, A&A 580, A79).

use nalgebra::Complex;

use super::MassProfile;
use crate::error::{Result, require};

/// Elliptical power-law lens, κ = (3−γ)/2·(θ_E/√(qx²+y²/q))^(γ−1), in its own axes.
///
/// Deflection by the series of the hypergeometric function ₂F₁ (their eq. 13 with b = θ_E√q, t = γ−1);
/// shear and flexion from homogeneity: α is of degree 1−t, so z̄·γ = (1−t)α − zκ (complex notation).
/// Parameters as lenstronomy's `EPL`: e1 = (1−q)/(1+q)·cos 2φ, e2 = (1−q)/(1+q)·sin 2φ.
#[derive(Debug, Clone, Copy)]
pub struct Epl {
    pub(super) centre_arcsec: [f64; 2],
    /// e^{iφ} of the major axis.
    axis: Complex<f64>,
    q: f64,
    b_arcsec: f64,
    t: f64,
}

impl Epl {
    /// Lens of Einstein radius `einstein_radius_arcsec` ≥ 0, slope 1 < `slope` < 3, |e| < 1.
    ///
    /// # Errors
    /// When a parameter lies outside its domain.
    pub fn new(
        einstein_radius_arcsec: f64,
        slope: f64,
        ellipticity: [f64; 2],
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        require(
            einstein_radius_arcsec >= 0.0,
            "einstein_radius_arcsec",
            einstein_radius_arcsec,
            "zero or positive",
        )?;
        require(slope > 1.0 && slope < 3.0, "slope", slope, "above 1 and below 3")?;
        let e = ellipticity[0].hypot(ellipticity[1]);
        require(e < 1.0, "|e| of the lens", e, "below 1")?;
        require(true, "centre_x_arcsec", centre_arcsec[0], "finite")?;
        require(true, "centre_y_arcsec", centre_arcsec[1], "finite")?;
        let q = (1.0 - e) / (1.0 + e);
        let phi = 0.5 * ellipticity[1].atan2(ellipticity[0]);
        Ok(Self {
            centre_arcsec,
            axis: Complex::from_polar(1.0, phi),
            q,
            b_arcsec: einstein_radius_arcsec * q.sqrt(),
            t: slope - 1.0,
        })
    }

    /// Position in the frame of the axes, and the elliptical radius √(q²x²+y²), floored at 1e-9″.
    fn own_frame(&self, x: f64, y: f64) -> (Complex<f64>, f64) {
        const RADIUS_FLOOR_ARCSEC: f64 = 1e-9;
        let z = Complex::new(x - self.centre_arcsec[0], y - self.centre_arcsec[1]) * self.axis.conj();
        let z = if z.norm() < RADIUS_FLOOR_ARCSEC { Complex::new(RADIUS_FLOOR_ARCSEC, 0.0) } else { z };
        (z, (self.q * self.q * z.re * z.re + z.im * z.im).sqrt())
    }

    /// Complex deflection α_x + iα_y in the own frame.
    fn own_deflection(&self, z: Complex<f64>, radius: f64) -> Complex<f64> {
        /// The series is cut when a term no longer changes the sum.
        const RELATIVE: f64 = 1e-17;
        let f = (1.0 - self.q) / (1.0 + self.q);
        let direction = Complex::new(self.q * z.re, z.im) / radius;
        let step = direction * direction * (-f);
        let (mut term, mut sum) = (direction, direction);
        let mut n = 1.0;
        while f > 0.0 && term.norm_sqr() > RELATIVE * RELATIVE {
            term *= step * ((2.0 * n - (2.0 - self.t)) / (2.0 * n + (2.0 - self.t)));
            sum += term;
            n += 1.0;
        }
        sum * (2.0 * self.b_arcsec / (1.0 + self.q) * (self.b_arcsec / radius).powf(self.t - 1.0))
    }

    fn own_convergence(&self, radius: f64) -> f64 {
        0.5 * (2.0 - self.t) * (self.b_arcsec / radius).powf(self.t)
    }

    /// (κ, γ) in the own frame.
    fn own_shear(&self, z: Complex<f64>, radius: f64) -> (f64, Complex<f64>) {
        let kappa = self.own_convergence(radius);
        (kappa, (self.own_deflection(z, radius) * (1.0 - self.t) - z * kappa) / z.conj())
    }
}

impl MassProfile for Epl {
    fn potential(&self, x: f64, y: f64) -> f64 {
        // ψ is homogeneous of degree 2−t: (2−t)ψ = θ·α.
        let (z, radius) = self.own_frame(x, y);
        (z.conj() * self.own_deflection(z, radius)).re / (2.0 - self.t)
    }

    fn deflection(&self, x: f64, y: f64) -> [f64; 2] {
        let (z, radius) = self.own_frame(x, y);
        let alpha = self.own_deflection(z, radius) * self.axis;
        [alpha.re, alpha.im]
    }

    fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
        let (z, radius) = self.own_frame(x, y);
        let (kappa, gamma) = self.own_shear(z, radius);
        let gamma = gamma * self.axis * self.axis;
        [kappa + gamma.re, gamma.im, kappa - gamma.re]
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let (z, radius) = self.own_frame(x, y);
        let (kappa, gamma) = self.own_shear(z, radius);
        // F = ∂*κ with κ ∝ radius^{-t}; G = ∂*γ from ∂* of z̄γ = (1−t)α − zκ.
        let f = Complex::new(self.q * self.q * z.re, z.im) * (-0.5 * self.t * kappa / (radius * radius));
        let g = (gamma * (-self.t) - z * f) / z.conj();
        let f = f * self.axis;
        let g = g * self.axis * self.axis * self.axis;
        // ∂xκ = 2Re F, ∂yκ = 2Im F; ∂xγ = F + G, ∂yγ = i(F − G).
        [3.0 * f.re + g.re, f.im + g.im, f.re - g.re, 3.0 * f.im - g.im]
    }
}

#[cfg(test)]
mod tests {
    use super::super::derivative_checks::assert_consistent;
    use super::*;
    use proptest::prelude::*;

    /// Richardson differences with a step of 1% of the radius.
    const DIFFERENCES: f64 = 2e-8;

    proptest! {
        #[test]
        fn derivatives_are_consistent(
            slope in 1.2..2.8_f64, e1 in -0.4..0.4_f64, e2 in -0.4..0.4_f64,
            r in 0.05..5.0_f64, phi in 0.0..std::f64::consts::TAU,
        ) {
            let lens = Epl::new(1.3, slope, [e1, e2], [0.1, -0.05]).unwrap();
            assert_consistent(&lens, 0.1 + r * phi.cos(), -0.05 + r * phi.sin(), 0.01 * r, DIFFERENCES);
        }
    }

    #[test]
    fn isothermal_sphere_deflects_by_its_einstein_radius_everywhere() {
        let lens = Epl::new(1.5, 2.0, [0.0, 0.0], [0.0, 0.0]).unwrap();
        for (x, y) in [(0.3, 0.4), (3.0, -4.0)] {
            let [ax, ay] = lens.deflection(x, y);
            assert!((ax.hypot(ay) - 1.5).abs() < 1e-15);
        }
    }

    #[test]
    fn parameters_outside_their_domain_are_refused() {
        for (theta_e, slope, e) in
            [(-1.0, 2.0, 0.0), (1.0, 1.0, 0.0), (1.0, 3.0, 0.0), (1.0, 2.0, 1.0), (f64::NAN, 2.0, 0.0)]
        {
            assert!(Epl::new(theta_e, slope, [e, 0.0], [0.0, 0.0]).is_err());
        }
    }
}
