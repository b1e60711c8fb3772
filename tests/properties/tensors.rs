//! Theorems of multi-plane lensing: A_LOS is symmetric, its linear form is the first order, Fermat's principle holds.

use crate::any_cone::{any_cone, cases};
use crate::cone::{Halo, Z_SOURCE, catalogue};
use haloray::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use haloray::cosmology::Background;
use haloray::diagnostics::EffectiveLineOfSight;
use haloray::mapping::multiplane::{LineOfSight, MainLens, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::profile::mass::{Epl, MassModel};
use proptest::prelude::*;

/// ω_LOS: rounding of a dozen planes.
const SYMMETRY_TOLERANCE: f64 = 1e-12;
/// Gradient of the arrival time by Richardson differences, over the largest gradient of its two parts.
const FERMAT_TOLERANCE: f64 = 1e-8;
const Z_LENS: f64 = 0.5;

fn sight(haloes: &[Halo]) -> LineOfSight {
    LineOfSight::new(&catalogue(haloes), &Sheets::OnAxis).unwrap()
}

fn effective(haloes: &[Halo]) -> EffectiveLineOfSight {
    EffectiveLineOfSight::of(&sight(haloes), Z_LENS).unwrap()
}

/// All deflections multiplied by `factor`.
fn weakened(haloes: &[Halo], factor: f64) -> Vec<Halo> {
    haloes.iter().map(|h| Halo { alpha_rs: factor * h.alpha_rs, ..*h }).collect()
}

/// Largest difference between the exact and the linear LOS tensor.
fn nonlinearity(haloes: &[Halo]) -> f64 {
    let effective = effective(haloes);
    let (exact, linear) = (effective.los, effective.los_linear);
    (exact.kappa - linear.kappa).abs().max((exact.gamma - linear.gamma).norm()).max(linear.omega.abs())
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn the_los_tensor_is_symmetric(haloes in any_cone()) {
        let los = effective(&haloes).los;
        prop_assert!(los.omega.abs() < SYMMETRY_TOLERANCE, "{:e}", los.omega);
    }

    #[test]
    fn a_halo_in_the_lens_plane_does_not_break_the_symmetry(mut haloes in any_cone()) {
        haloes[0].z = Z_LENS;
        let los = effective(&haloes).los;
        prop_assert!(los.omega.abs() < SYMMETRY_TOLERANCE, "{:e}", los.omega);
    }

    #[test]
    fn linear_and_exact_los_agree_to_second_order(haloes in any_cone()) {
        let (whole, tenth) = (nonlinearity(&weakened(&haloes, 0.1)), nonlinearity(&weakened(&haloes, 0.01)));
        // A hundredth when the deflections fall to a tenth, within the third order; rounding is 1e-15.
        prop_assert!(tenth < 0.02 * whole + 1e-14, "{whole:e} {tenth:e}");
    }

    #[test]
    fn the_arrival_time_obeys_fermat(haloes in any_cone(), x in -2.0..2.0_f64, y in -2.0..2.0_f64) {
        let last = haloes.iter().map(|h| h.z).fold(0.0, f64::max);
        let sight = sight(&haloes);

        prop_assume!(nearest(&haloes, [x, y]) > 0.3);
        let near = sight.observer_to(0.5 * (last + Z_SOURCE)).unwrap();
        let gap = fermat_gap(&sight.observer_to_source(), &near, 0.5 * (last + Z_SOURCE), [x, y]);
        prop_assert!(gap < FERMAT_TOLERANCE, "{gap:e}");
    }
}

/// Smallest angle between a ray and a halo, which must be long beside the steps of the differences, up to 8e-3″.
fn nearest(haloes: &[Halo], [x, y]: [f64; 2]) -> f64 {
    haloes.iter().map(|h| (h.centre[0] - x).hypot(h.centre[1] - y)).fold(f64::INFINITY, f64::min)
}

/// How far cτ is from the arrival-time surface that is stationary at fixed β.
///
/// A ray arrives at x_s = χ_sβ with the slope s_e. If the surface is stationary, moving θ moves cτ only through the
/// end point, as a moved source would: ∂(cτ)/∂θ = χ_s Aᵀ(s_e − β). The slope is taken between `near` (at `z_near`,
/// behind the last plane) and the source.
fn fermat_gap(whole: &impl Mapping, near: &impl Mapping, z_near: f64, theta: [f64; 2]) -> f64 {
    let background = Background::paper();
    let (chi, chi_near) =
        (background.comoving_distance_mpc(Z_SOURCE), background.comoving_distance_mpc(z_near));
    let rays = whole.map(&[theta], Order::Jacobian);
    let (beta, [xx, xy, yx, yy]) = (rays.beta_arcsec[0], rays.jacobian[0]);
    let before = near.map(&[theta], Order::Position).beta_arcsec[0];
    let pull: [f64; 2] =
        std::array::from_fn(|c| chi * ((chi * beta[c] - chi_near * before[c]) / (chi - chi_near) - beta[c]));
    let want = [xx * pull[0] + yx * pull[1], xy * pull[0] + yy * pull[1]];
    let unit = ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS;
    let got = gradient(whole, theta).map(|g| g / unit);
    (got[0] - want[0]).hypot(got[1] - want[1]) / pull[0].hypot(pull[1]).max(1.0)
}

/// Gradient of the delay in days per arcsec: central differences, twice extrapolated.
fn gradient(mapping: &impl Mapping, [x, y]: [f64; 2]) -> [f64; 2] {
    let central = |h: f64| -> [f64; 2] {
        let d = mapping.delay_days(&[[x + h, y], [x - h, y], [x, y + h], [x, y - h]]);
        [(d[0] - d[1]) / (2.0 * h), (d[2] - d[3]) / (2.0 * h)]
    };
    let (d1, d2, d4) = (central(8e-3), central(4e-3), central(2e-3));
    std::array::from_fn(|i| {
        let (r1, r2) = ((4.0 * d2[i] - d1[i]) / 3.0, (4.0 * d4[i] - d2[i]) / 3.0);
        (16.0 * r2 - r1) / 15.0
    })
}

#[test]
fn the_arrival_time_through_a_main_lens_obeys_fermat() {
    let halo = |z, x, y| Halo { z, centre: [x, y], r_s: 1.3, alpha_rs: 0.05 };
    let sight = sight(&[halo(0.2, 0.9, -1.8), halo(0.4, -2.5, 0.4), halo(0.31, 3.0, 3.0)]);
    let profile = MassModel::Epl(Epl::new(1.5, 2.3, [0.1, -0.2], [0.05, 0.02]).unwrap());
    let lens = MainLens { z: Z_LENS, profile };
    for theta in [[1.4, 0.3], [-0.9, 0.8], [0.2, -1.7]] {
        let near = sight.observer_to(Z_LENS).unwrap();
        let gap = fermat_gap(&sight.through_lens(&lens).unwrap(), &near, Z_LENS, theta);
        assert!(gap < FERMAT_TOLERANCE, "{theta:?}: {gap:e}");
    }
}

#[test]
fn one_lens_has_the_textbook_arrival_time() {
    // τ = D_Δt/c·[½(θ−β)² − ψ], D_Δt = χ_d χ_s/(χ_s − χ_d) in comoving distances with τ as observed.
    let background = Background::paper();
    let profile = MassModel::Epl(Epl::new(1.5, 2.3, [0.1, -0.2], [0.05, 0.02]).unwrap());
    let (lens, empty) = (MainLens { z: Z_LENS, profile: profile.clone() }, sight(&[]));
    let (d, s) = (background.comoving_distance_mpc(Z_LENS), background.comoving_distance_mpc(Z_SOURCE));
    let theta = [[1.4, 0.3], [-0.9, 0.8], [0.2, -1.7]];
    let mapping = empty.through_lens(&lens).unwrap();
    let beta = mapping.map(&theta, Order::Position).beta_arcsec;
    for ((theta, beta), days) in theta.iter().zip(beta).zip(mapping.delay_days(&theta)) {
        use haloray::profile::mass::MassProfile;
        let bent = (theta[0] - beta[0]).hypot(theta[1] - beta[1]);
        let fermat = 0.5 * bent * bent - profile.potential(theta[0], theta[1]);
        let want = d * s / (s - d) * fermat * ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS;
        assert!((days / want - 1.0).abs() < 1e-12, "{days} {want}");
    }
}

#[test]
fn without_the_transpose_the_los_tensor_is_not_symmetric() {
    // Two haloes in front of the lens, seen under 45° of each other, turn the image: ω_od ≠ 0.
    let halo = |z, x, y| Halo { z, centre: [x, y], r_s: 1.0, alpha_rs: 0.1 };
    let effective = effective(&[halo(0.1, 0.8, 0.0), halo(0.3, 0.6, 0.6), halo(0.9, -1.0, 0.3)]);
    let inverse = effective.ds.tidal.jacobian().try_inverse().unwrap();
    let paper = effective.od.tidal.jacobian() * inverse * effective.os.tidal.jacobian();
    let asymmetry = (paper[(1, 0)] - paper[(0, 1)]).abs();
    println!(
        "omega_od {:.1e}; asymmetry of A_od A_ds^-1 A_os {asymmetry:.1e}, of A_od^T A_ds^-1 A_os {:.1e}",
        effective.od.tidal.omega, effective.los.omega
    );
    assert!(effective.los.omega.abs() < SYMMETRY_TOLERANCE);
    assert!(asymmetry > 1e-4 && effective.od.tidal.omega.abs() > 1e-5, "the test must be able to fail");
}
