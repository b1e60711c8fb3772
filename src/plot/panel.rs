//! A panel: two axes, the marks between them, and what surrounds them.

use super::colour::Colour;
use super::mark::Mark;
use super::norm::ColourScale;
use super::scale::Scale;
use super::svg::Anchor;

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Label in markup, with the unit in square brackets; empty for none.
    pub label: String,
    /// Values at both ends; `None` takes in all marks.
    pub limits: Option<(f64, f64)>,
    /// Whether the ticks carry numbers; inner panels of a grid do without.
    pub tick_labels: bool,
}

impl Axis {
    /// A linear axis that takes in all marks.
    pub fn linear(label: &str) -> Self {
        Self { scale: Scale::Linear, label: label.into(), limits: None, tick_labels: true }
    }

    /// A logarithmic axis that takes in all marks.
    pub fn log(label: &str) -> Self {
        Self { scale: Scale::Log, ..Self::linear(label) }
    }
}

/// A second axis on top: other numbers for the same abscissae.
#[derive(Debug, Clone, PartialEq)]
pub struct TopAxis {
    /// Label in markup.
    pub label: String,
    /// Long ticks: abscissa in data units of the panel, and what is written there.
    pub major: Vec<(f64, String)>,
    /// Short ticks, data units of the panel.
    pub minor: Vec<f64>,
}

/// A colour bar for the rasters of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourBar {
    /// From values to colours, as in the rasters.
    pub colours: ColourScale,
    /// Label in markup, with the unit in square brackets.
    pub label: String,
    /// Where it stands.
    pub side: Side,
}

/// Where a colour bar stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Upright on the right of the panel.
    Right,
    /// Lying above the panel.
    Top,
    /// Lying above the panel and its neighbours on the right: so many panels in all.
    TopOver(usize),
}

/// Where a legend stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    /// Top left.
    TopLeft,
    /// Top right.
    TopRight,
    /// Bottom left.
    BottomLeft,
    /// Bottom right.
    BottomRight,
}

/// A line of small text above a panel; it may be wider than the panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Caption {
    /// What, in markup.
    pub text: String,
    /// Colour.
    pub colour: Colour,
    /// Which end of the text lies at that end of the panel.
    pub anchor: Anchor,
}

/// Two axes and what lies between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// Drawn in this order.
    pub marks: Vec<Mark>,
    /// Text above the panel, in markup; empty for none.
    pub title: String,
    /// Lines of small text above the panel.
    pub captions: Vec<Caption>,
    /// A second axis on top.
    pub top: Option<TopAxis>,
    /// A colour bar.
    pub colour_bar: Option<ColourBar>,
    /// Where the legend stands, if any mark has a text for it.
    pub legend: Corner,
    /// Colour of the ticks: white shows on dark rasters.
    pub tick_colour: Colour,
    /// Leaves the panel's place in the grid empty but for its legend.
    pub is_blank: bool,
}

impl Panel {
    /// An empty panel between two axes.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            x,
            y,
            marks: Vec::new(),
            title: String::new(),
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
        Self { is_blank: true, ..Self::new(Axis::linear(""), Axis::linear("")) }
    }

    /// True if no mark has a point with a place on both axes.
    pub(super) fn is_empty(&self) -> bool {
        let drawn = |(x, y)| self.x.scale.forward(x).is_some() && self.y.scale.forward(y).is_some();
        !self.marks.iter().any(|mark| mark.points().into_iter().any(drawn))
    }

    /// Limits of both axes: those asked for, else those that take in all marks with a little room.
    pub(super) fn limits(&self) -> ((f64, f64), (f64, f64)) {
        const ROOM: f64 = 0.04;
        let tight = self.marks.iter().any(|mark| matches!(mark, Mark::Raster(_)));
        let points: Vec<(f64, f64)> = match (self.x.limits, self.y.limits) {
            (Some(_), Some(_)) => Vec::new(),
            _ => self.marks.iter().flat_map(Mark::points).collect(),
        };
        let drawn = || {
            points
                .iter()
                .filter(|(x, y)| self.x.scale.forward(*x).is_some() && self.y.scale.forward(*y).is_some())
        };
        let of = |axis: &Axis, values: Vec<f64>| {
            let found = || {
                axis.scale.range(values).map(|range| axis.scale.padded(range, if tight { 0.0 } else { ROOM }))
            };
            axis.scale.drawable(axis.limits.or_else(found))
        };
        (of(&self.x, drawn().map(|p| p.0).collect()), of(&self.y, drawn().map(|p| p.1).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Line, Stroke};

    fn panel_of(x: Vec<f64>, y: Vec<f64>) -> Panel {
        let line = Line { x, y, stroke: Stroke::solid(Colour::BLACK, 1.0), legend: String::new() };
        Panel { marks: vec![Mark::Line(line)], ..Panel::new(Axis::linear(""), Axis::log("")) }
    }

    #[test]
    fn limits_take_in_only_points_with_a_place_on_both_axes() {
        let panel = panel_of(vec![0.0, 1.0, 50.0, f64::NAN], vec![1.0, 100.0, -1.0, 1e9]);
        let ((x_low, x_high), (y_low, y_high)) = panel.limits();
        assert!(x_low < 0.0 && (1.0..1.1).contains(&x_high));
        assert!((0.5..1.0).contains(&y_low) && (100.0..200.0).contains(&y_high));
    }

    #[test]
    fn a_panel_without_drawable_points_is_empty() {
        assert!(panel_of(vec![], vec![]).is_empty());
        assert!(panel_of(vec![f64::NAN, 1.0], vec![1.0, -1.0]).is_empty());
        assert!(!panel_of(vec![1.0], vec![1.0]).is_empty());
    }
}
