//! What figures of fields share: a grid on the sky, a panel that shows it, names and circles over it.

use crate::plot::{Anchor, At, Axis, ColourBar, ColourMap, ColourScale, Extent, Mark, Panel, Shape, Stroke};

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

    /// A panel that shows the grid; only a panel of the first column carries the numbers of θ_y.
    pub(super) fn panel(&self, colours: ColourScale, column: usize) -> Panel {
        let Extent { left, right, bottom, top } = self.extent_arcsec;
        let axis = |label: &str, low: f64, high: f64| Axis {
            limits: (low < high).then_some((low, high)),
            ..Axis::linear(label)
        };
        let (x, y) = (axis("θ_{x} [arcsec]", left, right), axis("θ_{y} [arcsec]", bottom, top));
        let (values, extent) = (self.values.to_vec(), self.extent_arcsec);
        let raster = Shape::Raster { values, nx: self.nx, ny: self.ny, extent, colours };
        Panel { tick_colour: colours.map.ink()[0], ..Panel::new(x, y.outer(column == 0), [raster.into()]) }
    }

    /// The panel with a colour bar over it and its neighbours on the right, so many panels in all.
    pub(super) fn panel_with_bar(
        &self,
        colours: ColourScale,
        column: usize,
        label: &str,
        panels: usize,
    ) -> Panel {
        let colour_bar = Some(ColourBar { colours, label: label.into(), panels });
        Panel { colour_bar, ..self.panel(colours, column) }
    }
}

/// The dashed Einstein circle about the axis; none for a radius that is not positive.
pub(super) fn einstein_circle(radius_arcsec: f64, over: ColourMap) -> Option<Mark> {
    let (stroke, centre) = (Stroke::dashed(over.ink()[0], 0.8), [0.0; 2]);
    (radius_arcsec > 0.0).then(|| Shape::Circle { centre, radius: radius_arcsec, stroke }.into())
}

/// A bar of a round length at the lower right with its length above it; none of a field without area.
pub(super) fn scale_bar(field: Extent, over: ColourMap) -> Vec<Mark> {
    let width = field.right - field.left;
    // A fifth to a half of the width.
    let round = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0].into_iter().find(|length| *length >= 0.2 * width);
    let Some(length) = round.filter(|_| width > 0.0) else { return Vec::new() };
    let [colour, halo] = over.ink();
    let (right, y) = (field.right - 0.06 * width, field.bottom + 0.06 * (field.top - field.bottom));
    let line =
        |colour, width_pt| Mark::line([[right - length, y], [right, y]], Stroke::solid(colour, width_pt));
    let at = At::Fraction(0.94 - 0.5 * length / width, 0.1);
    let text =
        Shape::Text { at, text: format!("{length}″"), anchor: Anchor::Middle, colour, halo: Some(halo) };
    vec![line(halo, 2.6), line(colour, 1.4), text.into()]
}

/// A name inside a panel, its left end at those fractions of the panel.
pub(super) fn caption(text: &str, (x, y): (f64, f64), over: ColourMap) -> Mark {
    let (at, anchor, [colour, halo]) = (At::Fraction(x, y), Anchor::Start, over.ink());
    Shape::Text { at, text: text.into(), anchor, colour, halo: Some(halo) }.into()
}
