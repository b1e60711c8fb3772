//! Flexion and shear variation averaged over a ring and the disc inside it: finite where single points are not.
//!
//! At a point ⟨|F|²⟩, ⟨|G|²⟩ of cusped haloes diverge. The average of ∂*f over a disc of radius R is ⟨f e^{iφ}⟩/R over its
//! edge, that of ∂f is ⟨f e^{−iφ}⟩/R (Green's theorem), so that both need what happens on the ring alone.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::distortion::Distortion;
use crate::mapping::multiplane::{Circle, CircleWave, Distorts, LineOfSight, Meeting, RAYS, turn};

/// Shear and flexion averaged over a ring or a disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Averaged {
    /// ⟨γ⟩.
    pub gamma: Complex<f64>,
    /// ⟨F⟩ per arcsec.
    pub f_per_arcsec: Complex<f64>,
    /// ⟨G⟩ per arcsec.
    pub g_per_arcsec: Complex<f64>,
    /// Relative variation of the shear. Ring: Δ² = 2⟨|γ − ⟨γ⟩|²⟩/|⟨γ⟩|²; disc: Δ² = 2R²(|⟨F⟩|² + |⟨G⟩|²)/|⟨γ⟩|². In the
    /// flexion regime both are the Δ of two points.
    pub delta: f64,
}

/// Averages over the ring of one radius and over the disc inside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingAndDisc {
    /// Over the ring.
    pub ring: Averaged,
    /// Over the disc.
    pub disc: Averaged,
}

/// What a field does at one place on the ring.
pub(super) struct OnRing {
    /// α = θ − β.
    pub deflection: Complex<f64>,
    pub gamma: Complex<f64>,
    pub f_per_arcsec: Complex<f64>,
    pub g_per_arcsec: Complex<f64>,
}

/// What averages are made of: γ, F, G, αe^{iφ}, γe^{−iφ}, γe^{iφ}, and last |γ|².
type Moments = [Complex<f64>; 7];

impl OnRing {
    pub(super) fn moments(&self, [cos, sin]: [f64; 2]) -> Moments {
        let turn = Complex::new(cos, sin);
        [
            self.gamma,
            self.f_per_arcsec,
            self.g_per_arcsec,
            self.deflection * turn,
            self.gamma * turn.conj(),
            self.gamma * turn,
            self.gamma.norm_sqr().into(),
        ]
    }

    fn of_halo(halo: &Distorts) -> Self {
        let ([x, y], [xx, xy, yy]) = (halo.deflection_arcsec, halo.hessian);
        let [f_per_arcsec, g_per_arcsec] = flexion(halo.third_per_arcsec);
        let gamma = Complex::new(0.5 * (xx - yy), xy);
        Self { deflection: Complex::new(x, y), gamma, f_per_arcsec, g_per_arcsec }
    }
}

/// F = ∂*κ and G = ∂*γ of ∂³ψ (xxx, xxy, xyy, yyy).
pub(super) fn flexion(t: [f64; 4]) -> [Complex<f64>; 2] {
    [Complex::new(t[0] + t[2], t[1] + t[3]) * 0.25, Complex::new(t[0] - 3.0 * t[2], 3.0 * t[1] - t[3]) * 0.25]
}

/// (cos φ, sin φ) and equal weights of so many places around the ring.
pub(super) fn evenly(places: usize) -> impl Iterator<Item = ([f64; 2], f64)> {
    (0..places).map(move |i| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / places as f64).sin_cos();
        ([cos, sin], 1.0 / places as f64)
    })
}

impl RingAndDisc {
    /// From the weighted places of a rule on the ring.
    pub(super) fn of(
        radius_arcsec: f64,
        rule: impl Iterator<Item = ([f64; 2], f64)>,
        at: impl Fn([f64; 2]) -> OnRing,
    ) -> Self {
        let mut moments = Moments::default();
        for (turn, weight) in rule {
            add(&mut moments, weight, at(turn).moments(turn));
        }
        Self::of_moments(radius_arcsec, moments)
    }

    fn of_moments(radius: f64, [gamma, f, g, disc_gamma, disc_f, disc_g, square]: Moments) -> Self {
        let spread = (square.re - gamma.norm_sqr()).max(0.0);
        let delta = (2.0 * spread / gamma.norm_sqr()).sqrt();
        let ring = Averaged { gamma, f_per_arcsec: f, g_per_arcsec: g, delta };
        let [gamma, f, g] = [disc_gamma, disc_f, disc_g].map(|sum| sum / radius);
        let flexion = 2.0 * radius * radius * (f.norm_sqr() + g.norm_sqr());
        let delta = (flexion / gamma.norm_sqr()).sqrt();
        Self { ring, disc: Averaged { gamma, f_per_arcsec: f, g_per_arcsec: g, delta } }
    }

    /// Averages over the ring of that radius about the axis of a line of sight, from observer to source.
    ///
    /// Eight rays are traced; what they miss of the haloes near the ring is added to first order in these haloes.
    pub fn of_sight(sight: &LineOfSight, radius_arcsec: f64) -> Self {
        let circle = sight.circle(radius_arcsec);
        let traced: [OnRing; RAYS] = std::array::from_fn(|i| {
            let (rays, theta) = (&circle.rays, turn(circle.angles[i]).map(|c| radius_arcsec * c));
            let d = Distortion::of_ray(&rays.jacobian[i], &rays.second_per_arcsec[i]);
            let [x, y] = [0, 1].map(|c| theta[c] - rays.beta_arcsec[i][c]);
            let (f_per_arcsec, g_per_arcsec) = (d.f_per_arcsec, d.g_per_arcsec);
            OnRing { deflection: Complex::new(x, y), gamma: d.tidal.gamma, f_per_arcsec, g_per_arcsec }
        });
        let mut moments = Moments::default();
        for (ray, angle) in traced.iter().zip(circle.angles) {
            add(&mut moments, 1.0 / RAYS as f64, ray.moments(turn(angle)));
        }
        for halo in &circle.near {
            let missed = halo.missed(|angle, halo| flat(OnRing::of_halo(halo).moments(turn(angle))));
            add(&mut moments, 1.0, std::array::from_fn(|k| Complex::new(missed[2 * k], missed[2 * k + 1])));
        }
        moments[6] = mean_square(&traced.map(|ray| ray.gamma), &circle).into();
        Self::of_moments(radius_arcsec, moments)
    }
}

/// ⟨|γ|²⟩: of near haloes where they are, and of all else as a wave through what the rays have of it.
fn mean_square(traced: &[Complex<f64>; RAYS], circle: &Circle) -> f64 {
    const PLACES: usize = 6 * RAYS;
    let sum = |of: &dyn Fn(&Meeting) -> Distorts| -> Complex<f64> {
        circle.near.iter().map(|halo| OnRing::of_halo(&of(halo)).gamma).sum()
    };
    let rest = std::array::from_fn(|i| traced[i] - sum(&|halo| halo.to_ray(i)));
    let wave = CircleWave::through(&circle.angles, &rest);
    let square = |k: usize| {
        let angle = TAU * k as f64 / PLACES as f64;
        (wave.at(angle) + sum(&|halo| halo.at(angle))).norm_sqr()
    };
    (0..PLACES).map(square).sum::<f64>() / PLACES as f64
}

fn add(sum: &mut Moments, weight: f64, moments: Moments) {
    sum.iter_mut().zip(moments).for_each(|(sum, moment)| *sum += moment * weight);
}

fn flat(moments: Moments) -> [f64; 14] {
    std::array::from_fn(|k| if k % 2 == 0 { moments[k / 2].re } else { moments[k / 2].im })
}
