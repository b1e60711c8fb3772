//! Every profile of the registry: its facts, its derivatives, and what is known of it in closed form.

use haloray::profile::light::{LightProfile, Sersic};
use haloray::profile::mass::{Epl, MassProfile, Nfw, TruncatedNfw};
use haloray::profile::registry::{LENS_LIGHTS, MASSES, Parameter, PriorShape, Role, SOURCES};
use haloray::profile::registry::{lens_light, mass, mass_names};
use proptest::prelude::*;

use crate::derivatives::{assert_consistent, assert_parameter_derivatives};

/// Richardson differences with a step of 2% of the radius lose six digits at most.
const NFW_DIFFERENCES: f64 = 2e-9;
/// The same; far outside r_t the closed form of the truncated lens cancels to 1e-10.
const TRUNCATED_DIFFERENCES: f64 = 2e-8;

/// m of an NFW lens at its scale radius.
const M_AT_R_S: f64 = 1.0 - std::f64::consts::LN_2;

#[test]
fn the_centre_of_an_nfw_lens_gives_finite_numbers() {
    let halo = Nfw::new(0.5, 0.01, [0.0, 0.0]).unwrap();
    assert_eq!(halo.deflection(0.0, 0.0), [0.0, 0.0]);
    assert!(halo.hessian(0.0, 0.0).iter().all(|v| v.is_finite()));
    assert!(halo.third_derivatives(0.0, 0.0).iter().all(|v| v.is_finite()));
    assert!(halo.potential(0.0, 0.0).abs() < 1e-20);
}

#[test]
fn far_away_an_nfw_lens_is_isolated_mass_growing_as_the_logarithm() {
    // r·α/(k r_s²) = ln(r/2r_s) + O(r_s/r): at r = 1e6 r_s to 2e-6 of one.
    let halo = Nfw::new(1.0, M_AT_R_S, [0.0, 0.0]).unwrap();
    let r = 1e6;
    let want = (r / 2.0_f64).ln();
    assert!((r * halo.deflection(r, 0.0)[0] - want).abs() < 2e-6);
}

#[test]
fn a_truncated_nfw_lens_without_truncation_is_the_nfw_lens() {
    let (cut, nfw) =
        (TruncatedNfw::new(1.3, 0.2, 1.3e6, [0.0, 0.0]).unwrap(), Nfw::new(1.3, 0.2, [0.0, 0.0]).unwrap());
    for r in [1e-3, 0.3, 1.3, 4.0, 90.0] {
        let (a, b) = (cut.deflection(r, 0.0)[0], nfw.deflection(r, 0.0)[0]);
        // The difference is O(r²/r_t²) and π r_s/r_t.
        assert!((a / b - 1.0).abs() < 1e-5, "{r}: {a} {b}");
    }
}

#[test]
fn total_mass_of_a_truncated_nfw_lens_is_the_published_one() {
    let tau = 7.0_f64;
    let halo = TruncatedNfw::new(1.0, M_AT_R_S, tau, [0.0, 0.0]).unwrap();
    let t2 = tau * tau;
    let total = t2 / (t2 + 1.0).powi(2) * ((t2 - 1.0) * tau.ln() + std::f64::consts::PI * tau - (t2 + 1.0));
    let r = 1e4;
    assert!((r * halo.deflection(r, 0.0)[0] / total - 1.0).abs() < 1e-6);
}

#[test]
fn an_isothermal_sphere_deflects_by_its_einstein_radius_everywhere() {
    let lens = Epl::new(1.5, 2.0, [0.0, 0.0], [0.0, 0.0]).unwrap();
    for (x, y) in [(0.3, 0.4), (3.0, -4.0)] {
        let [ax, ay] = lens.deflection(x, y);
        assert!((ax.hypot(ay) - 1.5).abs() < 1e-15);
    }
}

#[test]
fn flux_of_a_sersic_profile_is_the_integral_of_the_brightness() {
    // Log-spaced radial sum over 1e-5″ < R < 1e3″; an ellipse of constant R has area πR².
    let s = Sersic::with_flux(2.5, 0.3, 4.0, [0.1, 0.2], [0.0, 0.0]).unwrap();
    let e = 0.1_f64.hypot(0.2);
    let q = (1.0 - e) / (1.0 + e);
    let (sin, cos) = (0.5 * 0.2_f64.atan2(0.1)).sin_cos();
    let steps = 40_000;
    let mut flux = 0.0;
    for i in 0..steps {
        let lr = |k: f64| (1e-5f64.ln() + k / f64::from(steps) * (1e8f64).ln()).exp();
        let (a, b, mid) = (lr(f64::from(i)), lr(f64::from(i) + 1.0), lr(f64::from(i) + 0.5));
        // The point on the own x axis with elliptical radius `mid`.
        let x = mid / q.sqrt();
        let brightness = s.surface_brightness(x * cos, x * sin);
        flux += brightness * std::f64::consts::PI * (b * b - a * a);
    }
    assert!((flux / 2.5 - 1.0).abs() < 1e-5, "{flux}");
}

#[test]
fn parameters_of_light_outside_their_domain_are_refused() {
    for (flux, r, n, e) in [
        (-1.0, 1.0, 1.0, 0.0),
        (1.0, 0.0, 1.0, 0.0),
        (1.0, 1.0, 0.1, 0.0),
        (1.0, 1.0, 11.0, 0.0),
        (1.0, 1.0, 1.0, 1.0),
    ] {
        assert!(Sersic::with_flux(flux, r, n, [e, 0.0], [0.0, 0.0]).is_err());
    }
}

/// Richardson differences over steps of 1% to 2%.
const DIFFERENCES: f64 = 1e-7;

/// A value inside the usual prior; ellipticities keep away from 0, where the direction of a multipole jumps.
fn usual(parameter: &Parameter, u: f64) -> f64 {
    match parameter.usual_prior {
        _ if parameter.role == Role::Ellipticity => 0.05 + 0.3 * u,
        PriorShape::Uniform([low, high]) => low + (0.1 + 0.8 * u) * (high - low),
        PriorShape::Normal([mean, sd]) => mean + (2.0 * u - 1.0) * sd,
        PriorShape::LogNormal([median, sd]) => median * ((2.0 * u - 1.0) * sd).exp(),
    }
}

proptest! {
    #[test]
    fn every_derivative_of_every_profile_is_one(
        u in prop::array::uniform9(0.0..1.0_f64), r in 0.05..5.0_f64, phi in 0.0..std::f64::consts::TAU,
    ) {
        for description in MASSES {
            let values = description.parameters.iter().zip(u).map(|(parameter, u)| usual(parameter, u));
            let mut values: Vec<f64> = values.collect();
            let build = |values: &[f64]| description.build(values).unwrap();
            let [x, y] = build(&values).centre_arcsec().unwrap_or_default();
            let (x, y) = (x + r * phi.cos(), y + r * phi.sin());
            assert_consistent(&build(&values), x, y, 0.02 * r, DIFFERENCES);
            assert_parameter_derivatives(build, &values, [x, y], DIFFERENCES);
            let is_round = |p: &Parameter| p.role == Role::Ellipticity || p.name == "a4_a";
            let round = description.parameters.iter().zip(&mut values).filter(|(p, _)| is_round(p));
            round.for_each(|(_, value)| *value = 0.0);
            assert_consistent(&build(&values), x, y, 0.02 * r, DIFFERENCES);
            if description.names[0].name != "EPL_BOXYDISKY" {
                assert_parameter_derivatives(build, &values, [x, y], DIFFERENCES);
            }
        }
    }
}

fn values(parameters: &[Parameter]) -> Vec<f64> {
    parameters.iter().map(|parameter| usual(parameter, 0.5)).collect()
}

#[test]
fn every_profile_is_built_from_exactly_its_parameters() {
    for description in MASSES {
        let values = values(description.parameters);
        let built = description.build(&values).unwrap();
        assert_eq!(built.parameters(), description.parameters);
        for wrong in [&values[1..], &[values.as_slice(), &[0.1]].concat(), &[]] {
            assert!(description.build(wrong).is_err(), "{:?}", description.names);
        }
        for (i, parameter) in description.parameters.iter().enumerate() {
            let mut outside = values.clone();
            outside[i] = f64::NAN;
            let message = description.build(&outside).unwrap_err().to_string();
            assert!(message.starts_with(parameter.name), "{message}");
        }
    }
    for description in SOURCES.iter().chain(LENS_LIGHTS) {
        assert!(description.build(&values(description.parameters)).is_ok());
        assert!(description.build(&[0.3]).is_err());
    }
}

#[test]
fn facts_agree_with_one_another() {
    let mut seen = Vec::new();
    for (names, parameters) in MASSES
        .iter()
        .map(|d| (d.names, d.parameters))
        .chain(SOURCES.iter().chain(LENS_LIGHTS).map(|d| (d.names, d.parameters)))
    {
        for parameter in parameters {
            assert!(!parameter.label.is_empty(), "{parameter:?}");
            assert!(parameter.default.is_none_or(|value| parameter.domain.contains(value)), "{parameter:?}");
            let [low, high] = parameter.domain.edges();
            if let PriorShape::Uniform([from, to]) = parameter.usual_prior {
                assert!(low <= from && from < to && to <= high, "{parameter:?}");
            }
        }
        for name in names {
            for (held, value) in name.held {
                let parameter = parameters.iter().find(|parameter| parameter.name == *held).unwrap();
                assert!(parameter.domain.contains(*value), "{name:?}");
            }
            seen.push(name.name);
        }
    }
    assert_eq!(mass_names(), seen[..mass_names().len()]);
    assert!(mass("EPLX").unwrap_err().to_string().contains("SHEAR_GAMMA_PSI"));
    assert!(lens_light("EPL").unwrap_err().to_string().ends_with("one of SERSIC_ELLIPSE, SERSIC"));
}

proptest! {
    #[test]
    fn derivatives_of_an_nfw_lens_are_consistent_at_every_radius(lg in -4.0..3.0_f64, phi in 0.0..std::f64::consts::TAU, r_s in 0.05..30.0_f64) {
        let r = r_s * 10f64.powf(lg);
        let halo = Nfw::new(r_s, 0.3, [0.0, 0.0]).unwrap();
        assert_consistent(&halo, r * phi.cos(), r * phi.sin(), 0.02 * r, NFW_DIFFERENCES);
    }
}

#[test]
fn derivatives_of_an_nfw_lens_are_consistent_across_its_seam() {
    let halo = Nfw::new(1.0, 0.3, [0.1, -0.2]).unwrap();
    for i in 0..60 {
        let r = 0.85 + 0.005 * f64::from(i);
        assert_consistent(&halo, 0.1 + r * 0.6, -0.2 + r * 0.8, 0.02, NFW_DIFFERENCES);
    }
}

proptest! {
    #[test]
    fn derivatives_of_a_truncated_nfw_lens_are_consistent_at_every_radius(lg in -4.0..1.5_f64, phi in 0.0..std::f64::consts::TAU, lg_tau in -0.5..2.0_f64) {
        let r = 10f64.powf(lg);
        let halo = TruncatedNfw::new(1.0, 0.3, 10f64.powf(lg_tau), [0.0, 0.0]).unwrap();
        assert_consistent(&halo, r * phi.cos(), r * phi.sin(), 0.02 * r, TRUNCATED_DIFFERENCES);
    }
}

#[test]
fn an_nfw_lens_without_size_is_refused() {
    for r_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Nfw::new(r_s, 0.1, [0.0, 0.0]).is_err(), "{r_s}");
    }
    assert!(Nfw::new(1.0, f64::NAN, [0.0, 0.0]).is_err());
}
