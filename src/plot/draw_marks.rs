//! The marks of a panel, put on the page.

use super::colour::Colour;
use super::layout::Placed;
use super::mark::{
    Band, Circle, ErrorBars, Extent, Histogram, Line, Mark, Raster, Region, Rule, RuleAt, Scatter, Text,
    TextAt,
};
use super::raster_picture::Picture;
use super::scale::Span;
use super::style::{HALF_DIGIT, HISTOGRAM_OPACITY, POINT_PT, SMALL_PT, error_bar};
use super::svg::{Anchor, Rect, Svg, TextStyle, number};

/// Opacity of the area of a band.
const BAND_OPACITY: f64 = 0.25;

/// Draws all marks of a panel, cut at its frame; an empty panel says so.
pub(super) fn draw(svg: &mut Svg, place: &Placed) {
    svg.begin_clip(place.frame);
    for mark in &place.panel.marks {
        match mark {
            Mark::Line(line) => draw_line(svg, place, line),
            Mark::Band(band) => draw_band(svg, place, band),
            Mark::Scatter(scatter) => draw_scatter(svg, place, scatter),
            Mark::ErrorBars(bars) => draw_error_bars(svg, place, bars),
            Mark::Histogram(steps) => draw_histogram(svg, place, steps),
            Mark::Raster(raster) => draw_raster(svg, place, raster),
            Mark::Region(region) => draw_region(svg, place, region),
            Mark::Circle(circle) => draw_circle(svg, place, circle),
            Mark::Rule(rule) => draw_rule(svg, place, rule),
            Mark::Text(text) => draw_text(svg, place, text),
        }
    }
    if place.panel.is_empty() {
        let (at, anchor, halo) = (TextAt::Fraction(0.5, 0.5), Anchor::Middle, Some(Colour::WHITE));
        draw_text(svg, place, &Text { at, text: "no data".into(), anchor, colour: Colour::GREY, halo });
    }
    svg.end_clip();
}

/// Places of the pairs that have one on both axes; `None` where a curve breaks.
fn places<'a>(
    place: &'a Placed,
    x: &'a [f64],
    y: &'a [f64],
) -> impl Iterator<Item = Option<(f64, f64)>> + 'a {
    x.iter().zip(y).map(|(&x, &y)| place.x.at(x).zip(place.y.at(y)))
}

fn point((x, y): (f64, f64)) -> String {
    format!("{} {}", number(x), number(y))
}

/// A polyline that starts anew after each break.
fn polyline(points: impl IntoIterator<Item = Option<(f64, f64)>>) -> String {
    let mut path = String::new();
    let mut broken = true;
    for place in points {
        if let Some(place) = place {
            path.push(if broken { 'M' } else { 'L' });
            path.push_str(&point(place));
        }
        broken = place.is_none();
    }
    path
}

fn draw_line(svg: &mut Svg, place: &Placed, line: &Line) {
    svg.stroked_path(&polyline(places(place, &line.x, &line.y)), line.stroke);
}

fn draw_band(svg: &mut Svg, place: &Placed, band: &Band) {
    let edges = places(place, &band.x, &band.low).zip(places(place, &band.x, &band.high));
    let whole: Vec<((f64, f64), (f64, f64))> = edges.filter_map(|(low, high)| low.zip(high)).collect();
    let around =
        whole.iter().map(|(low, _)| Some(*low)).chain(whole.iter().rev().map(|(_, high)| Some(*high)));
    svg.filled_path(&polyline(around), band.colour, BAND_OPACITY);
}

fn draw_region(svg: &mut Svg, place: &Placed, region: &Region) {
    let mut path = String::new();
    for ring in &region.rings {
        let points: Vec<(f64, f64)> =
            ring.iter().filter_map(|&(x, y)| place.x.at(x).zip(place.y.at(y))).collect();
        if points.len() > 2 {
            path.push_str(&polyline(points.into_iter().map(Some)));
            path.push('Z');
        }
    }
    svg.filled_path(&path, region.stroke.colour, region.opacity);
    svg.stroked_path(&path, region.stroke);
}

/// All discs as one path of round dots: 15 bytes a point, and sharp at any magnification.
fn draw_scatter(svg: &mut Svg, place: &Placed, scatter: &Scatter) {
    let mut dots = String::new();
    for at in places(place, &scatter.x, &scatter.y).flatten().filter(|at| place.frame.reaches(*at)) {
        dots.push_str(&format!("M{}h0", point(at)));
    }
    svg.dots(&dots, 2.0 * scatter.radius_pt, scatter.colour, scatter.opacity);
}

fn draw_error_bars(svg: &mut Svg, place: &Placed, bars: &ErrorBars) {
    let ends = bars.low.iter().zip(&bars.high);
    let mut path = String::new();
    for (at, (&low, &high)) in places(place, &bars.x, &bars.y).zip(ends) {
        let Some((x, y)) = at else { continue };
        let (low, high) = (place.y.at(low).unwrap_or(place.frame.bottom()), place.y.at(high).unwrap_or(y));
        path.push_str(&format!("M{}V{}", point((x, low)), number(high)));
    }
    svg.stroked_path(&path, error_bar(bars.colour));
    places(place, &bars.x, &bars.y).flatten().for_each(|at| svg.disc(at, POINT_PT, bars.colour, 1.0));
}

fn draw_histogram(svg: &mut Svg, place: &Placed, steps: &Histogram) {
    let floor = place.y.at(0.0).unwrap_or(place.frame.bottom());
    let bins = steps.edges.windows(2).zip(&steps.counts);
    let mut outline: Vec<(f64, f64)> = Vec::new();
    for (edges, &count) in bins {
        let (Some(left), Some(right)) = (place.x.at(edges[0]), place.x.at(edges[1])) else { continue };
        let y = place.y.at(count).unwrap_or(floor);
        if outline.is_empty() {
            outline.push((left, floor));
        }
        outline.extend([(left, y), (right, y)]);
    }
    outline.extend(outline.last().map(|&(x, _)| (x, floor)));
    let path = polyline(outline.into_iter().map(Some));
    svg.filled_path(&path, steps.stroke.colour, HISTOGRAM_OPACITY);
    svg.stroked_path(&path, steps.stroke);
}

fn draw_raster(svg: &mut Svg, place: &Placed, raster: &Raster) {
    let Extent { left, right, bottom, top } = raster.extent;
    let Some(((x0, x1), (y0, y1))) =
        (place.x.at(left).zip(place.x.at(right))).zip(place.y.at(bottom).zip(place.y.at(top)))
    else {
        return;
    };
    let picture = Picture::of_grid(&raster.values, raster.nx, raster.ny, raster.colours);
    if let (Some(uri), true) = (picture.data_uri(), x1 > x0 && y0 > y1) {
        svg.image(Rect { x: x0, y: y1, width: x1 - x0, height: y0 - y1 }, &uri);
    }
}

fn draw_circle(svg: &mut Svg, place: &Placed, circle: &Circle) {
    let half = |span: &Span, centre: f64| {
        let (low, high) = (span.at(centre - circle.radius)?, span.at(centre + circle.radius)?);
        Some((0.5 * (low + high), 0.5 * (high - low).abs()))
    };
    if let Some(((x, rx), (y, ry))) = half(&place.x, circle.x).zip(half(&place.y, circle.y)) {
        svg.stroked_ellipse((x, y), (rx, ry), circle.stroke);
    }
}

fn draw_rule(svg: &mut Svg, place: &Placed, rule: &Rule) {
    let frame = place.frame;
    let path = match rule.at {
        RuleAt::X(x) => place.x.at(x).map(|x| format!("M{}V{}", point((x, frame.bottom())), number(frame.y))),
        RuleAt::Y(y) => place.y.at(y).map(|y| format!("M{}H{}", point((frame.x, y)), number(frame.right()))),
    };
    svg.stroked_path(&path.unwrap_or_default(), rule.stroke);
}

fn draw_text(svg: &mut Svg, place: &Placed, text: &Text) {
    let frame = place.frame;
    let across = |fraction: f64| frame.x + fraction * frame.width;
    let up = |fraction: f64| frame.bottom() - fraction * frame.height;
    let at = match text.at {
        TextAt::Data(x, y) => place.x.at(x).zip(place.y.at(y)),
        TextAt::DataFraction(x, fraction) => place.x.at(x).map(|x| (x, up(fraction))),
        TextAt::Fraction(x, y) => Some((across(x), up(y))),
    };
    if let Some((x, y)) = at {
        let Text { anchor, colour, halo, .. } = *text;
        let style = TextStyle { size_pt: SMALL_PT, anchor, colour, upwards: false, halo };
        svg.text((x, y + HALF_DIGIT * SMALL_PT), &text.text, style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_breaks_where_a_value_has_no_place() {
        let points = [Some((0.0, 1.0)), Some((1.0, 1.0)), None, None, Some((3.0, 1.0)), Some((4.0, 2.0))];
        assert_eq!(polyline(points), "M0 1L1 1M3 1L4 2");
        assert_eq!(polyline([None]), "");
    }
}
