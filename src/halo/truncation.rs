//! Where haloes end: truncation radii by scale radius, by virial radius, or by the mass that is to be theirs.

use crate::error::{Domain, Result};
use crate::numerics::roots::bracketed_root;

/// What sets the truncation radius r_t of a halo (ρ ∝ NFW·τ²/(τ² + x²), τ = r_t/r_s; Baltz, Marshall & Oguri 2009).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truncation {
    /// r_t is so many scale radii.
    OverRs(f64),
    /// r_t is so many r_200c = c·r_s.
    OverR200c(f64),
    /// r_t is such that the total mass is so many M200c.
    MassOverM200c(f64),
}

impl Truncation {
    /// The number, with the name of its configuration key.
    pub fn named(self) -> (&'static str, f64) {
        match self {
            Self::OverRs(value) => ("truncation_over_r_s", value),
            Self::OverR200c(value) => ("truncation_over_r_200c", value),
            Self::MassOverM200c(value) => ("total_mass_over_m200c", value),
        }
    }

    /// Checks the number.
    ///
    /// # Errors
    /// When it is not positive and finite, or a mass is not between 0.01 and 10 M200c.
    pub fn validate(self) -> Result<()> {
        let (name, value) = self.named();
        let domain = match self {
            Self::MassOverM200c(_) => Domain::from_to(0.01, 10.0),
            _ => Domain::POSITIVE,
        };
        domain.check(name, value).map(drop)
    }

    /// τ of a halo of concentration r_200c/r_s.
    pub fn over_r_s(self, c200c: f64) -> f64 {
        match self {
            Self::OverRs(tau) => tau,
            Self::OverR200c(multiple) => multiple * c200c,
            Self::MassOverM200c(multiple) => {
                let within_r200c = c200c.ln_1p() - c200c / (1.0 + c200c);
                let excess = |ln_tau: f64| total_mass(ln_tau.exp()) - multiple * within_r200c;
                // The total mass grows from 0 without limit; ln τ = 100 is more than 98 of it, a halo of c = 1e42.
                bracketed_root(excess, -30.0, 100.0, 1e-13).map_or(f64::INFINITY, f64::exp)
            }
        }
    }
}

/// M∞/(4πρ₀r_s³) = τ²/(τ²+1)²·[(τ²−1)ln τ + πτ − (τ²+1)].
fn total_mass(tau: f64) -> f64 {
    let t2 = tau * tau;
    t2 / (t2 + 1.0).powi(2) * ((t2 - 1.0) * tau.ln() + std::f64::consts::PI * tau - (t2 + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_halo_of_total_mass_m200c_ends_a_little_beyond_r_200c() {
        for c in [2.0, 6.0, 15.0, 40.0] {
            let tau = Truncation::MassOverM200c(1.0).over_r_s(c);
            let within = f64::ln_1p(c) - c / (1.0 + c);
            assert!((total_mass(tau) / within - 1.0).abs() < 1e-11, "{c}: {tau}");
            assert!((0.5..3.0).contains(&(tau / c)), "{c}: {tau}");
        }
        assert_eq!(Truncation::OverR200c(2.0).over_r_s(5.0), 10.0);
    }

    #[test]
    fn numbers_outside_their_domain_are_named() {
        let error = Truncation::MassOverM200c(0.0).validate().unwrap_err().to_string();
        assert!(error.starts_with("total_mass_over_m200c is 0"), "{error}");
        assert!(
            Truncation::OverR200c(-1.0).validate().is_err() && Truncation::OverRs(8.0).validate().is_ok()
        );
    }
}
