//! Convergence, shear, rotation and flexion of a mapping at one point.

use nalgebra::{Complex, Matrix2};

use crate::mapping::tidal::{Flexion, Tidal};
use crate::mapping::{Mapping, Order, RayBundle};

/// Tidal part and flexion of a mapping at one point; F = ∂γ and G = ∂*γ per arcsec, ∂ = ½(∂x − i∂y).
///
/// This F is half of Bacon et al. 2006's. Without rotation F = ∂*κ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    /// Convergence, shear, rotation.
    pub tidal: Tidal,
    /// F-type flexion per arcsec (spin 1).
    pub f_per_arcsec: Complex<f64>,
    /// G-type flexion per arcsec (spin 3).
    pub g_per_arcsec: Complex<f64>,
}

impl Distortion {
    /// From the Jacobian (a_xx, a_xy, a_yx, a_yy) and b_ijk = ∂²β_i/∂θ_j∂θ_k of a traced ray.
    pub fn of_ray(a: &[f64; 4], b: &[f64; 6]) -> Self {
        let [xxx, xxy, xyy, yxx, yxy, yyy] = *b;
        // Derivatives of γ1 = −½(a_xx − a_yy) and γ2 = −½(a_xy + a_yx).
        let g1 = [-0.5 * (xxx - yxy), -0.5 * (xxy - yyy)];
        let g2 = [-0.5 * (xxy + yxx), -0.5 * (xyy + yxy)];
        Self {
            tidal: Tidal::of_jacobian(&Matrix2::new(a[0], a[1], a[2], a[3])),
            f_per_arcsec: Complex::new(0.5 * (g1[0] + g2[1]), 0.5 * (g2[0] - g1[1])),
            g_per_arcsec: Complex::new(0.5 * (g1[0] - g2[1]), 0.5 * (g1[1] + g2[0])),
        }
    }

    /// The flexion alone.
    pub fn flexion(&self) -> Flexion {
        Flexion { f: self.f_per_arcsec, g: self.g_per_arcsec }
    }

    /// Distortions of all rays of a bundle traced with [`Order::SecondDerivatives`].
    pub fn of_bundle(rays: &RayBundle) -> Vec<Self> {
        rays.jacobian.iter().zip(&rays.second_per_arcsec).map(|(a, b)| Self::of_ray(a, b)).collect()
    }

    /// Distortion of a mapping on the axis.
    pub fn on_axis(mapping: &impl Mapping) -> Self {
        let rays = mapping.map(&[[0.0, 0.0]], Order::SecondDerivatives);
        Self::of_ray(&rays.jacobian[0], &rays.second_per_arcsec[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flexion_of_a_cubic_potential() {
        // ψ = Re(F* z² z̄)/2·… built from γ(θ) = Fθ + Gθ̄ and κ(θ) = 2Re(Fθ̄):
        // β = θ − ½(F̄θ² + 2F|θ|² + Gθ̄²); read F and G back from its second derivatives.
        let (f, g) = (Complex::new(0.01, -0.03), Complex::new(-0.02, 0.005));
        let beta = |x: f64, y: f64| {
            let z = Complex::new(x, y);
            z - (f.conj() * z * z + f * 2.0 * z.norm_sqr() + g * z.conj() * z.conj()) * 0.5
        };
        let second =
            |i: f64, j: f64, k: f64, l: f64| beta(i + k, j + l) - beta(i, j) - beta(k, l) + beta(0.0, 0.0);
        let (xx, xy, yy) =
            (second(1.0, 0.0, 1.0, 0.0), second(1.0, 0.0, 0.0, 1.0), second(0.0, 1.0, 0.0, 1.0));
        let d = Distortion::of_ray(&[1.0, 0.0, 0.0, 1.0], &[xx.re, xy.re, yy.re, xx.im, xy.im, yy.im]);
        assert!((d.f_per_arcsec - f).norm() < 1e-15 && (d.g_per_arcsec - g).norm() < 1e-15);
    }
}
