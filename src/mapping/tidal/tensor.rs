//! Convergence, shear and rotation of a tidal matrix.

use nalgebra::{Complex, Matrix2};

/// The tidal part Γ = 1 − A = [[κ+γ1, γ2−ω], [γ2+ω, κ−γ1]] of a mapping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tidal {
    /// Convergence κ.
    pub kappa: f64,
    /// Shear γ = γ1 + iγ2.
    pub gamma: Complex<f64>,
    /// Rotation ω.
    pub omega: f64,
}

impl Tidal {
    /// No distortion: A = 1.
    pub const NONE: Self = Self { kappa: 0.0, gamma: Complex::new(0.0, 0.0), omega: 0.0 };

    /// Reads κ, γ, ω off the Jacobian A.
    pub fn of_jacobian(a: &Matrix2<f64>) -> Self {
        let g = Matrix2::identity() - a;
        Self {
            kappa: 0.5 * (g[(0, 0)] + g[(1, 1)]),
            gamma: Complex::new(0.5 * (g[(0, 0)] - g[(1, 1)]), 0.5 * (g[(0, 1)] + g[(1, 0)])),
            omega: 0.5 * (g[(1, 0)] - g[(0, 1)]),
        }
    }

    /// That of Aᵀ: the rotation turned round.
    pub fn transposed(&self) -> Self {
        Self { omega: -self.omega, ..*self }
    }

    /// The Jacobian A = 1 − Γ.
    pub fn jacobian(&self) -> Matrix2<f64> {
        let (k, g, w) = (self.kappa, self.gamma, self.omega);
        Matrix2::new(1.0 - k - g.re, -g.im + w, -g.im - w, 1.0 - k + g.re)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_and_tidal_part_invert_each_other() {
        let tidal = Tidal { kappa: 0.03, gamma: Complex::new(0.01, -0.02), omega: 0.004 };
        let back = Tidal::of_jacobian(&tidal.jacobian());
        assert!((back.kappa - 0.03).abs() < 1e-15 && (back.omega - 0.004).abs() < 1e-15);
        assert!((back.gamma - tidal.gamma).norm() < 1e-15);
    }
}
