//! Δ, the relative variation of the shear across the Einstein radius: is the field tidal?

use nalgebra::Complex;

use super::distortion::Distortion;
use crate::mapping::tidal::Tidal;
use crate::mapping::{Mapping, Order};

/// Shear at the axis and Δ, Δ² = [|γ(θ_E x̂)−γ(0)|² + |γ(θ_E ŷ)−γ(0)|²]/|γ(0)|².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShearVariation {
    /// γ(0).
    pub gamma: Complex<f64>,
    /// Δ; infinite where γ(0) = 0.
    pub delta: f64,
}

impl ShearVariation {
    /// From the Jacobians of the rays 0, θ_E x̂ and θ_E ŷ.
    pub fn of_jacobians(jacobians: [&[f64; 4]; 3]) -> Self {
        let shear = |a: &[f64; 4]| Tidal::of_jacobian(&nalgebra::Matrix2::new(a[0], a[1], a[2], a[3])).gamma;
        Self::of_shears(shear(jacobians[0]), shear(jacobians[1]), shear(jacobians[2]))
    }

    /// From the shear at 0, θ_E x̂ and θ_E ŷ.
    pub fn of_shears(at_axis: Complex<f64>, right: Complex<f64>, above: Complex<f64>) -> Self {
        let change = (right - at_axis).norm_sqr() + (above - at_axis).norm_sqr();
        Self { gamma: at_axis, delta: (change / at_axis.norm_sqr()).sqrt() }
    }
}

/// Δ_tot of a traced mapping at the scale `theta_e_arcsec`.
pub fn total_variation(mapping: &impl Mapping, theta_e_arcsec: f64) -> ShearVariation {
    let rays = mapping.map(&[[0.0, 0.0], [theta_e_arcsec, 0.0], [0.0, theta_e_arcsec]], Order::Jacobian);
    ShearVariation::of_jacobians([&rays.jacobian[0], &rays.jacobian[1], &rays.jacobian[2]])
}

/// Δ in the flexion regime, Δ² = 2θ_E²(|F|²+|G|²)/|γ|²; the paper prints ½ for the 2, which belongs to Bacon's F and G.
pub fn flexion_regime_variation(on_axis: &Distortion, theta_e_arcsec: f64) -> f64 {
    let flexion = on_axis.f_per_arcsec.norm_sqr() + on_axis.g_per_arcsec.norm_sqr();
    theta_e_arcsec * (2.0 * flexion / on_axis.tidal.gamma.norm_sqr()).sqrt()
}
