//! Pixels integrated to a stated accuracy.

use haloray::cosmology::Background;
use haloray::halo::{HaloCatalogue, HaloMasses};
use haloray::imaging::{PixelSampling, Scene, SkyGrid, integrate_pixels};
use haloray::mapping::multiplane::{LineOfSight, MainLens, Sheets};
use haloray::monitor::Silent;
use haloray::profile::light::Sersic;
use haloray::profile::mass::{Epl, MassModel};

/// One halo on the ring in front of a power-law lens: a cusp of the mapping and one of the source.
fn line_of_sight() -> LineOfSight {
    let masses = HaloMasses::Angles { r_s_arcsec: vec![0.3], alpha_rs_arcsec: vec![0.01] };
    let at = [vec![0.61], vec![0.55]];
    let background = Background::paper();
    let haloes = HaloCatalogue::new(1.5, &background, vec![0.3], at, masses).unwrap();
    LineOfSight::new(&haloes, &Sheets::OnAxis).unwrap()
}

#[test]
fn adaptive_integration_meets_its_tolerance_where_the_centre_does_not() {
    let sight = line_of_sight();
    let lens =
        MainLens { z: 0.5, profile: MassModel::Epl(Epl::new(0.8, 2.3, [0.1, 0.05], [0.0, 0.0]).unwrap()) };
    let mapping = sight.through_lens(&lens).unwrap();
    let source = Sersic::with_flux(3.0, 0.25, 1.5, [0.1, -0.05], [0.013, 0.02]).unwrap();
    let scene = Scene { mapping: &mapping, source: &source, lens_light: None };
    let grid = SkyGrid::new(30, 0.08).unwrap();
    let tolerance = 1e-5;
    let got = integrate_pixels(&scene, &grid, PixelSampling::Adaptive, tolerance, &Silent).unwrap();
    let crude = integrate_pixels(&scene, &grid, PixelSampling::Point, tolerance, &Silent).unwrap();
    // 40×40 rays a pixel, exact mapping.
    let fine = 40;
    let step = 0.08 / f64::from(fine);
    let (mut worst, mut worst_crude) = (0.0_f64, 0.0_f64);
    for (k, theta) in grid.theta_arcsec().into_iter().enumerate() {
        let at = |c: f64, j: i32| c + (f64::from(j) - 0.5 * f64::from(fine - 1)) * step;
        let rays: Vec<[f64; 2]> =
            (0..fine * fine).map(|i| [at(theta[0], i % fine), at(theta[1], i / fine)]).collect();
        let want = scene.surface_brightness(&rays, &Silent).unwrap().iter().sum::<f64>() * step * step;
        worst = worst.max((got[k] - want).abs());
        worst_crude = worst_crude.max((crude[k] - want).abs());
    }
    assert!(worst < 5.0 * tolerance, "{worst:e}");
    assert!(worst_crude > 30.0 * worst, "the test must be able to fail: {worst_crude:e}");
}
