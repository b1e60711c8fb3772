//! Figures from saved results: one SVG description, rendered to SVG and PNG.
//!
//! A [`Figure`] is a grid of panels, a panel two axes and a list of marks; the figures of this project are in
//! [`figures`]. This room knows no physics; it bins and smooths for display and chooses limits, nothing more.
//!
//! Labels use a tiny markup: `κ_{os}` lowers, `10^{-3}` raises, `2^{+1}_{−1}` stacks, everything else is literal.

// Text and page: the font, labels in markup, the SVG writer and the PNG renderer.
mod colour;
mod figure_style;
mod font;
mod markup;
mod pdf;
mod png;
mod style;
mod svg;
// Numbers: scales, their ticks, stretches of colours, contours and densities.
mod colour_scale;
mod contour;
mod density;
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
mod legend_corner;
mod raster_picture;
mod render;
// The figures of this project.
pub mod figures;

pub(crate) use colour::{Colour, ColourMap, Stroke};
pub(crate) use colour_scale::{ColourScale, Stretch};
pub use figure::Figure;
pub use figure_style::Style;
pub use mark::Extent;
pub(crate) use mark::{At, Mark, Rule, Shape, points};
pub(crate) use panel::{Axis, Caption, ColourBar, Corner, Panel, TopAxis};
pub(crate) use scale::{Scale, quantile};
pub(crate) use svg::Anchor;
