//! Tracing tells its monitor of every ray once, and stops when told to.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::adaptive::{background_haloes, cone, errors, grid};
use haloray::Error;
use haloray::halo::{draw_brute_force, draw_direct};
use haloray::mapping::multiplane::{Accuracy, Field, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::monitor::{Monitor, Silent};

const SIDE: usize = 130;

/// Counts units, and cancels after so many.
struct Count {
    units: AtomicU64,
    enough: u64,
}

impl Count {
    fn up_to(enough: u64) -> Self {
        Self { units: AtomicU64::new(0), enough }
    }
}

impl Monitor for Count {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, units: u64) {
        self.units.fetch_add(units, Ordering::Relaxed);
    }
    fn tell(&self, _: &str) {}
    fn end(&self) {}
    fn is_cancelled(&self) -> bool {
        self.units.load(Ordering::Relaxed) >= self.enough
    }
}

#[test]
fn every_ray_is_told_once_and_watching_changes_nothing() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let (segment, theta) = (sight.observer_to_source(), grid(SIDE, 1.8));
    let count = Count::up_to(u64::MAX);
    let rays = segment.trace(&theta, Order::SecondDerivatives, &count).unwrap();
    assert_eq!(rays, segment.map(&theta, Order::SecondDerivatives));
    assert_eq!(count.units.into_inner(), theta.len() as u64);
}

#[test]
fn adaptive_tracing_keeps_its_accuracy_and_tells_every_ray_once() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let (segment, theta) = (sight.observer_to_source(), grid(SIDE, 1.8));
    let accuracy_arcsec = 1e-7;
    let adaptive =
        segment.adaptive(Accuracy::WithinArcsec(accuracy_arcsec), Field::around(&theta), theta.len());
    let count = Count::up_to(u64::MAX);
    let rays = adaptive.trace(&theta, Order::Position, &count).unwrap();
    let [beta, ..] = errors(&rays, &segment.map(&theta, Order::Position));
    assert!(beta > 0.0 && beta <= accuracy_arcsec, "{beta:e}");
    let report = adaptive.report();
    assert_eq!(report.rays, theta.len(), "{report:?}");
    assert!(beta <= report.bound_arcsec && report.measured_arcsec <= accuracy_arcsec, "{report:?}");
    assert_eq!(count.units.into_inner(), theta.len() as u64);
}

#[test]
fn tracing_stops_when_told_to() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let (segment, theta) = (sight.observer_to_source(), grid(SIDE, 1.8));
    let adaptive = segment.adaptive(Accuracy::default(), Field::around(&theta), theta.len());
    let mappings: [&dyn Mapping; 2] = [&segment, &adaptive];
    for mapping in mappings {
        let count = Count::up_to(1000);
        let stopped = mapping.trace(&theta, Order::Jacobian, &count);
        assert!(matches!(stopped, Err(Error::Cancelled)));
        let traced = count.units.into_inner();
        assert!((1000..theta.len() as u64).contains(&traced), "{traced}");
    }
}

#[test]
fn drawing_stops_when_told_to() {
    let config = haloray::config::Preset::Paper.config().unwrap();
    let population = haloray::pipeline::populate(&config, None, 0, &Silent).unwrap().population;
    let draws = [draw_brute_force, draw_direct];
    for draw in draws {
        let count = Count::up_to(10);
        assert!(matches!(draw(&population, 1, 0, &count), Err(Error::Cancelled)));
    }
}
