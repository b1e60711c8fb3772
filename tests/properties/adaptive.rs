//! Adaptive tracing keeps its stated error on realistic and on adversarial cones; threads change no bit.

use haloray::config::Preset;
use haloray::cosmology::Background;
use haloray::halo::{HaloCatalogue, HaloMasses};
use haloray::mapping::multiplane::{Accuracy, AccuracyReport, Field, LineOfSight, MainLens, Segment, Sheets};
use haloray::mapping::{Mapping, Order, RayBundle};
use haloray::monitor::Silent;
use haloray::pipeline::{line_of_sight, populate};
use haloray::profile::mass::{Epl, MassModel};

/// The paper's source.
const Z_SOURCE: f64 = 1.5;
/// Half the side of the paper's field and more, arcsec.
const HALF_ARCSEC: f64 = 1.8;

pub fn grid(side: usize, half: f64) -> Vec<[f64; 2]> {
    let at = |i: usize| half * (2.0 * i as f64 / (side - 1) as f64 - 1.0);
    (0..side * side).map(|k| [at(k % side), at(k / side)]).collect()
}

/// The cone of the preset `paper`, about 35,000 haloes, or of another shear cut.
fn paper_cone(seed: u64, cut: f64) -> LineOfSight {
    let mut config = Preset::Paper.config().unwrap();
    (config.seed, config.haloes.min_point_shear) = (seed, cut);
    let haloes = populate(&config, None, 0, &Silent).unwrap();
    line_of_sight(&config, &haloes, &haloes.catalogue).unwrap()
}

/// A halo as (z, centre, r_s, α_Rs).
pub type Halo = (f64, [f64; 2], f64, f64);

pub fn cone(haloes: &[Halo], sheets: &Sheets) -> LineOfSight {
    let column = |f: &dyn Fn(&Halo) -> f64| haloes.iter().map(f).collect::<Vec<f64>>();
    let masses = HaloMasses::Angles { r_s_arcsec: column(&|h| h.2), alpha_rs_arcsec: column(&|h| h.3) };
    let background = Background::paper();
    let centres = [column(&|h| h.1[0]), column(&|h| h.1[1])];
    let catalogue = HaloCatalogue::new(Z_SOURCE, &background, column(&|h| h.0), centres, masses).unwrap();
    LineOfSight::new(&catalogue, sheets).unwrap()
}

/// A few hundred ordinary haloes around the field.
pub fn background_haloes() -> Vec<Halo> {
    let place = |i: usize, step: f64| (0.5 + i as f64 * step).fract();
    (0..600)
        .map(|i| {
            let z = 0.01 + 1.47 * place(i, 0.618_033_988_75);
            let at = [place(i, 0.754_877_666), place(i, 0.569_840_291)].map(|p| 40.0 * (p - 0.5));
            (z, at, 0.05 + place(i, 0.324_717_957), 3e-4 * (1.0 + 9.0 * place(i, 0.430_159_709).powi(3)))
        })
        .collect()
}

fn largest(differences: impl Iterator<Item = f64>) -> f64 {
    differences.fold(0.0, |most, d| {
        if d <= most {
            most
        } else if d.is_nan() {
            f64::INFINITY
        } else {
            d
        }
    })
}

/// Largest errors of β, of A, and of b over (1 + |b|).
pub fn errors(ours: &RayBundle, exact: &RayBundle) -> [f64; 3] {
    assert_eq!(ours.beta_arcsec.len(), exact.beta_arcsec.len());
    let beta = ours.beta_arcsec.iter().zip(&exact.beta_arcsec);
    let jacobian = ours.jacobian.iter().flatten().zip(exact.jacobian.iter().flatten());
    let second = ours.second_per_arcsec.iter().flatten().zip(exact.second_per_arcsec.iter().flatten());
    [
        largest(beta.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))),
        largest(jacobian.map(|(a, b)| (a - b).abs())),
        largest(second.map(|(a, b)| (a - b).abs() / (1.0 + b.abs()))),
    ]
}

fn trace(
    segment: &Segment,
    theta: &[[f64; 2]],
    accuracy_arcsec: f64,
    order: Order,
) -> (RayBundle, AccuracyReport) {
    let accuracy = Accuracy::WithinArcsec(accuracy_arcsec);
    let adaptive = segment.adaptive(accuracy, Field::around(theta), theta.len());
    let rays = adaptive.map(theta, order);
    (rays, adaptive.report())
}

/// Checks every ray of a grid against the exact recursion; returns what the trace reports.
fn check(name: &str, segment: &Segment, accuracy_arcsec: f64, order: Order) -> AccuracyReport {
    let theta = grid(64, HALF_ARCSEC);
    let (ours, report) = trace(segment, &theta, accuracy_arcsec, order);
    let [beta, jacobian, second] = errors(&ours, &segment.map(&theta, order));
    println!("{name}: {accuracy_arcsec:e}: {beta:.1e} {jacobian:.1e} {second:.1e} {report:?}");
    assert!(beta <= accuracy_arcsec, "{name}: {beta:e} exceeds {accuracy_arcsec:e}");
    assert!(beta <= report.bound_arcsec || beta == 0.0, "{name}: {beta:e} exceeds the bound {report:?}");
    assert!(report.bound_arcsec <= accuracy_arcsec && report.measured_arcsec <= accuracy_arcsec);
    assert!(jacobian <= 20.0 * accuracy_arcsec, "{name}: Jacobian off by {jacobian:e}");
    assert!(second <= 2000.0 * accuracy_arcsec, "{name}: second derivatives off by {second:e}");
    report
}

fn check_cones_of_the_paper(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let sight = paper_cone(seed, 1e-6);
        let report = check("paper", &sight.observer_to_source(), 1e-7, Order::Position);
        assert_eq!(report.rays_traced_exactly, 0, "{report:?}");
        // Of 35,000 planes a ray meets few.
        assert!(report.planes_met < 200 * report.rays, "{report:?}");
    }
}

#[test]
fn a_cone_of_the_paper_is_traced_within_1e_7_arcsec() {
    check_cones_of_the_paper(11..12);
}

#[test]
#[ignore = "slow: just nightly"]
fn cones_of_the_paper_are_traced_within_1e_7_arcsec() {
    check_cones_of_the_paper(11..21);
}

#[test]
fn derivatives_keep_their_accuracy() {
    let sight = paper_cone(21, 1e-6);
    check("derivatives", &sight.observer_to_source(), 1e-7, Order::SecondDerivatives);
}

fn check_accuracies(seed: u64, cut: f64) {
    let sight = paper_cone(seed, cut);
    for accuracy in [1e-5, 1e-7, 1e-9] {
        check("cut", &sight.observer_to_source(), accuracy, Order::Position);
    }
}

#[test]
fn coarse_and_fine_accuracies_are_kept_in_a_sparse_cone() {
    check_accuracies(31, 1e-5);
}

#[test]
#[ignore = "slow: just nightly"]
fn coarse_and_fine_accuracies_are_kept_in_a_dense_cone() {
    check_accuracies(32, 3e-7);
}

#[test]
fn segments_to_and_from_the_lens_and_through_it_are_traced() {
    let sight = paper_cone(41, 1e-5);
    check("od", &sight.observer_to(0.5).unwrap(), 1e-7, Order::Position);
    check("ds", &sight.to_source_from(0.5).unwrap(), 1e-7, Order::Position);
    let profile = MassModel::Epl(Epl::new(1.2, 2.6, [0.1, -0.05], [0.02, 0.01]).unwrap());
    let lens = MainLens { z: 0.5, profile };
    check("lens", &sight.through_lens(&lens).unwrap(), 1e-7, Order::SecondDerivatives);
}

/// Checks images through elliptical power laws of any size, slope and place, and through haloes on their rings.
fn check_lenses(seeds: std::ops::Range<u64>) {
    let place = |seed: u64, step: f64| (0.5 + seed as f64 * step).fract();
    for seed in seeds {
        let radius = 0.5 + 1.5 * place(seed, 0.618_033_988_75);
        let slope = 1.8 + 0.6 * place(seed, 0.754_877_666);
        let [e1, e2, x, y] =
            [0.569_840_291, 0.324_717_957, 0.430_159_709, 0.819_172_513].map(|s| place(seed, s));
        let centre = [0.4 * (x - 0.5), 0.4 * (y - 0.5)];
        let lens = |z: f64, centre: [f64; 2]| {
            let profile = Epl::new(radius, slope, [0.4 * (e1 - 0.5), 0.4 * (e2 - 0.5)], centre).unwrap();
            MainLens { z, profile: MassModel::Epl(profile) }
        };
        let sight = paper_cone(seed, 1e-6);
        let at_lens = sight.observer_to(0.5).unwrap().map(&[[0.0; 2]], Order::Position).beta_arcsec[0];
        let on_axis = [at_lens[0] + centre[0], at_lens[1] + centre[1]];
        let through = sight.through_lens(&lens(0.5, on_axis)).unwrap();
        let report = check("lens", &through, 1e-7, Order::Position);
        assert!(report.rays_traced_exactly < report.rays / 5, "{report:?}");
        check("lens, coarse", &through, 1e-5, Order::Jacobian);
        let on_the_ring = |k: usize| {
            let (sin, cos) = (0.7 * k as f64).sin_cos();
            let at = [centre[0] + radius * cos, centre[1] + radius * sin];
            (0.1 + 0.15 * k as f64, at, 0.02 * (1.0 + k as f64), 1e-3 * k as f64)
        };
        let haloes = [background_haloes(), (0..9).map(on_the_ring).collect()].concat();
        let sight = cone(&haloes, &Sheets::OnAxis);
        let through = sight.through_lens(&lens(0.45, centre)).unwrap();
        check("haloes on the ring", &through, 1e-7, Order::Jacobian);
    }
}

#[test]
fn images_through_the_main_lens_keep_their_accuracy() {
    check_lenses(61..63);
}

#[test]
#[ignore = "slow: just nightly"]
fn images_through_many_main_lenses_keep_their_accuracy() {
    check_lenses(63..83);
}

#[test]
fn adversarial_cones_keep_the_accuracy() {
    let step = 2.0 * HALF_ARCSEC / 63.0;
    let on_a_pixel = [-HALF_ARCSEC + 20.0 * step, -HALF_ARCSEC + 41.0 * step];
    let cases: [(&str, Vec<Halo>); 10] = [
        ("no halo at all", vec![]),
        ("one halo on a pixel", vec![(0.4, on_a_pixel, 0.4, 0.02)]),
        ("many haloes on one pixel", (1..9).map(|i| (0.1 * f64::from(i), on_a_pixel, 0.3, 0.01)).collect()),
        ("coincident planes", vec![(0.4, [0.3, 0.2], 0.4, 0.02), (0.4, [0.3, 0.2], 0.4, 0.02)]),
        ("planes at the observer", vec![(1e-6, [0.2, 0.1], 0.4, 0.02), (1e-9, [-0.9, 0.1], 2.0, 0.05)]),
        ("planes at the source", vec![(Z_SOURCE * (1.0 - 1e-9), [0.2, 0.1], 0.4, 1e-9)]),
        ("a cluster on the axis", vec![(0.4, [0.0, 0.0], 60.0, 12.0)]),
        ("a cluster beside the field", vec![(0.3, [25.0, 8.0], 60.0, 12.0)]),
        ("almost a point mass", vec![(0.6, [0.5, -0.4], 1e-6, 0.5)]),
        (
            "strong haloes",
            (1..14).map(|i| (0.1 * f64::from(i), [0.1, 0.03 * f64::from(i)], 0.5, 0.1)).collect(),
        ),
    ];
    for (name, special) in cases {
        for sheets in [Sheets::OnAxis, Sheets::None] {
            let haloes: Vec<Halo> =
                if special.is_empty() { vec![] } else { [background_haloes(), special.clone()].concat() };
            let sight = cone(&haloes, &sheets);
            check(name, &sight.observer_to_source(), 1e-7, Order::Position);
            if name != "almost a point mass" {
                check(name, &sight.observer_to_source(), 1e-5, Order::Jacobian);
            }
        }
    }
}

#[test]
fn exact_and_few_rays_give_the_bits_of_the_recursion() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let segment = sight.observer_to_source();
    for (accuracy, side) in [(Accuracy::EXACT, 40), (Accuracy::default(), 9)] {
        let theta = grid(side, 1.0);
        let adaptive = segment.adaptive(accuracy, Field::around(&theta), theta.len());
        assert_eq!(
            adaptive.map(&theta, Order::SecondDerivatives),
            segment.map(&theta, Order::SecondDerivatives)
        );
        assert_eq!(adaptive.report().rays_traced_exactly, theta.len());
    }
}

#[test]
fn rays_outside_the_field_and_coincident_rays_are_traced() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let segment = sight.observer_to_source();
    let mut theta = grid(50, 1.0);
    let field = Field::around(&theta);
    theta.extend([[5.0, 0.0], [0.0, -3.0]]);
    theta.extend([[0.3, 0.4]; 900]);
    let adaptive = segment.adaptive(Accuracy::default(), field, theta.len());
    let [beta, ..] = errors(&adaptive.map(&theta, Order::Position), &segment.map(&theta, Order::Position));
    assert!(beta <= 1e-7 && adaptive.report().rays_traced_exactly >= 2);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let sight = paper_cone(51, 1e-5);
    let theta = grid(80, HALF_ARCSEC);
    let profile = MassModel::Epl(Epl::new(1.2, 2.0, [0.1, -0.05], [0.02, 0.01]).unwrap());
    let through = sight.through_lens(&MainLens { z: 0.5, profile }).unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let traced =
            |segment: &Segment| pool.install(|| trace(segment, &theta, 1e-7, Order::SecondDerivatives));
        [traced(&sight.observer_to_source()), traced(&through)]
    };
    let (one, two) = (with(1), with(2));
    assert!(one == two, "threads changed the rays");
}
