//! A panel: two axes, the marks between them, and what surrounds them.

use super::colour::Colour;
use super::colour_scale::ColourScale;
use super::mark::{Mark, Shape};
use super::scale::Scale;
use super::svg::Anchor;
use super::ticks::Ticks;

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub scale: Scale,
    /// Label in markup, with the unit in square brackets; empty for none.
    pub label: String,
    /// Values at both ends; `None` takes in all marks.
    pub limits: Option<(f64, f64)>,
    /// Whether the ticks carry numbers; inner panels of a grid do without.
    pub tick_labels: bool,
    /// The most intervals between ticks.
    pub most_intervals: usize,
}

impl Axis {
    /// A linear axis that takes in all marks.
    pub fn linear(label: &str) -> Self {
        Self { scale: Scale::Linear, label: label.into(), limits: None, tick_labels: true, most_intervals: 7 }
    }

    /// A logarithmic axis that takes in all marks.
    pub fn log(label: &str) -> Self {
        Self { scale: Scale::Log, ..Self::linear(label) }
    }

    /// The same with values at both ends.
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { limits: Some((low, high)), ..self }
    }

    /// The same, without label and numbers unless it lies at the edge of its grid.
    pub fn outer(self, is_outer: bool) -> Self {
        if is_outer { self } else { Self { label: String::new(), tick_labels: false, ..self } }
    }
}

/// A second axis on top: other numbers for the same abscissae, which are in data units of the panel.
#[derive(Debug, Clone, PartialEq)]
pub struct TopAxis {
    /// Label in markup.
    pub label: String,
    pub ticks: Ticks,
}

/// A colour bar for the rasters of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourBar {
    /// From values to colours, as in the rasters.
    pub colours: ColourScale,
    /// Label in markup, with the unit in square brackets.
    pub label: String,
    /// It lies above the panel and its neighbours on the right: so many panels in all.
    pub panels: usize,
}

/// Where a legend stands, unless it hid there more than elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    TopLeft,
    TopRight,
    BottomLeft,
    BottomRight,
}

/// A line of small text above a panel; it may be wider than the panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Caption {
    /// What, in markup.
    pub text: String,
    pub colour: Colour,
    /// Which end of the text, start or end, lies at that end of the panel.
    pub anchor: Anchor,
}

/// Two axes and what lies between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub x: Axis,
    pub y: Axis,
    /// Drawn in this order.
    pub marks: Vec<Mark>,
    /// Lines of small text above the panel.
    pub captions: Vec<Caption>,
    /// A second axis on top.
    pub top: Option<TopAxis>,
    pub colour_bar: Option<ColourBar>,
    /// Where the legend stands, if any mark has a text for it.
    pub legend: Corner,
    /// Colour of the ticks: white shows on dark rasters.
    pub tick_colour: Colour,
    /// Leaves the panel's place in the grid empty but for its legend.
    pub is_blank: bool,
}

impl Panel {
    /// Marks between two axes, drawn in this order.
    pub fn new(x: Axis, y: Axis, marks: impl IntoIterator<Item = Mark>) -> Self {
        Self {
            x,
            y,
            marks: marks.into_iter().collect(),
            captions: Vec::new(),
            top: None,
            colour_bar: None,
            legend: Corner::TopRight,
            tick_colour: Colour::BLACK,
            is_blank: false,
        }
    }

    /// An empty place in the grid.
    pub fn blank() -> Self {
        Self { is_blank: true, ..Self::new(Axis::linear(""), Axis::linear(""), []) }
    }

    /// Whether its marks lie on a picture.
    pub fn is_picture(&self) -> bool {
        self.marks.iter().any(|mark| matches!(mark.shape, Shape::Raster { .. }))
    }

    /// All points of marks that have a place on both axes.
    fn drawn(&self) -> impl Iterator<Item = [f64; 2]> {
        let has_place =
            |[x, y]: &[f64; 2]| self.x.scale.forward(*x).is_some() && self.y.scale.forward(*y).is_some();
        self.marks.iter().flat_map(Mark::points).filter(has_place)
    }

    /// True if no mark has a point with a place on both axes.
    pub fn is_empty(&self) -> bool {
        self.drawn().next().is_none()
    }

    /// Limits of both axes: those asked for, else those that take in all marks with a little room.
    pub fn limits(&self) -> [(f64, f64); 2] {
        const ROOM: f64 = 0.04;
        let room = if self.is_picture() { 0.0 } else { ROOM };
        [(0, &self.x), (1, &self.y)].map(|(i, axis)| {
            let found =
                || Some(axis.scale.padded(axis.scale.range(self.drawn().map(|point| point[i]))?, room));
            axis.scale.drawable(axis.limits.or_else(found))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Stroke, points};

    fn panel_of(x: &[f64], y: &[f64]) -> Panel {
        let line = Mark::line(points(x, y), Stroke::solid(Colour::BLACK, 1.0));
        Panel::new(Axis::linear(""), Axis::log(""), [line])
    }

    #[test]
    fn limits_take_in_only_points_with_a_place_on_both_axes() {
        let panel = panel_of(&[0.0, 1.0, 50.0, f64::NAN], &[1.0, 100.0, -1.0, 1e9]);
        let [(x_low, x_high), (y_low, y_high)] = panel.limits();
        assert!(x_low < 0.0 && (1.0..1.1).contains(&x_high));
        assert!((0.5..1.0).contains(&y_low) && (100.0..200.0).contains(&y_high));
        let steps = Shape::Histogram {
            edges: vec![1.0, 2.0, 4.0],
            counts: vec![7.0, 8.0],
            stroke: Stroke::solid(Colour::BLACK, 1.0),
        };
        assert_eq!(Mark::from(steps).points(), [[1.0, 7.0], [2.0, 8.0], [2.0, 7.0], [4.0, 8.0]]);
    }

    #[test]
    fn a_panel_without_drawable_points_is_empty() {
        assert!(panel_of(&[], &[]).is_empty());
        assert!(panel_of(&[f64::NAN, 1.0], &[1.0, -1.0]).is_empty());
        assert!(!panel_of(&[1.0], &[1.0]).is_empty());
    }
}
