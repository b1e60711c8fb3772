//! The figures of this project, one file each: plain saved numbers in, a [`Figure`] out.

mod calibration;
mod corner;
mod curves;
mod cut;
mod cylinder;
mod flexion_maps;
mod histograms;
mod images;
mod mass_function;
mod mosaic;
mod reconstruction;
mod recovery;
mod tidal_maps;
mod tidal_residuals;
mod trace_plot;

pub use calibration::{RankHistogram, calibration};
pub use corner::{CornerData, CornerParameter, CornerPosterior, corner};
pub use curves::{CurveData, CurvesData, curves, overlay};
pub use cut::{CutData, cut};
pub use cylinder::{CylinderData, cylinder};
pub use flexion_maps::{FlexionMapsData, flexion_maps};
pub use histograms::{HaloEffects, histograms};
pub use images::{ImagePairData, ImageRow, ImagesData, image_pair, images};
pub use mass_function::{DrawnHaloes, MassFunctionCurve, MassFunctionData, mass_function};
pub use mosaic::{MosaicImage, mosaic};
pub use reconstruction::{ReconstructionData, reconstruction, source_plane};
pub use recovery::{RecoveredPoint, RecoveryData, recovery, recovery_histograms, recovery_quality};
pub use tidal_maps::{TidalMapsData, tidal_maps};
pub use tidal_residuals::{TidalResidualsData, tidal_residuals};
pub use trace_plot::{TraceParameter, trace_plot};

use super::{Anchor, Axis, Circle, Colour, ColourBar, ColourMap, Figure, Mark, Norm, Panel, Raster, Side};
use super::{Stroke, Text, TextAt};

/// A saved grid on the sky.
#[derive(Debug, Clone, Copy)]
pub struct GridData<'a> {
    /// Values, row-major (y, x), y up; missing cells stay blank.
    pub values: &'a [f64],
    /// Number of columns.
    pub nx: usize,
    /// Number of rows.
    pub ny: usize,
    /// Outer edges of the grid: left, right, bottom, top.
    pub extent_arcsec: [f64; 4],
}

impl GridData<'_> {
    /// Height over width of the field; 1 if the extent has no area.
    fn aspect(&self) -> f64 {
        let [left, right, bottom, top] = self.extent_arcsec;
        let aspect = (top - bottom) / (right - left);
        if (0.01..100.0).contains(&aspect) { aspect } else { 1.0 }
    }

    /// A panel that shows the grid; only a panel of the first column carries the numbers of θ_y.
    fn panel(&self, map: ColourMap, norm: Norm, column: usize) -> Panel {
        let [left, right, bottom, top] = self.extent_arcsec;
        let limits = |low: f64, high: f64| (low < high).then_some((low, high));
        let y_label = if column == 0 { "θ_{y} [arcsec]" } else { "" };
        let x = Axis { limits: limits(left, right), ..Axis::linear("θ_{x} [arcsec]") };
        let y = Axis { limits: limits(bottom, top), tick_labels: column == 0, ..Axis::linear(y_label) };
        let raster = Raster {
            values: self.values.to_vec(),
            nx: self.nx,
            ny: self.ny,
            extent: self.extent_arcsec,
            map,
            norm,
        };
        Panel { marks: vec![Mark::Raster(raster)], ..Panel::new(x, y) }
    }
}

/// Three maps of one field in a row, each with its colour bar above.
fn map_row(title: &str, maps: Vec<(GridData, ColourMap, Norm, &str)>, einstein_radius_arcsec: f64) -> Figure {
    let panel_aspect = maps.first().map_or(1.0, |(grid, ..)| grid.aspect());
    let panels = maps.into_iter().enumerate().map(|(column, (grid, map, norm, label))| {
        let mut panel = grid.panel(map, norm, column);
        let dark = map != ColourMap::Diverging;
        panel.marks.extend(einstein_circle(einstein_radius_arcsec, dark));
        panel.tick_colour = if dark { Colour::WHITE } else { Colour::BLACK };
        panel.colour_bar = Some(ColourBar { map, norm, label: label.into(), side: Side::Top });
        panel
    });
    Figure { columns: 3, panel_aspect, panels: panels.collect(), ..Figure::full_width(title) }
}

/// The dashed Einstein circle about the axis; none for a radius that is not positive.
fn einstein_circle(radius_arcsec: f64, on_dark: bool) -> Option<Mark> {
    let colour = if on_dark { Colour::WHITE } else { Colour::BLACK };
    let stroke = Stroke::dashed(colour, 0.8);
    (radius_arcsec > 0.0).then_some(Mark::Circle(Circle { x: 0.0, y: 0.0, radius: radius_arcsec, stroke }))
}

/// A name inside a panel, white on a dark raster and black on a light one.
fn caption(text: &str, (x, y): (f64, f64), on_dark: bool) -> Mark {
    let (at, anchor) = (TextAt::Fraction(x, y), Anchor::Start);
    let (colour, halo) =
        if on_dark { (Colour::WHITE, Colour::BLACK) } else { (Colour::BLACK, Colour::WHITE) };
    Mark::Text(Text { at, text: text.into(), anchor, colour, halo: Some(halo) })
}
