//! What figures of fields share: a grid on the sky, a panel that shows it, names and circles over it.

use crate::plot::{
    Anchor, Axis, Circle, Colour, ColourBar, ColourMap, ColourScale, Extent, Figure, Mark, Norm, Panel,
    Raster, Side, Stroke, Text, TextAt,
};

/// A saved grid on the sky.
#[derive(Debug, Clone, Copy)]
pub struct GridData<'a> {
    /// Values, row-major (y, x), y up; missing cells stay blank.
    pub values: &'a [f64],
    /// Number of columns.
    pub nx: usize,
    /// Number of rows.
    pub ny: usize,
    /// Outer edges of the grid.
    pub extent_arcsec: Extent,
}

impl<'a> GridData<'a> {
    /// A grid of `n` × `n` cells about the axis.
    pub fn square(values: &'a [f64], n: usize, half_width_arcsec: f64) -> Self {
        Self { values, nx: n, ny: n, extent_arcsec: Extent::square([0.0; 2], half_width_arcsec) }
    }

    /// Height over width of the field; 1 if the extent has no area.
    pub(super) fn aspect(&self) -> f64 {
        let Extent { left, right, bottom, top } = self.extent_arcsec;
        let aspect = (top - bottom) / (right - left);
        if (0.01..100.0).contains(&aspect) { aspect } else { 1.0 }
    }

    /// The grid in colours.
    pub(super) fn raster(&self, colours: ColourScale) -> Mark {
        let (values, extent) = (self.values.to_vec(), self.extent_arcsec);
        Mark::Raster(Raster { values, nx: self.nx, ny: self.ny, extent, colours })
    }

    /// A panel that shows the grid; only a panel of the first column carries the numbers of θ_y.
    pub(super) fn panel(&self, colours: ColourScale, column: usize) -> Panel {
        let Extent { left, right, bottom, top } = self.extent_arcsec;
        let limits = |low: f64, high: f64| (low < high).then_some((low, high));
        let y_label = if column == 0 { "θ_{y} [arcsec]" } else { "" };
        let x = Axis { limits: limits(left, right), ..Axis::linear("θ_{x} [arcsec]") };
        let y = Axis { limits: limits(bottom, top), tick_labels: column == 0, ..Axis::linear(y_label) };
        Panel { marks: vec![self.raster(colours)], tick_colour: ink(colours.map), ..Panel::new(x, y) }
    }

    /// The panel with a colour bar.
    pub(super) fn panel_with_bar(
        &self,
        colours: ColourScale,
        column: usize,
        label: impl Into<String>,
        side: Side,
    ) -> Panel {
        let colour_bar = Some(ColourBar { colours, label: label.into(), side });
        Panel { colour_bar, ..self.panel(colours, column) }
    }
}

/// White on a dark map, black on a light one.
fn ink(map: ColourMap) -> Colour {
    if map.is_dark() { Colour::WHITE } else { Colour::BLACK }
}

/// Three maps of one field in a row, each with its colour bar above and the Einstein circle.
pub(super) fn map_row(
    title: &str,
    maps: [(GridData, ColourMap, Norm, &str); 3],
    einstein_radius_arcsec: f64,
) -> Figure {
    let panel_aspect = maps[0].0.aspect();
    let panels = maps.into_iter().enumerate().map(|(column, (grid, map, norm, label))| {
        let mut panel = grid.panel_with_bar(ColourScale { map, norm }, column, label, Side::Top);
        panel.marks.extend(einstein_circle(einstein_radius_arcsec, map));
        panel
    });
    Figure { columns: 3, panel_aspect, panels: panels.collect(), ..Figure::full_width(title) }
}

/// The dashed Einstein circle about the axis; none for a radius that is not positive.
pub(super) fn einstein_circle(radius_arcsec: f64, over: ColourMap) -> Option<Mark> {
    let stroke = Stroke::dashed(ink(over), 0.8);
    (radius_arcsec > 0.0).then_some(Mark::Circle(Circle { x: 0.0, y: 0.0, radius: radius_arcsec, stroke }))
}

/// A name inside a panel, its left end at those fractions of the panel.
pub(super) fn caption(text: &str, (x, y): (f64, f64), over: ColourMap) -> Mark {
    let (at, anchor, colour) = (TextAt::Fraction(x, y), Anchor::Start, ink(over));
    let halo = Some(if over.is_dark() { Colour::BLACK } else { Colour::WHITE });
    Mark::Text(Text { at, text: text.into(), anchor, colour, halo })
}
