//! The lensed image with all haloes, without the rough ones, and the difference; noise-free and noisy.

use super::{GridData, caption};
use crate::plot::{Colour, ColourBar, ColourMap, Figure, Norm, Panel, Side, quantile};

/// Two images of one scene and their difference, all in e⁻ s⁻¹ per pixel.
#[derive(Debug, Clone, Copy)]
pub struct ImageRow<'a> {
    /// With all haloes.
    pub all_haloes: GridData<'a>,
    /// Without the haloes of Δ_h at or above the threshold.
    pub without_rough: GridData<'a>,
    /// The first minus the second.
    pub difference: GridData<'a>,
}

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct ImagesData<'a> {
    /// Images before noise.
    pub noise_free: ImageRow<'a>,
    /// Images with noise.
    pub noisy: ImageRow<'a>,
    /// Rms of the background: where the stretch turns from linear to logarithmic.
    pub background_rms_e_per_s: f64,
    /// Δ_h from which on haloes were left out.
    pub delta_threshold: f64,
}

/// Draws both rows over the full page; the four images share one stretch, the two differences another.
pub fn images(data: &ImagesData) -> Figure {
    let rows = [(data.noise_free, "noise-free"), (data.noisy, "with noise")];
    let without = format!("without Δ_{{h}} ≥ {}", data.delta_threshold);
    let brightest = [data.noise_free.all_haloes, data.noise_free.without_rough];
    let stretch = image_norm(&brightest, data.background_rms_e_per_s);
    let change = Norm::symmetric_about(0.0, &largest_differences(data), 1.0);
    let unit = "[e^{−} s^{−1} pixel^{−1}]";

    let mut panels: Vec<Panel> = Vec::new();
    for (row, row_name) in rows {
        let columns = [
            (row.all_haloes, ColourMap::Inferno, stretch, "all haloes"),
            (row.without_rough, ColourMap::Inferno, stretch, without.as_str()),
            (row.difference, ColourMap::Diverging, change, "difference"),
        ];
        let first = panels.is_empty();
        for (column, (grid, map, norm, name)) in columns.into_iter().enumerate() {
            let mut panel = grid.panel(map, norm, column);
            let dark = map != ColourMap::Diverging;
            panel.marks.extend([caption(name, (0.05, 0.93), dark), caption(row_name, (0.05, 0.07), dark)]);
            if dark {
                panel.tick_colour = Colour::WHITE;
            }
            if first {
                (panel.x.label, panel.x.tick_labels) = (String::new(), false);
                panel.colour_bar = bar(column, map, norm, unit);
            }
            panels.push(panel);
        }
    }
    let panel_aspect = data.noise_free.all_haloes.aspect();
    Figure {
        columns: 3,
        panel_aspect,
        panels,
        ..Figure::full_width("Images with all haloes and without the rough ones")
    }
}

/// One exposure.
#[derive(Debug, Clone, Copy)]
pub struct ImagePairData<'a> {
    /// Before noise.
    pub noise_free: GridData<'a>,
    /// With noise.
    pub noisy: GridData<'a>,
    /// Rms of the background: where the stretch turns from linear to logarithmic.
    pub background_rms_e_per_s: f64,
}

/// Draws one exposure before and with noise over the full page, in one stretch.
pub fn image_pair(data: &ImagePairData) -> Figure {
    let norm = image_norm(&[data.noise_free], data.background_rms_e_per_s);
    let panel = |column: usize, (grid, name): (GridData, &str)| {
        let mut panel = grid.panel(ColourMap::Inferno, norm, column);
        panel.marks.push(caption(name, (0.05, 0.93), true));
        panel.tick_colour = Colour::WHITE;
        if column == 0 {
            let label = "flux [e^{−} s^{−1} pixel^{−1}]".into();
            panel.colour_bar =
                Some(ColourBar { map: ColourMap::Inferno, norm, label, side: Side::TopOver(2) });
        }
        panel
    };
    let columns = [(data.noise_free, "noise-free"), (data.noisy, "with noise")];
    let panels = columns.into_iter().enumerate().map(|(i, column)| panel(i, column)).collect();
    Figure { columns: 2, panel_aspect: data.noise_free.aspect(), panels, ..Figure::full_width("Exposure") }
}

/// The bar over the two image columns, and that over the differences.
fn bar(column: usize, map: ColourMap, norm: Norm, unit: &str) -> Option<ColourBar> {
    let (label, side) = match column {
        0 => (format!("flux {unit}"), Side::TopOver(2)),
        2 => (format!("difference {unit}"), Side::Top),
        _ => return None,
    };
    Some(ColourBar { map, norm, label, side })
}

/// An asinh stretch from just below the background to the brightest of the pixels given.
pub(super) fn image_norm(grids: &[GridData], background_rms_e_per_s: f64) -> Norm {
    let brightest = grids.iter().filter_map(|grid| quantile(grid.values, 1.0)).fold(f64::MIN, f64::max);
    let high = if brightest > 0.0 { brightest } else { 1.0 };
    let softening = if background_rms_e_per_s > 0.0 { background_rms_e_per_s } else { 0.01 * high };
    Norm::Asinh { low: -2.0 * softening, high, softening }
}

/// Robust extremes of both difference images.
fn largest_differences(data: &ImagesData) -> Vec<f64> {
    const COVERAGE: f64 = 0.995;
    let extreme = |grid: GridData| {
        let sizes: Vec<f64> = grid.values.iter().map(|value| value.abs()).collect();
        quantile(&sizes, COVERAGE)
    };
    [extreme(data.noise_free.difference), extreme(data.noisy.difference)].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[f64]) -> ImageRow<'_> {
        let grid = GridData { values, nx: 2, ny: 2, extent_arcsec: [-1.0, 1.0, -1.0, 1.0] };
        ImageRow { all_haloes: grid, without_rough: grid, difference: grid }
    }

    #[test]
    fn the_images_share_one_bar_and_the_differences_another() {
        let (clean, noisy) = ([0.0, 0.1, 0.2, 0.3], [0.0, f64::NAN, -0.1, 0.5]);
        let data = ImagesData {
            noise_free: row(&clean),
            noisy: row(&noisy),
            background_rms_e_per_s: 0.006,
            delta_threshold: 0.1,
        };
        let figure = images(&data);
        assert_eq!(figure.panels.len(), 6);
        assert_eq!(figure.panels.iter().filter(|panel| panel.colour_bar.is_some()).count(), 2);
        let brightest = [data.noise_free.all_haloes];
        assert_eq!(image_norm(&brightest, 0.006), Norm::Asinh { low: -0.012, high: 0.3, softening: 0.006 });
    }

    #[test]
    fn empty_images_do_not_panic() {
        let data = ImagesData {
            noise_free: row(&[]),
            noisy: row(&[]),
            background_rms_e_per_s: f64::NAN,
            delta_threshold: 0.1,
        };
        assert!(images(&data).to_svg().contains("no data"));
    }
}
