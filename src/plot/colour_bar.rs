//! Colour bars: the strip of colours, its ticks, numbers and label.

use super::colour::{Colour, Stroke};
use super::layout::{Placed, widest_pt};
use super::mark::Mark;
use super::markup::width_pt;
use super::panel::{ColourBar, Panel, Side};
use super::scale::Direction;
use super::style::{
    self, BAR_GAP_PT, BAR_PT, FRAME, HALF_DIGIT, LABEL_GAP_PT, LABEL_PT, SMALL_PT, TICK_GAP_PT,
};
use super::svg::{Anchor, Rect, Svg, TextStyle, number};
use super::ticks::{Ticks, with_exponent};

/// Length of the arrow that says that values go on beyond the end.
const ARROW_PT: f64 = 5.0;
/// Number of straight pieces that the colour map is drawn with.
const STOPS: u8 = 64;

/// Draws the colour bar of a panel of the figure.
pub(super) fn draw(svg: &mut Svg, place: &Placed, bar: &ColourBar, figure: &[Panel]) {
    let frame = place.frame;
    let (below, above) = beyond(figure, bar);
    match bar.side {
        Side::Right => {
            let x = frame.right() + BAR_GAP_PT;
            let strip = inset(Rect { x, width: BAR_PT, ..frame }, Direction::Vertical, below, above);
            paint(svg, strip, bar, Direction::Vertical, below, above);
            let ticks = bar.colours.norm.ticks(strip.bottom(), strip.y, Direction::Vertical, SMALL_PT);
            let at = |value| strip.bottom() - bar.colours.norm.position(value).unwrap_or(0.0) * strip.height;
            let tick =
                |value, length| format!("M{} {}h{}", number(x + BAR_PT), number(at(value)), number(length));
            draw_ticks(svg, &ticks, tick);
            let left = x + BAR_PT + TICK_GAP_PT;
            for (value, label) in &ticks.major {
                svg.text(
                    (left, at(*value) + HALF_DIGIT * SMALL_PT),
                    label,
                    style::text(SMALL_PT, Anchor::Start),
                );
            }
            let label_x = left + widest_pt(&ticks) + LABEL_GAP_PT + 0.85 * LABEL_PT;
            let upwards = TextStyle { upwards: true, ..style::text(LABEL_PT, Anchor::Middle) };
            let middle = frame.y + 0.5 * frame.height;
            svg.text((label_x, middle), &with_exponent(&bar.label, ticks.exponent), upwards);
        }
        Side::Top | Side::TopOver(_) => {
            let (y, width) = (frame.y - BAR_GAP_PT - BAR_PT, place.bar_right_pt - frame.x);
            let strip =
                inset(Rect { x: frame.x, y, width, height: BAR_PT }, Direction::Horizontal, below, above);
            paint(svg, strip, bar, Direction::Horizontal, below, above);
            let ticks = bar.colours.norm.ticks(strip.x, strip.right(), Direction::Horizontal, SMALL_PT);
            let at = |value| strip.x + bar.colours.norm.position(value).unwrap_or(0.0) * strip.width;
            let tick =
                |value, length: f64| format!("M{} {}v{}", number(at(value)), number(y), number(-length));
            draw_ticks(svg, &ticks, tick);
            for (value, label) in &ticks.major {
                let half = 0.5 * width_pt(label, SMALL_PT);
                let (first, last) = (frame.x + half, frame.x + width - half);
                let middle = at(*value).min(last).max(first);
                svg.text((middle, y - TICK_GAP_PT), label, style::text(SMALL_PT, Anchor::Middle));
            }
            let baseline = y - TICK_GAP_PT - SMALL_PT - LABEL_GAP_PT - 0.2 * LABEL_PT;
            let label = with_exponent(&bar.label, ticks.exponent);
            svg.text((frame.x + 0.5 * width, baseline), &label, style::text(LABEL_PT, Anchor::Middle));
        }
    }
}

/// Whether the rasters that the bar explains have finite values below and above its ends.
fn beyond(figure: &[Panel], bar: &ColourBar) -> (bool, bool) {
    let (low, high) = bar.colours.norm.limits();
    let values = || {
        let rasters = figure.iter().flat_map(|panel| &panel.marks).filter_map(|mark| match mark {
            Mark::Raster(raster) if raster.colours == bar.colours => Some(&raster.values),
            _ => None,
        });
        rasters.flatten().filter(|value| value.is_finite())
    };
    (values().any(|&value| value < low), values().any(|&value| value > high))
}

/// The strip without the room of its arrows.
fn inset(whole: Rect, direction: Direction, below: bool, above: bool) -> Rect {
    let room = |arrow| if arrow { ARROW_PT } else { 0.0 };
    let both = room(below) + room(above);
    match direction {
        Direction::Horizontal => Rect { x: whole.x + room(below), width: whole.width - both, ..whole },
        Direction::Vertical => Rect { y: whole.y + room(above), height: whole.height - both, ..whole },
    }
}

/// The colours, their arrows, and one outline about all.
fn paint(svg: &mut Svg, strip: Rect, bar: &ColourBar, direction: Direction, below: bool, above: bool) {
    let arrow = |present| if present { ARROW_PT } else { 0.0 };
    let (low_tip, high_tip) = match direction {
        Direction::Horizontal => {
            let middle = strip.y + 0.5 * strip.height;
            ((strip.x - arrow(below), middle), (strip.right() + arrow(above), middle))
        }
        Direction::Vertical => {
            let middle = strip.x + 0.5 * strip.width;
            ((middle, strip.bottom() + arrow(below)), (middle, strip.y - arrow(above)))
        }
    };
    let (left, right, top, bottom) = (strip.x, strip.right(), strip.y, strip.bottom());
    let (low_side, high_side) = match direction {
        Direction::Horizontal => ([(left, bottom), (left, top)], [(right, top), (right, bottom)]),
        Direction::Vertical => ([(right, bottom), (left, bottom)], [(left, top), (right, top)]),
    };
    let centre = (0.5 * (left + right), 0.5 * (top + bottom));
    for (present, side, tip, t) in [(below, low_side, low_tip, 0.0), (above, high_side, high_tip, 1.0)] {
        if present {
            // Reaches under the strip, so that no seam shows between the two.
            svg.filled_path(&polygon(&[side[0], tip, side[1], centre]), bar.colours.map.at(t), 1.0);
        }
    }
    let stops: Vec<Colour> =
        (0..=STOPS).map(|i| bar.colours.map.at(f64::from(i) / f64::from(STOPS))).collect();
    svg.gradient_rect(strip, &stops, direction);
    let outline = [high_side[0], high_tip, high_side[1], low_side[0], low_tip, low_side[1]];
    svg.stroked_path(&polygon(&outline), FRAME);
}

fn polygon(corners: &[(f64, f64)]) -> String {
    let points: Vec<String> = corners.iter().map(|(x, y)| format!("{} {}", number(*x), number(*y))).collect();
    format!("M{}Z", points.join("L"))
}

/// The ticks, outwards: inside they would vanish in the dark colours.
fn draw_ticks(svg: &mut Svg, ticks: &Ticks, tick: impl Fn(f64, f64) -> String) {
    const MAJOR_PT: f64 = 2.0;
    const MINOR_PT: f64 = 1.2;
    let major = ticks.major.iter().map(|(value, _)| tick(*value, MAJOR_PT));
    let minor = ticks.minor.iter().map(|value| tick(*value, MINOR_PT));
    let path: String = major.chain(minor).collect();
    svg.stroked_path(&path, Stroke { width_pt: 0.5, ..FRAME });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, ColourMap, ColourScale, Extent, Norm, Raster};

    #[test]
    fn arrows_stand_only_where_values_go_on() {
        let colours = ColourScale { map: ColourMap::Viridis, norm: Norm::Linear { low: 0.0, high: 1.0 } };
        let raster = |values: Vec<f64>| {
            let extent = Extent::square([0.5; 2], 0.5);
            let raster = Raster { nx: values.len(), ny: 1, values, extent, colours };
            Panel { marks: vec![Mark::Raster(raster)], ..Panel::new(Axis::linear(""), Axis::linear("")) }
        };
        let bar = ColourBar { colours, label: String::new(), side: Side::Top };
        let arrows = |values| beyond(&[raster(vec![0.5]), raster(values)], &bar);
        assert_eq!(arrows(vec![0.0, 1.0, f64::INFINITY]), (false, false));
        assert_eq!(arrows(vec![-0.1, 1.0, f64::NAN]), (true, false));
        assert_eq!(arrows(vec![0.5, 1.1]), (false, true));
    }
}
