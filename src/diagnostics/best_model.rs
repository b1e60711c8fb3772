//! The tidal or flexion model nearest to a traced mapping: least squares over the rays that carry light.
//!
//! β_traced ≈ T·β̃(θ; line of sight, lens) + t, free in the shears (and flexions) of the minimal model, in the lens's own
//! parameters and in the linear source transformation T, t: what an image with an unknown source can tell at best.

use nalgebra::{Complex, DMatrix, DVector};

use crate::error::Result;
use crate::mapping::Rays;
use crate::mapping::tidal::{LensResponse, LineOfSightKind, Tidal};
use crate::numerics::complex::Cx;
use crate::numerics::real::LANES;
use crate::profile::mass::{Epl, MassModel};

/// A tidal model fitted to a traced mapping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BestModel {
    /// Observer to lens; κ and ω are 0 by convention.
    pub od: Tidal,
    /// A_LOS; κ is 0 by convention.
    pub los: Tidal,
    /// Weighted root mean square of |β_traced − β_model| that is left, arcsec.
    pub residual_arcsec: f64,
}

/// Rays through haloes and lens with the weights of their squared residuals.
pub struct WeightedRays<'a> {
    /// Directions, arcsec.
    pub theta_arcsec: &'a [[f64; 2]],
    /// Where they come from, arcsec.
    pub beta_arcsec: &'a [[f64; 2]],
    /// Weights, not negative.
    pub weights: &'a [f64],
}

/// Numbers of the lens: θ_E, slope, e1, e2, x, y.
const LENS: usize = 6;
/// Numbers of the source transformation: T and t.
const SOURCE: usize = 6;
const NO_TRANSFORMATION: [f64; SOURCE] = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

impl BestModel {
    /// Fits the minimal model from a start, shears of od and LOS and the lens, and from its end the flexion-minimal model.
    ///
    /// # Errors
    /// When the lens to start from cannot be.
    pub fn tidal_and_flexion(
        rays: &WeightedRays,
        start: (&Tidal, &Tidal),
        lens: [f64; LENS],
    ) -> Result<[Self; 2]> {
        let minimal = Problem::new(rays, LineOfSightKind::Minimal, start, lens, NO_TRANSFORMATION);
        let (tidal, p) = minimal.solve()?;
        let beyond = LineOfSightKind::Minimal.parameters().len();
        let lens = std::array::from_fn(|i| p[beyond + i]);
        let source = std::array::from_fn(|i| p[beyond + LENS + i]);
        let kind = LineOfSightKind::FlexionMinimal;
        let (flexion, _) = Problem::new(rays, kind, (&tidal.od, &tidal.los), lens, source).solve()?;
        Ok([tidal, flexion])
    }
}

struct Problem<'a> {
    rays: &'a WeightedRays<'a>,
    lanes: Rays,
    kind: LineOfSightKind,
    /// Which numbers of the line of sight are free: all but κ and ω_od.
    free: Vec<usize>,
    /// Numbers of the line of sight, the lens, T (xx, xy, yx, yy) and t.
    start: Vec<f64>,
}

impl<'a> Problem<'a> {
    fn new(
        rays: &'a WeightedRays<'a>,
        kind: LineOfSightKind,
        (od, los): (&Tidal, &Tidal),
        lens: [f64; LENS],
        source: [f64; SOURCE],
    ) -> Self {
        let names: Vec<&str> = kind.parameters().iter().map(|parameter| parameter.name).collect();
        let free = (0..names.len()).filter(|&i| !names[i].starts_with("kappa") && names[i] != "omega_od");
        let number = |name: &&str| match *name {
            "gamma1_od" => od.gamma.re,
            "gamma2_od" => od.gamma.im,
            "gamma1_los" => los.gamma.re,
            "gamma2_los" => los.gamma.im,
            "omega_los" => los.omega,
            _ => 0.0,
        };
        let mut start: Vec<f64> = names.iter().map(number).collect();
        start.extend(lens);
        start.extend(source);
        Self { rays, lanes: Rays::new(rays.theta_arcsec), kind, free: free.collect(), start }
    }

    /// Columns of the parameters that move, in `start`.
    fn moving(&self) -> Vec<usize> {
        self.free.iter().copied().chain(self.kind.parameters().len()..self.start.len()).collect()
    }

    /// Weighted residuals and their derivatives by what moves; `None` where there is no such lens.
    fn residuals(&self, p: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let numbers = self.kind.parameters().len();
        let [radius, slope, e1, e2, x, y, t_xx, t_xy, t_yx, t_yy, t_x, t_y] =
            <[f64; LENS + SOURCE]>::try_from(&p[numbers..]).ok()?;
        let lenses = [MassModel::Epl(Epl::new(radius, slope, [e1, e2], [x, y]).ok()?)];
        let response = LensResponse::new(self.kind, &p[..numbers], &lenses);
        let (n, moving) = (self.rays.theta_arcsec.len(), self.moving());
        let (mut residual, mut by) = (DVector::zeros(2 * n), DMatrix::zeros(2 * n, moving.len()));
        let mut columns = vec![Cx::zero(); numbers + LENS];
        for start in self.lanes.blocks() {
            let beta = response.respond(&self.lanes, start, &mut columns);
            for lane in 0..LANES.min(n - start.min(n)) {
                let (i, root) = (start + lane, self.rays.weights[start + lane].sqrt());
                let (bx, by_) = (beta.re.0[lane], beta.im.0[lane]);
                let model = [t_xx * bx + t_xy * by_ + t_x, t_yx * bx + t_yy * by_ + t_y];
                for c in 0..2 {
                    residual[2 * i + c] = root * (model[c] - self.rays.beta_arcsec[i][c]);
                }
                for (k, &column) in moving.iter().enumerate() {
                    let d = if column < numbers + LENS {
                        let (dx, dy) = (columns[column].re.0[lane], columns[column].im.0[lane]);
                        [t_xx * dx + t_xy * dy, t_yx * dx + t_yy * dy]
                    } else {
                        let [zero, one] = [0.0, 1.0];
                        match column - numbers - LENS {
                            0 => [bx, zero],
                            1 => [by_, zero],
                            2 => [zero, bx],
                            3 => [zero, by_],
                            4 => [one, zero],
                            _ => [zero, one],
                        }
                    };
                    (0..2).for_each(|c| by[(2 * i + c, k)] = root * d[c]);
                }
            }
        }
        Some((residual, by))
    }

    /// Levenberg–Marquardt from the start; the model and all its numbers.
    fn solve(&self) -> Result<(BestModel, Vec<f64>)> {
        const STEPS: usize = 60;
        const CONVERGED: f64 = 1e-10;
        let mut p = self.start.clone();
        let no_lens = || crate::Error::out_of_range("the main lens", "impossible", "a power law");
        let (mut residual, mut by) = self.residuals(&p).ok_or_else(no_lens)?;
        let mut damping = 1e-4;
        for _ in 0..STEPS {
            // `tr_mul` has the same bits on every processor, which nalgebra's product of two matrices has not.
            let (normal, downhill) = (by.tr_mul(&by), by.tr_mul(&residual));
            let mut damped = normal.clone();
            // Directions that rays do not see at all must not make it singular.
            let floor = 1e-14 * normal.trace();
            (0..damped.nrows()).for_each(|k| damped[(k, k)] += damping * normal[(k, k)] + floor);
            let step = damped.cholesky().map(|cholesky| cholesky.solve(&downhill));
            let moved = step.and_then(|step| {
                let mut moved = p.clone();
                self.moving().iter().enumerate().for_each(|(k, &column)| moved[column] -= step[k]);
                let (residual, by) = self.residuals(&moved)?;
                Some((moved, residual, by))
            });
            let before = residual.norm_squared();
            match moved.filter(|(_, new, _)| new.norm_squared() < before) {
                Some((moved, new, new_by)) => {
                    let gain = 1.0 - new.norm_squared() / before;
                    (p, residual, by) = (moved, new, new_by);
                    damping = (0.1 * damping).max(1e-12);
                    if gain < CONVERGED {
                        break;
                    }
                }
                None if damping > 1e6 => break,
                None => damping *= 10.0,
            }
        }
        let named = |name: &str| {
            let place = self.kind.parameters().iter().position(|parameter| parameter.name == name);
            place.map_or(0.0, |i| p[i])
        };
        let shear =
            |place: &str| Complex::new(named(&format!("gamma1_{place}")), named(&format!("gamma2_{place}")));
        let model = BestModel {
            od: Tidal { gamma: shear("od"), ..Tidal::NONE },
            los: Tidal { kappa: 0.0, gamma: shear("los"), omega: named("omega_los") },
            residual_arcsec: (residual.norm_squared() / self.rays.weights.iter().sum::<f64>()).sqrt(),
        };
        Ok((model, p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::tidal::{LineOfSightModel, TidalLens};
    use crate::mapping::{Mapping, Order};

    #[test]
    fn a_tidal_mapping_is_found_whatever_the_lens_and_source_are_called() {
        let tidal = |g1: f64, g2: f64, omega: f64| Tidal { kappa: 0.01, gamma: Complex::new(g1, g2), omega };
        let (od, os, ds) = (tidal(0.02, -0.01, 0.0), tidal(-0.03, 0.02, 0.001), tidal(0.01, 0.015, 0.0));
        let full = LineOfSightModel::Full { od, os, ds };
        let lens = [1.4, 2.3, 0.1, -0.05, 0.02, -0.01];
        let epl = Epl::new(lens[0], lens[1], [lens[2], lens[3]], [lens[4], lens[5]]).unwrap();
        let mapping =
            TidalLens { model: full, lenses: vec![MassModel::Epl(epl)], time_delay_distance_mpc: None };
        let theta: Vec<[f64; 2]> = (0..120)
            .map(|i| {
                let (sin, cos) = (0.37 * f64::from(i)).sin_cos();
                let r = 1.0 + 0.8 * (0.618 * f64::from(i)).fract();
                [r * cos, r * sin]
            })
            .collect();
        let beta = mapping.map(&theta, Order::Position).beta_arcsec;
        let weights: Vec<f64> = (0..120).map(|i| 1.0 + f64::from(i % 5)).collect();
        let rays = WeightedRays { theta_arcsec: &theta, beta_arcsec: &beta, weights: &weights };
        let start = [1.5, 2.2, 0.0, 0.0, 0.0, 0.0];
        let none = (&Tidal::NONE, &Tidal::NONE);
        let [best, flexion] = BestModel::tidal_and_flexion(&rays, none, start).unwrap();
        // To first order in the shears: the flexion model has no others.
        assert!(flexion.residual_arcsec < 2e-3 && (flexion.los.gamma - best.los.gamma).norm() < 0.01);
        let Some(LineOfSightModel::Minimal { los, .. }) = full.minimal() else { panic!() };
        // κ_od scales γ_od, κ_LOS scales γ_LOS: what is left when both are called 0.
        let reduced = [od.gamma / (1.0 - od.kappa), los.gamma / (1.0 - los.kappa)];
        assert!(best.residual_arcsec < 1e-9, "{:e}", best.residual_arcsec);
        assert!((best.od.gamma - reduced[0]).norm() < 1e-6 && (best.los.gamma - reduced[1]).norm() < 1e-6);
    }
}
