//! Whole runs and single exposures.

use std::path::{Path, PathBuf};

use haloray::config::Config as Settings;
use haloray::imaging::{Exposure, Psf};
use haloray::io::{Provenance, PsfKernel, Replace, Staging, write_atomically};
use haloray::numerics::random::Stage;
use haloray::pipeline::{self, Inputs, LensAndSource, Summary, View, line_of_sight};
use haloray::report::{RunRecord, image_file, stage_page, write_run};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, numbers, square};
use crate::config::Config;
use crate::errors::OrRaise;
use crate::haloes::Catalogue;
use crate::watch::run;

/// The PSF of a configuration: Gaussian, or the kernel in its file.
pub fn psf(settings: &Settings) -> haloray::Result<Psf> {
    let camera = &settings.instrument;
    match &camera.psf_file {
        None => Psf::gaussian(camera.psf_fwhm_arcsec, camera.psf_truncation_sigma, camera.pixel_scale_arcsec),
        Some(path) => {
            let kernel = PsfKernel::read(path, camera.pixel_scale_arcsec)?;
            Psf::kernel(kernel.nx, kernel.ny, kernel.data, kernel.oversampling)
        }
    }
}

/// What files of that sightline store.
pub fn provenance(config: &Config, sightline: u64) -> haloray::Result<Provenance> {
    let told = if sightline == 0 { String::new() } else { format!("# sightline = {sightline}\n") };
    Ok(Provenance::new(Some(config.0.seed), told + &config.text()?))
}

/// A folder for results: an earlier run's files are replaced, a user's own only when told to.
pub fn staged(folder: &Path, names: &[&str], overwrite: bool) -> haloray::Result<Staging> {
    Staging::begin(folder, names, if overwrite { Replace::Any } else { Replace::Own })
}

/// An exposure's two images, (y, x), e⁻/s.
fn set_exposure(all: &Bound<'_, PyDict>, exposure: &Exposure) -> PyResult<()> {
    let (py, side) = (all.py(), exposure.grid.pixels());
    all.set_item("noisy_e_s", square(py, exposure.noisy_e_s.clone(), side)?)?;
    all.set_item("noise_free_e_s", square(py, exposure.noise_free_e_s.clone(), side)?)?;
    all.set_item("pixel_scale_arcsec", exposure.grid.pixel_scale_arcsec())
}

fn set_view(all: &Bound<'_, PyDict>, view: &View) -> PyResult<()> {
    set_exposure(all, &view.exposure)?;
    all.set_item("lens_centre_arcsec", (view.lens_centre_arcsec[0], view.lens_centre_arcsec[1]))?;
    all.set_item("source_centre_arcsec", (view.source_centre_arcsec[0], view.source_centre_arcsec[1]))
}

/// One exposure of the lens of a configuration through its haloes.
#[pyfunction]
#[pyo3(signature = (config, haloes=None, sightline=0, progress=None))]
pub fn image<'py>(
    py: Python<'py>,
    config: &Config,
    haloes: Option<&Catalogue>,
    sightline: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (settings, imported) = (&config.0, haloes.map(|own| (*own.haloes).clone()));
    let view = run(py, progress.as_ref(), |monitor| {
        let haloes = pipeline::populate(settings, imported, sightline, monitor)?;
        let sight = line_of_sight(settings, &haloes, &haloes.catalogue)?;
        let shapes = LensAndSource::resolve(settings, sightline);
        View::through(settings, &sight, &shapes, &psf(settings)?, (sightline, Stage::NoiseImage), monitor)
    })?;
    let all = PyDict::new(py);
    set_view(&all, &view)?;
    all.set_item("background_rms_e_s", settings.instrument.background_rms_e_s())?;
    all.set_item("exposure_s", settings.instrument.exposure_s)?;
    Ok(all)
}

/// Writes an image of that configuration as FITS, as the command does.
#[pyfunction]
pub fn write_image(
    py: Python<'_>,
    config: &Config,
    pixels_e_s: Column<'_>,
    sightline: u64,
    path: PathBuf,
) -> PyResult<()> {
    let pixels = numbers(py, "pixels_e_s", &pixels_e_s)?;
    let settings = &config.0;
    let grid = haloray::imaging::SkyGrid::new(settings.image.pixels, settings.instrument.pixel_scale_arcsec);
    let (grid, provenance) = (grid.or_raise(py)?, provenance(config, sightline).or_raise(py)?);
    run(py, None, |_| {
        let image = image_file(settings, &psf(settings)?, &grid, pixels);
        write_atomically(&path, |path| image.write(path, &provenance))
    })
}

/// The whole chain; with `output`, its folder too.
#[pyfunction]
#[pyo3(signature = (config, haloes=None, sightline=0, output=None, overwrite=false, progress=None))]
pub fn simulate<'py>(
    py: Python<'py>,
    config: &Config,
    haloes: Option<&Catalogue>,
    sightline: u64,
    output: Option<PathBuf>,
    overwrite: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (settings, imported) = (&config.0, haloes.map(|own| (*own.haloes).clone()));
    let (simulation, json, complaints) = run(py, progress.as_ref(), |monitor| {
        let psf = psf(settings)?;
        let begin = |folder: &PathBuf| staged(folder, &["run.h5", "summary.json", "config.toml"], overwrite);
        let staging = output.as_ref().map(begin).transpose()?;
        let inputs = Inputs { catalogue: imported, psf: psf.clone() };
        let simulation = pipeline::simulate(settings, inputs, sightline, monitor)?;
        let summary = serde_json::to_string(&Summary::of(&simulation));
        let json =
            summary.map_err(|e| haloray::Error::out_of_range("summary", e, "representable as JSON"))?;
        let mut complaints = Vec::new();
        if let Some(staging) = staging {
            let provenance = provenance(config, sightline)?;
            write_run(&simulation, &psf, &staging, &provenance)?;
            let call = format!(
                "haloray.simulate(\"config.toml\", sightline={sightline}, output=\"simulate_again\")"
            );
            let about = "What every halo on one line of sight does to the image of a lens.";
            let record =
                RunRecord { repeat: vec![call], ..RunRecord::new("simulate", &[], about, &provenance) };
            stage_page(&staging, "", &record)?;
            complaints = staging.complaints();
            staging.commit()?;
        }
        Ok((simulation, json, complaints))
    })?;
    let all = PyDict::new(py);
    all.set_item("summary", json)?;
    all.set_item("complaints", complaints)?;
    for (name, view) in [("all_haloes", &simulation.all), ("tidal_haloes", &simulation.tidal)] {
        let own = PyDict::new(py);
        set_view(&own, view)?;
        all.set_item(name, own)?;
    }
    let maps = PyDict::new(py);
    let grid = simulation.maps.grid;
    for (name, unit, values) in simulation.maps.columns() {
        maps.set_item(name, (unit, square(py, values.to_vec(), grid.points)?))?;
    }
    let node = |i: usize| -grid.half_width_arcsec + grid.step_arcsec() * i as f64;
    maps.set_item("theta_arcsec", numpy::PyArray1::from_iter(py, (0..grid.points).map(node)))?;
    all.set_item("maps", maps)?;
    all.set_item("haloes", Catalogue::new(simulation.haloes.catalogue))?;
    Ok(all)
}
