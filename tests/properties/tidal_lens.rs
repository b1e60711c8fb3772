//! The models of the line of sight: derivatives, the source transformation, the empty line of sight, Fermat.

use haloray::mapping::tidal::{Flexion, FlexionModel, LineOfSightModel, Tidal, TidalLens};
use haloray::mapping::{Mapping, Order};
use haloray::profile::mass::{Epl, MassModel, MassProfile};
use nalgebra::{Complex, Vector2};
use proptest::prelude::*;

use crate::derivatives::derivative;

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
                let dx = derivative(|x| at(x, y).beta_arcsec[0][i], x, h);
                let dy = derivative(|y| at(x, y).beta_arcsec[0][i], y, h);
                prop_assert!((rays.jacobian[0][2 * i] - dx).abs() < 1e-9);
                prop_assert!((rays.jacobian[0][2 * i + 1] - dy).abs() < 1e-9);
                let dxx = derivative(|x| at(x, y).jacobian[0][2 * i], x, h);
                let dxy = derivative(|y| at(x, y).jacobian[0][2 * i], y, h);
                let dyy = derivative(|y| at(x, y).jacobian[0][2 * i + 1], y, h);
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
        let want = transform * Vector2::new(bx, by);
        let got = beta(minimal);
        prop_assert!((got[0] - want[0]).hypot(got[1] - want[1]) < 1e-14);
    }
}

#[test]
fn all_parameters_zero_is_the_single_plane_lens_bit_for_bit() {
    let empty = FlexionModel::minimal(Tidal::NONE, Tidal::NONE, Flexion::NONE, Flexion::NONE, Flexion::NONE);
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
        let gradient = [phi(x + h, y) - phi(x - h, y), phi(x, y + h) - phi(x, y - h)].map(|d| d / (2.0 * h));
        assert!(gradient[0].hypot(gradient[1]) < 1e-7, "{gradient:?}");
    }
}
