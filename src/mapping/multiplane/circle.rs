//! Averages over a circle about the axis: eight rays are traced, and what these miss of the haloes near the circle is added.
//!
//! A halo at d > 3R varies so little along a circle of radius R that eight rays average its shear to (R/d)⁸. Of the others,
//! which rise as 1/r or ln r where the circle passes them, the average over the curve in which the circle meets their plane is
//! taken by a rule whose nodes crowd at the halo, and that over the places of the eight rays is taken away.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Complex;

use super::kick::{Distortion, Kick};
use super::line_of_sight::LineOfSight;
use super::plane::Plane;
use super::recursion::{FEW, FewRays};
use crate::mapping::RayBundle;
use crate::numerics::circle_rule;

/// A halo acts on a circle otherwise than through eight rays within so many radii.
const NEAR: f64 = 3.0;

/// Rays of a circle.
pub(crate) const RAYS: usize = FEW;

/// (cos φ, sin φ).
pub(crate) fn turn(angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos, sin]
}

/// The angles φ of equally spaced rays, the first of which is at `first`.
fn angles_from(first: f64) -> [f64; RAYS] {
    std::array::from_fn(|i| first + TAU * i as f64 / RAYS as f64)
}

/// A traced circle about the axis.
pub(crate) struct Circle {
    /// Where on it the rays are, φ.
    pub angles: [f64; RAYS],
    /// The rays, from observer to source with second derivatives.
    pub rays: RayBundle,
    /// The haloes near it.
    pub near: Vec<Meeting>,
}

/// Planes of haloes near a circle, and rays of it that keep off them.
pub(super) struct Nearby {
    /// Indices of planes, ascending.
    planes: Vec<usize>,
    pub angles: [f64; RAYS],
}

/// What a halo alone does to a ray, reduced to the source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distorts {
    /// α, arcsec.
    pub deflection_arcsec: [f64; 2],
    /// H = ∂α/∂θ (xx, xy, yy).
    pub hessian: [f64; 3],
    /// ∂H/∂θ (xxx, xxy, xyy, yyy) per arcsec.
    pub third_per_arcsec: [f64; 4],
}

/// A halo near the circle and where the circle meets its plane.
#[derive(Debug, Clone)]
pub(crate) struct Meeting {
    /// Comoving distance, Mpc.
    pub chi_cmpc: f64,
    /// The halo at the origin, without its sheet.
    plane: Plane,
    /// 1/f: from the change of a slope to the deflection reduced to the source.
    reduced: f64,
    angles: [f64; RAYS],
    /// Where the rays are, seen from the halo, arcsec.
    places: [Complex<f64>; RAYS],
    /// The curve through these places.
    curve: CircleWave,
}

/// What has a value at every ray of a circle as a function of φ: Σ cₘ e^{imψ}, m = −3 … 3, and c₄ cos 4ψ, ψ from the first ray on.
#[derive(Debug, Clone)]
pub(crate) struct CircleWave {
    first: f64,
    modes: [Complex<f64>; RAYS],
}

impl CircleWave {
    /// With these values at rays of these angles.
    pub fn through(angles: &[f64; RAYS], values: &[Complex<f64>; RAYS]) -> Self {
        let back = angles_from(0.0).map(turn).map(|[cos, sin]| Complex::new(cos, -sin));
        let mode = |m: usize| (0..RAYS).map(|i| values[i] * back[(i * m) % RAYS]).sum::<Complex<f64>>();
        Self { first: angles[0], modes: std::array::from_fn(|m| mode(m) / RAYS as f64) }
    }

    /// At φ.
    pub fn at(&self, angle: f64) -> Complex<f64> {
        let [cos, sin] = turn(angle - self.first);
        let (turn, mut power, mut sum) = (Complex::new(cos, sin), Complex::new(1.0, 0.0), self.modes[0]);
        for m in 1..RAYS / 2 {
            power *= turn;
            sum += self.modes[m] * power + self.modes[RAYS - m] * power.conj();
        }
        sum + self.modes[RAYS / 2] * (power * turn).re
    }
}

impl Meeting {
    fn new(plane: &Plane, chi_source_cmpc: f64, angles: &[f64; RAYS], places: [Complex<f64>; RAYS]) -> Self {
        Self {
            chi_cmpc: plane.chi_cmpc,
            plane: Plane { centre_arcsec: [0.0; 2], f_sheet: 0.0, ..*plane },
            reduced: (chi_source_cmpc - plane.chi_cmpc) / chi_source_cmpc,
            curve: CircleWave::through(angles, &places),
            angles: *angles,
            places,
        }
    }

    fn distorts(&self, at: Complex<f64>) -> Distorts {
        let (mut f_alpha_arcsec, mut distortion) = ([0.0; 2], Distortion::none());
        let turn = |_, kick: Kick| f_alpha_arcsec = kick.f_alpha_arcsec;
        self.plane.kick::<2, 1>(&[[at.re], [at.im]], 1.0, &mut distortion, turn);
        Distorts {
            deflection_arcsec: f_alpha_arcsec.map(|a| a * self.reduced),
            hessian: distortion.h.map(|[h]| h * self.reduced),
            third_per_arcsec: distortion.t.map(|[t]| t * self.reduced),
        }
    }

    /// What the halo does to ray `i`.
    pub fn to_ray(&self, i: usize) -> Distorts {
        self.distorts(self.places[i])
    }

    /// What the halo does to the circle at φ.
    pub fn at(&self, angle: f64) -> Distorts {
        self.distorts(self.curve.at(angle))
    }

    /// The average over the circle of `of` (φ and what the halo does there), minus that over the rays.
    pub fn missed<const K: usize>(&self, of: impl Fn(f64, &Distorts) -> [f64; K]) -> [f64; K] {
        let mut sum = [0.0; K];
        let mut add = |weight: f64, values: [f64; K]| {
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        };
        let (nearest, distance) = self.nearest();
        for (angle, weight) in circle_rule::around(nearest, distance) {
            add(weight, of(angle, &self.at(angle)));
        }
        for (i, &angle) in self.angles.iter().enumerate() {
            add(-1.0 / RAYS as f64, of(angle, &self.to_ray(i)));
        }
        sum
    }

    /// The angle at which the curve is nearest to the halo, and how near, in radii.
    fn nearest(&self) -> (f64, f64) {
        let [centre, radius] = [self.curve.modes[0], self.curve.modes[1]];
        let mut angle = self.curve.first + (-centre / radius).arg();
        let distance = (centre.norm() / radius.norm()).ln().abs();
        if distance > 0.5 {
            return (angle, distance);
        }
        // Two steps of Newton towards Re(z̄ dz/dφ) = 0, as on a circle that goes by at a small distance.
        let step = 1e-3;
        for _ in 0..2 {
            let here = self.curve.at(angle);
            let by_angle = (self.curve.at(angle + step) - here) / step;
            angle -= (here.conj() * by_angle).re / by_angle.norm_sqr();
        }
        (angle, self.curve.at(angle).norm() / radius.norm())
    }
}

impl LineOfSight {
    /// A circle of that radius about the axis, traced from observer to source.
    pub(crate) fn circle(&self, radius_arcsec: f64) -> Circle {
        let nearby = self.nearby(|_| radius_arcsec);
        let theta = nearby.angles.map(|angle| turn(angle).map(|c| radius_arcsec * c));
        let mut rays = FewRays::start(0.0, [0.0; 2], [0.0; 2], &theta);
        let near = self.through_meeting::<2>(&mut rays, 0..self.planes.len(), &nearby);
        rays.advance::<2>(self.chi_source_cmpc);
        let origin = self.origin(self.chi_source_cmpc).x;
        let rays = rays.bundle::<2>(RAYS, origin, self.chi_source_cmpc);
        Circle { angles: nearby.angles, rays, near }
    }

    /// The haloes near a circle about the axis that has the radius `radius_arcsec` at a comoving distance, and rays that keep off them.
    pub(super) fn nearby(&self, radius_arcsec: impl Fn(f64) -> f64) -> Nearby {
        let (mut planes, mut offsets) = (Vec::new(), Vec::new());
        for (i, plane) in self.planes.iter().enumerate() {
            let (radius, axis) = (radius_arcsec(plane.chi_cmpc), self.axis.at_plane(i));
            let off = [0, 1].map(|c| (plane.centre_arcsec[c] - axis[c]).abs());
            let near = NEAR * radius;
            if off[0] < near && off[1] < near && off[0].hypot(off[1]) < near {
                planes.push(i);
                offsets.push([0, 1].map(|c| (plane.centre_arcsec[c] - axis[c]) / radius));
            }
        }
        /// Turns of the rays that are compared: next to a halo what is left of an error of a few per cent would rise as 1/r.
        const TURNS: usize = 16;
        let clearance = |angles: &[f64; RAYS]| {
            let square = |[x, y]: [f64; 2], off: &[f64; 2]| (x - off[0]).powi(2) + (y - off[1]).powi(2);
            let turns = angles.map(turn);
            offsets.iter().flat_map(|off| turns.map(|at| square(at, off))).fold(f64::INFINITY, f64::min)
        };
        let turned = |k: usize| angles_from(TAU * k as f64 / (TURNS * RAYS) as f64);
        let mut best = (turned(0), clearance(&turned(0)));
        for k in 1..TURNS {
            let this = (turned(k), clearance(&turned(k)));
            if this.1 > best.1 {
                best = this;
            }
        }
        Nearby { planes, angles: best.0 }
    }

    /// Carries the rays of a circle through planes and notes where they meet the haloes near it.
    pub(super) fn through_meeting<const ORDER: usize>(
        &self,
        rays: &mut FewRays,
        planes: Range<usize>,
        nearby: &Nearby,
    ) -> Vec<Meeting> {
        let (mut meetings, mut next) = (Vec::new(), planes.start);
        for &i in nearby.planes.iter().filter(|i| planes.contains(i)) {
            let plane = &self.planes[i];
            rays.through::<ORDER>(&self.planes[next..i]);
            rays.advance::<ORDER>(plane.chi_cmpc);
            next = i;
            let place = |ray: usize| {
                let [x, y] = [0, 1].map(|c| rays.x[c][ray] * plane.inv_chi - plane.centre_arcsec[c]);
                Complex::new(x, y)
            };
            let places = std::array::from_fn(place);
            meetings.push(Meeting::new(plane, self.chi_source_cmpc, &nearby.angles, places));
        }
        rays.through::<ORDER>(&self.planes[next..planes.end]);
        meetings
    }
}
