//! What a tidal and a flexion model leave of a traced cone, in β and in the image.

use super::grid::{GridData, einstein_circle};
use crate::plot::{Axis, Colour, ColourMap, ColourScale, Corner, Figure, Mark, Panel, Shape, Stroke, points};

/// What one of the models leaves.
#[derive(Debug, Clone)]
pub struct ModelResiduals<'a> {
    /// |β_traced − β_model| for one cone, arcsec.
    pub rays: GridData<'a>,
    /// (image through the cone − image through the model)/σ of that cone.
    pub image: GridData<'a>,
    /// Image χ² for every cone.
    pub chi_squared: Vec<f64>,
    /// Rms residual for every cone, arcsec.
    pub rms_arcsec: Vec<f64>,
}

/// Above both residuals in β of one cone in one stretch and the rms of all cones against each other, below the same of
/// the image; of the tidal and the flexion model.
pub fn tidal_residuals(models: &[ModelResiduals; 2], einstein_radius_arcsec: f64) -> Figure {
    const NAMES: [&str; 2] = ["tidal", "flexion"];
    /// Fraction of the pixels whose values lie within the colour bar.
    const COVERAGE: f64 = 0.99;
    let [tidal, flexion] = models;
    let both = [tidal.rays.values, flexion.rays.values].concat();
    let colours = ColourScale::log_of(ColourMap::Magma, &both, COVERAGE);
    let map = |i: usize| {
        let label = format!("|β − β_{{{}}}| [arcsec]", NAMES[i]);
        let mut panel = models[i].rays.panel_with_bar(colours, i, &label, 1);
        panel.marks.extend(einstein_circle(einstein_radius_arcsec, ColourMap::Magma));
        panel
    };
    // In a stretch of its own: the two differ by orders of magnitude.
    let image = |i: usize| {
        let colours = ColourScale::symmetric_about(0.0, models[i].image.values, 1.0);
        models[i].image.panel_with_bar(colours, i, &format!("(image − image_{{{}}})/σ", NAMES[i]), 1)
    };
    let rms = comparison(&tidal.rms_arcsec, &flexion.rms_arcsec, "rms", " [arcsec]");
    let chi_squared = comparison(&tidal.chi_squared, &flexion.chi_squared, "image χ^{2}", "");
    let panels = [map(0), map(1), rms, image(0), image(1), chi_squared];
    Figure::full_width("Residuals of the tidal and flexion models", tidal.rays.aspect(), 3, panels)
}

/// Tidal against flexion, one point a cone.
fn comparison(tidal: &[f64], flexion: &[f64], what: &str, unit: &str) -> Panel {
    let all = tidal.iter().chain(flexion).copied().filter(|v| *v > 0.0 && v.is_finite());
    let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    let equal = Mark::line([[low; 2], [high; 2]], Stroke::dashed(Colour::BLACK, 0.8)).named("equal");
    let (points, colour) = (points(tidal, flexion), Colour::BLUE);
    let cones = Mark::from(Shape::Dots { points, colour, radius_pt: 1.2, opacity: 0.8 });
    let axis = |model: &str| Axis::log(&format!("{what}, {model}{unit}"));
    let panel = Panel::new(axis("tidal"), axis("flexion"), [equal, cones.named("one cone each")]);
    Panel { legend: Corner::TopLeft, ..panel }
}
