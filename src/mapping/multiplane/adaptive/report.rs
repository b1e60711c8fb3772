//! What adaptive traces promised and how far they were off.

use serde::Serialize;

use crate::mapping::RayBundle;

/// How accurate adaptive traces were.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct AccuracyReport {
    /// Largest bound of |β − β_exact| over the rays, arcsec; 0 when all were traced exactly.
    pub bound_arcsec: f64,
    /// Largest |β − β_exact| over the random rays, arcsec.
    pub measured_arcsec: f64,
    /// Largest difference of an element of the Jacobian over the random rays, where one was asked for.
    pub measured_jacobian: f64,
    /// Largest difference of a second derivative over (1 + its size), per arcsec, where one was asked for.
    pub measured_second_per_arcsec: f64,
    /// Rays traced.
    pub rays: usize,
    /// Those of them traced exactly.
    pub rays_traced_exactly: usize,
    /// Random rays compared with the exact recursion.
    pub rays_compared: usize,
    /// Planes met one by one, summed over the rays.
    pub planes_met: usize,
}

impl AccuracyReport {
    /// Both together.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            bound_arcsec: self.bound_arcsec.max(other.bound_arcsec),
            measured_arcsec: self.measured_arcsec.max(other.measured_arcsec),
            measured_jacobian: self.measured_jacobian.max(other.measured_jacobian),
            measured_second_per_arcsec: self.measured_second_per_arcsec.max(other.measured_second_per_arcsec),
            rays: self.rays + other.rays,
            rays_traced_exactly: self.rays_traced_exactly + other.rays_traced_exactly,
            rays_compared: self.rays_compared + other.rays_compared,
            planes_met: self.planes_met + other.planes_met,
        }
    }

    /// With the differences between `rays[chosen]` and the same rays traced exactly.
    pub(super) fn compared(mut self, rays: &RayBundle, chosen: &[usize], exact: &RayBundle) -> Self {
        let pairs = || chosen.iter().enumerate();
        self.rays_compared = chosen.len();
        self.measured_arcsec = largest(pairs().map(|(k, &i)| {
            let (ours, exact) = (rays.beta_arcsec[i], exact.beta_arcsec[k]);
            (ours[0] - exact[0]).hypot(ours[1] - exact[1])
        }));
        if !exact.jacobian.is_empty() {
            self.measured_jacobian = largest(pairs().flat_map(|(k, &i)| {
                rays.jacobian[i].into_iter().zip(exact.jacobian[k]).map(|(a, b)| (a - b).abs())
            }));
        }
        if !exact.second_per_arcsec.is_empty() {
            self.measured_second_per_arcsec = largest(pairs().flat_map(|(k, &i)| {
                let pairs = rays.second_per_arcsec[i].into_iter().zip(exact.second_per_arcsec[k]);
                pairs.map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))
            }));
        }
        self
    }

    /// Whether what was measured is within `arcsec`, and derivatives within what follows from it.
    pub(super) fn is_within(&self, arcsec: f64) -> bool {
        self.measured_arcsec <= arcsec
            && self.measured_jacobian <= 10.0 * arcsec
            && self.measured_second_per_arcsec <= 1000.0 * arcsec
    }
}

/// Largest of some differences; not a number counts as infinite.
fn largest(differences: impl Iterator<Item = f64>) -> f64 {
    differences.fold(0.0, |most, d| {
        if d <= most {
            most
        } else if d.is_nan() {
            f64::INFINITY
        } else {
            d
        }
    })
}
