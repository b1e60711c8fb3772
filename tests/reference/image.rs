//! A noise-free image, lens, haloes, source and PSF together, against lenstronomy's ImageModel.

use crate::cone::{Halo, catalogue};
use crate::differences::Differences;
use crate::oracle_table::Reference;
use haloray::imaging::{Instrument, PixelSampling, Psf, Scene, SkyGrid, integrate_pixels};
use haloray::mapping::multiplane::{LineOfSight, MainLens, Sheets};
use haloray::monitor::Silent;
use haloray::profile::light::Sersic;
use haloray::profile::mass::{Epl, MassModel};

/// Pixel differences over the peak: rays agree to 1e-14″, the gradient of the cusp is 1e3 peaks per arcsec at most.
const PEAK_TOLERANCE: f64 = 1e-11;

fn render(sampling: PixelSampling) -> Vec<f64> {
    let haloes = catalogue(&[
        Halo { z: 0.8, centre: [-0.7, 1.2], r_s: 0.3, alpha_rs: 0.006 },
        Halo { z: 0.3, centre: [1.1, -0.9], r_s: 0.4, alpha_rs: 0.01 },
    ]);
    let sight = LineOfSight::new(&haloes, &Sheets::None).unwrap();
    let profile = MassModel::Epl(Epl::new(1.5, 2.6, [0.08, -0.05], [0.03, -0.02]).unwrap());
    let lens = MainLens { z: 0.5, profile };
    let mapping = sight.through_lens(&lens).unwrap();
    let camera = Instrument::default();
    let source = Sersic::with_flux(camera.flux_e_s(23.0), 0.3, 6.0, [0.1, -0.05], [0.043, 0.071]).unwrap();
    let scene = Scene { mapping: &mapping, source: &source, lens_light: None };
    let grid = SkyGrid::new(64, camera.pixel_scale_arcsec).unwrap();
    let flux = integrate_pixels(&scene, &grid, sampling, 1e-4, &Silent).unwrap();
    let (width, cut) = (camera.psf_fwhm_arcsec, camera.psf_truncation_sigma);
    Psf::gaussian(width, cut, camera.pixel_scale_arcsec).unwrap().convolve(&flux, 64)
}

#[test]
fn the_image_is_lenstronomys() {
    let reference = Reference::load("image");
    let theirs = reference.column("flux");
    let peak = theirs.iter().copied().fold(0.0, f64::max);
    let against = |label: &str, ours: &[f64]| {
        Differences::of(label, ours.iter().zip(theirs).map(|(a, b)| (a - b) / peak))
    };
    against("image over peak, one point a pixel", &render(PixelSampling::Point)).require_max(PEAK_TOLERANCE);
    // Integrated pixels are another image: the cusp of the source is worth percents of the peak.
    let integrated = against("image over peak, integrated pixels", &render(PixelSampling::Adaptive));
    assert!(integrated.max > 1e-3, "the test must be able to fail: {integrated:?}");
}
