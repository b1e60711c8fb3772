//! A noise-free composite system of the mock catalogue against lenstronomy's ImageModel.

use crate::differences::Differences;
use crate::oracle_table::Reference;
use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::mock::{Baryons, Halo, LensedSource, MockImage, MockSystem, Perturber};

/// Pixel differences over the peak that the issue allows.
const PEAK_TOLERANCE: f64 = 1e-8;

/// The system of data/reference/make_composite_image.py; masses and redshifts do not enter the image.
fn system() -> MockSystem {
    MockSystem {
        number: 0,
        attempts: 1,
        z_lens: 0.5,
        z_source: 2.0,
        einstein_radius_arcsec: f64::NAN,
        baryons: Baryons {
            mass_msun: f64::NAN,
            k_eff: 1.1,
            radius_arcsec: 0.31,
            index: 4.3,
            ellipticity: [0.03, -0.02],
            magnitude: 19.4,
        },
        halo: Halo {
            m200c_msun: f64::NAN,
            c200c: f64::NAN,
            r_s_arcsec: 5.2,
            alpha_rs_arcsec: 1.6,
            ellipticity: [-0.025, 0.03],
            centre_arcsec: [0.041, -0.055],
        },
        gamma_od: [0.011, -0.017],
        gamma_os: [-0.008, 0.021],
        gamma_ds: [0.013, 0.005],
        source: LensedSource {
            magnitude: 23.7,
            radius_arcsec: 0.35,
            index: 3.7,
            ellipticity: [0.02, -0.04],
            centre_arcsec: [0.153, -0.092],
        },
        perturbers: vec![Perturber {
            flux: 0.01,
            radius_arcsec: 0.12,
            index: 2.9,
            ellipticity: [0.05, -0.03],
            centre_arcsec: [0.31, -0.013],
        }],
        pixels: 61,
    }
}

fn render(system: &MockSystem) -> Vec<f64> {
    let camera = Instrument::default();
    let (width, cut) = (camera.psf_fwhm_arcsec, camera.psf_truncation_sigma);
    let psf = Psf::gaussian(width, cut, camera.pixel_scale_arcsec).unwrap();
    MockImage::expose(system, &camera, &psf, PixelSampling::Point, 1).unwrap().exposure.noise_free_e_s
}

#[test]
fn the_composite_image_is_lenstronomys() {
    let reference = Reference::load("composite_image");
    let theirs = reference.column("flux");
    let peak = theirs.iter().copied().fold(0.0, f64::max);
    let against = |label: &str, ours: &[f64]| {
        Differences::of(label, ours.iter().zip(theirs).map(|(a, b)| (a - b) / peak))
    };
    against("composite image over peak", &render(&system())).require_max(PEAK_TOLERANCE);
    let mut moved = system();
    moved.gamma_ds[0] += 1e-4;
    assert!(
        against("with another shear", &render(&moved)).max > PEAK_TOLERANCE,
        "the test must be able to fail"
    );
}
