//! Mock systems of the paper's catalogue and their images.

use std::ops::Range;

use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::io::{Column as TableColumn, Values, catalogue_table};
use haloray::mock::{MockImage, MockSystem, Protocol};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rayon::prelude::*;

use crate::arrays::square;
use crate::errors::{OrRaise, input};
use crate::watch::run;

fn protocol(py: Python<'_>, name: &str) -> PyResult<Protocol> {
    match name {
        "paper" => Ok(Protocol::paper()),
        "text" => Ok(Protocol::text()),
        other => Err(input(py, "preset", other, "\"paper\" or \"text\"")),
    }
}

/// The camera of the mock catalogue: scale, background rms, exposure, PSF width and truncation.
#[pyfunction]
pub fn mock_instrument() -> (f64, f64, f64, f64, f64) {
    let own = Instrument::default();
    let rms = own.background_rms_e_s();
    (own.pixel_scale_arcsec, rms, own.exposure_s, own.psf_fwhm_arcsec, own.psf_truncation_sigma)
}

/// Draws systems `start..end` of a seed and, where asked for, images them.
#[pyfunction]
#[pyo3(signature = (preset, seed, start, end, pixel_sampling, images, perturbers, progress=None))]
#[allow(clippy::too_many_arguments, reason = "each has its name in Python")]
pub fn mock<'py>(
    py: Python<'py>,
    preset: &str,
    seed: u64,
    start: u64,
    end: u64,
    pixel_sampling: &str,
    images: bool,
    perturbers: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let preset = protocol(py, preset)?;
    let protocol = if perturbers { preset } else { preset.without_perturbers() };
    let sampling = match pixel_sampling {
        "point" => PixelSampling::Point,
        "adaptive" => PixelSampling::Adaptive,
        other => return Err(input(py, "pixel_sampling", other, "\"point\" or \"adaptive\"")),
    };
    let instrument = Instrument::default();
    let (systems, exposures) = run(py, progress.as_ref(), |monitor| {
        let scale = instrument.pixel_scale_arcsec;
        let draw = |number: u64| {
            monitor.check()?;
            MockSystem::draw(&protocol, seed, number, scale)
        };
        let systems: Vec<MockSystem> =
            Range { start, end }.into_par_iter().map(draw).collect::<haloray::Result<_>>()?;
        let psf = Psf::gaussian(instrument.psf_fwhm_arcsec, instrument.psf_truncation_sigma, scale)?;
        let seen = if images { systems.as_slice() } else { &[] };
        let task = monitor.task("images", Some(seen.len() as u64));
        let expose = |system: &MockSystem| {
            task.check()?;
            let image = MockImage::expose(system, &instrument, &psf, sampling, seed);
            task.advance(1);
            image
        };
        let exposures: Vec<MockImage> = seen.par_iter().map(expose).collect::<haloray::Result<_>>()?;
        drop(task);
        Ok((systems, exposures))
    })?;
    let found = PyDict::new(py);
    let columns = PyList::empty(py);
    for TableColumn { name, unit, values } in catalogue_table(&systems, None).or_raise(py)?.columns() {
        if let Values::F64(values) = values {
            columns.append((name, unit.as_deref().unwrap_or(""), PyArray1::from_slice(py, values)))?;
        }
    }
    found.set_item("columns", columns)?;
    let truths: Vec<_> = systems.iter().map(MockSystem::truths).collect();
    let names: Vec<&str> = truths.first().into_iter().flatten().map(|(name, _)| name.as_str()).collect();
    let of = |place: usize| PyArray1::from_iter(py, truths.iter().map(move |row| row[place].1));
    let named: Vec<_> = names.iter().enumerate().map(|(place, name)| (*name, of(place))).collect();
    found.set_item("truths", named)?;
    let all = PyList::empty(py);
    for MockImage { exposure, source_e_s, quality } in exposures {
        let (own, side) = (PyDict::new(py), exposure.grid.pixels());
        own.set_item("noisy_e_s", square(py, exposure.noisy_e_s, side)?)?;
        own.set_item("noise_free_e_s", square(py, exposure.noise_free_e_s, side)?)?;
        own.set_item("source_e_s", square(py, source_e_s, side)?)?;
        own.set_item("quality", quality)?;
        all.append(own)?;
    }
    found.set_item("images", all)?;
    Ok(found)
}
