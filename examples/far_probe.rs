//! probe
use haloray::config::Preset;
use haloray::mapping::multiplane::Field;
use haloray::mapping::{Mapping, Order};
use haloray::pipeline::{Silent, line_of_sight, populate};
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let side: usize = args[1].parse().unwrap();
    let pix: f64 = args[2].parse().unwrap();
    let order = [Order::Position, Order::Jacobian, Order::SecondDerivatives]
        [args.get(3).map_or(0, |s| s.parse().unwrap())];
    let mut config = Preset::Paper.config().unwrap();
    if let Some(c) = args.get(4) {
        config.haloes.min_point_shear = c.parse().unwrap();
    }
    for seed in [1u64, 77, 78] {
        config.seed = seed;
        let h = populate(&config, None, 0, &Silent).unwrap();
        let t1 = Instant::now();
        let sight = line_of_sight(&config, &h, &h.catalogue).unwrap();
        let t2 = Instant::now();
        let at = |i: usize| pix * (i as f64 - 0.5 * (side - 1) as f64);
        let rays: Vec<[f64; 2]> = (0..side * side).map(|k| [at(k % side), at(k / side)]).collect();
        let seg = sight.observer_to_source();
        for _ in 0..2 {
            let t3 = Instant::now();
            let ad = seg.adaptive(Field::around(&rays).unwrap(), 1e-7, rays.len()).unwrap();
            let t4 = Instant::now();
            let tr = ad.trace(&rays, order);
            let t5 = Instant::now();
            println!(
                "seed {seed} n {} sight {:?} setup {:?} trace {:?}; bound {:e} exact rays {} met {}",
                sight.len(),
                t2 - t1,
                t4 - t3,
                t5 - t4,
                tr.bound_arcsec,
                tr.traced_exactly,
                tr.haloes_met
            );
            let step = (rays.len() / 4096).max(1);
            let some: Vec<[f64; 2]> = rays.iter().copied().step_by(step).collect();
            let t6 = Instant::now();
            let exact = seg.map(&some, order);
            let t7 = Instant::now();
            let worst = tr
                .rays
                .beta_arcsec
                .iter()
                .step_by(step)
                .zip(&exact.beta_arcsec)
                .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                .fold(0.0, f64::max);
            let wj = tr
                .rays
                .jacobian
                .iter()
                .step_by(step)
                .flatten()
                .zip(exact.jacobian.iter().flatten())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            let wb = tr
                .rays
                .second_per_arcsec
                .iter()
                .step_by(step)
                .flatten()
                .zip(exact.second_per_arcsec.iter().flatten())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            println!("   exact {:?} worst {worst:e} {wj:e} {wb:e}", t7 - t6);
        }
    }
}
