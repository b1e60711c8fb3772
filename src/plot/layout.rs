//! Where the panels of a figure lie: margins follow from the labels, panels of a figure are equally large.

use super::figure::Figure;
use super::markup::width_pt;
use super::panel::{ColourBar, Panel};
use super::scale::{Direction, Span};
use super::style::{BAR_GAP_PT, BAR_PT, CAPTION_PT, LABEL_PT, SMALL_PT, TICK_GAP_PT, line_pt};
use super::svg::{PT_PER_MM, Rect};
use super::ticks::Ticks;

/// Height of a line of numbers beside a frame or a colour bar.
const NUMBERS_PT: f64 = TICK_GAP_PT + SMALL_PT;
/// Between panels, and around the figure.
const GAP_PT: f64 = 5.0;

/// A panel on the page.
pub struct Placed<'a> {
    pub panel: &'a Panel,
    pub frame: Rect,
    pub x: Span,
    pub y: Span,
    pub x_ticks: Ticks,
    pub y_ticks: Ticks,
    /// Distance from the frame to the outer edge of its column's labels.
    pub left_pt: f64,
    /// Right end of the colour bar where it spans several panels.
    pub bar_right_pt: f64,
}

/// All panels on the page.
pub struct Layout<'a> {
    pub width_pt: f64,
    pub height_pt: f64,
    pub placed: Vec<Placed<'a>>,
}

/// Room a panel needs around its frame.
#[derive(Debug, Clone, Copy, Default)]
struct Margins {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

/// Lays out a figure on a page that is magnified afterwards: two rounds, because labels depend on the room and the room on
/// the labels, and more where these two have not agreed and the panels are too wide.
pub fn lay_out(figure: &Figure, magnification: f64) -> Layout<'_> {
    let (columns, width_pt) = (figure.columns as f64, figure.width_mm * PT_PER_MM / magnification);
    let mut frame_width = 0.75 * width_pt / columns;
    let mut layout = arrange(figure, frame_width);
    for round in 0..20 {
        let excess = layout.width_pt - width_pt;
        if round >= 2 && excess < 0.01 {
            break;
        }
        frame_width = (frame_width - excess / columns).max(10.0);
        layout = arrange(figure, frame_width);
    }
    layout.width_pt = width_pt;
    layout
}

fn arrange(figure: &Figure, frame_width: f64) -> Layout<'_> {
    let columns = figure.columns;
    let frame_height = (frame_width * figure.panel_aspect).max(10.0);
    let mut placed: Vec<Placed> =
        figure.panels.iter().map(|panel| ticked(panel, frame_width, frame_height)).collect();
    let needs: Vec<Margins> = placed.iter().map(Margins::of).collect();
    let rows = placed.len().div_ceil(columns);

    let largest = |in_group: &dyn Fn(usize) -> bool, side: &dyn Fn(&Margins) -> f64| {
        needs.iter().enumerate().filter(|(i, _)| in_group(*i)).map(|(_, m)| side(m)).fold(0.0, f64::max)
    };
    let mut x = 0.5 * GAP_PT;
    let mut lefts = Vec::new();
    for column in 0..columns {
        let mine = |i: usize| i % columns == column;
        let left = largest(&mine, &|m| m.left);
        lefts.push((x + left, left));
        x += left + frame_width + largest(&mine, &|m| m.right) + GAP_PT;
    }
    let mut y = 0.5 * GAP_PT;
    for row in 0..rows {
        let mine = |i: usize| i / columns == row;
        y += largest(&mine, &|m| m.top);
        for (i, place) in placed.iter_mut().enumerate().filter(|(i, _)| mine(*i)) {
            let (frame_x, left) = lefts[i % columns];
            place.move_to(frame_x, y, left);
            let over = place.panel.colour_bar.as_ref().map_or(1, |bar| bar.panels.max(1));
            place.bar_right_pt = lefts[(i % columns + over).min(columns) - 1].0 + frame_width;
        }
        y += frame_height + largest(&mine, &|m| m.bottom) + GAP_PT;
    }
    Layout { width_pt: x - 0.5 * GAP_PT, height_pt: (y - 0.5 * GAP_PT).max(GAP_PT), placed }
}

/// A panel of that size at the page's corner, with its ticks chosen.
fn ticked(panel: &Panel, width: f64, height: f64) -> Placed<'_> {
    let [(x_low, x_high), (y_low, y_high)] = panel.limits();
    let x = Span { scale: panel.x.scale, low: x_low, high: x_high, start_pt: 0.0, end_pt: width };
    let y = Span { scale: panel.y.scale, low: y_low, high: y_high, start_pt: height, end_pt: 0.0 };
    // Inner panels of a grid stand close to their neighbours.
    let inside = !panel.y.tick_labels;
    let x_ticks = Ticks::for_span(&x, Direction::Horizontal, panel.x.most_intervals, inside);
    Placed {
        panel,
        frame: Rect { x: 0.0, y: 0.0, width, height },
        x_ticks,
        y_ticks: Ticks::for_span(&y, Direction::Vertical, panel.y.most_intervals, false),
        x,
        y,
        left_pt: 0.0,
        bar_right_pt: width,
    }
}

impl Placed<'_> {
    fn move_to(&mut self, x: f64, y: f64, left: f64) {
        let Rect { width, height, .. } = self.frame;
        self.frame = Rect { x, y, width, height };
        (self.x.start_pt, self.x.end_pt) = (x, x + width);
        (self.y.start_pt, self.y.end_pt) = (y + height, y);
        self.left_pt = left;
    }
}

impl ColourBar {
    /// From the frame to the upper end of its label.
    pub fn height_pt(&self) -> f64 {
        BAR_GAP_PT + BAR_PT + NUMBERS_PT + line_pt(&self.label, LABEL_PT)
    }
}

impl Margins {
    fn of(place: &Placed) -> Self {
        let Placed { panel, frame, x, .. } = place;
        if panel.is_blank {
            return Self::default();
        }
        let mut margins = Self {
            left: line_pt(&panel.y.label, LABEL_PT),
            bottom: line_pt(&panel.x.label, LABEL_PT),
            top: CAPTION_PT * panel.captions.len() as f64,
            right: 0.0,
        };
        if panel.y.tick_labels {
            let widths = place.y_ticks.major.iter().map(|(_, label)| width_pt(label, SMALL_PT));
            margins.left += TICK_GAP_PT + widths.fold(0.0, f64::max);
            margins.top = margins.top.max(0.4 * SMALL_PT);
        }
        if panel.x.tick_labels {
            margins.bottom += NUMBERS_PT;
            for (value, label) in &place.x_ticks.major {
                let (middle, half) = (x.at(*value).unwrap_or(0.0), 0.5 * width_pt(label, SMALL_PT));
                margins.left = margins.left.max(half - middle);
                margins.right = margins.right.max(middle + half - frame.width);
            }
        }
        if let Some(top) = &panel.top {
            for (value, label) in top.ticks.major.iter().filter(|(value, _)| x.contains(*value)) {
                let end = x.at(*value).unwrap_or(0.0) + 0.5 * width_pt(label, SMALL_PT);
                margins.right = margins.right.max(end - frame.width);
            }
            margins.top += NUMBERS_PT + line_pt(&top.label, LABEL_PT);
        }
        margins.top += panel.colour_bar.as_ref().map_or(0.0, ColourBar::height_pt);
        margins
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Axis;

    fn figure(columns: usize, panels: usize) -> Figure {
        let panel = Panel::new(Axis::linear("x").between(0.0, 1.0), Axis::log("y"), []);
        Figure::full_width("test", 0.75, columns, vec![panel; panels])
    }

    #[test]
    fn panels_fill_the_width_and_do_not_overlap() {
        for (columns, panels) in [(1, 1), (2, 3), (3, 6)] {
            let figure = figure(columns, panels);
            let layout = lay_out(&figure, 1.0);
            let right = layout.placed.iter().map(|p| p.frame.right()).fold(0.0, f64::max);
            assert!(right < layout.width_pt && right > layout.width_pt - 15.0, "{columns}: {right}");
            for (i, a) in layout.placed.iter().enumerate() {
                assert!(a.frame.x >= a.left_pt && a.frame.bottom() < layout.height_pt);
                for b in &layout.placed[i + 1..] {
                    let apart = a.frame.right() < b.frame.x || a.frame.bottom() < b.frame.y;
                    assert!(apart, "{columns} columns");
                }
            }
        }
    }

    #[test]
    fn panels_stay_on_the_page_whatever_their_labels() {
        for (k, ratio) in (1..120).flat_map(|k| [0.78, 0.82, 0.86, 0.9, 0.94].map(|ratio| (k, ratio))) {
            let half = 0.01 * 1.021f64.powi(k);
            let panel = |half: f64| {
                let axis = |label| Axis::linear(label).between(-half, half);
                Panel::new(axis("x"), axis("y"), [])
            };
            let panels = [panel(half), panel(ratio * half)].map(|row| vec![row; 3]).concat();
            let figure = Figure::full_width("test", 1.0, 3, panels);
            let layout = lay_out(&figure, 1.0);
            for placed in &layout.placed {
                let right = placed.frame.right();
                assert!(right < layout.width_pt + 0.01, "±{half}: {right} of {}", layout.width_pt);
                let labelled = placed.x_ticks.major.iter().filter(|(_, label)| !label.is_empty());
                assert!(labelled.count() >= 2, "±{half}: {:?}", placed.x_ticks);
            }
        }
    }

    #[test]
    fn a_figure_without_panels_has_a_page() {
        let figure = figure(2, 0);
        assert!(lay_out(&figure, 1.0).height_pt > 0.0);
    }
}
