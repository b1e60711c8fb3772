//! Profiles on 100×100 points of a 5″ field, one core: deflection, and with Hessian and parameter derivatives.
//!
//! `cargo bench --bench lens`. Items are points: 20 Mitem/s is 50 ns a point.

use divan::Bencher;
use divan::counter::ItemsCount;
use haloray::profile::mass::{Epl, MassModel, Nfw, Responses, SersicMass, deflections, responses};

fn main() {
    divan::main();
}

const LENSES: [&str; 4] = ["epl round", "epl q=0.7", "nfw potential", "sersic potential"];

fn lens(name: &str) -> MassModel {
    let (e, centre) = ([0.17, 0.04], [0.01, -0.02]);
    let built = match name {
        "epl round" => Epl::new(1.2, 2.6, [0.0; 2], centre).map(MassModel::Epl),
        "epl q=0.7" => Epl::new(1.2, 2.6, e, centre).map(MassModel::Epl),
        "nfw potential" => {
            Nfw::new(5.0, 1.0, centre).and_then(|l| l.with_elliptical_potential(e)).map(MassModel::Nfw)
        }
        _ => SersicMass::new(0.3, 0.6, 4.0, centre)
            .and_then(|l| l.with_elliptical_potential(e))
            .map(MassModel::Sersic),
    };
    built.expect("parameters inside their domains")
}

fn points() -> [Vec<f64>; 2] {
    let at = |i: usize| (i as f64 - 49.5) * 0.05;
    [(0..10_000).map(|k| at(k % 100)).collect(), (0..10_000).map(|k| at(k / 100)).collect()]
}

#[divan::bench(args = LENSES)]
fn deflection(bencher: Bencher, name: &str) {
    let (lens, [x, y]) = (lens(name), points());
    let mut out = [vec![], vec![]];
    bencher.counter(ItemsCount::new(x.len())).bench_local(|| deflections(&lens, &x, &y, &mut out));
}

#[divan::bench(args = LENSES)]
fn with_hessian_and_parameter_derivatives(bencher: Bencher, name: &str) {
    let (lens, [x, y]) = (lens(name), points());
    let mut out = Responses::default();
    bencher.counter(ItemsCount::new(x.len())).bench_local(|| responses(&lens, &x, &y, &mut out));
}
