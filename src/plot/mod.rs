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

mod colour;
mod colour_bar;
mod contour;
mod density;
mod draw;
mod embed;
mod figure;
pub mod figures;
mod font;
mod frame;
mod layout;
mod legend;
mod mark;
mod markup;
mod norm;
mod panel;
mod png;
mod scale;
mod svg;
mod ticks;

pub use colour::{Colour, ColourMap, Dash, Stroke};
pub use figure::Figure;
pub use mark::{
    Band, Circle, ErrorBars, Histogram, Line, Mark, Raster, Region, Rule, RuleAt, Scatter, Text, TextAt,
};
pub use norm::Norm;
pub use panel::{Axis, Caption, ColourBar, Corner, Panel, Side, TopAxis};
pub use scale::{Scale, quantile};
pub use svg::Anchor;
