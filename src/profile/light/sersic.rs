//! The elliptical Sérsic light profile (Sérsic 1963), as lenstronomy's `SERSIC_ELLIPSE`.

use statrs::function::gamma::ln_gamma;

use super::LightProfile;
use crate::error::{Result, require};

/// Elliptical Sérsic profile I = I_R·exp{−b_n[(R/R_s)^{1/n} − 1]}, R = √(qx² + y²/q) in its own axes.
///
/// b_n = 1.9992n − 0.3271 (Capaccioli 1989), good to 1e-3 for 0.5 < n < 10 and exact by convention here:
/// the flux below uses the same b_n. At R → 0 the brightness is that of R = 1e-4″, as in lenstronomy 1.14.2; an n = 6 profile loses 1e-4 of its flux there.
#[derive(Debug, Clone, Copy)]
pub struct Sersic {
    amplitude: f64,
    radius_arcsec: f64,
    index: f64,
    b_n: f64,
    q: f64,
    axis: [f64; 2],
    centre_arcsec: [f64; 2],
}

/// b_n of the Sérsic profile, 1.9992n − 0.3271.
pub fn b_n(index: f64) -> f64 {
    1.9992 * index - 0.3271
}

/// Surface brightness at the half-light radius for a total flux: F/(2πnR²eᵇb⁻²ⁿΓ(2n)), per arcsec².
///
/// ```
/// use haloray::profile::light::Sersic;
/// // Magnitude 23, zero point 25.96, R = 0.3″, n = 6 (CONVENTIONS.md section 5).
/// let flux = 10f64.powf(-0.4 * (23.0 - 25.96));
/// let s = Sersic::with_flux(flux, 0.3, 6.0, [0.0, 0.0], [0.0, 0.0]).unwrap();
/// assert!((s.amplitude() / 6.150082191862573 - 1.0).abs() < 1e-13);
/// ```
fn amplitude_of_flux(flux: f64, radius: f64, index: f64) -> f64 {
    let b = b_n(index);
    let ln_shape = b - 2.0 * index * b.ln() + ln_gamma(2.0 * index);
    flux / (2.0 * std::f64::consts::PI * index * radius * radius * ln_shape.exp())
}

impl Sersic {
    /// Profile of the given total flux.
    ///
    /// # Errors
    /// When flux < 0, radius ≤ 0, the index is outside 0.3–10 or |e| ≥ 1.
    pub fn with_flux(
        flux: f64,
        radius_arcsec: f64,
        index: f64,
        ellipticity: [f64; 2],
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        require(flux >= 0.0, "flux", flux, "zero or positive")?;
        require(radius_arcsec > 0.0, "radius_arcsec", radius_arcsec, "positive")?;
        require((0.3..=10.0).contains(&index), "sersic_index", index, "between 0.3 and 10")?;
        let e = ellipticity[0].hypot(ellipticity[1]);
        require(e < 1.0, "|e| of the light", e, "below 1")?;
        require(true, "centre_x_arcsec", centre_arcsec[0], "finite")?;
        require(true, "centre_y_arcsec", centre_arcsec[1], "finite")?;
        let phi = 0.5 * ellipticity[1].atan2(ellipticity[0]);
        Ok(Self {
            amplitude: amplitude_of_flux(flux, radius_arcsec, index),
            radius_arcsec,
            index,
            b_n: b_n(index),
            q: (1.0 - e) / (1.0 + e),
            axis: [phi.cos(), phi.sin()],
            centre_arcsec,
        })
    }

    /// Surface brightness at the half-light radius, flux per arcsec².
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// Centre in arcsec.
    pub fn centre_arcsec(&self) -> [f64; 2] {
        self.centre_arcsec
    }
}

impl LightProfile for Sersic {
    fn surface_brightness(&self, x: f64, y: f64) -> f64 {
        const RADIUS_FLOOR_ARCSEC: f64 = 1e-4;
        let (dx, dy) = (x - self.centre_arcsec[0], y - self.centre_arcsec[1]);
        let (u, v) = (self.axis[0] * dx + self.axis[1] * dy, -self.axis[1] * dx + self.axis[0] * dy);
        let r = (self.q * u * u + v * v / self.q).sqrt().max(RADIUS_FLOOR_ARCSEC);
        self.amplitude * (-self.b_n * ((r / self.radius_arcsec).powf(1.0 / self.index) - 1.0)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flux_is_the_integral_of_the_brightness() {
        // Log-spaced radial sum over 1e-5″ < R < 1e3″; an ellipse of constant R has area πR².
        let s = Sersic::with_flux(2.5, 0.3, 4.0, [0.1, 0.2], [0.0, 0.0]).unwrap();
        let q: f64 = s.q;
        let steps = 40_000;
        let mut flux = 0.0;
        for i in 0..steps {
            let lr = |k: f64| (1e-5f64.ln() + k / f64::from(steps) * (1e8f64).ln()).exp();
            let (a, b, mid) = (lr(f64::from(i)), lr(f64::from(i) + 1.0), lr(f64::from(i) + 0.5));
            // The point on the own x axis with elliptical radius `mid`.
            let x = mid / q.sqrt();
            let brightness = s.surface_brightness(x * s.axis[0], x * s.axis[1]);
            flux += brightness * std::f64::consts::PI * (b * b - a * a);
        }
        assert!((flux / 2.5 - 1.0).abs() < 1e-5, "{flux}");
    }

    #[test]
    fn parameters_outside_their_domain_are_refused() {
        for (flux, r, n, e) in [
            (-1.0, 1.0, 1.0, 0.0),
            (1.0, 0.0, 1.0, 0.0),
            (1.0, 1.0, 0.1, 0.0),
            (1.0, 1.0, 11.0, 0.0),
            (1.0, 1.0, 1.0, 1.0),
        ] {
            assert!(Sersic::with_flux(flux, r, n, [e, 0.0], [0.0, 0.0]).is_err());
        }
    }
}
