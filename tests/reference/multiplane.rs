//! A cone of 300 haloes against lenstronomy's MultiPlane (β, delays) and an independent recursion in numpy (A).

use crate::cone::{Halo, catalogue};
use crate::differences::{Differences, scaled_difference};
use crate::oracle_table::Reference;
use haloray::halo::{HaloCatalogue, Truncation};
use haloray::mapping::multiplane::{LineOfSight, MainLens, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::profile::mass::{Epl, MassModel};

/// β of two independent codes: rounding of 300 planes; the standard of "exact" is 1e-11″.
const BETA_TOLERANCE_ARCSEC: f64 = 1e-13;
/// A: both recursions are analytic; numpy loses a few digits inside the smallest haloes.
const JACOBIAN_TOLERANCE: f64 = 1e-12;
/// Delays over the spread of all delays: lenstronomy takes Mpc, c and arcsec to nine digits.
const DELAY_TOLERANCE: f64 = 1e-8;
/// b_ijk over the largest component: what Richardson differences of A leave.
const SECOND_DERIVATIVE_TOLERANCE: f64 = 1e-6;
/// Truncation in scale radii of the case `truncated`.
const TAU: f64 = 8.0;

fn cone() -> HaloCatalogue {
    let table = Reference::load("multiplane_cone");
    let at = |name: &str, row: usize| table.column(name)[row];
    let haloes: Vec<Halo> = (0..table.column("z").len())
        .map(|i| Halo {
            z: at("z", i),
            centre: [at("theta_x_arcsec", i), at("theta_y_arcsec", i)],
            r_s: at("r_s_arcsec", i),
            alpha_rs: at("alpha_rs_arcsec", i),
        })
        .collect();
    catalogue(&haloes)
}

fn line_of_sight(haloes: &HaloCatalogue) -> LineOfSight {
    LineOfSight::new(haloes, &Sheets::OnAxis).unwrap()
}

fn main_lens() -> MainLens {
    MainLens { z: 0.5, profile: MassModel::Epl(Epl::new(1.5, 2.6, [0.08, -0.05], [0.03, -0.02]).unwrap()) }
}

fn rays(table: &Reference) -> Vec<[f64; 2]> {
    let (x, y) = (table.column("theta_x_arcsec"), table.column("theta_y_arcsec"));
    x.iter().zip(y).map(|(&x, &y)| [x, y]).collect()
}

/// Compares β, A and delays of `mapping` with the columns of `case`.
fn compare(case: &str, mapping: &impl Mapping) {
    let table = Reference::load("multiplane_rays");
    let theta = rays(&table);
    let column = |part: &str| table.column(&format!("{case}_{part}"));
    let ours = mapping.map(&theta, Order::Jacobian);
    let component = |part: &str, of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        column(part).iter().enumerate().map(|(i, value)| of(i) - value).collect()
    };
    let beta: Vec<f64> = ["beta_x", "beta_y"]
        .iter()
        .enumerate()
        .flat_map(|(c, part)| component(part, &|i| ours.beta_arcsec[i][c]))
        .collect();
    Differences::of(&format!("{case}: beta (arcsec)"), beta).require_max(BETA_TOLERANCE_ARCSEC);
    let jacobian: Vec<f64> = ["a_xx", "a_xy", "a_yx", "a_yy"]
        .iter()
        .enumerate()
        .flat_map(|(c, part)| component(part, &|i| ours.jacobian[i][c]))
        .collect();
    Differences::of(&format!("{case}: A"), jacobian).require_max(JACOBIAN_TOLERANCE);
    let days = mapping.delay_days(&theta);
    let theirs = column("delay_days");
    let spread =
        theirs.iter().copied().fold(f64::MIN, f64::max) - theirs.iter().copied().fold(f64::MAX, f64::min);
    let delays = component("delay_days", &|i| days[i] - days[0]).into_iter().map(|d| d / spread);
    Differences::of(&format!("{case}: delay differences over their spread of {spread:.0} days"), delays)
        .require_max(DELAY_TOLERANCE);
}

#[test]
fn haloes_alone_agree() {
    compare("haloes", &line_of_sight(&cone()).observer_to_source());
}

#[test]
fn haloes_and_a_main_lens_agree() {
    compare("lens", &line_of_sight(&cone()).through_lens(&main_lens()).unwrap());
}

#[test]
fn truncated_haloes_agree() {
    compare(
        "truncated",
        &line_of_sight(&cone().truncated(Truncation::OverRs(TAU)).unwrap()).observer_to_source(),
    );
}

/// ∂A/∂θ by differences of second order, twice extrapolated: (b_xxx, b_xxy, b_xyy, b_yxx, b_yxy, b_yyy).
fn differences_of_jacobian(mapping: &impl Mapping, [x, y]: [f64; 2], step: f64) -> [f64; 6] {
    let central = |h: f64| -> [f64; 6] {
        let around = [[x + h, y], [x - h, y], [x, y + h], [x, y - h]];
        let a = mapping.map(&around, Order::Jacobian).jacobian;
        let d =
            |component: usize, axis: usize| (a[2 * axis][component] - a[2 * axis + 1][component]) / (2.0 * h);
        [d(0, 0), d(1, 0), d(1, 1), d(2, 0), d(3, 0), d(3, 1)]
    };
    let (d1, d2, d4) = (central(step), central(step / 2.0), central(step / 4.0));
    std::array::from_fn(|i| {
        let (r1, r2) = ((4.0 * d2[i] - d1[i]) / 3.0, (4.0 * d4[i] - d2[i]) / 3.0);
        (16.0 * r2 - r1) / 15.0
    })
}

#[test]
fn second_derivatives_are_the_differences_of_the_jacobian() {
    /// Haloes in the field are as small as 0.06″; the error of the differences goes with the sixth power of this.
    const STEP_ARCSEC: f64 = 4e-3;
    let theta = rays(&Reference::load("multiplane_rays"));
    let (plain, cut) =
        (line_of_sight(&cone()), line_of_sight(&cone().truncated(Truncation::OverRs(TAU)).unwrap()));
    let lens = main_lens();
    for (label, mapping) in [
        ("haloes", plain.observer_to_source()),
        ("lens", plain.through_lens(&lens).unwrap()),
        ("truncated", cut.observer_to_source()),
        ("lens to source", plain.to_source_from(0.5).unwrap()),
    ] {
        let second = mapping.map(&theta, Order::SecondDerivatives).second_per_arcsec;
        let scaled = theta.iter().zip(&second).map(|(&theta, ours)| {
            scaled_difference(&differences_of_jacobian(&mapping, theta, STEP_ARCSEC), ours)
        });
        Differences::of(&format!("{label}: b_ijk"), scaled).require_max(SECOND_DERIVATIVE_TOLERANCE);
    }
}

#[test]
fn all_orders_give_the_same_rays() {
    let theta = rays(&Reference::load("multiplane_rays"));
    let sight = line_of_sight(&cone());
    let mapping = sight.observer_to_source();
    let orders = [Order::Position, Order::Jacobian, Order::SecondDerivatives];
    let [position, jacobian, second] = orders.map(|order| mapping.map(&theta, order));
    for (a, b) in
        [(&position.beta_arcsec, &jacobian.beta_arcsec), (&position.beta_arcsec, &second.beta_arcsec)]
    {
        let gaps = a.iter().zip(b).flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
        Differences::of("beta of two orders (arcsec)", gaps).require_max(1e-13);
    }
    assert_eq!(jacobian.jacobian.len(), second.jacobian.len());
    let gaps =
        jacobian.jacobian.iter().zip(&second.jacobian).flat_map(|(a, b)| (0..4).map(move |c| a[c] - b[c]));
    Differences::of("A of two orders", gaps).require_max(1e-13);
}
