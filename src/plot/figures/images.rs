//! The lensed image with all haloes, without the rough ones, and the difference; noise-free and noisy.

use super::grid::{GridData, caption};
use crate::plot::{ColourBar, ColourMap, ColourScale, Figure, Norm, Panel, Side, quantile};

/// Label of the bar of images.
pub(super) const FLUX: &str = "flux [e^{−} s^{−1} pixel^{−1}]";

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
    let stretch = image_colours(&brightest, data.background_rms_e_per_s);
    let norm = Norm::symmetric_about(0.0, &largest_differences(data), 1.0);
    let change = ColourScale { map: ColourMap::Diverging, norm };

    let mut panels: Vec<Panel> = Vec::new();
    for (row, row_name) in rows {
        let columns = [
            (row.all_haloes, stretch, "all haloes"),
            (row.without_rough, stretch, without.as_str()),
            (row.difference, change, "difference"),
        ];
        let first = panels.is_empty();
        for (column, (grid, colours, name)) in columns.into_iter().enumerate() {
            let mut panel = grid.panel(colours, column);
            let written = [(name, 0.93), (row_name, 0.07)];
            panel.marks.extend(written.map(|(text, y)| caption(text, (0.05, y), colours.map)));
            if first {
                (panel.x.label, panel.x.tick_labels) = (String::new(), false);
                panel.colour_bar = bar(column, colours);
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
    let colours = image_colours(&[data.noise_free], data.background_rms_e_per_s);
    let panel = |column: usize, (grid, name): (GridData, &str)| {
        let mut panel = Panel { colour_bar: bar(column, colours), ..grid.panel(colours, column) };
        panel.marks.push(caption(name, (0.05, 0.93), colours.map));
        panel
    };
    let columns = [(data.noise_free, "noise-free"), (data.noisy, "with noise")];
    let panels = columns.into_iter().enumerate().map(|(i, column)| panel(i, column)).collect();
    Figure { columns: 2, panel_aspect: data.noise_free.aspect(), panels, ..Figure::full_width("Exposure") }
}

/// The bar over the two image columns, and that over the differences.
fn bar(column: usize, colours: ColourScale) -> Option<ColourBar> {
    let (label, side) = match column {
        0 => (FLUX.into(), Side::TopOver(2)),
        2 => (FLUX.replace("flux", "difference"), Side::Top),
        _ => return None,
    };
    Some(ColourBar { colours, label, side })
}

/// Inferno in an asinh stretch from just below the background to the brightest of the pixels given.
pub(super) fn image_colours(grids: &[GridData], background_rms_e_per_s: f64) -> ColourScale {
    let brightest = grids.iter().filter_map(|grid| quantile(grid.values, 1.0)).fold(f64::MIN, f64::max);
    let high = if brightest > 0.0 { brightest } else { 1.0 };
    let softening = if background_rms_e_per_s > 0.0 { background_rms_e_per_s } else { 0.01 * high };
    let norm = Norm::Asinh { low: -2.0 * softening, high, softening };
    ColourScale { map: ColourMap::Inferno, norm }
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
        let grid = GridData::square(values, 2, 1.0);
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
        let norm = Norm::Asinh { low: -0.012, high: 0.3, softening: 0.006 };
        assert_eq!(image_colours(&brightest, 0.006), ColourScale { map: ColourMap::Inferno, norm });
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
