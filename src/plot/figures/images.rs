//! Images on the sky: with all haloes and without the rough ones; before and with noise; data, model and residual of a fit,
//! and the source that it found.

use super::grid::{GridData, caption};
use crate::plot::{ColourMap, ColourScale, Figure, Panel, Stretch, quantile};

/// Label of the bar of images.
const FLUX: &str = "flux [e^{−} s^{−1} pixel^{−1}]";
const DIFFERENCE: &str = "all − tidal [e^{−} s^{−1} pixel^{−1}]";

/// Draws two rows over the full page, before noise and with it: the image with all haloes, that without those of Δ_h from
/// the threshold on, and their difference, all in e⁻ s⁻¹ per pixel. The four images share one stretch, the two differences
/// another.
pub fn images(
    noise_free: [GridData; 3],
    noisy: [GridData; 3],
    background_rms_e_per_s: f64,
    delta_threshold: f64,
) -> Figure {
    /// Of the differences of a row, the share that lies within the colour bar.
    const COVERAGE: f64 = 0.995;
    let extreme = |grid: &GridData| {
        let sizes: Vec<f64> = grid.values.iter().map(|value| value.abs()).collect();
        quantile(&sizes, COVERAGE)
    };
    let largest: Vec<f64> = [&noise_free[2], &noisy[2]].into_iter().filter_map(extreme).collect();
    let stretch = image_colours(&noise_free[..2], background_rms_e_per_s);
    let colours = [stretch, stretch, ColourScale::symmetric_about(0.0, &largest, 1.0)];
    let tidal = format!("tidal haloes (Δ_{{h}} < {delta_threshold})");
    let names = ["all haloes", &tidal, "all − tidal"];
    let rows = [("noise-free", noise_free), ("with noise", noisy)];
    let mut panels: Vec<Panel> = Vec::new();
    for (row, grids) in rows {
        for column in 0..3 {
            let (grid, colours) = (&grids[column], colours[column]);
            let mut panel = match column {
                0 if panels.is_empty() => grid.panel_with_bar(colours, column, FLUX, 2),
                2 if panels.len() == 2 => grid.panel_with_bar(colours, column, DIFFERENCE, 1),
                _ => grid.panel(colours, column),
            };
            panel.x = panel.x.outer(panels.len() >= 3);
            panel.marks.push(caption(names[column], TOP_LEFT, colours.map));
            panel.marks.push(caption(row, (0.05, 0.07), colours.map));
            panels.push(panel);
        }
    }
    Figure::full_width("Images with all haloes and without the rough ones", noise_free[0].aspect(), 3, panels)
}

/// Draws one exposure before and with noise over the full page, in one stretch.
pub fn image_pair(noise_free: GridData, noisy: GridData, background_rms_e_per_s: f64) -> Figure {
    let colours = image_colours(&[noise_free], background_rms_e_per_s);
    let panels = [
        named(noise_free.panel_with_bar(colours, 0, FLUX, 2), "noise-free", colours),
        named(noisy.panel(colours, 1), "with noise", colours),
    ];
    Figure::full_width("Exposure", noise_free.aspect(), 2, panels)
}

/// Draws data, model and (data − model)/σ of a fit over the full page.
pub fn reconstruction(
    [data, model, residual]: [GridData; 3],
    background_rms_e_per_s: f64,
    chi2_reduced: f64,
) -> Figure {
    /// Residuals beyond this many standard deviations have the colour of the end of the bar.
    const LARGEST_RESIDUAL_SIGMA: f64 = 5.0;
    let stretch = image_colours(&[data, model], background_rms_e_per_s);
    let sigma = ColourScale::symmetric(0.0, LARGEST_RESIDUAL_SIGMA);
    let chi2 = format!("χ^{{2}}/dof = {chi2_reduced:.3}");
    let panels = [
        named(data.panel_with_bar(stretch, 0, FLUX, 2), "data", stretch),
        named(model.panel(stretch, 1), "model", stretch),
        named(residual.panel_with_bar(sigma, 2, "(data − model)/σ", 1), &chi2, sigma),
    ];
    Figure::full_width("Reconstruction", data.aspect(), 3, panels)
}

/// Draws the source plane of the best fit.
pub fn source_plane(source: GridData, faintest_e_per_s_arcsec2: f64) -> Figure {
    let colours = image_colours(&[source], faintest_e_per_s_arcsec2);
    let mut panel = source.panel_with_bar(colours, 0, "source [e^{−} s^{−1} arcsec^{−2}]", 1);
    (panel.x.label, panel.y.label) = ("β_{x} [arcsec]".into(), "β_{y} [arcsec]".into());
    Figure::one_column("Source plane", source.aspect(), panel)
}

const TOP_LEFT: (f64, f64) = (0.05, 0.93);

fn named(mut panel: Panel, name: &str, colours: ColourScale) -> Panel {
    panel.marks.push(caption(name, TOP_LEFT, colours.map));
    panel
}

/// Inferno in an asinh stretch from just below the background, where the stretch turns from linear to logarithmic, to the
/// brightest of the pixels given.
pub(super) fn image_colours(grids: &[GridData], background_rms_e_per_s: f64) -> ColourScale {
    let brightest = grids.iter().filter_map(|grid| quantile(grid.values, 1.0)).fold(f64::MIN, f64::max);
    let high = if brightest > 0.0 { brightest } else { 1.0 };
    let softening = if background_rms_e_per_s > 0.0 { background_rms_e_per_s } else { 0.01 * high };
    let (map, stretch) = (ColourMap::Inferno, Stretch::Asinh { softening });
    ColourScale { map, low: -2.0 * softening, high, stretch }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_images_share_one_bar_and_the_differences_another() {
        let (clean, noisy) = ([0.0, 0.1, 0.2, 0.3], [0.0, f64::NAN, -0.1, 0.5]);
        let [clean, noisy] = [&clean, &noisy].map(|values| GridData::square(values, 2, 1.0));
        let figure = images([clean; 3], [noisy; 3], 0.006, 0.1);
        assert_eq!(figure.panels.len(), 6);
        assert_eq!(figure.panels.iter().filter(|panel| panel.colour_bar.is_some()).count(), 2);
        let colours = figure.panels[0].colour_bar.as_ref().unwrap().colours;
        assert_eq!((colours.low, colours.high), (-0.012, 0.3));
        assert_eq!(colours.stretch, Stretch::Asinh { softening: 0.006 });
    }
}
