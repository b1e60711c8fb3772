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
    pub(super) fn ray(&self, [x, y]: [f64; 2]) -> Jet {
        let (equation, theta) = (Equation::of(&self.model), Jet::theta(x, y));
        let alpha_d = equation.at_lens(theta).deflected_by(&self.lenses);
        let alpha = match equation {
            Equation::Full { .. } => alpha_d,
            Equation::Flexion(_) => theta.deflected_by(&self.lenses),
        };
        equation.beta(theta, alpha_d, alpha)
    }

    /// θ_d: where a ray seen at θ meets the lens.
    pub(super) fn at_lens(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let at = Equation::of(&self.model).at_lens(Complex::new(x, y));
        [at.re, at.im]
    }
}

impl Mapping for TidalLens {
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle> {
        monitor.check()?;
        let jets: Vec<Jet> = theta_arcsec.par_iter().map(|&theta| self.ray(theta)).collect();
        let mut rays = RayBundle {
            beta_arcsec: jets.iter().map(|j| [j.value.re, j.value.im]).collect(),
            ..RayBundle::default()
        };
        if order >= Order::Jacobian {
            rays.jacobian = jets.iter().map(|j| components(&j.first)).collect();
        }
        if order >= Order::SecondDerivatives {
            rays.second_per_arcsec = jets.iter().map(|j| components(&j.second)).collect();
        }
        monitor.advance(theta_arcsec.len() as u64);
        Ok(rays)
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
