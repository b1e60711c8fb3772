//! Everything a panel can show, as one closed list.

use super::colour::{Colour, Stroke};
use super::norm::ColourScale;
use super::svg::Anchor;

/// One thing drawn in a panel. Values that are not finite are left out.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A curve.
    Line(Line),
    /// The area between two curves.
    Band(Band),
    /// Many points of one look.
    Scatter(Scatter),
    /// Points with error bars.
    ErrorBars(ErrorBars),
    /// Counts in bins, as steps.
    Histogram(Histogram),
    /// A grid of values in colours.
    Raster(Raster),
    /// Areas inside closed curves.
    Region(Region),
    /// A circle in data units.
    Circle(Circle),
    /// A straight line across the whole panel.
    Rule(Rule),
    /// A short text.
    Text(Text),
}

/// A curve through points; it breaks where a value has no place on its axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Abscissae, data units.
    pub x: Vec<f64>,
    /// Ordinates, data units.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub stroke: Stroke,
    /// Text in the legend; empty for none.
    pub legend: String,
}

impl Line {
    /// A curve that the legend does not name.
    pub fn new(x: Vec<f64>, y: Vec<f64>, stroke: Stroke) -> Self {
        Self { x, y, stroke, legend: String::new() }
    }
}

/// The area between a lower and an upper curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Abscissae, data units.
    pub x: Vec<f64>,
    /// Lower ordinates.
    pub low: Vec<f64>,
    /// Upper ordinates.
    pub high: Vec<f64>,
    /// Colour, drawn with a quarter of full opacity.
    pub colour: Colour,
}

/// Discs at points.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Abscissae, data units.
    pub x: Vec<f64>,
    /// Ordinates, data units.
    pub y: Vec<f64>,
    /// Colour.
    pub colour: Colour,
    /// Radius in points on the printed page.
    pub radius_pt: f64,
    /// Opacity, 0–1.
    pub opacity: f64,
    /// Text in the legend; empty for none.
    pub legend: String,
}

/// Points with vertical error bars from `low` to `high`.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorBars {
    /// Abscissae, data units.
    pub x: Vec<f64>,
    /// Ordinates, data units.
    pub y: Vec<f64>,
    /// Lower ends of the bars; one without a place on the axis reaches its lower end.
    pub low: Vec<f64>,
    /// Upper ends of the bars.
    pub high: Vec<f64>,
    /// Colour.
    pub colour: Colour,
    /// Text in the legend; empty for none.
    pub legend: String,
}

/// Counts between bin edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Edges, increasing, data units; one more than counts.
    pub edges: Vec<f64>,
    /// Count (or density) of each bin.
    pub counts: Vec<f64>,
    /// Outline and fill colour; the fill has an eighth of full opacity.
    pub stroke: Stroke,
    /// Text in the legend; empty for none.
    pub legend: String,
}

/// A grid of values in colours.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Values, row-major (y, x), y up.
    pub values: Vec<f64>,
    /// Number of columns.
    pub nx: usize,
    /// Number of rows.
    pub ny: usize,
    /// Outer edges of the grid.
    pub extent: Extent,
    /// From values to colours.
    pub colours: ColourScale,
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

/// Areas inside closed curves, such as the contours of a posterior.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Closed curves, data units; one that runs the other way round cuts a hole.
    pub rings: Vec<Vec<(f64, f64)>>,
    /// Outline and fill colour.
    pub stroke: Stroke,
    /// Opacity of the fill, 0–1.
    pub opacity: f64,
    /// Text in the legend; empty for none.
    pub legend: String,
}

/// A circle in data units (an ellipse on the page where the axes differ).
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    /// Abscissa of the centre.
    pub x: f64,
    /// Ordinate of the centre.
    pub y: f64,
    /// Radius.
    pub radius: f64,
    /// How it is drawn.
    pub stroke: Stroke,
}

/// A line across the panel at one value of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// Which axis the value belongs to.
    pub at: RuleAt,
    /// How it is drawn.
    pub stroke: Stroke,
}

/// Where a [`Rule`] lies, in data units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RuleAt {
    /// A vertical line at this abscissa.
    X(f64),
    /// A horizontal line at this ordinate.
    Y(f64),
}

/// A short text in the markup of labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// Where.
    pub at: TextAt,
    /// What, in markup.
    pub text: String,
    /// Which end of the text lies there.
    pub anchor: Anchor,
    /// Colour.
    pub colour: Colour,
    /// Colour of an outline that keeps it legible on a raster.
    pub halo: Option<Colour>,
}

/// Where a [`Text`] lies: its anchor on the vertical middle of the letters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TextAt {
    /// In data units.
    Data(f64, f64),
    /// Abscissa in data units, ordinate as a fraction of the panel's height.
    DataFraction(f64, f64),
    /// In fractions of the panel from the bottom left.
    Fraction(f64, f64),
}

impl Mark {
    /// The points that the axes should take in.
    pub(super) fn points(&self) -> Vec<(f64, f64)> {
        let zip =
            |x: &[f64], y: &[f64]| -> Vec<(f64, f64)> { x.iter().copied().zip(y.iter().copied()).collect() };
        match self {
            Self::Line(line) => zip(&line.x, &line.y),
            Self::Band(band) => [zip(&band.x, &band.low), zip(&band.x, &band.high)].concat(),
            Self::Scatter(scatter) => zip(&scatter.x, &scatter.y),
            Self::ErrorBars(bars) => {
                [zip(&bars.x, &bars.y), zip(&bars.x, &bars.low), zip(&bars.x, &bars.high)].concat()
            }
            Self::Histogram(steps) => {
                let right = steps.edges.get(1..).unwrap_or_default();
                [zip(&steps.edges, &steps.counts), zip(right, &steps.counts)].concat()
            }
            Self::Raster(raster) => {
                let Extent { left, right, bottom, top } = raster.extent;
                let drawn = raster.values.iter().any(|value| value.is_finite());
                if drawn { vec![(left, bottom), (right, top)] } else { Vec::new() }
            }
            Self::Region(region) => region.rings.concat(),
            Self::Circle(_) | Self::Rule(_) | Self::Text(_) => Vec::new(),
        }
    }

    /// Text in the legend; empty for none.
    pub(super) fn legend(&self) -> &str {
        match self {
            Self::Line(line) => &line.legend,
            Self::Scatter(scatter) => &scatter.legend,
            Self::ErrorBars(bars) => &bars.legend,
            Self::Histogram(steps) => &steps.legend,
            Self::Region(region) => &region.legend,
            Self::Band(_) | Self::Raster(_) | Self::Circle(_) | Self::Rule(_) | Self::Text(_) => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_takes_in_both_edges_of_every_bin() {
        let stroke = Stroke::solid(Colour::BLACK, 1.0);
        let steps =
            Histogram { edges: vec![1.0, 2.0, 4.0], counts: vec![7.0, 8.0], stroke, legend: String::new() };
        assert_eq!(Mark::Histogram(steps).points(), [(1.0, 7.0), (2.0, 8.0), (2.0, 7.0), (4.0, 8.0)]);
    }
}
