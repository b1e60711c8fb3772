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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Flexion, FlexionModel, Tidal};
    use super::*;
    use crate::profile::mass::{Epl, MassProfile};

    fn lens() -> Vec<MassModel> {
        vec![MassModel::Epl(Epl::new(1.4, 2.2, [0.1, -0.05], [0.02, 0.03]).unwrap())]
    }

    fn through(model: LineOfSightModel) -> TidalLens {
        TidalLens::new(model, lens())
    }

    fn tidal(v: [f64; 4]) -> Tidal {
        Tidal { kappa: v[0], gamma: Complex::new(v[1], v[2]), omega: v[3] }
    }

    fn flexion(v: [f64; 4]) -> Flexion {
        Flexion { f: Complex::new(v[0], v[1]) * 0.1, g: Complex::new(v[2], v[3]) * 0.1 }
    }

    prop_compose! {
        fn numbers()(v in prop::array::uniform4(-0.05..0.05_f64)) -> [f64; 4] { v }
    }

    proptest! {
        #[test]
        fn jacobian_and_second_derivatives_are_those_of_beta(
            od in numbers(), os in numbers(), ds in numbers(), f in numbers(), g in numbers(),
            x in -2.0..2.0_f64, y in 0.3..2.0_f64,
        ) {
            let flexed = FlexionModel {
                od: tidal(od), os: tidal(os), ds: tidal(ds), flexion_od: flexion(f), flexion_os: flexion(g),
                flexion_1ds: flexion(os), flexion_2ds: flexion(ds),
            };
            for model in [
                LineOfSightModel::Full { od: tidal(od), os: tidal(os), ds: tidal(ds) },
                LineOfSightModel::Minimal { od: tidal(od), los: tidal(os) },
                LineOfSightModel::Flexion(flexed),
            ] {
                let mapping = through(model);
                let at = |x: f64, y: f64| mapping.map(&[[x, y]], Order::SecondDerivatives);
                let rays = at(x, y);
                let h = 1e-3;
                for i in 0..2 {
                    let dx = crate::profile::mass::derivative_checks::derivative(|x| at(x, y).beta_arcsec[0][i], x, h);
                    let dy = crate::profile::mass::derivative_checks::derivative(|y| at(x, y).beta_arcsec[0][i], y, h);
                    prop_assert!((rays.jacobian[0][2 * i] - dx).abs() < 1e-9);
                    prop_assert!((rays.jacobian[0][2 * i + 1] - dy).abs() < 1e-9);
                    let dxx = crate::profile::mass::derivative_checks::derivative(|x| at(x, y).jacobian[0][2 * i], x, h);
                    let dxy = crate::profile::mass::derivative_checks::derivative(|y| at(x, y).jacobian[0][2 * i], y, h);
                    let dyy = crate::profile::mass::derivative_checks::derivative(|y| at(x, y).jacobian[0][2 * i + 1], y, h);
                    for (k, d) in [dxx, dxy, dyy].into_iter().enumerate() {
                        prop_assert!((rays.second_per_arcsec[0][3 * i + k] - d).abs() < 1e-7);
                    }
                }
            }
        }

        #[test]
        fn minimal_is_the_full_model_up_to_the_source_transformation(
            od in numbers(), os in numbers(), ds in numbers(), x in -2.0..2.0_f64, y in 0.3..2.0_f64,
        ) {
            let full = LineOfSightModel::Full { od: tidal(od), os: tidal(os), ds: tidal(ds) };
            let minimal = full.minimal().unwrap();
            let beta = |model| through(model).map(&[[x, y]], Order::Position).beta_arcsec[0];
            let transform = tidal(od).jacobian().transpose() * tidal(ds).jacobian().try_inverse().unwrap();
            let [bx, by] = beta(full);
            let want = transform * nalgebra::Vector2::new(bx, by);
            let got = beta(minimal);
            prop_assert!((got[0] - want[0]).hypot(got[1] - want[1]) < 1e-14);
        }
    }

    #[test]
    fn all_parameters_zero_is_the_single_plane_lens_bit_for_bit() {
        let empty =
            FlexionModel::minimal(Tidal::NONE, Tidal::NONE, Flexion::NONE, Flexion::NONE, Flexion::NONE);
        let minimal = LineOfSightModel::Minimal { od: Tidal::NONE, los: Tidal::NONE };
        for model in [LineOfSightModel::EMPTY, minimal, LineOfSightModel::Flexion(empty)] {
            for (x, y) in [(1.1, 0.3), (-0.7, 1.9), (0.01, -0.02)] {
                let beta = through(model).map(&[[x, y]], Order::Position).beta_arcsec[0];
                let [ax, ay] = lens()[0].deflection(x, y);
                assert_eq!(beta, [x - ax, y - ay]);
            }
        }
    }

    #[test]
    fn the_fermat_potential_is_stationary_at_images() {
        // A symmetric A_LOS: any od and os without rotation, ds such that A_LOS is the one given.
        let (od, los) = (tidal([0.02, 0.03, -0.01, 0.0]), tidal([0.01, -0.02, 0.04, 0.0]));
        let mapping = through(LineOfSightModel::Minimal { od, los });
        for (x, y) in [(1.3, 0.5), (-0.4, 1.1)] {
            let beta = mapping.map(&[[x, y]], Order::Position).beta_arcsec[0];
            let h = 1e-4;
            let phi = |x: f64, y: f64| mapping.fermat_arcsec2([x, y], beta).unwrap();
            let gradient =
                [phi(x + h, y) - phi(x - h, y), phi(x, y + h) - phi(x, y - h)].map(|d| d / (2.0 * h));
            assert!(gradient[0].hypot(gradient[1]) < 1e-7, "{gradient:?}");
        }
    }
}
