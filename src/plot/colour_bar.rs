//! Colour bars: the strip of colours above a panel, its ticks, numbers and label.

use super::colour::{Colour, Stroke};
use super::layout::Placed;
use super::mark::Shape;
use super::markup::width_pt;
use super::panel::{ColourBar, Panel};
use super::scale::Direction;
use super::style::{self, BAR_GAP_PT, BAR_PT, FRAME, LABEL_GAP_PT, LABEL_PT, SMALL_PT, TICK_GAP_PT};
use super::svg::{Anchor, Rect, Svg, number, point};
use super::ticks::with_exponent;

/// Length of the arrow that says that values go on beyond the end.
const ARROW_PT: f64 = 5.0;
/// Number of straight pieces that the colour map is drawn with.
const STOPS: u8 = 64;
/// The ticks point outwards: inside they would vanish in the dark colours.
const MAJOR_PT: f64 = 2.0;
const MINOR_PT: f64 = 1.2;

/// Draws the colour bar of a panel of the figure.
pub fn draw(svg: &mut Svg, place: &Placed, bar: &ColourBar, figure: &[Panel]) {
    let (frame, colours) = (place.frame, bar.colours);
    let (x, y, width) = (frame.x, frame.y - BAR_GAP_PT - BAR_PT, place.bar_right_pt - frame.x);
    let arrows = beyond(figure, bar).map(|beyond| if beyond { ARROW_PT } else { 0.0 });
    let strip = Rect { x: x + arrows[0], y, width: width - (arrows[0] + arrows[1]), height: BAR_PT };
    paint(svg, strip, bar, arrows);
    let ticks = colours.ticks(strip.x, strip.right(), Direction::Horizontal);
    let at = |value| strip.x + colours.position(value).unwrap_or(0.0) * strip.width;
    let tick = |value, length: f64| format!("M{}v{}", point((at(value), y)), number(-length));
    let major = ticks.major.iter().map(|(value, _)| tick(*value, MAJOR_PT));
    let path: String = major.chain(ticks.minor.iter().map(|value| tick(*value, MINOR_PT))).collect();
    svg.stroked_path(&path, Stroke { width_pt: 0.5, ..FRAME });
    let mut taken = f64::NEG_INFINITY;
    for (value, label) in &ticks.major {
        let half = 0.5 * width_pt(label, SMALL_PT);
        // Numbers at the ends move inwards, where they must not meet their neighbours.
        let middle = at(*value).min(x + width - half).max(x + half);
        if label.is_empty() || middle - half < taken {
            continue;
        }
        taken = middle + half + 0.4 * SMALL_PT;
        svg.text((middle, y - TICK_GAP_PT), label, style::text(SMALL_PT, Anchor::Middle));
    }
    let baseline = y - TICK_GAP_PT - SMALL_PT - LABEL_GAP_PT - 0.2 * LABEL_PT;
    let label = with_exponent(&bar.label, ticks.exponent);
    svg.text((x + 0.5 * width, baseline), &label, style::text(LABEL_PT, Anchor::Middle));
}

/// Whether the rasters that the bar explains have finite values below and above its ends.
fn beyond(figure: &[Panel], bar: &ColourBar) -> [bool; 2] {
    let (low, high) = bar.colours.limits();
    let values = || {
        let shapes = figure.iter().flat_map(|panel| &panel.marks).map(|mark| &mark.shape);
        let rasters = shapes.filter_map(|shape| match shape {
            Shape::Raster { values, colours, .. } if *colours == bar.colours => Some(values),
            _ => None,
        });
        rasters.flatten().filter(|value| value.is_finite())
    };
    [values().any(|&value| value < low), values().any(|&value| value > high)]
}

/// The colours, arrows of those lengths at their ends, and one outline about all.
fn paint(svg: &mut Svg, strip: Rect, bar: &ColourBar, [below, above]: [f64; 2]) {
    let (left, right, top, bottom) = (strip.x, strip.right(), strip.y, strip.bottom());
    let (low_side, high_side) = ([(left, bottom), (left, top)], [(right, top), (right, bottom)]);
    let (low_tip, high_tip) = ((left - below, top + 0.5 * BAR_PT), (right + above, top + 0.5 * BAR_PT));
    let centre = (0.5 * (left + right), 0.5 * (top + bottom));
    for (arrow, side, tip, t) in [(below, low_side, low_tip, 0.0), (above, high_side, high_tip, 1.0)] {
        if arrow > 0.0 {
            // Reaches under the strip, so that no seam shows between the two.
            svg.lie_on_picture(true);
            svg.filled_path(&polygon(&[side[0], tip, side[1], centre]), bar.colours.map.at(t), 1.0);
            svg.lie_on_picture(false);
        }
    }
    let stops: Vec<Colour> =
        (0..=STOPS).map(|i| bar.colours.map.at(f64::from(i) / f64::from(STOPS))).collect();
    svg.gradient_rect(strip, &stops);
    let outline = [high_side[0], high_tip, high_side[1], low_side[0], low_tip, low_side[1]];
    svg.stroked_path(&polygon(&outline), FRAME);
}

fn polygon(corners: &[(f64, f64)]) -> String {
    let points: Vec<String> = corners.iter().map(|corner| point(*corner)).collect();
    format!("M{}Z", points.join("L"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, ColourScale, Extent};

    #[test]
    fn arrows_stand_only_where_values_go_on() {
        let colours = ColourScale::symmetric(0.5, 0.5);
        let raster = |values: Vec<f64>| {
            let extent = Extent::square([0.5; 2], 0.5);
            let raster = Shape::Raster { nx: values.len(), ny: 1, values, extent, colours };
            Panel::new(Axis::linear(""), Axis::linear(""), [raster.into()])
        };
        let bar = ColourBar { colours, label: String::new(), panels: 1 };
        let arrows = |values| beyond(&[raster(vec![0.5]), raster(values)], &bar);
        assert_eq!(arrows(vec![0.0, 1.0, f64::INFINITY]), [false, false]);
        assert_eq!(arrows(vec![-0.1, 1.0, f64::NAN]), [true, false]);
        assert_eq!(arrows(vec![0.5, 1.1]), [false, true]);
    }
}
