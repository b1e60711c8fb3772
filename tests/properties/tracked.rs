//! Tracing that reports its progress traces the same rays, also where they take several reports.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::adaptive::{background_haloes, cone, errors, grid};
use haloray::mapping::multiplane::{Accuracy, Field, Sheets};
use haloray::mapping::{Mapping, Order};
use haloray::monitor::Monitor;
use haloray::pipeline::Tracked;

/// More rays than one report covers (16,384).
const SIDE: usize = 130;

/// Counts units and how often they came.
#[derive(Default)]
struct Count {
    units: AtomicU64,
    reports: AtomicU64,
}

impl Monitor for Count {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, units: u64) {
        self.units.fetch_add(units, Ordering::Relaxed);
        self.reports.fetch_add(1, Ordering::Relaxed);
    }
    fn tell(&self, _: &str) {}
    fn end(&self) {}
}

#[test]
fn rays_of_several_reports_are_the_rays_of_one_trace() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let (segment, theta) = (sight.observer_to_source(), grid(SIDE, 1.8));
    let count = Count::default();
    let tracked = Tracked { mapping: &segment, monitor: &count };
    let rays = tracked.map(&theta, Order::SecondDerivatives);
    assert_eq!(rays, segment.map(&theta, Order::SecondDerivatives));
    assert_eq!(count.units.into_inner(), theta.len() as u64);
    assert!(count.reports.into_inner() > 1);
}

#[test]
fn adaptive_tracing_keeps_its_accuracy_in_every_report() {
    let sight = cone(&background_haloes(), &Sheets::OnAxis);
    let (segment, theta) = (sight.observer_to_source(), grid(SIDE, 1.8));
    let accuracy_arcsec = 1e-7;
    let adaptive =
        segment.adaptive(Accuracy::WithinArcsec(accuracy_arcsec), Field::around(&theta), theta.len());
    assert!(adaptive.is_adaptive());
    let count = Count::default();
    let rays = Tracked { mapping: &adaptive, monitor: &count }.map(&theta, Order::Position);
    let [beta, ..] = errors(&rays, &segment.map(&theta, Order::Position));
    assert!(beta > 0.0 && beta <= accuracy_arcsec, "{beta:e}");
    let report = adaptive.report();
    assert_eq!(report.rays, theta.len(), "{report:?}");
    assert!(beta <= report.bound_arcsec && report.measured_arcsec <= accuracy_arcsec, "{report:?}");
    assert_eq!(count.units.into_inner(), theta.len() as u64);
}
