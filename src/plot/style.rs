//! Sizes, gaps, strokes and opacities that all parts of a page share.

use super::colour::{Colour, Stroke};
use super::svg::{Anchor, TextStyle};

/// Size of tick labels, legends and notes.
pub const SMALL_PT: f64 = 7.0;
/// Size of axis labels and titles.
pub const LABEL_PT: f64 = 8.0;
/// Between a frame and its tick labels.
pub const TICK_GAP_PT: f64 = 3.0;
/// Between tick labels and axis label.
pub const LABEL_GAP_PT: f64 = 2.5;
/// Thickness of a colour bar.
pub const BAR_PT: f64 = 5.0;
/// Between a frame and its colour bar.
pub const BAR_GAP_PT: f64 = 3.5;
/// Height of a line of text that may carry scripts, relative to its size.
pub const LINE_HEIGHT: f64 = 1.15;
/// Height of a line of captions.
pub const CAPTION_PT: f64 = 1.3 * SMALL_PT;
/// From the middle of the digits down to the baseline, relative to the size.
pub const HALF_DIGIT: f64 = 0.36;
/// Frame and ticks of every panel and colour bar.
pub const FRAME: Stroke = Stroke::solid(Colour::BLACK, 0.6);
/// Opacity of the area under a histogram.
pub const HISTOGRAM_OPACITY: f64 = 0.125;
/// Radius of a point with error bars.
pub const POINT_PT: f64 = 1.5;

/// The stroke of error bars.
pub fn error_bar(colour: Colour) -> Stroke {
    Stroke::solid(colour, 0.7)
}

/// Black text without an outline.
pub fn text(size_pt: f64, anchor: Anchor) -> TextStyle {
    TextStyle { size_pt, anchor, colour: Colour::BLACK, upwards: false, halo: None }
}

/// Height that a line of text takes beside a frame; an empty one takes none.
pub fn line_pt(text: &str, size_pt: f64) -> f64 {
    if text.is_empty() { 0.0 } else { LABEL_GAP_PT + LINE_HEIGHT * size_pt }
}
