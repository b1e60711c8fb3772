//! A main lens in a tidal line of sight, as a [`Mapping`].

use nalgebra::Complex;
use rayon::prelude::*;

use super::equation::{Equation, deflection};
use super::jet::Jet;
use super::model::LineOfSightModel;
use crate::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::numerics::complex::Cx;
use crate::numerics::dispatch::kernel;
use crate::numerics::real::{LANES, Lanes};
use crate::profile::mass::{MassModel, MassProfile};

/// One or more mass profiles in one plane, seen through a tidal model of the line of sight.
#[derive(Debug, Clone)]
pub struct TidalLens {
    /// The line of sight.
    pub model: LineOfSightModel,
    /// The main lens: its profiles add up.
    pub lenses: Vec<MassModel>,
    /// D_Δt = χ_d χ_s/(χ_s − χ_d) in Mpc, for delays; `None` where no redshifts are known.
    pub time_delay_distance_mpc: Option<f64>,
}

impl TidalLens {
    /// A lens of which no redshifts are known.
    pub fn new(model: LineOfSightModel, lenses: Vec<MassModel>) -> Self {
        Self { model, lenses, time_delay_distance_mpc: None }
    }

    /// β of rays alone, lanes at a time.
    fn positions(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let equation = Equation::of(&self.model);
        let mut rays = RayBundle { beta_arcsec: vec![[0.0; 2]; theta_arcsec.len()], ..RayBundle::default() };
        for (theta, out) in theta_arcsec.chunks(LANES).zip(rays.beta_arcsec.chunks_mut(LANES)) {
            let beta = beta(&equation, &self.lenses, &lanes(theta));
            for (i, out) in out.iter_mut().enumerate() {
                *out = [beta.re.0[i], beta.im.0[i]];
            }
        }
        rays
    }

    /// β of rays with derivatives, `S` = 0 second ones or all 3: what the lenses do in lanes, the equation ray by ray.
    fn expansions<const S: usize>(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let equation = Equation::of(&self.model);
        let n = theta_arcsec.len();
        let mut rays = RayBundle {
            beta_arcsec: Vec::with_capacity(n),
            jacobian: Vec::with_capacity(n),
            second_per_arcsec: Vec::with_capacity(if S > 0 { n } else { 0 }),
        };
        for block in theta_arcsec.chunks(LANES) {
            let theta = lanes(block);
            let at_lens = self.expand(equation.at_lens_lanes(&theta));
            let at_theta = matches!(equation, Equation::Flexion(_)).then(|| self.expand(theta));
            for (i, &[x, y]) in block.iter().enumerate() {
                let theta = Jet::<S>::theta(x, y);
                let alpha_d = self.deflected(equation.at_lens(theta), &at_lens, i);
                let alpha = at_theta.as_ref().map_or(alpha_d, |lenses| self.deflected(theta, lenses, i));
                let beta = equation.beta(theta, alpha_d, alpha);
                rays.beta_arcsec.push([beta.value.re, beta.value.im]);
                rays.jacobian.push(components(&beta.first));
                if S > 0 {
                    rays.second_per_arcsec.push(components(&beta.second));
                }
            }
        }
        rays
    }

    /// Deflection and Hessian of all lenses in every lane.
    fn expand(&self, at: Cx<Lanes>) -> (Cx<Lanes>, [Lanes; 3]) {
        let (mut alpha, mut hessian) = (Cx::zero(), [Lanes::ZERO; 3]);
        for lens in &self.lenses {
            let (own, own_hessian) = lens.expansion_lanes(at.re, at.im);
            alpha += own;
            hessian.iter_mut().zip(own_hessian).for_each(|(sum, own)| *sum += own);
        }
        (alpha, hessian)
    }

    /// The deflection of a ray that meets the lenses at `at`, with `(alpha, hessian)` of its lane there.
    #[inline(always)]
    fn deflected<const S: usize>(
        &self,
        at: Jet<S>,
        (alpha, hessian): &(Cx<Lanes>, [Lanes; 3]),
        lane: usize,
    ) -> Jet<S> {
        let mut third = [0.0; 4];
        if S > 0 {
            for lens in &self.lenses {
                let own = lens.third_derivatives(at.value.re, at.value.im);
                third.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
            }
        }
        at.deflected(alpha.lane(lane), [hessian[0].0[lane], hessian[1].0[lane], hessian[2].0[lane]], third)
    }

    /// θ_d: where a ray seen at θ meets the lens.
    pub(super) fn at_lens(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = Equation::of(&self.model).at_lens(Complex::new(x, y));
        [at.re, at.im]
    }
}

impl Mapping for TidalLens {
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle> {
        /// Rays that go to a thread together.
        const BLOCK: usize = 8 * LANES;
        RayBundle::in_blocks(theta_arcsec, BLOCK, monitor, |theta| match order {
            Order::Position => self.positions(theta),
            Order::Jacobian => self.expansions::<0>(theta),
            Order::SecondDerivatives => self.expansions::<3>(theta),
        })
    }

    /// D_Δt/c times the Fermat potential of each ray at its own β; not a number where no redshifts are known.
    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let days =
            self.time_delay_distance_mpc.unwrap_or(f64::NAN) * MPC_OVER_C_DAYS * ARCSEC_RAD * ARCSEC_RAD;
        theta_arcsec.par_iter().map(|&theta| self.ray_fermat_arcsec2(theta) * days).collect()
    }
}

kernel! {
    /// β of rays in lanes.
    fn beta(equation: &Equation, lenses: &[MassModel], theta: &Cx<Lanes>) -> Cx<Lanes> {
        let alpha_d = deflection(lenses, &equation.at_lens_lanes(theta));
        match equation {
            Equation::Full { .. } => equation.beta_lanes(theta, &alpha_d, &alpha_d),
            Equation::Flexion(_) => equation.beta_lanes(theta, &alpha_d, &deflection(lenses, theta)),
        }
    }
}

/// At most [`LANES`] rays, the last one again where there are fewer.
#[inline(always)]
fn lanes(theta: &[[f64; 2]]) -> Cx<Lanes> {
    let mut lanes = Cx::new(Lanes::ZERO, Lanes::ZERO);
    for i in 0..LANES {
        [lanes.re.0[i], lanes.im.0[i]] = theta[i.min(theta.len() - 1)];
    }
    lanes
}

/// Derivatives of β_x, then those of β_y.
#[inline(always)]
fn components<const N: usize, const M: usize>(derivatives: &[Cx<f64>; N]) -> [f64; M] {
    let mut components = [0.0; M];
    for i in 0..N {
        (components[i], components[N + i]) = (derivatives[i].re, derivatives[i].im);
    }
    components
}

#[cfg(test)]
mod tests {
    use super::super::{Flexion, FlexionModel, Tidal};
    use super::*;
    use crate::profile::mass::{Epl, Nfw};

    #[test]
    fn rays_are_the_same_whatever_is_asked_of_them() {
        let tidal = Tidal { kappa: 0.05, gamma: Complex::new(0.03, -0.1), omega: 0.02 };
        let flexion = Flexion { f: Complex::new(0.01, 0.02), g: Complex::new(-0.01, 0.0) };
        let flexed = FlexionModel::minimal(tidal, tidal, flexion, flexion, flexion);
        let lenses = vec![
            MassModel::Epl(Epl::new(1.4, 2.2, [0.1, -0.05], [0.02, 0.03]).unwrap()),
            MassModel::Nfw(Nfw::new(3.0, 0.2, [0.5, -0.4]).unwrap()),
        ];
        let theta: Vec<[f64; 2]> =
            (0..300).map(|i| [1e-2 * f64::from(i) - 1.5, 0.7 - 3e-3 * f64::from(i)]).collect();
        for model in [LineOfSightModel::Minimal { od: tidal, los: tidal }, LineOfSightModel::Flexion(flexed)]
        {
            let lens = TidalLens::new(model, lenses.clone());
            let all = lens.map(&theta, Order::SecondDerivatives);
            assert_eq!(lens.map(&theta, Order::Position).beta_arcsec, all.beta_arcsec);
            let first = lens.map(&theta, Order::Jacobian);
            assert_eq!((&first.beta_arcsec, &first.jacobian), (&all.beta_arcsec, &all.jacobian));
            assert!(first.second_per_arcsec.is_empty());
        }
    }
}
