//! Adaptive tracing: the cost follows what varies across the field, every ray carries a bound on its error.
//!
//! Haloes that a polynomial of low degree follows across the field are smooth. The rays that they and the sheets bend
//! (the skeleton) are traced exactly at a few Chebyshev nodes and interpolated. A ray then meets only the rough haloes;
//! its deviation from the skeleton feels the smooth ones through their tides. docs/ADAPTIVE_TRACING.md derives the bound.

mod chebyshev;
mod classify;
mod deviation;
mod polynomial_kick;
mod skeleton;

pub use chebyshev::Field;

use rand::RngExt;
use rayon::prelude::*;

use super::recursion::TILE;
use super::segment::Segment;
use crate::error::{Result, require};
use crate::mapping::{Mapping, Order, RayBundle};
use crate::numerics::random::{Stage, stream};
use skeleton::{Skeleton, Stretch, Tolerances};

/// A segment traced to a stated accuracy instead of exactly.
///
/// Positions inside the field come from skeleton and rough haloes, each with a bound on its error; a ray whose bound
/// exceeds the accuracy, derivatives, delays and rays outside the field are traced exactly.
pub struct AdaptiveSegment<'a> {
    exact: Segment<'a>,
    accuracy_arcsec: f64,
    field: Field,
    /// None where exact tracing is cheaper or the bounds cannot be met.
    skeleton: Option<Skeleton>,
}

/// How accurate an adaptive trace was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccuracyReport {
    /// Largest accepted bound of |β − β_exact| over the rays, arcsec; 0 when all were traced exactly.
    pub bound_arcsec: f64,
    /// Largest |β − β_exact| over the random rays, arcsec.
    pub measured_arcsec: f64,
    /// Random rays compared.
    pub rays_compared: usize,
    /// Haloes met one by one; all of them when exact.
    pub rough_haloes: usize,
    /// Rays traced exactly because their bound exceeded the accuracy.
    pub rays_traced_exactly: usize,
}

/// Nodes a side, tried in turn until the bounds meet the accuracy.
const NODES: [usize; 2] = [12, 16];
/// Part of the accuracy that smooth haloes may use up by what their polynomials leave.
const SMOOTH_SHARE: f64 = 0.05;
/// Part of the accuracy that leaving out the highest degrees of a path may use: rough haloes pass on a hundredth.
const PATH_SHARE: f64 = 0.05;
/// What leaving out the highest degrees of the tides may change in a deviation.
const TIDE_PRECISION: f64 = 3e-7;
/// Cost of a node through a plane, of a ray past a rough halo and of its tides, in ray-planes of exact tracing.
const COST_NODE: f64 = 2.5;
const COST_ROUGH: f64 = 5.0;
const COST_TIDES: f64 = 1000.0;
/// Adaptive tracing is tried where it promises to cost less than this part of exact tracing.
const WORTHWHILE: f64 = 0.7;

impl<'a> Segment<'a> {
    /// Prepares adaptive tracing of about `rays` rays inside `field`, |β − β_exact| ≤ `accuracy_arcsec` for each.
    ///
    /// # Errors
    /// Unless the accuracy is a positive number.
    pub fn adaptive(&self, field: Field, accuracy_arcsec: f64, rays: usize) -> Result<AdaptiveSegment<'a>> {
        require(accuracy_arcsec > 0.0, "accuracy_arcsec", accuracy_arcsec, "a positive number")?;
        let skeleton = self.skeleton(&field, accuracy_arcsec, rays);
        Ok(AdaptiveSegment { exact: *self, accuracy_arcsec, field, skeleton })
    }

    fn skeleton(&self, field: &Field, accuracy_arcsec: f64, rays: usize) -> Option<Skeleton> {
        let possible = self.lens.is_none() && field.half_arcsec.iter().all(|h| *h > 0.0 && h.is_finite());
        let exact_cost = (rays * self.planes.len()) as f64;
        if !possible || exact_cost <= COST_NODE * (TILE * self.planes.len()) as f64 {
            return None;
        }
        let slope = [0, 1].map(|c| self.s_start[c] + field.centre_arcsec[c]);
        let central = classify::central_ray(self.planes, self.chi_start, self.x_start, slope);
        let reaches = classify::reaches(self.planes, &central, self.chi_start, self.chi_end);
        let tolerances = Tolerances { path_arcsec: PATH_SHARE * accuracy_arcsec, tide: TIDE_PRECISION };
        for n in NODES {
            let remainders = classify::remainders(&reaches, field.radius_arcsec(), n - 1);
            let limit = classify::threshold(&remainders, SMOOTH_SHARE * accuracy_arcsec);
            let is_rough: Vec<bool> = remainders.iter().map(|r| !(*r <= limit)).collect();
            let rough = is_rough.iter().filter(|r| **r).count() as f64;
            let nodes = ((n * n).div_ceil(TILE) * TILE) as f64;
            let a_ray = COST_ROUGH * rough + COST_TIDES;
            let cost = COST_NODE * nodes * self.planes.len() as f64 + rays as f64 * a_ray;
            if cost > WORTHWHILE * exact_cost {
                continue;
            }
            let stretch = Stretch {
                planes: self.planes,
                is_rough: &is_rough,
                central: &central,
                reaches: &reaches,
                chi_start: self.chi_start,
                chi_end: self.chi_end,
                x_start: self.x_start,
                s_start: self.s_start,
            };
            if let Some(skeleton) = stretch.skeleton(field, n, tolerances)
                && self.mostly_within(&skeleton, field, accuracy_arcsec)
            {
                return Some(skeleton);
            }
        }
        None
    }

    /// True when the bounds of four fifths of a tile of rays, spread over the field, meet the accuracy.
    fn mostly_within(&self, skeleton: &Skeleton, field: &Field, accuracy_arcsec: f64) -> bool {
        let probe = |i: usize| {
            let at = |c: usize, step: f64| {
                let part = (step * (i as f64 + 0.5)).fract();
                field.centre_arcsec[c] + field.half_arcsec[c] * (2.0 * part - 1.0)
            };
            // The additive recurrence of the plastic number fills a square evenly (Roberts 2018).
            [at(0, 0.754_877_666_246_692_8), at(1, 0.569_840_290_998_053_3)]
        };
        let theta: Vec<[f64; 2]> = (0..TILE).map(probe).collect();
        let largest = accuracy_arcsec * (self.chi_end - self.chi_start);
        let within =
            deviation::trace(skeleton, field, &theta).error.iter().filter(|e| **e <= largest).count();
        if std::env::var("FARDBG").is_ok() {
        let t0 = std::time::Instant::now();
        for _ in 0..20 { std::hint::black_box(deviation::trace(skeleton, field, &theta)); }
        let t = t0.elapsed();
        let pt: usize = skeleton.rough.iter().map(|r| r.path.len()).sum();
        let ht: usize = skeleton.tides.iter().map(|r| r.0.len()).sum();
        let tt: usize = skeleton.tides.iter().map(|r| r.1.len()).sum();
        let mut e = deviation::trace(skeleton, field, &theta).error.map(|e| e/self.chi_end); e.sort_by(f64::total_cmp);
        eprintln!("n {} tile {:?} rough {} borders {} mean terms {} {} {} within {within} err {:e} {:e} {:e}", skeleton.nodes, t/20, skeleton.rough.len(), skeleton.tides.len(), pt/skeleton.rough.len(), ht/skeleton.tides.len(), tt/skeleton.tides.len(), e[0],e[24],e[47]);
        }
        std::env::var("MASK").is_ok() || 5 * within >= 4 * TILE
    }
}

impl AdaptiveSegment<'_> {
    /// False when every ray is traced exactly.
    pub fn is_adaptive(&self) -> bool {
        self.skeleton.is_some()
    }

    /// β of every ray, the largest accepted bound of its error (arcsec), and the number of rays traced exactly.
    pub fn positions(&self, theta_arcsec: &[[f64; 2]]) -> (Vec<[f64; 2]>, f64, usize) {
        let exactly = |theta: &[[f64; 2]]| self.exact.map(theta, Order::Position).beta_arcsec;
        let Some(skeleton) = &self.skeleton else { return (exactly(theta_arcsec), 0.0, theta_arcsec.len()) };
        let scale = 1.0 / (self.exact.chi_end - self.exact.chi_start);
        let tile = |theta: &[[f64; 2]]| {
            let ends = deviation::trace(skeleton, &self.field, theta);
            let ray = |i: usize| {
                let beta = [0, 1].map(|c| (ends.x[c][i] - self.exact.x_axis_end[c]) * scale);
                let bound = if self.field.contains(theta[i]) { ends.error[i] * scale } else { f64::INFINITY };
                (beta, bound)
            };
            (0..theta.len()).map(ray).collect::<Vec<_>>()
        };
        let rays: Vec<([f64; 2], f64)> = theta_arcsec.par_chunks(TILE).flat_map_iter(tile).collect();
        if std::env::var("MASK").is_ok() {
            let mut b: Vec<f64> = rays.iter().map(|r| r.1).collect();
            b.sort_by(f64::total_cmp);
            eprintln!("bounds {:e} {:e} {:e} {:e}", b[0], b[b.len()/2], b[b.len()*9/10],b[b.len()-1]);
            return (rays.into_iter().map(|r| r.0).collect(), 0.0, 0);
        }
        let accepted = |bound: f64| bound <= self.accuracy_arcsec;
        let refused: Vec<usize> = (0..rays.len()).filter(|&i| !accepted(rays[i].1)).collect();
        let again: Vec<[f64; 2]> = refused.iter().map(|&i| theta_arcsec[i]).collect();
        let bound = rays.iter().map(|r| r.1).filter(|b| accepted(*b)).fold(0.0, f64::max);
        let mut beta: Vec<[f64; 2]> = rays.into_iter().map(|r| r.0).collect();
        for (&i, exact) in refused.iter().zip(exactly(&again)) {
            beta[i] = exact;
        }
        (beta, bound, refused.len())
    }

    /// Compares with the exact recursion on `rays` random rays of the field and returns what was promised and found.
    pub fn check(&self, theta_arcsec: &[[f64; 2]], rays: usize, seed: u64) -> AccuracyReport {
        let (_, bound_arcsec, rays_traced_exactly) = self.positions(theta_arcsec);
        self.report(bound_arcsec, rays_traced_exactly, rays, seed)
    }

    /// The report of a trace whose bound and number of exact rays are known.
    pub fn report(
        &self,
        bound_arcsec: f64,
        rays_traced_exactly: usize,
        rays: usize,
        seed: u64,
    ) -> AccuracyReport {
        let mut rng = stream(seed, 0, Stage::AccuracyCheck, 0);
        let mut coordinate = |c: usize| {
            self.field.centre_arcsec[c] + self.field.half_arcsec[c] * (2.0 * rng.random::<f64>() - 1.0)
        };
        let theta: Vec<[f64; 2]> = (0..rays).map(|_| [coordinate(0), coordinate(1)]).collect();
        let exact = self.exact.map(&theta, Order::Position).beta_arcsec;
        let errors =
            self.positions(&theta).0.into_iter().zip(exact).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        AccuracyReport {
            bound_arcsec,
            measured_arcsec: errors.fold(0.0, f64::max),
            rays_compared: rays,
            rough_haloes: self.skeleton.as_ref().map_or(self.exact.planes.len(), |s| s.rough.len()),
            rays_traced_exactly,
        }
    }
}

impl Mapping for AdaptiveSegment<'_> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        match order {
            Order::Position => {
                RayBundle { beta_arcsec: self.positions(theta_arcsec).0, ..RayBundle::default() }
            }
            _ => self.exact.map(theta_arcsec, order),
        }
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.exact.delay_days(theta_arcsec)
    }
}
