//! Section 2.3: Table 1's image fitted with the full and with the minimal model of the line of sight.

use nalgebra::Complex;

use crate::error::{Error, Result};
use crate::imaging::{Exposure, Instrument, PixelSampling, Psf, Scene, SkyGrid, expose};
use crate::inference::model::{CompiledModel, ModelDescription};
use crate::inference::sample::SamplerSettings;
use crate::inference::{Fit, FitSettings, NoStore, Observation};
use crate::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use crate::monitor::{Monitor, Silent};
use crate::numerics::random::{Stage, StreamName};
use crate::profile::light::Sersic;
use crate::profile::mass::{Epl, MassModel};

/// Table 1 of Hogg et al. 2023; the centre of lens and lens light with the digits of the authors' notebook.
const TABLE_1: [(&str, f64); 22] = [
    ("lens.theta_E", 1.2),
    ("lens.gamma", 2.6),
    ("lens.e1", -0.053),
    ("lens.e2", 0.077),
    ("lens.center_x", 0.01375733),
    ("lens.center_y", -0.04843291),
    ("lens_light.magnitude", 20.0),
    ("lens_light.R_sersic", 0.5),
    ("lens_light.n_sersic", 4.0),
    ("source.magnitude", 24.0),
    ("source.R_sersic", 0.3),
    ("source.n_sersic", 1.0),
    ("source.e1", 0.104),
    ("source.e2", -0.038),
    ("source.center_x", -0.003),
    ("source.center_y", 0.048),
    ("gamma1_od", -0.0027),
    ("gamma2_od", -0.0060),
    ("gamma1_os", -0.0091),
    ("gamma2_os", -0.028),
    ("gamma1_ds", 0.019),
    ("gamma2_ds", 0.018),
];

/// Table 1's system as a camera saw it.
#[derive(Debug, Clone)]
pub struct Table1Image {
    /// The image.
    pub exposure: Exposure,
    /// The camera.
    pub instrument: Instrument,
    /// True values by parameter name, γ_LOS and ω_LOS included.
    pub truths: Vec<(String, f64)>,
}

/// The image with both fits.
#[derive(Debug, Clone)]
pub struct Advantage {
    /// What was fitted.
    pub image: Table1Image,
    /// Fit with the full model.
    pub full: Fit,
    /// Fit with the minimal model.
    pub minimal: Fit,
}

/// Pixels a side of the image.
const PIXELS: usize = 49;

fn table(name: &str) -> Result<f64> {
    let row = TABLE_1.iter().find(|(own, _)| *own == name);
    row.map(|(_, value)| *value).ok_or_else(|| Error::out_of_range(name, "missing", "a row of Table 1"))
}

fn light(part: &str, instrument: &Instrument, ellipticity: [f64; 2], centre: [f64; 2]) -> Result<Sersic> {
    let of = |name: &str| table(&format!("{part}.{name}"));
    Sersic::with_flux(
        instrument.flux_e_s(of("magnitude")?),
        of("R_sersic")?,
        of("n_sersic")?,
        ellipticity,
        centre,
    )
}

/// Table 1's system as HST sees it, with noise of the seed, sampled at pixel centres as the paper did.
///
/// # Errors
/// A row that the table lacks.
pub fn table1_image(seed: u64) -> Result<Table1Image> {
    let pair = |a: &str, b: &str| -> Result<[f64; 2]> { Ok([table(a)?, table(b)?]) };
    let tidal = |place: &str| -> Result<Tidal> {
        let [gamma1, gamma2] = pair(&format!("gamma1_{place}"), &format!("gamma2_{place}"))?;
        Ok(Tidal { kappa: 0.0, gamma: Complex::new(gamma1, gamma2), omega: 0.0 })
    };
    let instrument = Instrument::default();
    let (shape, centre) = (pair("lens.e1", "lens.e2")?, pair("lens.center_x", "lens.center_y")?);
    let lens = Epl::new(table("lens.theta_E")?, table("lens.gamma")?, shape, centre)?;
    let model = LineOfSightModel::Full { od: tidal("od")?, os: tidal("os")?, ds: tidal("ds")? };
    let mapping = TidalLens::new(model, vec![MassModel::Epl(lens)]);
    let source_centre = pair("source.center_x", "source.center_y")?;
    let source = light("source", &instrument, pair("source.e1", "source.e2")?, source_centre)?;
    let lens_light = light("lens_light", &instrument, shape, centre)?;
    let scene = Scene { mapping: &mapping, source: &source, lens_light: Some(&lens_light) };
    let grid = SkyGrid::new(PIXELS, instrument.pixel_scale_arcsec)?;
    let psf = psf(&instrument)?;
    let noise = StreamName { seed, realisation: 0, stage: Stage::NoiseImage };
    let exposure = expose(&scene, grid, &instrument, &psf, PixelSampling::Point, noise, &Silent)?;
    let mut truths: Vec<(String, f64)> = TABLE_1
        .iter()
        .filter(|(name, _)| !name.contains("magnitude"))
        .map(|(n, v)| (n.to_string(), *v))
        .collect();
    if let Some(LineOfSightModel::Minimal { los, .. }) = model.minimal() {
        let implied = [("gamma1_los", los.gamma.re), ("gamma2_los", los.gamma.im), ("omega_los", los.omega)];
        truths.extend(implied.map(|(name, value)| (name.to_string(), value)));
    }
    Ok(Table1Image { exposure, instrument, truths })
}

fn psf(instrument: &Instrument) -> Result<Psf> {
    Psf::gaussian(instrument.psf_fwhm_arcsec, instrument.psf_truncation_sigma, instrument.pixel_scale_arcsec)
}

/// Makes the image and fits both models.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn advantage(seed: u64, sampler: SamplerSettings, monitor: &dyn Monitor) -> Result<Advantage> {
    let image = table1_image(seed)?;
    let (exposure, instrument) = (&image.exposure, &image.instrument);
    let fit = |name: &str| {
        let description = ModelDescription::built_in(name)?;
        let data = exposure.noisy_e_s.clone();
        let observation = Observation::of_camera(exposure.grid, data, instrument, psf(instrument)?);
        let settings = FitSettings {
            likelihood: description.likelihood,
            pixel_sampling: PixelSampling::Point,
            sampler,
            seed,
            ..FitSettings::default()
        };
        let _task = monitor.task(name, None);
        Fit::run(observation, CompiledModel::new(&description)?, settings, &mut NoStore, monitor)
    };
    let (full, minimal) = (fit("simple-full")?, fit("simple-minimal")?);
    Ok(Advantage { image, full, minimal })
}
