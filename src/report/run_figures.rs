//! Every figure of a run, drawn from its saved file alone.

use std::path::Path;
use std::sync::Arc;

use super::curve_figure::lay_over;
use super::staged::Drawing;
use crate::config::Config;
use crate::constants::ARCSEC_RAD;
use crate::diagnostics::CriticalCurves;
use crate::error::{Error, FileFault, Result};
use crate::io::{AttributeValue, RunFileReader, read_curves};
use crate::plot::figures::{
    CylinderData, DrawnHaloes, GridData, cylinder, flexion_maps, histograms, images, mass_function,
    tidal_maps,
};
use crate::plot::{Colour, Figure};

/// Of the haloes in the tidal regime every tenth is drawn, as in the paper, where they are so many that dots would cover all.
const FEW_HALOES: usize = 5000;
const CYLINDER_STRIDE: usize = 10;

/// Each figure of the run saved at `run_file`, by name, to be drawn.
///
/// # Errors
/// When the file is not a run of haloray.
pub fn run_figures(run_file: &Path) -> Result<Vec<(&'static str, Drawing<'static>)>> {
    let run = Arc::new(open(run_file)?);
    let figure = |draw: fn(&RunFileReader, &Config) -> Result<Figure>| -> Drawing<'static> {
        let run = Arc::clone(&run);
        Box::new(move || draw(&run.0, &run.1).map(Some))
    };
    let mut figures = vec![("cylinder", figure(cylinder_figure)), ("histograms", figure(histogram_figure))];
    // Haloes of the user's own do not come from the relation of the configuration.
    if !run.1.haloes.is_imported() {
        figures.insert(0, ("mass_function", figure(mass_function_figure)));
    }
    figures.extend(map_figures(run_file)?);
    figures.push(("images", figure(image_figure)));
    Ok(figures)
}

/// The figures of the maps saved in `file` (of a run, or of maps alone), by name, to be drawn.
///
/// # Errors
/// When the file holds no maps.
pub fn map_figures(file: &Path) -> Result<[(&'static str, Drawing<'static>); 2]> {
    let saved = Arc::new(open(file)?);
    let of_images = saved.0.names("/")?.iter().any(|name| name == "images");
    let figure = |draw: fn(&RunFileReader, &Config) -> Result<Figure>, colour| -> Drawing<'static> {
        let saved = Arc::clone(&saved);
        Box::new(move || {
            let mut figure = draw(&saved.0, &saved.1)?;
            let parent = if of_images { "images/all_haloes" } else { "" };
            if let Some(curves) = saved_curves(&saved.0, parent)? {
                figure.panels.iter_mut().for_each(|panel| lay_over(panel, &curves, colour));
            }
            Ok(Some(figure))
        })
    };
    let (tidal, flexion) =
        (figure(tidal_map_figure, Colour::BLACK), figure(flexion_map_figure, Colour::WHITE));
    Ok([("tidal_maps", tidal), ("flexion_maps", flexion)])
}

/// The critical curves saved in the group `parent`, if there are any; caustics about the source.
fn saved_curves(file: &RunFileReader, parent: &str) -> Result<Option<CriticalCurves>> {
    if !file.names(parent)?.iter().any(|name| name == "curves") {
        return Ok(None);
    }
    let group = format!("{parent}/curves");
    let source = [number(file, &group, "source_x_arcsec")?, number(file, &group, "source_y_arcsec")?];
    Ok(Some(read_curves(file, &group)?.about(source)))
}

fn open(path: &Path) -> Result<(RunFileReader, Config)> {
    let file = RunFileReader::open(path)?;
    let config = toml::from_str(&file.provenance()?.config_toml).map_err(|e| {
        Error::file(FileFault::Content, path, format!("holds no configuration of this version: {e}"))
    })?;
    Ok((file, config))
}

fn number(file: &RunFileReader, object: &str, name: &str) -> Result<f64> {
    Ok(match file.read_attribute(object, name)? {
        AttributeValue::F64(value) => value,
        _ => f64::NAN,
    })
}

fn mass_function_figure(file: &RunFileReader, _: &Config) -> Result<Figure> {
    let masses = file.read_1d("mass_function", "m200c_msun")?;
    let density = file.read_1d("mass_function", "dn_dlnm_per_cmpc3")?;
    let name = match file.read_attribute("mass_function", "name")? {
        AttributeValue::Text(name) => name,
        _ => String::new(),
    };
    let z = number(file, "mass_function", "z")?;
    let legend = format!("{name}, z = {z}");
    if !file.names("mass_function")?.iter().any(|name| name == "drawn") {
        return Ok(mass_function(&legend, &masses, &density, None));
    }
    let drawn = DrawnHaloes {
        edges_msun: &file.read_1d("mass_function/drawn", "m200c_edges_msun")?,
        counts: &file.read_1d("mass_function/drawn", "counts")?,
        volume_cmpc3: &file.read_1d("mass_function/drawn", "kept_volume_cmpc3")?,
    };
    Ok(mass_function(&legend, &masses, &density, Some(drawn)))
}

fn cylinder_figure(file: &RunFileReader, config: &Config) -> Result<Figure> {
    let distance = file.read_1d("haloes", "chi_cmpc")?;
    let theta_y = file.read_1d("haloes", "theta_y_arcsec")?;
    let transverse: Vec<f64> =
        distance.iter().zip(&theta_y).map(|(chi, theta)| chi * theta * ARCSEC_RAD).collect();
    Ok(cylinder(&CylinderData {
        distance_cmpc: &distance,
        transverse_cmpc: &transverse,
        delta: &file.read_1d("haloes", "delta_h")?,
        delta_threshold: config.diagnostics.delta_threshold,
        stride: if file.read_1d("haloes", "delta_h")?.len() < FEW_HALOES { 1 } else { CYLINDER_STRIDE },
        lens_distance_cmpc: number(file, "distances", "lens_cmpc")?,
        source_distance_cmpc: number(file, "distances", "source_cmpc")?,
        redshift: &file.read_1d("distances", "z")?,
        redshift_distance_cmpc: &file.read_1d("distances", "chi_cmpc")?,
    }))
}

fn histogram_figure(file: &RunFileReader, config: &Config) -> Result<Figure> {
    let (gamma1, gamma2) = (file.read_1d("haloes", "gamma1_h")?, file.read_1d("haloes", "gamma2_h")?);
    let shear: Vec<f64> = gamma1.iter().zip(&gamma2).map(|(a, b)| a.hypot(*b)).collect();
    let (kappa, delta) = (file.read_1d("haloes", "kappa_h")?, file.read_1d("haloes", "delta_h")?);
    let delta_of_disc = file.read_1d("haloes", "delta_disc_h")?;
    Ok(histograms([&kappa, &shear, &delta], &delta_of_disc, config.diagnostics.delta_threshold))
}

/// A map read back, with the outer edges of its cells.
struct Grid {
    values: Vec<f64>,
    n: usize,
    half_width_arcsec: f64,
}

impl Grid {
    /// Nodes out to ±half width, so that the outermost cells reach half a step further.
    fn map(file: &RunFileReader, name: &str) -> Result<Self> {
        let (values, (_, n)) = file.read_2d("maps", name)?;
        let half = number(file, "maps", "half_width_arcsec")?;
        Ok(Self { values, n, half_width_arcsec: half * n as f64 / (n - 1) as f64 })
    }

    fn image(file: &RunFileReader, group: &str, name: &str) -> Result<Self> {
        let (values, (_, n)) = file.read_2d(group, name)?;
        let scale = number(file, group, "pixel_scale_arcsec")?;
        Ok(Self { values, n, half_width_arcsec: 0.5 * n as f64 * scale })
    }

    fn minus(&self, other: &Self) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(a, b)| a - b).collect();
        Self { values, n: self.n, half_width_arcsec: self.half_width_arcsec }
    }

    fn data(&self) -> GridData<'_> {
        GridData::square(&self.values, self.n, self.half_width_arcsec)
    }
}

fn tidal_map_figure(file: &RunFileReader, config: &Config) -> Result<Figure> {
    let on_axis = |name: &str| number(file, "maps", name);
    let maps = [Grid::map(file, "kappa")?, Grid::map(file, "gamma1")?, Grid::map(file, "gamma2")?];
    let centres = [on_axis("kappa_on_axis")?, on_axis("gamma1_on_axis")?, on_axis("gamma2_on_axis")?];
    Ok(tidal_maps(maps.each_ref().map(Grid::data), centres, config.lens.einstein_radius_arcsec))
}

fn flexion_map_figure(file: &RunFileReader, config: &Config) -> Result<Figure> {
    let maps = [Grid::map(file, "abs_f")?, Grid::map(file, "abs_g")?, Grid::map(file, "delta")?];
    Ok(flexion_maps(maps.each_ref().map(Grid::data), config.lens.einstein_radius_arcsec))
}

fn image_figure(file: &RunFileReader, config: &Config) -> Result<Figure> {
    let pair = |name: &str| -> Result<[Grid; 3]> {
        let all = Grid::image(file, "images/all_haloes", name)?;
        let tidal = Grid::image(file, "images/tidal_haloes", name)?;
        let difference = all.minus(&tidal);
        Ok([all, tidal, difference])
    };
    let (noise_free, noisy) = (pair("noise_free")?, pair("noisy")?);
    let [noise_free, noisy] = [&noise_free, &noisy].map(|row| row.each_ref().map(Grid::data));
    let background_rms_e_s = config.instrument.background_rms_e_s();
    let mut figure = images(noise_free, noisy, background_rms_e_s, config.diagnostics.delta_threshold);
    for (column, name) in ["all_haloes", "tidal_haloes"].into_iter().enumerate() {
        if let Some(curves) = saved_curves(file, &format!("images/{name}"))? {
            let panels = figure.panels.iter_mut().skip(column).step_by(3);
            panels.for_each(|panel| lay_over(panel, &curves, Colour::WHITE));
        }
    }
    Ok(figure)
}
