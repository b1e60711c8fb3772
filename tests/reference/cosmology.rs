//! Distances and densities against astropy, and against 30-digit quadrature where astropy loses digits.

use crate::oracle_table::{Agreement, REQUIRED_HEADERS, Reference};
use haloray::cosmology::Background;

/// Ours against 30 digits: a few rounding errors, at every redshift from 1e-10 to 20.
const EXACT_TOLERANCE: f64 = 3e-15;
/// Ours against astropy where it does not subtract nearly equal numbers (z ≥ 0.01).
const ASTROPY_TOLERANCE: f64 = 1e-12;
/// astropy's own loss of digits for 1e-6 ≤ z < 0.01: its rounding error is about 1e-16/z.
const ASTROPY_SMALL_Z_TOLERANCE: f64 = 1e-9;
/// E(z), Ωm(z): the same closed form, a few rounding errors.
const CLOSED_FORM_TOLERANCE: f64 = 2e-15;
/// 3H²/(8πG): both take G·Msun and the parsec of the IAU, astropy as separate numbers.
const DENSITY_TOLERANCE: f64 = 1e-14;

fn evaluate(z: &[f64], function: impl Fn(f64) -> f64) -> Vec<f64> {
    z.iter().map(|&z| function(z)).collect()
}

#[test]
fn comoving_distances_are_exact_to_rounding() {
    let reference = Reference::load("distances");
    let z = reference.column("z");
    let ours = evaluate(z, |z| Background::paper().comoving_distance_mpc(z));
    Agreement::of("comoving distance, mpmath", &ours, reference.column("comoving_exact_mpc"))
        .require_max(EXACT_TOLERANCE);
}

#[test]
fn distances_agree_with_astropy_wherever_astropy_is_accurate() {
    let reference = Reference::load("distances");
    let background = Background::paper();
    for (label, low, tolerance) in
        [("z >= 0.01", 0.0099, ASTROPY_TOLERANCE), ("z >= 1e-6", 0.9e-6, ASTROPY_SMALL_Z_TOLERANCE)]
    {
        let pick = |column: &str| -> Vec<f64> {
            let rows = reference.column("z").iter().zip(reference.column(column));
            rows.filter(|(z, _)| **z > low).map(|(_, value)| *value).collect()
        };
        let z = pick("z");
        let comoving = evaluate(&z, |z| background.comoving_distance_mpc(z));
        Agreement::of(&format!("comoving, astropy, {label}"), &comoving, &pick("comoving_mpc"))
            .require_max(tolerance);
        let angular = evaluate(&z, |z| background.angular_diameter_distance_mpc(z));
        Agreement::of(&format!("angular diameter, {label}"), &angular, &pick("angular_diameter_mpc"))
            .require_max(tolerance);
    }
}

#[test]
fn the_remaining_difference_at_tiny_redshift_is_astropys() {
    let reference = Reference::load("distances");
    let astropy = Agreement::of(
        "astropy against mpmath",
        reference.column("comoving_mpc"),
        reference.column("comoving_exact_mpc"),
    );
    assert!(astropy.max > 1e3 * EXACT_TOLERANCE, "astropy has become exact: tighten the tests above");
}

#[test]
fn expansion_rate_and_densities_agree_with_astropy() {
    let reference = Reference::load("distances");
    let background = Background::paper();
    let z = reference.column("z");
    let hubble_ratio = evaluate(z, |z| background.hubble_ratio(z));
    Agreement::of("E(z)", &hubble_ratio, reference.column("hubble_ratio")).require_max(CLOSED_FORM_TOLERANCE);
    let omega_m = evaluate(z, |z| background.omega_m_at(z));
    Agreement::of("Omega_m(z)", &omega_m, reference.column("omega_m")).require_max(CLOSED_FORM_TOLERANCE);
    let density = evaluate(z, |z| background.critical_density_msun_mpc3(z));
    Agreement::of("critical density", &density, reference.column("critical_density_msun_mpc3"))
        .require_max(DENSITY_TOLERANCE);
}

#[test]
fn distances_between_two_redshifts_agree() {
    let reference = Reference::load("distances_between");
    let background = Background::paper();
    let pairs = || reference.column("z1").iter().zip(reference.column("z2"));
    let comoving: Vec<f64> =
        pairs().map(|(&z1, &z2)| background.comoving_distance_between_mpc(z1, z2)).collect();
    Agreement::of("comoving between, mpmath", &comoving, reference.column("comoving_exact_mpc"))
        .require_max(EXACT_TOLERANCE);
    // astropy subtracts two distances: its error is absolute, 1e-15 of the distance from us.
    let astropy = reference.column("angular_diameter_mpc");
    for ((&z1, &z2), expected) in pairs().zip(astropy) {
        let ours = background.angular_diameter_distance_between_mpc(z1, z2);
        assert!((ours - expected).abs() < 1e-11 * background.comoving_distance_mpc(z2) + 1e-12, "{z1} {z2}");
    }
}

#[test]
fn redshifts_come_back_from_exact_distances() {
    let reference = Reference::load("distances");
    let background = Background::paper();
    let z: Vec<f64> = reference
        .column("comoving_exact_mpc")
        .iter()
        .map(|&chi_mpc| background.redshift_at_comoving_distance(chi_mpc).unwrap())
        .collect();
    // dlnz/dlnχ reaches 6 at z = 20, which multiplies the rounding error of χ.
    Agreement::of("redshift at distance", &z, reference.column("z")).require_max(10.0 * EXACT_TOLERANCE);
}

#[test]
fn reference_data_without_an_origin_is_rejected() {
    let complete = "# oracle: a\n# version: 1\n# command: b\n# date: 2026-01-01\n# units: Mpc\nz,x\n0,1\n";
    assert_eq!(Reference::parse(complete).unwrap().column("x"), [1.0]);
    for key in REQUIRED_HEADERS {
        let without: String =
            complete.lines().filter(|line| !line.contains(key)).map(|line| format!("{line}\n")).collect();
        assert!(Reference::parse(&without).unwrap_err().contains(key), "{key}");
        let empty = complete.replace(&format!("# {key}: "), &format!("# {key}:\n# other: "));
        assert!(Reference::parse(&empty).unwrap_err().contains(key), "empty {key}");
    }
    assert!(Reference::parse(&complete.replace("0,1\n", "")).is_err());
    assert!(Reference::parse(&complete.replace("0,1", "0,1,2")).is_err());
    assert!(Reference::parse(&complete.replace("0,1", "0,one")).is_err());
}
