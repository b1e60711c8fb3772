//! Data, model and normalised residual of a fit side by side, and the source that the fit found.

use super::images::image_norm;
use super::{GridData, caption};
use crate::plot::{Colour, ColourBar, ColourMap, Figure, Norm, Side};

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
    let stretch = image_norm(&[data.data, data.model], data.background_rms_e_per_s);
    let sigma = Norm::Symmetric { centre: 0.0, half_width: LARGEST_RESIDUAL_SIGMA };
    let chi2 = format!("χ^{{2}}/dof = {:.3}", data.chi2_reduced);
    let columns = [
        (data.data, ColourMap::Inferno, stretch, "data"),
        (data.model, ColourMap::Inferno, stretch, "model"),
        (data.residual, ColourMap::Diverging, sigma, chi2.as_str()),
    ];
    let panels = columns.into_iter().enumerate().map(|(column, (grid, map, norm, name))| {
        let mut panel = grid.panel(map, norm, column);
        let dark = map != ColourMap::Diverging;
        panel.marks.push(caption(name, (0.05, 0.93), dark));
        panel.tick_colour = if dark { Colour::WHITE } else { Colour::BLACK };
        let bar = match column {
            0 => Some(("flux [e^{−} s^{−1} pixel^{−1}]", Side::TopOver(2))),
            2 => Some(("(data − model)/σ", Side::Top)),
            _ => None,
        };
        panel.colour_bar = bar.map(|(label, side)| ColourBar { map, norm, label: label.into(), side });
        panel
    });
    let panels = panels.collect();
    Figure { columns: 3, panel_aspect: data.data.aspect(), panels, ..Figure::full_width("Reconstruction") }
}

/// Draws the source plane of the best fit.
pub fn source_plane(source: GridData, faintest_e_per_s_arcsec2: f64) -> Figure {
    let norm = image_norm(&[source], faintest_e_per_s_arcsec2);
    let mut panel = source.panel(ColourMap::Inferno, norm, 0);
    panel.tick_colour = Colour::WHITE;
    panel.x.label = "β_{x} [arcsec]".into();
    panel.y.label = "β_{y} [arcsec]".into();
    let label = "source [e^{−} s^{−1} arcsec^{−2}]".into();
    panel.colour_bar = Some(ColourBar { map: ColourMap::Inferno, norm, label, side: Side::Top });
    let figure = Figure::full_width("Source plane");
    Figure { width_mm: 84.0, panel_aspect: source.aspect(), panels: vec![panel], ..figure }
}
