//! A straight axis ray: what single haloes do to it adds up, sheets cancel it, and nothing observable changes.

use haloray::config::{Config, Preset};
use haloray::cosmology::Background;
use haloray::diagnostics::{EffectiveLineOfSight, HaloTidal, PointImages, SkyWindow};
use haloray::halo::HaloCatalogue;
use haloray::mapping::multiplane::{Accuracy, Field, LineOfSight, MainLens, Reference, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::monitor::Silent;
use haloray::pipeline::{line_of_sight, populate};
use haloray::profile::mass::{Epl, MassModel, MassProfile};

use crate::cone::{Halo, Z_SOURCE, catalogue};

const Z_LENS: f64 = 0.5;

/// Haloes of all strengths close to the axis, some at the same redshift, some truncated.
fn haloes() -> HaloCatalogue {
    let at = |i: u32, step: f64| (f64::from(i) * step).fract();
    let haloes: Vec<Halo> = (0..300)
        .map(|i| {
            let (radius, turn) = (2.0 + 60.0 * at(i, 0.618_034), std::f64::consts::TAU * at(i, 0.414_214));
            Halo {
                z: if i % 10 == 0 { 0.8 } else { 0.02 + 1.45 * at(i, 0.732_051) },
                centre: [radius * turn.cos(), radius * turn.sin()],
                r_s: 0.3 + 5.0 * at(i, 0.236_068),
                alpha_rs: 0.3 * at(i, 0.449_49).powi(4),
            }
        })
        .collect();
    let mut haloes = catalogue(&haloes);
    let r_trunc = haloes.r_s_arcsec.iter().enumerate();
    haloes.r_trunc_arcsec =
        Some(r_trunc.map(|(i, r)| if i % 3 == 0 { 4.0 * r } else { f64::INFINITY }).collect());
    haloes
}

fn main_lens(centre: [f64; 2]) -> MainLens {
    let profile = MassModel::Epl(Epl::new(1.4, 2.2, [0.12, -0.05], centre).unwrap());
    MainLens { z: Z_LENS, profile }
}

fn theta() -> Vec<[f64; 2]> {
    (0..100).map(|i| [(f64::from(i) * 0.61).sin() * 2.0, (f64::from(i) * 0.37).cos() * 1.7]).collect()
}

/// β and the delay in Mpc·arcsec² of one ray, by the recursion as it is written: every kick less that on the axis.
fn plain(haloes: &HaloCatalogue, lens: Option<&MainLens>, theta: [f64; 2]) -> ([f64; 2], f64) {
    let background = Background::paper();
    let chi_s = background.comoving_distance_mpc(Z_SOURCE);
    let mut planes: Vec<(f64, MassModel, bool)> =
        (0..haloes.len()).map(|i| (haloes.chi_cmpc[i], haloes.profile(i).unwrap(), true)).collect();
    planes.extend(lens.map(|lens| (background.comoving_distance_mpc(lens.z), lens.profile.clone(), false)));
    planes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut chi, mut x, mut s, mut path) = (0.0, [0.0; 2], theta, 0.0);
    for (chi_plane, profile, is_halo) in &planes {
        let step = chi_plane - chi;
        path += 0.5 * step * (s[0] * s[0] + s[1] * s[1]);
        (chi, x) = (*chi_plane, [0, 1].map(|c| x[c] + step * s[c]));
        let t = x.map(|x| x / chi);
        let mut alpha = profile.deflection(t[0], t[1]);
        let mut psi = profile.potential(t[0], t[1]);
        if *is_halo {
            let (axis, [xx, _, yy]) = (profile.deflection(0.0, 0.0), profile.hessian(0.0, 0.0));
            let kappa = 0.5 * (xx + yy);
            alpha = [0, 1].map(|c| alpha[c] - axis[c] - kappa * t[c]);
            psi -= profile.potential(0.0, 0.0) + t[0] * axis[0] + t[1] * axis[1];
            psi -= 0.5 * kappa * (t[0] * t[0] + t[1] * t[1]);
        }
        let f = chi_s / (chi_s - chi);
        s = [0, 1].map(|c| s[c] - f * alpha[c]);
        path -= chi * f * psi;
    }
    let step = chi_s - chi;
    path += 0.5 * step * (s[0] * s[0] + s[1] * s[1]);
    let x = [0, 1].map(|c| x[c] + step * s[c]);
    (x.map(|x| x / chi_s), path - 0.5 * (x[0] * x[0] + x[1] * x[1]) / chi_s)
}

#[test]
fn rays_and_delays_are_those_of_the_recursion_less_the_axis() {
    use haloray::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
    let haloes = haloes();
    let sight = LineOfSight::along(Reference::Straight, &haloes, &Sheets::OnAxis).unwrap();
    let lens = main_lens([0.1, -0.05]);
    let segments = [(sight.observer_to_source(), None), (sight.through_lens(&lens).unwrap(), Some(&lens))];
    for (segment, lens) in segments {
        let (beta, delay) =
            (segment.map(&theta(), Order::Position).beta_arcsec, segment.delay_days(&theta()));
        for (i, theta) in theta().into_iter().enumerate() {
            let (x, path) = plain(&haloes, lens, theta);
            assert!((beta[i][0] - x[0]).hypot(beta[i][1] - x[1]) < 1e-12, "{theta:?}");
            let days = path * ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS;
            assert!((delay[i] - days).abs() < 1e-9 * days.abs().max(1.0), "{} {days}", delay[i]);
        }
    }
}

#[test]
fn the_axis_ray_stays_at_zero_between_any_two_redshifts() {
    let sight = LineOfSight::along(Reference::Straight, &haloes(), &Sheets::OnAxis).unwrap();
    let at_zero =
        |segment: &dyn Mapping| segment.map(&[[0.0; 2]], Order::Position).beta_arcsec[0] == [0.0; 2];
    assert!(at_zero(&sight.observer_to_source()));
    for z in [0.01, 0.3, Z_LENS, 0.8, 1.2] {
        assert!(at_zero(&sight.observer_to(z).unwrap()) && at_zero(&sight.to_source_from(z).unwrap()));
        let rays = sight.rays_at(z, &[[0.0; 2]], &Silent).unwrap();
        assert_eq!((rays.x_cmpc_arcsec[0], rays.slope_arcsec[0]), ([0.0; 2], [0.0; 2]));
        let onwards = sight.onwards(z, &rays, Order::Position, &Silent).unwrap().beta_arcsec[0];
        assert!(onwards[0].hypot(onwards[1]) < 1e-14, "{onwards:?}");
    }
}

#[test]
fn parts_with_a_kick_between_them_are_the_whole_mapping() {
    let sight = LineOfSight::along(Reference::Straight, &haloes(), &Sheets::None).unwrap();
    let lens = main_lens([0.1, -0.05]);
    let mut rays = sight.rays_at(Z_LENS, &theta(), &Silent).unwrap();
    let f = sight.slope_per_reduced_deflection(Z_LENS).unwrap();
    let chi = Background::paper().comoving_distance_mpc(Z_LENS);
    for (x, slope) in rays.x_cmpc_arcsec.iter().zip(&mut rays.slope_arcsec) {
        let alpha = lens.profile.deflection(x[0] / chi, x[1] / chi);
        *slope = [0, 1].map(|c| slope[c] - f * alpha[c]);
    }
    let composed = sight.onwards(Z_LENS, &rays, Order::Position, &Silent).unwrap().beta_arcsec;
    let whole = sight.through_lens(&lens).unwrap().map(&theta(), Order::Position).beta_arcsec;
    for (ours, whole) in composed.iter().zip(&whole) {
        assert!((ours[0] - whole[0]).hypot(ours[1] - whole[1]) < 1e-12, "{ours:?} {whole:?}");
    }
}

#[test]
fn images_of_a_source_and_their_delays_do_not_know_the_reference() {
    let haloes = haloes();
    let straight = LineOfSight::along(Reference::Straight, &haloes, &Sheets::OnAxis).unwrap();
    // The same haloes where a bent line of sight has them, with the same sheets.
    let (mut moved, by) = (haloes.clone(), straight.axis_ray_arcsec(&haloes.chi_cmpc));
    for (i, by) in by.iter().enumerate() {
        moved.theta_x_arcsec[i] += by[0];
        moved.theta_y_arcsec[i] += by[1];
    }
    let kappa = HaloTidal::of(&haloes, 1.0).unwrap().kappa;
    let bent = LineOfSight::new(&moved, &Sheets::Expected(kappa)).unwrap();
    let background = Background::paper();
    let chi = [Z_LENS, Z_SOURCE].map(|z| background.comoving_distance_mpc(z));
    let axis = bent.axis_ray_arcsec(&chi);
    let window = SkyWindow::about_axis(3.0, vec![[0.0; 2]]).unwrap();
    let source = [0.07, 0.04];
    let find = |sight: &LineOfSight, lens: [f64; 2], source: [f64; 2]| {
        let through = sight.through_lens(&main_lens(lens)).unwrap();
        PointImages::of(&through, &window, source, &Silent).unwrap().images
    };
    let ours = find(&straight, [0.0; 2], source);
    let theirs = find(&bent, axis[0], [0, 1].map(|c| source[c] + axis[1][c]));
    assert!(ours.len() == theirs.len() && ours.len() >= 2, "{} {}", ours.len(), theirs.len());
    for (a, b) in ours.iter().zip(&theirs) {
        let gap = (a.theta_arcsec[0] - b.theta_arcsec[0]).hypot(a.theta_arcsec[1] - b.theta_arcsec[1]);
        assert!(gap < 1e-9, "{gap:e}");
        let [ours, theirs] =
            [(a, &ours[0]), (b, &theirs[0])].map(|(image, first)| image.delay_days - first.delay_days);
        assert!((ours - theirs).abs() <= 1e-9 * ours.abs(), "{ours} {theirs}");
    }
}

#[test]
fn adaptive_tracing_keeps_its_bound() {
    let config = config(1e-5);
    let haloes = populate(&config, None, 0, &Silent).unwrap();
    let sight = line_of_sight(&config, &haloes, &haloes.catalogue).unwrap();
    let theta: Vec<[f64; 2]> =
        (0..2500).map(|i| [f64::from(i % 50) * 0.1 - 2.5, f64::from(i / 50) * 0.1 - 2.5]).collect();
    let field = Field { centre_arcsec: [0.0; 2], half_arcsec: [2.6; 2] };
    let exact = sight.observer_to_source();
    let adaptive = exact.adaptive(Accuracy::WithinArcsec(1e-7), Some(field), theta.len());
    let rays = adaptive.map(&theta, Order::Position).beta_arcsec;
    let some: Vec<usize> = (0..theta.len()).step_by(41).collect();
    let traced = exact.map(&some.iter().map(|&i| theta[i]).collect::<Vec<_>>(), Order::Position).beta_arcsec;
    let gap = |(&i, b): (&usize, &[f64; 2])| (rays[i][0] - b[0]).hypot(rays[i][1] - b[1]);
    let largest = some.iter().zip(&traced).map(gap).fold(0.0, f64::max);
    let report = adaptive.report();
    println!("bound {:.1e}, measured {largest:.1e}", report.bound_arcsec);
    assert!(report.rays_traced_exactly < report.rays && report.bound_arcsec <= 1e-7 && largest <= 1e-7);
}

/// The paper's population about a straight axis ray.
fn config(min_point_shear: f64) -> Config {
    let mut config = Preset::Paper.config().unwrap();
    config.haloes.min_point_shear = min_point_shear;
    config.line_of_sight.reference = Reference::Straight;
    config
}

/// |Σγ_h − γ_os| and κ_os of the first sightlines.
fn sums(config: &Config, sightlines: u64) -> Vec<(f64, f64)> {
    let of = |realisation| {
        let haloes = populate(config, None, realisation, &Silent).unwrap();
        let sight = line_of_sight(config, &haloes, &haloes.catalogue).unwrap();
        let effects = haloes.effects(config).unwrap();
        let os = EffectiveLineOfSight::of(&sight, Z_LENS).unwrap().os.tidal;
        let sum: nalgebra::Complex<f64> = effects.decisive(config).gamma.iter().sum();
        ((sum - os.gamma).norm(), os.kappa)
    };
    (0..sightlines).map(of).collect()
}

fn assert_sums(config: &Config, sightlines: u64) {
    let mut sums = sums(config, sightlines);
    let rms = (sums.iter().map(|(_, kappa)| kappa * kappa).sum::<f64>() / sums.len() as f64).sqrt();
    sums.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = sums[sums.len() / 2].0;
    println!("median |Σγ_h − γ_os| {median:.2e}, rms κ_os {rms:.2e}, {sightlines} sightlines");
    assert!(median < 5e-4 && rms < 1e-3);
}

#[test]
fn single_haloes_add_up_and_sheets_cancel() {
    assert_sums(&config(1e-5), 4);
}

#[test]
#[ignore = "slow: just nightly"]
fn single_haloes_add_up_and_sheets_cancel_over_sixty_sightlines() {
    assert_sums(&config(1e-6), 60);
    assert_sums(&Preset::Consistent.config().unwrap(), 60);
}

#[test]
fn along_a_bent_ray_single_haloes_add_up_too() {
    let mut config = config(1e-5);
    config.line_of_sight.reference = Reference::Bent;
    config.line_of_sight.halo_effects = haloray::config::HaloEffects::Ray;
    assert_sums(&config, 4);
}
