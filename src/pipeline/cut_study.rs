//! What the shear cut does: one line of sight at ever looser cuts.

use super::haloes::line_of_sight;
use super::shapes::LensAndSource;
use super::sightlines::populate;
use super::view::View;
use crate::config::Config;
use crate::error::Result;
use crate::halo::passes_shear_cut;
use crate::imaging::Psf;
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::Stage;

/// What is seen of one line of sight at one cut, and how it differs from the loosest.
#[derive(Debug, Clone, PartialEq)]
pub struct CutRow {
    /// Haloes of a smaller point-lens shear on the axis are left out.
    pub min_point_shear: f64,
    /// What is seen through the others.
    pub view: View,
    /// (image − image at the loosest cut)/σ of every pixel before noise, σ² = background² + flux/exposure time.
    pub image_over_noise: Vec<f64>,
}

impl CutRow {
    /// Σ over the pixels of the squares.
    pub fn image_chi_squared(&self) -> f64 {
        self.image_over_noise.iter().map(|d| d * d).sum()
    }
}

/// Looks through the haloes of one draw at every cut; the loosest comes last.
///
/// # Errors
/// As [`populate`] and [`View::through`]; when cancelled.
pub fn cut_study(config: &Config, psf: &Psf, cuts: &[f64], monitor: &dyn Monitor) -> Result<Vec<CutRow>> {
    let mut cuts = cuts.to_vec();
    cuts.sort_by(|a, b| b.total_cmp(a));
    cuts.dedup();
    let mut config = config.clone();
    config.haloes.min_point_shear = cuts.last().copied().unwrap_or(config.haloes.min_point_shear);
    let haloes = populate(&config, None, 0, monitor)?;
    let shapes = LensAndSource::resolve(&config, 0);
    let task = monitor.task("cuts", Some(cuts.len() as u64));
    let mut rows = Vec::with_capacity(cuts.len());
    for min_point_shear in cuts {
        task.check()?;
        let keep = passes_shear_cut(&haloes.catalogue, min_point_shear)?;
        // Sheets of the mean density know the cut.
        config.haloes.min_point_shear = min_point_shear;
        let sight = line_of_sight(&config, &haloes, &haloes.catalogue.select(&keep))?;
        let view = View::through(&config, &sight, &shapes, psf, (0, Stage::NoiseImage), &Uncounted(monitor))?;
        task.advance(1);
        rows.push(CutRow { min_point_shear, view, image_over_noise: Vec::new() });
    }
    drop(task);
    let loosest = rows.last().map(|row| row.view.exposure.noise_free_e_s.clone()).unwrap_or_default();
    let noise = config.instrument.noise();
    for row in &mut rows {
        let pixels = row.view.exposure.noise_free_e_s.iter().zip(&loosest);
        row.image_over_noise = pixels.map(|(flux, all)| (flux - all) / noise.sigma(*all)).collect();
    }
    Ok(rows)
}
