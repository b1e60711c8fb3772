//! The axes of a panel and what is written around it: frame, ticks on all four sides, numbers, labels.

use super::colour::Stroke;
use super::layout::{Placed, lying_bar_pt};
use super::panel::{Axis, Side};
use super::scale::Span;
use super::style::{
    self, CAPTION_PT, FRAME, HALF_DIGIT, LABEL_GAP_PT, LABEL_PT, LINE_HEIGHT, SMALL_PT, TICK_GAP_PT,
};
use super::svg::{Anchor, Svg, TextStyle, number};
use super::ticks::with_exponent;

const TICK_WIDTH_PT: f64 = 0.5;
const MAJOR_PT: f64 = 3.6;
const MINOR_PT: f64 = 2.0;

/// Draws frame, ticks, numbers, axis labels and title.
pub(super) fn draw(svg: &mut Svg, place: &Placed) {
    ticks(svg, place);
    svg.stroked_rect(place.frame, FRAME);
    numbers(svg, place);
    labels(svg, place);
}

fn ticks(svg: &mut Svg, place: &Placed) {
    let Placed { panel, frame, x, y, .. } = place;
    let mut path = String::new();
    let mut tick = |x: f64, y: f64, direction: char, length: f64| {
        path.push_str(&format!("M{} {}{direction}{}", number(x), number(y), number(length)));
    };
    let majors = |ticks: &[(f64, String)]| -> Vec<f64> { ticks.iter().map(|(value, _)| *value).collect() };
    let below = (majors(&place.x_ticks.major), place.x_ticks.minor.clone());
    let above = panel.top.as_ref().map_or(below.clone(), |top| (majors(&top.major), top.minor.clone()));
    let beside = (majors(&place.y_ticks.major), place.y_ticks.minor.clone());
    for (values, length) in [(&below.0, MAJOR_PT), (&below.1, MINOR_PT)] {
        places(x, values).for_each(|at| tick(at, frame.bottom(), 'v', -length));
    }
    for (values, length) in [(&above.0, MAJOR_PT), (&above.1, MINOR_PT)] {
        places(x, values).for_each(|at| tick(at, frame.y, 'v', length));
    }
    for (values, length) in [(&beside.0, MAJOR_PT), (&beside.1, MINOR_PT)] {
        places(y, values).for_each(|at| tick(frame.x, at, 'h', length));
        places(y, values).for_each(|at| tick(frame.right(), at, 'h', -length));
    }
    svg.stroked_path(&path, Stroke::solid(panel.tick_colour, TICK_WIDTH_PT));
}

/// Page coordinates of the values that lie inside the frame and not on its corners.
fn places<'a>(span: &'a Span, values: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let (low, high) = (span.start_pt.min(span.end_pt), span.start_pt.max(span.end_pt));
    values.iter().filter_map(|&value| span.at(value)).filter(move |at| at - low > 0.3 && high - at > 0.3)
}

fn numbers(svg: &mut Svg, place: &Placed) {
    let Placed { panel, frame, x, y, .. } = place;
    if panel.x.tick_labels {
        let baseline = frame.bottom() + TICK_GAP_PT + SMALL_PT;
        for (value, label) in &place.x_ticks.major {
            let at = x.at(*value).unwrap_or(frame.x);
            svg.text((at, baseline), label, style::text(SMALL_PT, Anchor::Middle));
        }
    }
    if panel.y.tick_labels {
        for (value, label) in &place.y_ticks.major {
            let baseline = y.at(*value).unwrap_or(frame.y) + HALF_DIGIT * SMALL_PT;
            svg.text((frame.x - TICK_GAP_PT, baseline), label, style::text(SMALL_PT, Anchor::End));
        }
    }
    if let Some(top) = &panel.top {
        for (value, label) in top.major.iter().filter(|(value, _)| x.contains(*value)) {
            let at = x.at(*value).unwrap_or(frame.x);
            svg.text((at, frame.y - TICK_GAP_PT), label, style::text(SMALL_PT, Anchor::Middle));
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

    let mut above = frame.y - LABEL_GAP_PT - 0.2 * LABEL_PT;
    for caption in panel.captions.iter().rev() {
        let x = match caption.anchor {
            Anchor::Start => frame.x,
            Anchor::Middle => middle_x,
            Anchor::End => frame.right(),
        };
        let caption_style = TextStyle { colour: caption.colour, ..style::text(SMALL_PT, caption.anchor) };
        svg.text((x, above), &caption.text, caption_style);
        above -= CAPTION_PT;
    }
    if let Some(top) = &panel.top {
        above -= TICK_GAP_PT + SMALL_PT;
        svg.text((middle_x, above), &top.label, label);
        above -= LABEL_GAP_PT + LINE_HEIGHT * LABEL_PT;
    }
    if let Some(bar) = panel.colour_bar.as_ref().filter(|bar| bar.side != Side::Right) {
        above -= lying_bar_pt(bar);
    }
    svg.text((middle_x, above), &panel.title, label);
}
