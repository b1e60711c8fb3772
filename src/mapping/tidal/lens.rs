//! A main lens in a tidal line of sight, as a [`Mapping`].

use nalgebra::Complex;
use rayon::prelude::*;

use super::equation::Equation;
use super::jet::Jet;
use super::model::LineOfSightModel;
use crate::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};
use crate::profile::mass::MassModel;

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
    pub(super) fn ray(&self, theta: [f64; 2]) -> Jet {
        self.expanded::<true>(theta)
    }

    /// β of a ray as a function of its direction, to second order or to first.
    fn expanded<const SECOND: bool>(&self, [x, y]: [f64; 2]) -> Jet {
        let (equation, theta) = (Equation::of(&self.model), Jet::theta(x, y));
        let alpha_d = equation.at_lens(theta).deflected_by::<SECOND>(&self.lenses);
        let alpha = match equation {
            Equation::Full { .. } => alpha_d,
            Equation::Flexion(_) => theta.deflected_by::<SECOND>(&self.lenses),
        };
        equation.beta(theta, alpha_d, alpha)
    }

    /// β of rays alone, lanes at a time.
    fn positions(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let equation = Equation::of(&self.model);
        let deflected = |at: Cx<Lanes>| {
            let each = self.lenses.iter().map(|lens| lens.deflection_lanes(at.re, at.im));
            each.fold(Cx::zero(), |sum, alpha| sum + alpha)
        };
        let of_block = |block: &[[f64; 2]]| {
            let lanes = |c: usize| Lanes(std::array::from_fn(|i| block[i.min(block.len() - 1)][c]));
            let theta = Cx::new(lanes(0), lanes(1));
            let alpha_d = deflected(equation.at_lens(theta));
            let alpha = match equation {
                Equation::Full { .. } => alpha_d,
                Equation::Flexion(_) => deflected(theta),
            };
            let beta = equation.beta(theta, alpha_d, alpha);
            (0..block.len()).map(move |i| [beta.re.0[i], beta.im.0[i]]).collect::<Vec<_>>()
        };
        let beta_arcsec = theta_arcsec.chunks(LANES).flat_map(of_block).collect();
        RayBundle { beta_arcsec, ..RayBundle::default() }
    }

    /// β of rays with derivatives.
    fn expansions<const SECOND: bool>(&self, theta_arcsec: &[[f64; 2]]) -> RayBundle {
        let jets: Vec<Jet> = theta_arcsec.iter().map(|&theta| self.expanded::<SECOND>(theta)).collect();
        let second = |jet: &Jet| components(&jet.second);
        RayBundle {
            beta_arcsec: jets.iter().map(|j| [j.value.re, j.value.im]).collect(),
            jacobian: jets.iter().map(|j| components(&j.first)).collect(),
            second_per_arcsec: if SECOND { jets.iter().map(second).collect() } else { Vec::new() },
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
            Order::Jacobian => self.expansions::<false>(theta),
            Order::SecondDerivatives => self.expansions::<true>(theta),
        })
    }

    /// D_Δt/c times the Fermat potential of each ray at its own β; not a number where no redshifts are known.
    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let days =
            self.time_delay_distance_mpc.unwrap_or(f64::NAN) * MPC_OVER_C_DAYS * ARCSEC_RAD * ARCSEC_RAD;
        theta_arcsec.par_iter().map(|&theta| self.ray_fermat_arcsec2(theta) * days).collect()
    }
}

/// Derivatives of β_x, then those of β_y.
fn components<const N: usize, const M: usize>(derivatives: &[Complex<f64>; N]) -> [f64; M] {
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
