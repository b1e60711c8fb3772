//! The mock catalogue: distributions of 10,000 systems beside what the protocol says of them.

use haloray::cosmology::Background;
use haloray::imaging::Instrument;
use haloray::mock::{HaloMassRule, MockSystem, PerturberRule, Protocol, SourceRule};
use haloray::profile::light::Sersic;
use spec_math::cephes64::ndtr;

const SYSTEMS: u64 = 10_000;
/// Probability below which a distribution counts as wrong.
const LEAST_P: f64 = 0.01;

/// Probability of a larger distance of a sample from a distribution, given the distribution function at its values
/// (Stephens 1970).
fn kolmogorov_smirnov_p(mut below: Vec<f64>) -> f64 {
    below.sort_by(f64::total_cmp);
    let n = below.len() as f64;
    let distance = below
        .iter()
        .enumerate()
        .fold(0.0_f64, |d, (i, p)| d.max((p - i as f64 / n).abs()).max(((i + 1) as f64 / n - p).abs()));
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    let term = |k: f64| (-2.0 * k * k * lambda * lambda).exp();
    (1..100).map(|k| if k % 2 == 1 { 2.0 } else { -2.0 } * term(f64::from(k))).sum::<f64>().clamp(0.0, 1.0)
}

fn check(name: &str, systems: &[MockSystem], below: impl Fn(&MockSystem) -> f64) {
    let p = kolmogorov_smirnov_p(systems.iter().map(below).collect());
    println!("{name}: p = {p:.3}");
    assert!(p > LEAST_P, "{name}: p = {p:.4}");
}

fn uniform([low, high]: [f64; 2], value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

fn log_normal(median: f64, sd_ln: f64, value: f64) -> f64 {
    ndtr((value / median).ln() / sd_ln)
}

fn axis_ratio([e1, e2]: [f64; 2]) -> f64 {
    let e = e1.hypot(e2);
    (1.0 - e) / (1.0 + e)
}

fn turn([x, y]: [f64; 2]) -> f64 {
    uniform([-1.0, 1.0], y.atan2(x) / std::f64::consts::PI)
}

fn check_protocol(protocol: &Protocol) {
    let scale = Instrument::default().pixel_scale_arcsec;
    let systems = MockSystem::draw_all(protocol, 11, SYSTEMS, scale).unwrap();
    let background = Background::paper();
    let kpc =
        |z: f64| 1e-3 / background.angular_diameter_distance_mpc(z) * (648_000.0 / std::f64::consts::PI);
    let check = |name: &str, below: &dyn Fn(&MockSystem) -> f64| check(name, &systems, below);
    check("lens redshift", &|s| uniform(protocol.z_lens, s.z_lens));
    check("source redshift", &|s| uniform(protocol.z_source, s.z_source));
    check("concentration", &|s| {
        log_normal(protocol.concentration_median, protocol.concentration_sd_ln, s.halo.c200c)
    });
    let mass = |m: f64| log_normal(protocol.mass_median_msun, protocol.mass_sd_ln, m);
    check("mass in stars", &|s| mass(s.baryons.mass_msun));
    check("index of the stars", &|s| log_normal(4.0, protocol.index_sd_ln, s.baryons.index));
    check("index of the source", &|s| log_normal(4.0, protocol.index_sd_ln, s.source.index));
    check("halo mass", &|s| match protocol.halo_mass {
        HaloMassRule::Times(range) => uniform(range, s.halo.m200c_msun / s.baryons.mass_msun),
        HaloMassRule::Over(range) => uniform(range, s.baryons.mass_msun / s.halo.m200c_msun),
    });
    for component in 0..2 {
        check("offset of the halo", &|s| ndtr(s.halo.centre_arcsec[component] / (0.3 * kpc(s.z_lens))));
    }
    let q = [protocol.least_axis_ratio, 1.0];
    for (name, of) in [
        ("stars", (|s| s.baryons.ellipticity) as fn(&MockSystem) -> [f64; 2]),
        ("halo", |s| s.halo.ellipticity),
        ("source", |s| s.source.ellipticity),
    ] {
        check(&format!("axis ratio of the {name}"), &|s| uniform(q, axis_ratio(of(s))));
        check(&format!("orientation of the {name}"), &|s| turn(of(s)));
    }
    for (name, of) in [
        ("od", (|s| s.gamma_od) as fn(&MockSystem) -> [f64; 2]),
        ("os", |s| s.gamma_os),
        ("ds", |s| s.gamma_ds),
    ] {
        let limit = protocol.largest_shear;
        check(&format!("γ² {name}"), &|s| (of(s)[0].hypot(of(s)[1]) / limit).powi(2));
        check(&format!("direction of γ {name}"), &|s| turn(of(s)));
    }
    match protocol.source {
        SourceRule::Radius { median_kpc, sd_ln, .. } => check("radius of the source", &|s| {
            log_normal(median_kpc, sd_ln, s.source.radius_arcsec / kpc(s.z_source))
        }),
        SourceRule::Mass => check("radius of the source", &|s| {
            mass(s.source.radius_arcsec / kpc(s.z_source) / 2.0 * protocol.mass_median_msun)
        }),
    }
    check("offset² of the source", &|s| {
        let limit = s.source.radius_arcsec.min(s.einstein_radius_arcsec);
        let [x, y] = s.source.centre_arcsec;
        (x * x + y * y) / (limit * limit)
    });
    check("radius of a perturber", &|s| {
        uniform(protocol.perturber_radius, s.perturbers[0].radius_arcsec / s.source.radius_arcsec)
    });
    check("index of a perturber", &|s| uniform([2.0, 6.0], s.perturbers[0].index));
    let unit = |radius: f64, index: f64| {
        Sersic::with_flux(1.0, radius, index, [0.0; 2], [0.0; 2]).unwrap().amplitude()
    };
    for s in systems.iter() {
        let (source, own) = (&s.source, &s.perturbers[0]);
        let amplitude =
            own.flux * unit(own.radius_arcsec, own.index) / unit(source.radius_arcsec, source.index);
        assert_eq!(protocol.perturber_brightness, PerturberRule::Amplitude(0.01));
        assert!((amplitude / 0.01 - 1.0).abs() < 1e-12, "{amplitude}");
    }
    if protocol.perturber_least_axis_ratio < 1.0 {
        let q = [protocol.perturber_least_axis_ratio, 1.0];
        check("axis ratio of a perturber", &|s| uniform(q, axis_ratio(s.perturbers[0].ellipticity)));
    } else {
        assert!(systems.iter().all(|s| s.perturbers.iter().all(|p| p.ellipticity == [0.0; 2])));
    }
    assert!(systems.iter().all(|s| s.einstein_radius_arcsec >= 0.5));
    let count = |n: usize| systems.iter().filter(|s| s.perturbers.len() == n).count() as f64;
    let [fewest, most] = protocol.perturbers;
    let kinds = f64::from(most - fewest + 1);
    for n in fewest..=most {
        let expected = SYSTEMS as f64 / kinds;
        assert!((count(n as usize) - expected).abs() <= 4.0 * expected.sqrt(), "{n} perturbers");
    }
}

#[test]
fn systems_follow_the_code_of_the_authors() {
    check_protocol(&Protocol::paper());
}

#[test]
fn systems_follow_the_text_of_the_appendix() {
    // Without the cut on the Einstein radius, which bends what it cuts.
    check_protocol(&Protocol { least_einstein_radius_arcsec: 0.5, ..Protocol::text() });
}

#[test]
fn a_system_does_not_depend_on_how_many_are_drawn() {
    let draw = |n| MockSystem::draw_all(&Protocol::paper(), 5, n, 0.08).unwrap();
    assert_eq!(draw(3)[..], draw(10)[..3]);
    assert_ne!(draw(1), MockSystem::draw_all(&Protocol::paper(), 6, 1, 0.08).unwrap());
}
