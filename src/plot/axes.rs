//! The axes of a panel and what is written around it: frame, ticks on all four sides, numbers, labels.

use super::colour::Stroke;
use super::layout::Placed;
use super::panel::Axis;
use super::scale::Span;
use super::style::{self, CAPTION_PT, FRAME, HALF_DIGIT, LABEL_GAP_PT, LABEL_PT, SMALL_PT, TICK_GAP_PT};
use super::svg::{Anchor, Svg, TextStyle, number, point};
use super::ticks::{Ticks, with_exponent};

const TICK_WIDTH_PT: f64 = 0.5;
const MAJOR_PT: f64 = 3.6;
const MINOR_PT: f64 = 2.0;

/// Draws frame, ticks, numbers, axis labels and captions.
pub fn draw(svg: &mut Svg, place: &Placed) {
    ticks(svg, place);
    svg.stroked_rect(place.frame, FRAME);
    numbers(svg, place);
    labels(svg, place);
}

fn ticks(svg: &mut Svg, place: &Placed) {
    let Placed { panel, frame, x, y, x_ticks, y_ticks, .. } = place;
    let below = |at, length: f64| format!("M{}v{}", point((at, frame.bottom())), number(-length));
    let above = |at, length| format!("M{}v{}", point((at, frame.y)), number(length));
    let left = |at, length| format!("M{}h{}", point((frame.x, at)), number(length));
    let right = |at, length: f64| format!("M{}h{}", point((frame.right(), at)), number(-length));
    type Side<'a> = &'a dyn Fn(f64, f64) -> String;
    let x_above = panel.top.as_ref().map_or(x_ticks, |top| &top.ticks);
    let axes: [(&Ticks, &Span, &[Side]); 3] =
        [(x_ticks, x, &[&below]), (x_above, x, &[&above]), (y_ticks, y, &[&left, &right])];
    let mut path = String::new();
    for (ticks, span, sides) in axes {
        let major: Vec<f64> = ticks.major.iter().map(|(value, _)| *value).collect();
        for (values, length) in [(&major, MAJOR_PT), (&ticks.minor, MINOR_PT)] {
            sides.iter().for_each(|side| path.extend(places(span, values).map(|at| side(at, length))));
        }
    }
    svg.lie_on_picture(panel.is_picture());
    svg.stroked_path(&path, Stroke::solid(panel.tick_colour, TICK_WIDTH_PT));
    svg.lie_on_picture(false);
}

/// Page coordinates of the values that lie inside the frame and not on its corners.
fn places<'a>(span: &'a Span, values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let (low, high) = (span.start_pt.min(span.end_pt), span.start_pt.max(span.end_pt));
    values.iter().filter_map(|&value| span.at(value)).filter(move |at| at - low > 0.3 && high - at > 0.3)
}

fn numbers(svg: &mut Svg, place: &Placed) {
    let Placed { panel, frame, x, y, .. } = place;
    let mut write = |at: (f64, f64), label: &str, anchor| svg.text(at, label, style::text(SMALL_PT, anchor));
    if panel.x.tick_labels {
        let baseline = frame.bottom() + TICK_GAP_PT + SMALL_PT;
        for (value, label) in &place.x_ticks.major {
            write((x.at(*value).unwrap_or(frame.x), baseline), label, Anchor::Middle);
        }
    }
    if panel.y.tick_labels {
        for (value, label) in &place.y_ticks.major {
            let baseline = y.at(*value).unwrap_or(frame.y) + HALF_DIGIT * SMALL_PT;
            write((frame.x - TICK_GAP_PT, baseline), label, Anchor::End);
        }
    }
    if let Some(top) = &panel.top {
        for (value, label) in top.ticks.major.iter().filter(|(value, _)| x.contains(*value)) {
            write((x.at(*value).unwrap_or(frame.x), frame.y - TICK_GAP_PT), label, Anchor::Middle);
        }
    }
}

fn labels(svg: &mut Svg, place: &Placed) {
    let Placed { panel, frame, .. } = place;
    let (middle_x, middle_y) = (frame.x + 0.5 * frame.width, frame.y + 0.5 * frame.height);
    let label = style::text(LABEL_PT, Anchor::Middle);
    let numbers_below = if panel.x.tick_labels { TICK_GAP_PT + SMALL_PT } else { 0.0 };
    let baseline = frame.bottom() + numbers_below + LABEL_GAP_PT + 0.9 * LABEL_PT;
    // Without numbers there is nothing the exponent belongs to.
    let text =
        |axis: &Axis, exponent| with_exponent(&axis.label, if axis.tick_labels { exponent } else { 0 });
    svg.text((middle_x, baseline), &text(&panel.x, place.x_ticks.exponent), label);

    let left = frame.x - place.left_pt + 0.9 * LABEL_PT;
    let upwards = TextStyle { upwards: true, ..label };
    svg.text((left, middle_y), &text(&panel.y, place.y_ticks.exponent), upwards);

    let bar = panel.colour_bar.as_ref().map_or(0.0, |bar| bar.height_pt());
    let mut above = frame.y - bar - LABEL_GAP_PT - 0.2 * LABEL_PT;
    for caption in panel.captions.iter().rev() {
        let x = if caption.anchor == Anchor::Start { frame.x } else { frame.right() };
        let caption_style = TextStyle { colour: caption.colour, ..style::text(SMALL_PT, caption.anchor) };
        svg.text((x, above), &caption.text, caption_style);
        above -= CAPTION_PT;
    }
    if let Some(top) = &panel.top {
        svg.text((middle_x, above - TICK_GAP_PT - SMALL_PT), &top.label, label);
    }
}
