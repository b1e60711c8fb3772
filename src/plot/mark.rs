//! Everything a panel can show, as one closed list.

use super::colour::{Colour, Stroke};
use super::colour_scale::ColourScale;
use super::svg::Anchor;

/// A point in data units.
pub type Point = [f64; 2];

/// The points of two columns.
pub fn points(x: &[f64], y: &[f64]) -> Vec<Point> {
    x.iter().zip(y).map(|(x, y)| [*x, *y]).collect()
}

/// One thing drawn in a panel; values that are not finite are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    pub shape: Shape,
    /// Text in the legend, in markup; empty for none.
    pub legend: String,
}

/// What a mark draws; lengths in data units unless they say otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A curve; it breaks where a value has no place on its axis.
    Line { points: Vec<Point>, stroke: Stroke },
    /// The area between a lower and an upper curve: (x, low, high).
    Band { edges: Vec<[f64; 3]>, colour: Colour },
    /// Discs at points.
    Dots { points: Vec<Point>, colour: Colour, radius_pt: f64, opacity: f64 },
    /// Points with vertical bars (x, y, low, high); a low end without a place on the axis lies at the axis' own.
    ErrorBars { points: Vec<[f64; 4]>, colour: Colour },
    /// Counts between increasing edges, one more than counts, as steps; the fill has an eighth of full opacity.
    Histogram { edges: Vec<f64>, counts: Vec<f64>, stroke: Stroke },
    /// Row-major (y, x) values of `nx` columns and `ny` rows, y up, in colours.
    Raster { values: Vec<f64>, nx: usize, ny: usize, extent: Extent, colours: ColourScale },
    /// Areas inside closed curves, such as the contours of a posterior; a curve that runs the other way round cuts a hole.
    Region { rings: Vec<Vec<Point>>, stroke: Stroke, opacity: f64 },
    /// A circle (an ellipse on the page where the axes differ).
    Circle { centre: Point, radius: f64, stroke: Stroke },
    /// A straight line across the whole panel.
    Rule { at: Rule, stroke: Stroke },
    /// A short text in the markup of labels, perhaps with an outline that keeps it legible on a raster.
    Text { at: At, text: String, anchor: Anchor, colour: Colour, halo: Option<Colour> },
}

/// Outer edges of a grid, data units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Left edge.
    pub left: f64,
    /// Right edge.
    pub right: f64,
    /// Bottom edge.
    pub bottom: f64,
    /// Top edge.
    pub top: f64,
}

impl Extent {
    /// A square about a point.
    pub fn square([x, y]: [f64; 2], half_width: f64) -> Self {
        Self { left: x - half_width, right: x + half_width, bottom: y - half_width, top: y + half_width }
    }
}

/// Where a [`Shape::Rule`] lies, in data units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// A vertical line at this abscissa.
    X(f64),
    /// A horizontal line at this ordinate.
    Y(f64),
}

/// Where a [`Shape::Text`] lies: its anchor on the vertical middle of the letters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum At {
    /// Abscissa in data units, ordinate as a fraction of the panel's height.
    DataFraction(f64, f64),
    /// In fractions of the panel from the bottom left.
    Fraction(f64, f64),
}

impl From<Shape> for Mark {
    fn from(shape: Shape) -> Self {
        Self { shape, legend: String::new() }
    }
}

impl Mark {
    /// A curve.
    pub fn line(points: impl Into<Vec<Point>>, stroke: Stroke) -> Self {
        Shape::Line { points: points.into(), stroke }.into()
    }

    /// A straight line across the whole panel.
    pub fn rule(at: Rule, stroke: Stroke) -> Self {
        Shape::Rule { at, stroke }.into()
    }

    /// The same with a text in the legend.
    pub fn named(self, legend: impl Into<String>) -> Self {
        Self { legend: legend.into(), ..self }
    }

    /// The points that the axes should take in.
    pub fn points(&self) -> Vec<Point> {
        match &self.shape {
            Shape::Line { points, .. } | Shape::Dots { points, .. } => points.clone(),
            Shape::Band { edges, .. } => edges.iter().flat_map(|&[x, a, b]| [[x, a], [x, b]]).collect(),
            Shape::ErrorBars { points, .. } => {
                points.iter().flat_map(|&[x, y, low, high]| [[x, y], [x, low], [x, high]]).collect()
            }
            Shape::Histogram { edges, counts, .. } => {
                [points(edges, counts), points(edges.get(1..).unwrap_or_default(), counts)].concat()
            }
            Shape::Raster { values, extent: Extent { left, right, bottom, top }, .. } => {
                let is_drawn = values.iter().any(|value| value.is_finite());
                if is_drawn { vec![[*left, *bottom], [*right, *top]] } else { Vec::new() }
            }
            Shape::Region { rings, .. } => rings.concat(),
            Shape::Circle { .. } | Shape::Rule { .. } | Shape::Text { .. } => Vec::new(),
        }
    }
}
