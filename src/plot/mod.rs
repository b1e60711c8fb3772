//! Figures from saved results: one SVG description, rendered to SVG and PNG.
//!
//! A [`Figure`] is a grid of [`Panel`]s, a panel two [`Axis`] and a list of [`Mark`]s. The figures of this project are
//! in [`figures`]. This room knows no physics; it bins and smooths for display and chooses limits, nothing more.
//!
//! Labels use a tiny markup: `κ_{os}` lowers, `10^{-3}` raises, `2^{+1}_{−1}` stacks, everything else is literal.
//!
//! ```
//! use haloray::plot::{Axis, Colour, Figure, Line, Mark, Panel, Stroke};
//! let line = Line {
//!     x: vec![1.0, 10.0, 100.0],
//!     y: vec![1.0, 0.1, f64::NAN],
//!     stroke: Stroke::solid(Colour::BLUE, 1.0),
//!     legend: "1/x".into(),
//! };
//! let panel = Panel { marks: vec![Mark::Line(line)], ..Panel::new(Axis::log("M [M_{⊙}]"), Axis::log("n")) };
//! let figure = Figure { panels: vec![panel], ..Figure::one_column("A power law") };
//! assert!(figure.to_svg().starts_with("<svg"));
//! ```

// Text and page: the font, labels in markup, the SVG writer and the PNG renderer.
mod colour;
mod font;
mod markup;
mod png;
mod svg;
// Numbers: scales, their ticks, stretches of colours, contours and densities.
mod contour;
mod density;
mod norm;
mod scale;
mod ticks;
// The description of a figure.
mod figure;
mod mark;
mod panel;
// From the description to the page: what lies where, then each part drawn.
mod axes;
mod colour_bar;
mod draw_marks;
mod layout;
mod legend;
mod raster_picture;
mod render;
mod style;
// The figures of this project.
pub mod figures;

pub use colour::{Colour, ColourMap, Dash, Stroke};
pub use figure::Figure;
pub use mark::{
    Band, Circle, ErrorBars, Extent, Histogram, Line, Mark, Raster, Region, Rule, RuleAt, Scatter, Text,
    TextAt,
};
pub use norm::{ColourScale, Norm};
pub use panel::{Axis, Caption, ColourBar, Corner, Panel, Side, TopAxis};
pub use scale::{Scale, quantile};
pub use svg::Anchor;
