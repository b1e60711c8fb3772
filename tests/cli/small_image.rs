//! A lensed source on few pixels and a model that fits it in a second.

use haloray::imaging::{Instrument, PixelSampling, Psf, Scene, SkyGrid, expose};
use haloray::io::{ExposureKeywords, ImageFile};
use haloray::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use haloray::monitor::Silent;
use haloray::numerics::random::{Stage, StreamName};
use haloray::profile::light::Sersic;
use haloray::profile::mass::{Epl, MassModel};
use nalgebra::Complex;

/// A model of few parameters for the image of [`image`].
pub const MODEL: &str = r#"name = "small"
pixel_sampling = "adaptive" # the PIXSAMP of the image comes first

[[lens]]
profile = "EPL"
[lens.parameters]
theta_E = { uniform = [0.5, 2.0] }
gamma = 2.1
e1 = { normal = [0.0, 0.1] }
e2 = { normal = [0.0, 0.1] }

[[source]]
profile = "SERSIC"
[source.parameters]
R_sersic = { log_normal = [0.3, 0.5] }
n_sersic = 1.0
center_x = { uniform = [-0.2, 0.2] }
center_y = { uniform = [-0.2, 0.2] }
"#;
pub const SIDE: usize = 21;

/// A lensed source on 21×21 pixels of 0.16″, behind a shear γ_LOS, with one of many noise draws.
pub fn image(gamma_los: [f64; 2], number: u64) -> ImageFile {
    let camera = Instrument { pixel_scale_arcsec: 0.16, psf_fwhm_arcsec: 0.16, ..Instrument::default() };
    let lens = Epl::new(1.1, 2.1, [0.05, -0.08], [0.0, 0.0]).unwrap();
    let los = Tidal { gamma: Complex::new(gamma_los[0], gamma_los[1]), ..Tidal::NONE };
    let mapping =
        TidalLens::new(LineOfSightModel::Minimal { od: Tidal::NONE, los }, vec![MassModel::Epl(lens)]);
    let source = Sersic::with_flux(camera.flux_e_s(23.0), 0.3, 1.0, [0.0; 2], [0.05, 0.03]).unwrap();
    let scene = Scene { mapping: &mapping, source: &source, lens_light: None };
    let grid = SkyGrid::new(SIDE, camera.pixel_scale_arcsec).unwrap();
    let psf = Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec)
        .unwrap();
    let noise = StreamName { seed: 1, realisation: number, stage: Stage::NoiseImage };
    let exposure = expose(&scene, grid, &camera, &psf, PixelSampling::Point, noise, &Silent).unwrap();
    ImageFile {
        data: exposure.noisy_e_s,
        nx: SIDE,
        ny: SIDE,
        pixel_scale_arcsec: camera.pixel_scale_arcsec,
        keywords: ExposureKeywords {
            exposure_time_s: Some(camera.exposure_s),
            background_rms_e_per_s: Some(camera.background_rms_e_s()),
            psf_fwhm_arcsec: Some(camera.psf_fwhm_arcsec),
            psf_truncation_sigma: Some(camera.psf_truncation_sigma),
            z_lens: Some(0.5),
            z_source: Some(1.5),
            pixel_sampling: Some(PixelSampling::Point),
        },
        psf: None,
        mask: None,
    }
}
