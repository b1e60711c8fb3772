//! A main lens in a tidal line of sight, as a [`Mapping`].

use nalgebra::Complex;
use rayon::prelude::*;

use super::algebra::Algebra;
use super::equation::Equation;
use super::jet::Jet;
use super::model::LineOfSightModel;
use crate::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes, Real};
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

    /// β of a ray as a function of its direction.
    pub(super) fn ray(&self, [x, y]: [f64; 2]) -> Jet<f64, 3> {
        self.beta(Jet::theta(x, y), |at: Jet<f64, 3>| {
            let (mut alpha, mut hessian, mut third) = (Cx::zero(), [0.0; 3], [0.0; 4]);
            for lens in &self.lenses {
                let (own, own_hessian) = lens.expand(at.value.re, at.value.im);
                alpha += own;
                add(&mut hessian, own_hessian);
                add(&mut third, lens.third_derivatives(at.value.re, at.value.im));
            }
            at.deflected(alpha, hessian, third)
        })
    }

    /// β of rays, or of one and its neighbours, from θ and what the lenses do to a ray that meets them somewhere.
    #[inline(always)]
    fn beta<C: Algebra>(&self, theta: C, deflected: impl Fn(C) -> C) -> C {
        let equation = Equation::of(&self.model);
        let alpha_d = deflected(equation.at_lens(theta));
        let alpha = match equation {
            Equation::Full { .. } => alpha_d,
            Equation::Flexion(_) => deflected(theta),
        };
        equation.beta(theta, alpha_d, alpha)
    }

    /// β of rays alone.
    fn positions(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let mut rays = RayBundle { beta_arcsec: vec![[0.0; 2]; theta_arcsec.len()], ..RayBundle::default() };
        for (theta, beta) in theta_arcsec.chunks(LANES).zip(rays.beta_arcsec.chunks_mut(LANES)) {
            let (x, y) = lanes(theta);
            let sum = |at: Cx<Lanes>| {
                let mut alpha = Cx::zero();
                for lens in &self.lenses {
                    alpha += lens.deflection_lanes(at.re, at.im);
                }
                alpha
            };
            store(self.beta(Cx::new(x, y), sum), beta);
        }
        rays
    }

    /// β and the Jacobian of rays.
    fn jacobians(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let mut rays = RayBundle {
            beta_arcsec: vec![[0.0; 2]; theta_arcsec.len()],
            jacobian: vec![[0.0; 4]; theta_arcsec.len()],
            ..RayBundle::default()
        };
        let columns = rays.beta_arcsec.chunks_mut(LANES).zip(rays.jacobian.chunks_mut(LANES));
        for (theta, (beta, jacobian)) in theta_arcsec.chunks(LANES).zip(columns) {
            let (x, y) = lanes(theta);
            let jet = self.beta(Jet::theta(x, y), |at: Jet<Lanes, 0>| {
                let (mut alpha, mut hessian) = (Cx::zero(), [Lanes::ZERO; 3]);
                for lens in &self.lenses {
                    let (own, own_hessian) = lens.expansion_lanes(at.value.re, at.value.im);
                    alpha += own;
                    add(&mut hessian, own_hessian);
                }
                at.deflected(alpha, hessian, [Lanes::ZERO; 4])
            });
            store(jet.value, beta);
            let [d_x, d_y] = jet.first;
            for (i, out) in jacobian.iter_mut().enumerate() {
                *out = [d_x.re.0[i], d_y.re.0[i], d_x.im.0[i], d_y.im.0[i]];
            }
        }
        rays
    }

    /// β of rays with first and second derivatives.
    fn second_derivatives(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let jets: Vec<_> = theta_arcsec.iter().map(|&theta| self.ray(theta)).collect();
        RayBundle {
            beta_arcsec: jets.iter().map(|j| [j.value.re, j.value.im]).collect(),
            jacobian: jets.iter().map(|j| components(&j.first)).collect(),
            second_per_arcsec: jets.iter().map(|j| components(&j.second)).collect(),
        }
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
            Order::Jacobian => self.jacobians(theta),
            Order::SecondDerivatives => self.second_derivatives(theta),
        })
    }

    /// D_Δt/c times the Fermat potential of each ray at its own β; not a number where no redshifts are known.
    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let days =
            self.time_delay_distance_mpc.unwrap_or(f64::NAN) * MPC_OVER_C_DAYS * ARCSEC_RAD * ARCSEC_RAD;
        theta_arcsec.par_iter().map(|&theta| self.ray_fermat_arcsec2(theta) * days).collect()
    }
}

/// The coordinates of at most [`LANES`] rays, the last one again where there are fewer.
#[inline(always)]
fn lanes(theta: &[[f64; 2]]) -> (Lanes, Lanes) {
    let (mut x, mut y) = (Lanes::ZERO, Lanes::ZERO);
    for i in 0..LANES {
        [x.0[i], y.0[i]] = theta[i.min(theta.len() - 1)];
    }
    (x, y)
}

/// As many lanes as there is room for.
#[inline(always)]
fn store(beta: Cx<Lanes>, out: &mut [[f64; 2]]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = [beta.re.0[i], beta.im.0[i]];
    }
}

#[inline(always)]
fn add<R: Real, const N: usize>(sum: &mut [R; N], terms: [R; N]) {
    for i in 0..N {
        sum[i] += terms[i];
    }
}

/// Derivatives of β_x, then those of β_y.
fn components<const N: usize, const M: usize>(derivatives: &[Cx<f64>; N]) -> [f64; M] {
    std::array::from_fn(|i| if i < N { derivatives[i].re } else { derivatives[i - N].im })
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
