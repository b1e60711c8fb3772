//! Images of point sources against lenstronomy's LensEquationSolver.

use crate::differences::Differences;
use crate::oracle_table::Reference;
use haloray::diagnostics::{PointImages, SkyWindow};
use haloray::mapping::tidal::{LineOfSightModel, TidalLens};
use haloray::monitor::Silent;
use haloray::profile::mass::{Epl, External, MassModel};

/// lenstronomy stops its iteration at a residual of 1e-12 in β, magnified in the image.
const POSITION_TOLERANCE_ARCSEC: f64 = 1e-9;
/// Magnifications relative, between positions that differ that much.
const MAGNIFICATION_TOLERANCE: f64 = 1e-6;

#[test]
fn every_image_of_lenstronomy_is_found() {
    let table = Reference::load("images");
    let column = |name: &str| table.column(name);
    let (mut apart, mut magnification) = (Vec::new(), Vec::new());
    for i in 0..column("case").len() {
        let at = |name: &str| column(name)[i];
        let epl = Epl::new(1.0, at("slope"), [at("e1"), at("e2")], [0.0; 2]).unwrap();
        let shear = External::new(0.0, [at("gamma1"), at("gamma2")], [0.0; 4], [0.0; 2]).unwrap();
        let lens =
            TidalLens::new(LineOfSightModel::EMPTY, vec![MassModel::Epl(epl), MassModel::External(shear)]);
        let window = SkyWindow::about_axis(4.0, lens.lens_centres_arcsec()).unwrap();
        let found = PointImages::of(&lens, &window, [at("source_x"), at("source_y")], &Silent).unwrap();
        assert!(found.is_complete(), "row {i}: {found:?}");
        let distance = |p: [f64; 2]| (p[0] - at("x")).hypot(p[1] - at("y"));
        let nearest = found
            .images
            .iter()
            .min_by(|a, b| distance(a.theta_arcsec).total_cmp(&distance(b.theta_arcsec)))
            .unwrap();
        apart.push(distance(nearest.theta_arcsec));
        magnification.push(nearest.magnification() / at("magnification") - 1.0);
    }
    Differences::of("image positions, arcsec", apart).require_max(POSITION_TOLERANCE_ARCSEC);
    Differences::of("magnifications, relative", magnification).require_max(MAGNIFICATION_TOLERANCE);
}
