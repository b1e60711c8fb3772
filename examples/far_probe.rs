use haloray::config::Preset;
use haloray::mapping::multiplane::Field;
use haloray::mapping::{Mapping, Order};
use haloray::pipeline::{Silent, line_of_sight, populate};
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let side: usize = args[1].parse().unwrap();
    let pix: f64 = args[2].parse().unwrap();
    let mut config = Preset::Paper.config().unwrap();
    if let Some(c) = args.get(3) { config.haloes.min_point_shear = c.parse().unwrap(); }
    for seed in [1u64, 77, 78] {
        config.seed = seed;
        let t0 = Instant::now();
        let h = populate(&config, None, 0, &Silent).unwrap();
        let t1 = Instant::now();
        let sight = line_of_sight(&config, &h, &h.catalogue).unwrap();
        let t2 = Instant::now();
        let at = |i: usize| pix * (i as f64 - 0.5 * (side - 1) as f64);
        let rays: Vec<[f64; 2]> = (0..side * side).map(|k| [at(k % side), at(k / side)]).collect();
        let seg = sight.observer_to_source();
        let t3 = Instant::now();
        let ad = seg.adaptive(Field::around(&rays).unwrap(), 1e-7, rays.len()).unwrap();
        let t4 = Instant::now();
        let (beta, bound, exactly) = ad.positions(&rays);
        let t5 = Instant::now();
        println!("seed {seed} n {} populate {:?} sight {:?} setup {:?} trace {:?}; bound {bound:e} exact rays {exactly}", sight.len(), t1 - t0, t2 - t1, t4 - t3, t5 - t4);
        let some: Vec<[f64;2]> = rays.iter().copied().step_by((rays.len() / 4096).max(1)).collect();
        let t6 = Instant::now();
        let exact = seg.map(&some, Order::Position).beta_arcsec;
        let t7 = Instant::now();
        let worst = beta.iter().step_by((rays.len() / 4096).max(1)).zip(&exact).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
        println!("   exact {:?} worst {worst:e} {:?}", t7 - t6, ad.report(bound, exactly, 50, 1));
    }
}
