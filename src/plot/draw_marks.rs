//! The marks of a panel, put on the page.

use super::colour::Colour;
use super::layout::Placed;
use super::mark::{At, Extent, Point, Rule, Shape};
use super::raster_picture::data_uri;
use super::scale::Span;
use super::style::{self, HALF_DIGIT, HISTOGRAM_OPACITY, POINT_PT, SMALL_PT, error_bar};
use super::svg::{Anchor, Rect, Svg, TextStyle, number, point};

/// Opacity of the area of a band.
const BAND_OPACITY: f64 = 0.25;

/// Draws all marks of a panel, cut at its frame; an empty panel says so.
pub fn draw(svg: &mut Svg, place: &Placed) {
    svg.begin_clip(place.frame);
    svg.lie_on_picture(place.panel.is_picture());
    place.panel.marks.iter().for_each(|mark| draw_shape(svg, place, &mark.shape));
    svg.lie_on_picture(false);
    if place.panel.is_empty() {
        let (at, anchor, halo) = (At::Fraction(0.5, 0.5), Anchor::Middle, Some(Colour::WHITE));
        let text = Shape::Text { at, text: "no data".into(), anchor, colour: Colour::GREY, halo };
        draw_shape(svg, place, &text);
    }
    svg.end_clip();
}

fn draw_shape(svg: &mut Svg, place: &Placed, shape: &Shape) {
    let frame = place.frame;
    // `None` where a value has no place on its axis.
    let at = |&[x, y]: &Point| place.x.at(x).zip(place.y.at(y));
    match shape {
        Shape::Line { points, stroke } => svg.stroked_path(&polyline(points.iter().map(at)), *stroke),
        Shape::Band { edges, colour } => {
            let whole = edges.iter().filter_map(|&[x, low, high]| at(&[x, low]).zip(at(&[x, high])));
            let (low, high): (Vec<_>, Vec<_>) = whole.unzip();
            let around = low.into_iter().chain(high.into_iter().rev()).map(Some);
            svg.filled_path(&polyline(around), *colour, BAND_OPACITY);
        }
        // All discs as one path of round dots: 15 bytes a point, and sharp at any magnification.
        Shape::Dots { points, colour, radius_pt, opacity } => {
            let places = points.iter().filter_map(at).filter(|at| frame.reaches(*at));
            let dots: String = places.map(|at| format!("M{}h0", point(at))).collect();
            svg.dots(&dots, 2.0 * radius_pt, *colour, *opacity);
        }
        Shape::ErrorBars { points, colour } => {
            let placed: Vec<_> =
                points.iter().filter_map(|bar| Some((at(&[bar[0], bar[1]])?, bar))).collect();
            let bar = |&((x, y), &[_, _, low, high]): &((f64, f64), &[f64; 4])| {
                let low = place.y.at(low).unwrap_or(frame.bottom());
                format!("M{}V{}", point((x, low)), number(place.y.at(high).unwrap_or(y)))
            };
            svg.stroked_path(&placed.iter().map(bar).collect::<String>(), error_bar(*colour));
            placed.iter().for_each(|(at, _)| svg.disc(*at, POINT_PT, *colour));
        }
        Shape::Histogram { edges, counts, stroke } => {
            let floor = place.y.at(0.0).unwrap_or(frame.bottom());
            let mut outline: Vec<(f64, f64)> = Vec::new();
            for (edges, &count) in edges.windows(2).zip(counts) {
                let (Some(left), Some(right)) = (place.x.at(edges[0]), place.x.at(edges[1])) else {
                    continue;
                };
                let y = place.y.at(count).unwrap_or(floor);
                if outline.is_empty() {
                    outline.push((left, floor));
                }
                outline.extend([(left, y), (right, y)]);
            }
            outline.extend(outline.last().map(|&(x, _)| (x, floor)));
            let path = polyline(outline.into_iter().map(Some));
            svg.filled_path(&path, stroke.colour, HISTOGRAM_OPACITY);
            svg.stroked_path(&path, *stroke);
        }
        Shape::Raster { values, nx, ny, extent: Extent { left, right, bottom, top }, colours } => {
            let corners = at(&[*left, *bottom]).zip(at(&[*right, *top]));
            let Some(((x0, y0), (x1, y1))) = corners.filter(|((x0, y0), (x1, y1))| x1 > x0 && y0 > y1) else {
                return;
            };
            if let Some(uri) = data_uri(values, *nx, *ny, *colours) {
                svg.image(Rect { x: x0, y: y1, width: x1 - x0, height: y0 - y1 }, &uri);
            }
        }
        Shape::Region { rings, stroke, opacity } => {
            let mut path = String::new();
            for ring in rings {
                let places: Vec<(f64, f64)> = ring.iter().filter_map(at).collect();
                if places.len() > 2 {
                    path.push_str(&polyline(places.into_iter().map(Some)));
                    path.push('Z');
                }
            }
            svg.filled_path(&path, stroke.colour, *opacity);
            svg.stroked_path(&path, *stroke);
        }
        Shape::Circle { centre: [x, y], radius, stroke } => {
            let half = |span: &Span, centre: f64| {
                let (low, high) = (span.at(centre - radius)?, span.at(centre + radius)?);
                Some((0.5 * (low + high), 0.5 * (high - low).abs()))
            };
            if let Some(((x, rx), (y, ry))) = half(&place.x, *x).zip(half(&place.y, *y)) {
                svg.stroked_ellipse((x, y), (rx, ry), *stroke);
            }
        }
        Shape::Rule { at, stroke } => {
            let path = match *at {
                Rule::X(x) => place.x.at(x).map(|x| (point((x, frame.bottom())), 'V', frame.y)),
                Rule::Y(y) => place.y.at(y).map(|y| (point((frame.x, y)), 'H', frame.right())),
            };
            let path = path.map(|(from, to, end)| format!("M{from}{to}{}", number(end)));
            svg.stroked_path(&path.unwrap_or_default(), *stroke);
        }
        Shape::Text { at, text, anchor, colour, halo } => {
            let up = |fraction: f64| frame.bottom() - fraction * frame.height;
            let at = match *at {
                At::DataFraction(x, fraction) => place.x.at(x).map(|x| (x, up(fraction))),
                At::Fraction(x, y) => Some((frame.x + x * frame.width, up(y))),
            };
            if let Some((x, y)) = at {
                let style = TextStyle { colour: *colour, halo: *halo, ..style::text(SMALL_PT, *anchor) };
                svg.text((x, y + HALF_DIGIT * SMALL_PT), text, style);
            }
        }
    }
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
