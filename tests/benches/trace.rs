//! Exact ray tracing: 64×64 rays through the paper's cone, and single ray-planes far from, at and inside a halo.
//!
//! `cargo bench --bench trace`. Items are ray-planes: 200 Mitem/s is 5 ns a ray-plane. The bundles of
//! `a_million_ray_planes` take as many milliseconds as a ray-plane takes nanoseconds.

mod cone;

use divan::Bencher;
use divan::counter::ItemsCount;
use haloray::cosmology::Background;
use haloray::halo::{HaloCatalogue, HaloMasses};
use haloray::mapping::multiplane::{LineOfSight, Sheets};
use haloray::mapping::{Mapping, Order};

fn main() {
    divan::main();
}

const ORDERS: [Order; 3] = [Order::Position, Order::Jacobian, Order::SecondDerivatives];

#[divan::bench(args = ORDERS, sample_count = 9, sample_size = 1)]
fn cone_of_64x64_rays_on_1_thread(bencher: Bencher, order: &Order) {
    trace_cone(bencher, *order, 1);
}

#[divan::bench(args = ORDERS, sample_count = 9, sample_size = 1)]
fn cone_of_64x64_rays_on_2_threads(bencher: Bencher, order: &Order) {
    trace_cone(bencher, *order, 2);
}

fn trace_cone(bencher: Bencher, order: Order, threads: usize) {
    let sight = cone::sight(&cone::config());
    let (rays, pool) = (cone::rays(), cone::pool(threads));
    bencher.counter(ItemsCount::new(rays.len() * sight.len())).bench_local(|| {
        let mapping = sight.observer_to_source();
        pool.install(|| mapping.map(&rays, order))
    });
}

/// Where the haloes stand, in scale radii from the rays: each has code of its own.
#[divan::bench_group(sample_count = 30, sample_size = 1)]
mod a_million_ray_planes {
    use super::*;

    #[divan::bench(args = ORDERS)]
    fn far_from_the_halo(bencher: Bencher, order: &Order) {
        trace_million(bencher, *order, 30.0, 1.0);
    }

    #[divan::bench(args = ORDERS)]
    fn across_the_scale_radius(bencher: Bencher, order: &Order) {
        trace_million(bencher, *order, 0.0, 1.0);
    }

    #[divan::bench(args = ORDERS)]
    fn inside_the_scale_radius(bencher: Bencher, order: &Order) {
        trace_million(bencher, *order, 0.0, 100.0);
    }
}

/// 8000 rays within 2″ through 125 equal haloes of scale radius `r_s_arcsec`, all `x_arcsec` right of the axis.
fn trace_million(bencher: Bencher, order: Order, x_arcsec: f64, r_s_arcsec: f64) {
    const PLANES: usize = 125;
    const RAYS: usize = 1_000_000 / PLANES;
    let column = |value: f64| vec![value; PLANES];
    let z = (0..PLANES).map(|i| 1.5 * (i as f64 + 0.5) / PLANES as f64).collect();
    let masses = HaloMasses::Angles { r_s_arcsec: column(r_s_arcsec), alpha_rs_arcsec: column(1e-5) };
    let background = Background::paper();
    let haloes = HaloCatalogue::new(1.5, &background, z, [column(x_arcsec), column(0.0)], masses)
        .expect("these haloes are in the domain");
    let sight = LineOfSight::new(&haloes, &Sheets::OnAxis).expect("on-axis sheets always exist");
    // A golden-angle spiral: every tile of rays spans the whole disc.
    let rays: Vec<[f64; 2]> = (0..RAYS)
        .map(|i| {
            let (sin, cos) = (2.399_963_229_728_653 * i as f64).sin_cos();
            let radius = 2.0 * ((i as f64 + 0.5) / RAYS as f64).sqrt();
            [radius * cos, radius * sin]
        })
        .collect();
    let pool = cone::pool(1);
    bencher.counter(ItemsCount::new(RAYS * PLANES)).bench_local(|| {
        let mapping = sight.observer_to_source();
        pool.install(|| mapping.map(&rays, order))
    });
}
