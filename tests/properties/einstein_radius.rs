//! The Einstein radius of lenses of which it is known.

use std::f64::consts::TAU;

use haloray::profile::mass::{
    Epl, External, MassModel, Nfw, PointMass, SersicMass, einstein_radius_arcsec, mean_convergence,
};

fn epl(theta_e: f64, slope: f64, e: [f64; 2]) -> MassModel {
    MassModel::Epl(Epl::new(theta_e, slope, e, [0.0, 0.0]).unwrap())
}

fn sheet(kappa: f64, shear: [f64; 2]) -> MassModel {
    MassModel::External(External::new(kappa, shear, [0.0; 4], [0.0; 2]).unwrap())
}

#[test]
fn round_lenses_have_the_radius_of_their_ring() {
    for slope in [1.1, 2.0, 2.9] {
        assert!(
            (einstein_radius_arcsec(&[epl(1.3, slope, [0.0; 2])], [0.0; 2]).unwrap() - 1.3).abs() < 1e-12
        );
    }
    let point = MassModel::PointMass(PointMass::new(0.7, [0.0; 2]).unwrap());
    assert!((einstein_radius_arcsec(&[point], [0.0; 2]).unwrap() - 0.7).abs() < 1e-13);
}

#[test]
fn a_sheet_scales_an_isothermal_sphere_and_shear_does_nothing() {
    let lenses = [epl(1.0, 2.0, [0.0; 2]), sheet(0.2, [0.1, -0.05])];
    assert!((einstein_radius_arcsec(&lenses, [0.0; 2]).unwrap() - 1.25).abs() < 1e-12);
}

#[test]
fn an_isothermal_ellipsoid_has_the_mean_of_its_convergence_over_angle() {
    // κ̄(R) = θ_E/R · ⟨(q cos² + sin²/q)^(−1/2)⟩ over the circle.
    let e = 0.2_f64;
    let q = (1.0 - e) / (1.0 + e);
    let n = 400;
    let mean: f64 = (0..n)
        .map(|i| (i as f64 / n as f64 * TAU).sin_cos())
        .map(|(s, c)| (q * c * c + s * s / q).sqrt().recip())
        .sum::<f64>()
        / n as f64;
    let got = einstein_radius_arcsec(&[epl(1.2, 2.0, [0.0, e])], [0.0; 2]).unwrap();
    assert!((got - 1.2 * mean).abs() < 1e-12, "{got}");
}

#[test]
fn a_composite_lens_has_its_outermost_circle() {
    let halo = MassModel::Nfw(Nfw::new(8.0, 1.5, [0.0; 2]).unwrap());
    let stars = SersicMass::new(0.4, 0.8, 4.0, [0.0; 2]).unwrap();
    let stars = MassModel::Sersic(stars.with_elliptical_potential([0.1, 0.05]).unwrap());
    let both = [halo, stars.clone()];
    let radius = einstein_radius_arcsec(&both, [0.0; 2]).unwrap();
    assert!((mean_convergence(&both, [0.0; 2], radius) - 1.0).abs() < 1e-12);
    assert!(radius > einstein_radius_arcsec(&[stars], [0.0; 2]).unwrap());
    // A heavy ring of satellites gives a second, larger circle.
    let far = |x: f64| MassModel::PointMass(PointMass::new(6.0, [x, 0.0]).unwrap());
    let radius = einstein_radius_arcsec(&[epl(1.0, 2.0, [0.0; 2]), far(5.0), far(-5.0)], [0.0; 2]).unwrap();
    assert!((radius - (0.5 + (0.25_f64 + 72.0).sqrt())).abs() < 1e-9, "{radius}");
}

#[test]
fn none_is_said_where_there_is_none() {
    assert_eq!(einstein_radius_arcsec(&[], [0.0; 2]), None);
    assert_eq!(einstein_radius_arcsec(&[sheet(0.3, [0.0; 2])], [0.0; 2]), None);
    assert_eq!(einstein_radius_arcsec(&[epl(1.0, 2.0, [0.0; 2]), sheet(1.1, [0.0; 2])], [0.0; 2]), None);
    assert_eq!(einstein_radius_arcsec(&[epl(0.0, 2.0, [0.0; 2])], [0.0; 2]), None);
}
