//! The folder of a run: `run.h5`, `summary.json`, FITS images and figures.

use super::run_figures::run_figures;
use super::staged::{stage_figures, stage_json, stage_text};
use crate::config::Config;
use crate::error::Result;
use crate::imaging::{Psf, SkyGrid};
use crate::io::{ImageFile, Provenance, Staging, write_simulation};
use crate::pipeline::{Simulation, Summary};

/// Name of the HDF5 file of a run.
pub const RUN_FILE: &str = "run.h5";

/// Stages every file of a run; nothing is seen under its final name until `staging` is committed.
///
/// # Errors
/// [`crate::Error::Write`] when the disk is full.
pub fn write_run(run: &Simulation, psf: &Psf, staging: &Staging, provenance: &Provenance) -> Result<()> {
    staging.write(RUN_FILE, |path| write_simulation(run, path, provenance))?;
    stage_json(staging, "summary.json", &Summary::of(run))?;
    stage_text(staging, "config.toml", &provenance.config_toml)?;
    for (name, view) in [("all_haloes", &run.all), ("tidal_haloes", &run.tidal)] {
        for (suffix, pixels) in
            [("", &view.exposure.noisy_e_s), ("_noise_free", &view.exposure.noise_free_e_s)]
        {
            let image = image_file(&run.config, psf, &view.exposure.grid, pixels);
            staging.write(format!("image_{name}{suffix}.fits"), |path| image.write(path, provenance))?;
        }
    }
    let figures = run_figures(&staging.path(RUN_FILE))?;
    let named = figures.into_iter().map(|(name, draw)| (format!("figures/{name}"), draw));
    stage_figures(staging, named.collect())
}

/// An exposure of `config` as the fitter reads it.
pub fn image_file(config: &Config, psf: &Psf, grid: &SkyGrid, pixels_e_s: &[f64]) -> ImageFile {
    let (los, sampling) = (&config.line_of_sight, config.image.pixel_sampling);
    let redshifts = [los.z_lens, los.z_source];
    ImageFile::simulated(pixels_e_s, grid, &config.instrument, psf, sampling, redshifts)
}
