//! Data, model and normalised residual of a fit side by side, and the source that the fit found.

use super::grid::{GridData, caption};
use super::images::{FLUX, image_colours};
use crate::plot::{ColourMap, ColourScale, Figure, Norm, Side};

/// What the figure shows, all on the grid of the image.
#[derive(Debug, Clone, Copy)]
pub struct ReconstructionData<'a> {
    /// The image, e⁻/s per pixel.
    pub data: GridData<'a>,
    /// The best fit.
    pub model: GridData<'a>,
    /// (data − model)/σ.
    pub residual: GridData<'a>,
    /// Rms of the background: where the stretch turns from linear to logarithmic.
    pub background_rms_e_per_s: f64,
    /// χ² per degree of freedom.
    pub chi2_reduced: f64,
}

/// Residuals beyond this many standard deviations have the colour of the end of the bar.
const LARGEST_RESIDUAL_SIGMA: f64 = 5.0;

/// Draws the three images over the full page.
pub fn reconstruction(data: &ReconstructionData) -> Figure {
    let stretch = image_colours(&[data.data, data.model], data.background_rms_e_per_s);
    let norm = Norm::Symmetric { centre: 0.0, half_width: LARGEST_RESIDUAL_SIGMA };
    let sigma = ColourScale { map: ColourMap::Diverging, norm };
    let chi2 = format!("χ^{{2}}/dof = {:.3}", data.chi2_reduced);
    let columns = [
        (data.data.panel_with_bar(stretch, 0, FLUX, Side::TopOver(2)), stretch, "data"),
        (data.model.panel(stretch, 1), stretch, "model"),
        (data.residual.panel_with_bar(sigma, 2, "(data − model)/σ", Side::Top), sigma, chi2.as_str()),
    ];
    let panels = columns.into_iter().map(|(mut panel, colours, name)| {
        panel.marks.push(caption(name, (0.05, 0.93), colours.map));
        panel
    });
    let panels = panels.collect();
    Figure { columns: 3, panel_aspect: data.data.aspect(), panels, ..Figure::full_width("Reconstruction") }
}

/// Draws the source plane of the best fit.
pub fn source_plane(source: GridData, faintest_e_per_s_arcsec2: f64) -> Figure {
    let colours = image_colours(&[source], faintest_e_per_s_arcsec2);
    let label = "source [e^{−} s^{−1} arcsec^{−2}]";
    let mut panel = source.panel_with_bar(colours, 0, label, Side::Top);
    panel.x.label = "β_{x} [arcsec]".into();
    panel.y.label = "β_{y} [arcsec]".into();
    Figure { panel_aspect: source.aspect(), panels: vec![panel], ..Figure::one_column("Source plane") }
}
