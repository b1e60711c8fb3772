//! The folder of a run: `run.h5`, `summary.json`, FITS images and figures.

use super::figures::draw_figures;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::imaging::{Exposure, Psf};
use crate::io::{ExposureKeywords, ImageFile, Provenance, PsfKernel, Staging, write_simulation};
use crate::pipeline::{Simulation, Summary};

/// Name of the HDF5 file of a run.
pub const RUN_FILE: &str = "run.h5";

/// Stages every file of a run; nothing is seen under its final name until `staging` is committed.
///
/// # Errors
/// [`Error::Write`] when the disk is full.
pub fn write_run(run: &Simulation, psf: &Psf, staging: &Staging, provenance: &Provenance) -> Result<()> {
    staging.write(RUN_FILE, |path| write_simulation(run, path, provenance))?;
    staging.write("summary.json", |path| {
        let text = serde_json::to_string_pretty(&Summary::of(run)).map_err(|e| Error::write(path, e))?;
        std::fs::write(path, text + "\n").map_err(|e| Error::write(path, e))
    })?;
    staging.write("config.toml", |path| {
        std::fs::write(path, &provenance.config_toml).map_err(|e| Error::write(path, e))
    })?;
    for (name, view) in [("all_haloes", &run.all), ("tidal_haloes", &run.tidal)] {
        for (suffix, pixels) in
            [("", &view.exposure.noisy_e_s), ("_noise_free", &view.exposure.noise_free_e_s)]
        {
            let image = image_file(&run.config, psf, &view.exposure, pixels);
            staging.write(format!("image_{name}{suffix}.fits"), |path| image.write(path, provenance))?;
        }
    }
    draw_figures(&staging.path(RUN_FILE), |name, figure| {
        staging.write(format!("figures/{name}.svg"), |path| figure.save(&path.with_extension("")).map(drop))
    })
}

/// An exposure as the fitter reads it: flux per pixel with WCS, exposure time, background and PSF.
pub fn image_file(config: &Config, psf: &Psf, exposure: &Exposure, pixels_e_s: &[f64]) -> ImageFile {
    let instrument = &config.instrument;
    let n = exposure.grid.pixels();
    let gaussian = matches!(psf, Psf::Gaussian(_));
    ImageFile {
        data: pixels_e_s.to_vec(),
        nx: n,
        ny: n,
        pixel_scale_arcsec: exposure.grid.pixel_scale_arcsec(),
        keywords: ExposureKeywords {
            exposure_time_s: Some(instrument.exposure_s),
            background_rms_e_per_s: Some(instrument.background_rms_e_s()),
            psf_fwhm_arcsec: gaussian.then_some(instrument.psf_fwhm_arcsec),
            psf_truncation_sigma: gaussian.then_some(instrument.psf_truncation_sigma),
            z_lens: Some(config.line_of_sight.z_lens),
            z_source: Some(config.line_of_sight.z_source),
            pixel_sampling: Some(config.image.pixel_sampling),
        },
        psf: match psf {
            Psf::Kernel { width, weights } => {
                Some(PsfKernel { data: weights.clone(), nx: *width, ny: *width })
            }
            _ => None,
        },
        mask: None,
    }
}
