//! The legend of a panel: a sample of each mark and its text.

use super::colour::{Colour, Stroke};
use super::layout::Placed;
use super::legend_corner::legend_box;
use super::mark::{Mark, Shape};
use super::markup::width_pt;
use super::style::{self, HALF_DIGIT, HISTOGRAM_OPACITY, POINT_PT, SMALL_PT};
use super::svg::{Anchor, Rect, Svg, number, point};

const LINE_PT: f64 = 1.45 * SMALL_PT;
const GAP_PT: f64 = 4.0;

/// Draws the legend if any mark has a text for it.
pub fn draw(svg: &mut Svg, place: &Placed) {
    let entries: Vec<&Mark> = place.panel.marks.iter().filter(|mark| !mark.legend.is_empty()).collect();
    if entries.is_empty() {
        return;
    }
    let widest = |of: &dyn Fn(&Mark) -> f64| entries.iter().map(|mark| of(mark)).fold(0.0, f64::max);
    let (text_width, sample_width) =
        (widest(&|mark| width_pt(&mark.legend, SMALL_PT)), widest(&sample_width_pt));
    let (width, height) = (sample_width + GAP_PT + text_width, LINE_PT * entries.len() as f64);
    let Rect { x, y, .. } = legend_box(place, width, height);
    let box_around = Rect { x: x - 2.0, y: y - 1.0, width: width + 4.0, height: height + 2.0 };
    svg.filled_rect(box_around, Colour::WHITE, 0.85);
    for (i, mark) in entries.into_iter().enumerate() {
        let middle = y + LINE_PT * (i as f64 + 0.5);
        sample(svg, &mark.shape, (x, middle), sample_width);
        let text_at = (x + sample_width + GAP_PT, middle + HALF_DIGIT * SMALL_PT);
        svg.text(text_at, &mark.legend, style::text(SMALL_PT, Anchor::Start));
    }
}

/// Points need less room than lines.
fn sample_width_pt(mark: &Mark) -> f64 {
    if matches!(mark.shape, Shape::Dots { .. } | Shape::ErrorBars { .. }) { 5.0 } else { 16.0 }
}

/// A sample of the shape about the height `middle`.
fn sample(svg: &mut Svg, shape: &Shape, (x, middle): (f64, f64), width: f64) {
    let centre = (x + 0.5 * width, middle);
    let mut block = |stroke: Stroke, opacity: f64| {
        let block = Rect { x, y: middle - 0.35 * LINE_PT, width, height: 0.7 * LINE_PT };
        svg.filled_rect(block, stroke.colour, opacity);
        svg.stroked_rect(block, stroke);
    };
    match shape {
        Shape::Histogram { stroke, .. } => block(*stroke, HISTOGRAM_OPACITY),
        Shape::Region { stroke, opacity, .. } => block(*stroke, *opacity),
        Shape::Line { stroke, .. } | Shape::Rule { stroke, .. } => {
            svg.stroked_path(&format!("M{}h{}", point((x, middle)), number(width)), *stroke);
        }
        Shape::Dots { radius_pt, colour, .. } => svg.disc(centre, radius_pt.max(1.6), *colour),
        Shape::ErrorBars { colour, .. } => {
            let half = 0.36 * LINE_PT;
            let upright = format!("M{}v{}", point((centre.0, middle - half)), number(2.0 * half));
            svg.stroked_path(&upright, style::error_bar(*colour));
            svg.disc(centre, POINT_PT, *colour);
        }
        _ => {}
    }
}
