//! The SVG writer: shapes and text in points on a page measured in millimetres.

use std::fmt::Write;

use super::colour::{Colour, Stroke};
use super::figure_style::Style;
use super::font::FAMILY;
use super::markup::{escape, tspans};

/// Points in a millimetre.
pub const PT_PER_MM: f64 = 72.0 / 25.4;

/// A rectangle on the page in points, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }

    /// True if a mark of a few points' size at that place may show inside.
    pub fn reaches(&self, (x, y): (f64, f64)) -> bool {
        const MARK_PT: f64 = 10.0;
        (self.x - MARK_PT..self.right() + MARK_PT).contains(&x)
            && (self.y - MARK_PT..self.bottom() + MARK_PT).contains(&y)
    }
}

/// Which point of a text its coordinates name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text is written.
#[derive(Debug, Clone, Copy)]
pub struct TextStyle {
    pub size_pt: f64,
    pub anchor: Anchor,
    pub colour: Colour,
    /// Turned by 90° to read upwards.
    pub upwards: bool,
    /// Colour of a thin outline that keeps the text legible on a raster.
    pub halo: Option<Colour>,
}

/// An SVG document being written.
pub struct Svg {
    text: String,
    ids: usize,
    style: Style,
    /// Whether colours are those of a picture, which no style changes.
    on_picture: bool,
}

impl Svg {
    /// An empty page of that size before the style magnifies it.
    pub fn new(width_pt: f64, height_pt: f64, title: &str, style: Style) -> Self {
        let (width, height) = (number(width_pt), number(height_pt));
        let mm = |length_pt: f64| number(style.magnification * length_pt / PT_PER_MM);
        let (width_mm, height_mm) = (mm(width_pt), mm(height_pt));
        let page = style.colour(Colour::WHITE);
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_mm}mm\" height=\"{height_mm}mm\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILY}\" xml:space=\"preserve\">\n\
             <title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"{page}\"/>\n",
            escape(title)
        );
        Self { text, ids: 0, style, on_picture: false }
    }

    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    /// Writing into a `String` cannot fail, so the result carries nothing.
    fn put(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = self.text.write_fmt(element);
        self.text.push('\n');
    }

    /// What follows lies on a picture, or on the page.
    pub fn lie_on_picture(&mut self, on_picture: bool) {
        self.on_picture = on_picture;
    }

    fn colour(&self, colour: Colour) -> Colour {
        if self.on_picture { colour } else { self.style.colour(colour) }
    }

    fn filling(&self, colour: Colour, opacity: f64) -> String {
        format!("fill=\"{}\" fill-opacity=\"{}\"", self.colour(colour), number(opacity))
    }

    fn stroking(&self, Stroke { colour, width_pt, is_dashed }: Stroke) -> String {
        let (colour, width_pt) = (self.colour(colour), self.style.line_width * width_pt);
        let [width, dash, gap] = [width_pt, 1.5 + 3.0 * width_pt, 1.0 + 1.5 * width_pt].map(number);
        let dashes = if is_dashed { format!(" stroke-dasharray=\"{dash} {gap}\"") } else { String::new() };
        format!(" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}")
    }

    /// Everything until [`Svg::end_clip`] shows only inside the rectangle.
    pub fn begin_clip(&mut self, to: Rect) {
        self.ids += 1;
        let id = self.ids;
        self.put(format_args!(
            "<clipPath id=\"id{id}\"><rect {}/></clipPath><g clip-path=\"url(#id{id})\">",
            place(to)
        ));
    }

    pub fn end_clip(&mut self) {
        self.put(format_args!("</g>"));
    }

    pub fn stroked_path(&mut self, d: &str, stroke: Stroke) {
        if !d.is_empty() {
            let stroke = self.stroking(stroke);
            self.put(format_args!("<path d=\"{d}\" fill=\"none\"{stroke}/>"));
        }
    }

    pub fn filled_path(&mut self, d: &str, colour: Colour, opacity: f64) {
        if !d.is_empty() {
            let fill = self.filling(colour, opacity);
            self.put(format_args!("<path d=\"{d}\" {fill}/>"));
        }
    }

    pub fn filled_rect(&mut self, rect: Rect, colour: Colour, opacity: f64) {
        let fill = self.filling(colour, opacity);
        self.put(format_args!("<rect {} {fill}/>", place(rect)));
    }

    pub fn stroked_rect(&mut self, rect: Rect, stroke: Stroke) {
        let stroke = self.stroking(stroke);
        self.put(format_args!("<rect {} fill=\"none\"{stroke}/>", place(rect)));
    }

    pub fn stroked_ellipse(&mut self, (x, y): (f64, f64), (rx, ry): (f64, f64), stroke: Stroke) {
        let [x, y, rx, ry] = [x, y, rx, ry].map(number);
        let stroke = self.stroking(stroke);
        self.put(format_args!(
            "<ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{rx}\" ry=\"{ry}\" fill=\"none\"{stroke}/>"
        ));
    }

    pub fn disc(&mut self, (x, y): (f64, f64), radius_pt: f64, colour: Colour) {
        let ([x, y, r], fill) = ([x, y, radius_pt].map(number), self.filling(colour, 1.0));
        self.put(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" {fill}/>"));
    }

    /// A path of round dots, one for each subpath `Mx yh0`; overlaps do not darken.
    pub fn dots(&mut self, d: &str, diameter_pt: f64, colour: Colour, opacity: f64) {
        if !d.is_empty() {
            let ([diameter, opacity], colour) = ([diameter_pt, opacity].map(number), self.colour(colour));
            self.put(format_args!(
                "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{diameter}\" \
                 stroke-linecap=\"round\" stroke-opacity=\"{opacity}\"/>"
            ));
        }
    }

    /// A picture given as data URI, stretched over the rectangle, each pixel with sharp edges.
    pub fn image(&mut self, at: Rect, uri: &str) {
        self.put(format_args!(
            "<image {} preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" href=\"{uri}\"/>",
            place(at)
        ));
    }

    /// A rectangle filled with colours from left to right.
    pub fn gradient_rect(&mut self, rect: Rect, colours: &[Colour]) {
        self.ids += 1;
        let id = self.ids;
        let last = colours.len().saturating_sub(1).max(1) as f64;
        let stop = |(i, colour)| format!("<stop offset=\"{:.4}\" stop-color=\"{colour}\"/>", i as f64 / last);
        let stops: String = colours.iter().enumerate().map(stop).collect();
        self.put(format_args!("<linearGradient id=\"id{id}\" x2=\"1\" y2=\"0\">{stops}</linearGradient>"));
        self.put(format_args!("<rect {} fill=\"url(#id{id})\"/>", place(rect)));
    }

    /// A label in markup, its baseline at `y`.
    pub fn text(&mut self, (x, y): (f64, f64), label: &str, style: TextStyle) {
        if label.is_empty() {
            return;
        }
        let [x, y, size, halo_width] = [x, y, style.size_pt, 0.22 * style.size_pt].map(number);
        let anchor = match style.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let turn = if style.upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
        let halo = style.halo.map_or(String::new(), |colour| {
            let colour = self.colour(colour);
            format!(
                " stroke=\"{colour}\" stroke-width=\"{halo_width}\" stroke-linejoin=\"round\" \
                 paint-order=\"stroke\""
            )
        });
        let (colour, spans) = (self.colour(style.colour), tspans(label, style.size_pt));
        self.put(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\"\
             {halo}{turn}>{spans}</text>"
        ));
    }
}

/// A number with at most two decimals (0.01 pt is 4 µm); what is not finite becomes 0.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "0".into();
    }
    let text = format!("{value:.2}");
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".into(),
        trimmed => trimmed.into(),
    }
}

/// A point as paths write it.
pub fn point((x, y): (f64, f64)) -> String {
    format!("{} {}", number(x), number(y))
}

fn place(rect: Rect) -> String {
    let [x, y, width, height] = [rect.x, rect.y, rect.width, rect.height].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_nan() {
        assert_eq!(number(1.0), "1");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(12.345678), "12.35");
        assert_eq!(number(f64::NAN), "0");
    }
}
