//! A catalogue of your own (here made up; from an N-body run or pyHalo in earnest) in front of a lens: an image.
//!
//! cargo run --release --example own_catalogue -- image.fits

use std::path::PathBuf;

use haloray::config::Preset;
use haloray::imaging::{PixelSampling, Psf};
use haloray::io::{Provenance, read_haloes};
use haloray::monitor::Silent;
use haloray::numerics::random::Stage;
use haloray::pipeline::{Inputs, LensAndSource, View, line_of_sight, populate};
use haloray::report::image_file;

fn main() -> haloray::Result<()> {
    let output =
        std::env::args().nth(1).map_or_else(|| std::env::temp_dir().join("image.fits"), PathBuf::from);
    let table = std::env::temp_dir().join(format!("haloray_own_catalogue_{}.csv", std::process::id()));
    let text = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n0.3,1.2,0.9,3e9,14\n0.7,-40,25,8e12,6\n";
    std::fs::write(&table, text).map_err(|e| haloray::Error::write(&table, e))?;

    let mut config = Preset::Paper.config()?;
    config.image.pixel_sampling = PixelSampling::Adaptive;
    let catalogue = read_haloes(&table, config.line_of_sight.z_source, &config.cosmology)?;
    let instrument = &config.instrument;
    let psf = Psf::gaussian(
        instrument.psf_fwhm_arcsec,
        instrument.psf_truncation_sigma,
        instrument.pixel_scale_arcsec,
    )?;
    let inputs = Inputs { catalogue: Some(catalogue), psf };
    let haloes = populate(&config, inputs.catalogue, 0, &Silent)?;
    let sight = line_of_sight(&config, &haloes, &haloes.catalogue)?;
    let shapes = LensAndSource::resolve(&config, 0);
    let view = View::through(&config, &sight, &shapes, &inputs.psf, (0, Stage::NoiseImage), &Silent)?;
    println!("{} haloes, gamma_os on the axis {}", view.number_of_haloes, view.effective.os.tidal.gamma);

    let image = image_file(&config, &inputs.psf, &view.exposure.grid, &view.exposure.noisy_e_s);
    image.write(&output, &Provenance::new(Some(config.seed), ""))?;
    println!("written to {}", output.display());
    let _ = std::fs::remove_file(&table);
    Ok(())
}
