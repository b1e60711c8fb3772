//! In which corner of its panel a legend hides least of what is drawn.

use super::layout::Placed;
use super::mark::{At, Point, Rule, Shape};
use super::panel::Corner;
use super::svg::Rect;

/// From the frame: clear of the ticks.
const INSET_PT: f64 = 6.0;
/// Curves are looked at every so many points of the page.
const STEP_PT: f64 = 2.0;

/// Where a legend of that size lies: in the corner that the panel wants, or in the one where it hides least.
pub fn legend_box(place: &Placed, width: f64, height: f64) -> Rect {
    let frame = place.frame;
    let boxed = |corner: Corner| {
        let is_left = matches!(corner, Corner::TopLeft | Corner::BottomLeft);
        let is_high = matches!(corner, Corner::TopLeft | Corner::TopRight);
        let x = if is_left { frame.x + INSET_PT } else { frame.right() - INSET_PT - width };
        let y = if is_high { frame.y + INSET_PT } else { frame.bottom() - INSET_PT - height };
        Rect { x, y, width, height }
    };
    let drawn = drawn(place);
    let wanted = place.panel.legend;
    let corners = [wanted, Corner::TopRight, Corner::TopLeft, Corner::BottomRight, Corner::BottomLeft];
    let hidden = |rect: &Rect| drawn.iter().filter(|(x, y)| holds(rect, *x, *y)).count();
    let boxes = corners.map(boxed).into_iter().map(|rect| (hidden(&rect), rect));
    // Of equals the first.
    let least = boxes.reduce(|least, other| if other.0 < least.0 { other } else { least });
    least.map_or(boxed(wanted), |(_, rect)| rect)
}

fn holds(rect: &Rect, x: f64, y: f64) -> bool {
    (rect.x..=rect.right()).contains(&x) && (rect.y..=rect.bottom()).contains(&y)
}

/// Places on the page that marks cover, curves closely sampled; pictures lie below a legend anyway.
fn drawn(place: &Placed) -> Vec<(f64, f64)> {
    let at = |&[x, y]: &Point| place.x.at(x).zip(place.y.at(y));
    let frame = place.frame;
    let mut found = Vec::new();
    let mut along = |points: &mut dyn Iterator<Item = Option<(f64, f64)>>| {
        let mut last: Option<(f64, f64)> = None;
        for point in points {
            if let (Some((x0, y0)), Some((x1, y1))) = (last, point) {
                let steps = ((x1 - x0).hypot(y1 - y0) / STEP_PT).ceil().min(1e4) as usize;
                let fraction = |i: usize| i as f64 / steps.max(1) as f64;
                let between = |t: f64| (x0 + t * (x1 - x0), y0 + t * (y1 - y0));
                found.extend((0..=steps).map(|i| between(fraction(i))));
            }
            last = point;
        }
    };
    for mark in &place.panel.marks {
        match &mark.shape {
            Shape::Line { points, .. } => along(&mut points.iter().map(at)),
            Shape::Band { edges, .. } => {
                along(&mut edges.iter().map(|&[x, low, _]| at(&[x, low])));
                along(&mut edges.iter().map(|&[x, _, high]| at(&[x, high])));
            }
            Shape::Histogram { edges, counts, .. } => {
                let tops = edges.windows(2).zip(counts);
                let tops = tops.flat_map(|(edges, &y)| [at(&[edges[0], y]), at(&[edges[1], y])]);
                along(&mut tops.map(|top| top.map(|(x, y)| (x, y.min(frame.bottom())))));
            }
            Shape::Region { rings, .. } => rings.iter().for_each(|ring| along(&mut ring.iter().map(at))),
            Shape::Rule { at: Rule::X(x), .. } => {
                let x = place.x.at(*x);
                along(&mut [frame.y, frame.bottom()].into_iter().map(|y| x.map(|x| (x, y))));
            }
            Shape::Rule { at: Rule::Y(y), .. } => {
                let y = place.y.at(*y);
                along(&mut [frame.x, frame.right()].into_iter().map(|x| y.map(|y| (x, y))));
            }
            // A point counts as two: nobody would know of it.
            Shape::Dots { points, .. } => {
                along(&mut points.iter().flat_map(|point| [at(point), at(point), None]));
            }
            Shape::ErrorBars { points, .. } => {
                let bars = points.iter().flat_map(|&[x, _, low, high]| [at(&[x, low]), at(&[x, high]), None]);
                along(&mut bars.into_iter());
            }
            Shape::Text { at: text_at, .. } => {
                let up = |fraction: f64| frame.bottom() - fraction * frame.height;
                let (x, y) = match *text_at {
                    At::DataFraction(x, fraction) => (place.x.at(x), up(fraction)),
                    At::Fraction(x, fraction) => (Some(frame.x + x * frame.width), up(fraction)),
                };
                let x = x.map(|x| (x, y));
                along(&mut [x, x].into_iter());
            }
            Shape::Raster { .. } | Shape::Circle { .. } => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::colour::{Colour, Stroke};
    use super::super::figure::Figure;
    use super::super::layout::lay_out;
    use super::super::mark::Mark;
    use super::super::panel::{Axis, Panel};
    use super::*;

    fn corner(marks: Vec<Mark>) -> (bool, bool) {
        let axis = || Axis::linear("a").between(0.0, 1.0);
        let panel = Panel { legend: Corner::TopLeft, ..Panel::new(axis(), axis(), marks) };
        let figure = Figure::one_column("a", 1.0, panel);
        let layout = lay_out(&figure, 1.0);
        let (place, boxed) = (&layout.placed[0], legend_box(&layout.placed[0], 30.0, 20.0));
        (boxed.x < place.frame.x + 10.0, boxed.y < place.frame.y + 10.0)
    }

    #[test]
    fn it_stands_where_it_is_wanted_unless_it_hid_something_there() {
        let line = |points: Vec<Point>| Mark::line(points, Stroke::solid(Colour::BLACK, 1.0));
        assert_eq!(corner(vec![]), (true, true));
        assert_eq!(corner(vec![line(vec![[0.0, 0.0], [1.0, 1.0]])]), (true, true));
        // Between its two ends a curve is there too.
        assert_eq!(corner(vec![line(vec![[0.0, 0.9], [0.1, 1.0]])]), (false, true));
        let dots =
            |points| Shape::Dots { points, colour: Colour::BLACK, radius_pt: 1.0, opacity: 1.0 }.into();
        let three = vec![[0.08, 0.92], [0.92, 0.92], [0.92, 0.08]];
        assert_eq!(corner(vec![dots(three)]), (true, false));
    }
}
