//! The legend of a panel: a sample of each mark and its text.

use super::colour::Colour;
use super::layout::Placed;
use super::mark::Mark;
use super::markup::width_pt;
use super::panel::Corner;
use super::style::{self, HALF_DIGIT, HISTOGRAM_OPACITY, POINT_PT, SMALL_PT};
use super::svg::{Anchor, Rect, Svg, number};

const LINE_PT: f64 = 1.45 * SMALL_PT;
const GAP_PT: f64 = 4.0;
/// From the frame: clear of the ticks.
const INSET_PT: f64 = 6.0;

/// Draws the legend if any mark has a text for it.
pub(super) fn draw(svg: &mut Svg, place: &Placed) {
    let entries: Vec<&Mark> = place.panel.marks.iter().filter(|mark| !mark.legend().is_empty()).collect();
    if entries.is_empty() {
        return;
    }
    let text_width = entries.iter().map(|mark| width_pt(mark.legend(), SMALL_PT)).fold(0.0, f64::max);
    let sample_width = entries.iter().map(|mark| sample_width_pt(mark)).fold(0.0, f64::max);
    let (width, height) = (sample_width + GAP_PT + text_width, LINE_PT * entries.len() as f64);
    let frame = place.frame;
    let x = match place.panel.legend {
        Corner::TopLeft | Corner::BottomLeft => frame.x + INSET_PT,
        Corner::TopRight | Corner::BottomRight => frame.right() - INSET_PT - width,
    };
    let y = match place.panel.legend {
        Corner::TopLeft | Corner::TopRight => frame.y + INSET_PT,
        Corner::BottomLeft | Corner::BottomRight => frame.bottom() - INSET_PT - height,
    };
    let box_around = Rect { x: x - 2.0, y: y - 1.0, width: width + 4.0, height: height + 2.0 };
    svg.filled_rect(box_around, Colour::WHITE, 0.85);
    for (i, mark) in entries.into_iter().enumerate() {
        let middle = y + LINE_PT * (i as f64 + 0.5);
        sample(svg, mark, (x, middle), sample_width);
        let text_at = (x + sample_width + GAP_PT, middle + HALF_DIGIT * SMALL_PT);
        svg.text(text_at, mark.legend(), style::text(SMALL_PT, Anchor::Start));
    }
}

/// Points need less room than lines.
fn sample_width_pt(mark: &Mark) -> f64 {
    match mark {
        Mark::Scatter(_) | Mark::ErrorBars(_) => 5.0,
        _ => 16.0,
    }
}

/// A sample of the mark about the height `middle`.
fn sample(svg: &mut Svg, mark: &Mark, (x, middle): (f64, f64), width: f64) {
    let across = format!("M{} {}h{}", number(x), number(middle), number(width));
    let upright =
        |half: f64| format!("M{} {}v{}", number(x + 0.5 * width), number(middle - half), number(2.0 * half));
    let block = Rect { x, y: middle - 0.35 * LINE_PT, width, height: 0.7 * LINE_PT };
    let centre = (x + 0.5 * width, middle);
    match mark {
        Mark::Line(line) => svg.stroked_path(&across, line.stroke),
        Mark::Scatter(scatter) => svg.disc(centre, scatter.radius_pt.max(1.6), scatter.colour, 1.0),
        Mark::ErrorBars(bars) => {
            svg.stroked_path(&upright(0.36 * LINE_PT), style::error_bar(bars.colour));
            svg.disc(centre, POINT_PT, bars.colour, 1.0);
        }
        Mark::Histogram(steps) => {
            svg.filled_rect(block, steps.stroke.colour, HISTOGRAM_OPACITY);
            svg.stroked_rect(block, steps.stroke);
        }
        Mark::Region(region) => {
            svg.filled_rect(block, region.stroke.colour, region.opacity);
            svg.stroked_rect(block, region.stroke);
        }
        Mark::Band(_) | Mark::Raster(_) | Mark::Circle(_) | Mark::Rule(_) | Mark::Text(_) => {}
    }
}
