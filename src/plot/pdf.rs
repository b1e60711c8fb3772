//! From SVG to PDF: the shapes that this room's SVGs hold, letters as outlines, pictures with every pixel sharp.

use std::collections::BTreeMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};
use resvg::tiny_skia::{Path, PathSegment, Pixmap, Point, Transform};
use resvg::usvg::{
    self, FillRule, Group, Image, ImageKind, LineCap, LineJoin, LinearGradient, Node, Paint, PaintOrder,
};

use super::font;

const CATALOGUE: Ref = Ref::new(1);
const PAGES: Ref = Ref::new(2);
const PAGE: Ref = Ref::new(3);
const CONTENT: Ref = Ref::new(4);
const FIRST_FREE: i32 = 5;
/// Pixels that stand for a gradient.
const GRADIENT_PIXELS: usize = 256;

/// Writes an SVG of this room as a PDF of one page, as large as on paper; the same SVG gives the same bytes.
pub fn render(svg: &str) -> Result<Vec<u8>, String> {
    let options = usvg::Options { fontdb: font::database(), ..Default::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let pt = 72.0 / options.dpi;
    let (width, height) = (pt * tree.size().width(), pt * tree.size().height());
    let mut page = Page { content: Content::new(), opacities: BTreeMap::new(), pictures: Vec::new() };
    // PDF's y runs upwards.
    page.content.transform([pt, 0.0, 0.0, -pt, 0.0, height]);
    page.group(tree.root())?;
    page.finish(width, height)
}

/// Colours and opacities of pixels, without the PDF's objects about them.
struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
    alpha: Vec<u8>,
}

struct Page {
    content: Content,
    /// In thousandths, with the name of the graphics state that sets them.
    opacities: BTreeMap<i32, String>,
    pictures: Vec<Picture>,
}

impl Page {
    fn group(&mut self, group: &Group) -> Result<(), String> {
        self.content.save_state();
        if let Some(clip) = group.clip_path() {
            let transform = group.abs_transform().pre_concat(clip.transform());
            for node in clip.root().children() {
                if let Node::Path(path) = node {
                    self.outline(path.data(), transform.pre_concat(path.abs_transform()));
                }
            }
            self.content.clip_nonzero();
            self.content.end_path();
        }
        for node in group.children() {
            match node {
                Node::Group(inner) => self.group(inner)?,
                Node::Path(path) => self.path(path),
                Node::Image(image) => self.image(image)?,
                Node::Text(text) => self.group(text.flattened())?,
            }
        }
        self.content.restore_state();
        Ok(())
    }

    fn path(&mut self, path: &usvg::Path) {
        let transform = path.abs_transform();
        let order = match path.paint_order() {
            PaintOrder::FillAndStroke => [true, false],
            PaintOrder::StrokeAndFill => [false, true],
        };
        for is_fill in order {
            if is_fill {
                self.fill(path, transform);
            } else {
                self.stroke(path, transform);
            }
        }
    }

    fn fill(&mut self, path: &usvg::Path, transform: Transform) {
        let Some(fill) = path.fill() else { return };
        match fill.paint() {
            Paint::Color(colour) => {
                self.opacity(fill.opacity().get());
                let [r, g, b] = unit(*colour);
                self.content.set_fill_rgb(r, g, b);
                self.outline(path.data(), transform);
                match fill.rule() {
                    FillRule::NonZero => self.content.fill_nonzero(),
                    FillRule::EvenOdd => self.content.fill_even_odd(),
                };
            }
            Paint::LinearGradient(gradient) => {
                let bounds = path.abs_bounding_box();
                let matrix = [bounds.width(), 0.0, 0.0, bounds.height(), bounds.x(), bounds.y()];
                self.opacity(fill.opacity().get());
                self.picture(of_gradient(gradient), matrix);
            }
            _ => {}
        }
    }

    fn stroke(&mut self, path: &usvg::Path, transform: Transform) {
        let Some((stroke, Paint::Color(colour))) = path.stroke().map(|stroke| (stroke, stroke.paint()))
        else {
            return;
        };
        let scale = transform.get_scale().0;
        self.opacity(stroke.opacity().get());
        let [r, g, b] = unit(*colour);
        self.content.set_stroke_rgb(r, g, b).set_line_width(scale * stroke.width().get());
        self.content.set_line_cap(match stroke.linecap() {
            LineCap::Butt => LineCapStyle::ButtCap,
            LineCap::Round => LineCapStyle::RoundCap,
            LineCap::Square => LineCapStyle::ProjectingSquareCap,
        });
        self.content.set_line_join(match stroke.linejoin() {
            LineJoin::Round => LineJoinStyle::RoundJoin,
            LineJoin::Bevel => LineJoinStyle::BevelJoin,
            LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
        });
        let dashes = stroke.dasharray().unwrap_or_default().iter().map(|length| scale * length);
        self.content.set_dash_pattern(dashes, scale * stroke.dashoffset());
        self.outline(path.data(), transform);
        self.content.stroke();
    }

    /// Adds the segments of a path, which the next operator fills, strokes or clips to.
    fn outline(&mut self, path: &Path, transform: Transform) {
        let at = |mut point: Point| {
            transform.map_point(&mut point);
            point
        };
        let mut last = Point::zero();
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(to) => {
                    let to = at(to);
                    self.content.move_to(to.x, to.y);
                    last = to;
                }
                PathSegment::LineTo(to) => {
                    let to = at(to);
                    self.content.line_to(to.x, to.y);
                    last = to;
                }
                // PDF has cubic curves alone: a quadratic one's handles lie two thirds of the way to its own.
                PathSegment::QuadTo(handle, to) => {
                    let (handle, to) = (at(handle), at(to));
                    let towards =
                        |end: Point| [(end.x + 2.0 * handle.x) / 3.0, (end.y + 2.0 * handle.y) / 3.0];
                    let ([x1, y1], [x2, y2]) = (towards(last), towards(to));
                    self.content.cubic_to(x1, y1, x2, y2, to.x, to.y);
                    last = to;
                }
                PathSegment::CubicTo(one, two, to) => {
                    let (one, two, to) = (at(one), at(two), at(to));
                    self.content.cubic_to(one.x, one.y, two.x, two.y, to.x, to.y);
                    last = to;
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }

    fn image(&mut self, image: &Image) -> Result<(), String> {
        let ImageKind::PNG(data) = image.kind() else { return Ok(()) };
        let pixmap = Pixmap::decode_png(data).map_err(|error| error.to_string())?;
        let bounds = image.abs_bounding_box();
        let colours = pixmap.pixels().iter().map(|pixel| pixel.demultiply());
        let (rgb, alpha) =
            (colours.clone().flat_map(|c| [c.red(), c.green(), c.blue()]), colours.map(|c| c.alpha()));
        let picture = Picture {
            width: pixmap.width() as usize,
            height: pixmap.height() as usize,
            rgb: rgb.collect(),
            alpha: alpha.collect(),
        };
        // The picture's own y runs upwards from its lower edge, which lies lower on the page.
        let matrix = [bounds.width(), 0.0, 0.0, -bounds.height(), bounds.x(), bounds.bottom()];
        self.opacity(1.0);
        self.picture(picture, matrix);
        Ok(())
    }

    fn picture(&mut self, picture: Picture, matrix: [f32; 6]) {
        let name = picture_name(self.pictures.len());
        self.pictures.push(picture);
        self.content.save_state().transform(matrix);
        self.content.x_object(Name(name.as_bytes())).restore_state();
    }

    fn opacity(&mut self, opacity: f32) {
        let thousandths = (1000.0 * opacity).round() as i32;
        let name = self.opacities.entry(thousandths).or_insert_with(|| format!("G{thousandths}"));
        self.content.set_parameters(Name(name.as_bytes()));
    }

    fn finish(self, width_pt: f32, height_pt: f32) -> Result<Vec<u8>, String> {
        let mut pdf = Pdf::new();
        pdf.catalog(CATALOGUE).pages(PAGES);
        pdf.pages(PAGES).kids([PAGE]).count(1);
        let picture = |i: usize| Ref::new(FIRST_FREE + 2 * i as i32);
        let mut page = pdf.page(PAGE);
        page.parent(PAGES).media_box(Rect::new(0.0, 0.0, width_pt, height_pt)).contents(CONTENT);
        let mut resources = page.resources();
        let mut states = resources.ext_g_states();
        for (thousandths, name) in &self.opacities {
            let opacity = *thousandths as f32 / 1000.0;
            states
                .insert(Name(name.as_bytes()))
                .start::<pdf_writer::writers::ExtGraphicsState>()
                .non_stroking_alpha(opacity)
                .stroking_alpha(opacity);
        }
        states.finish();
        let mut objects = resources.x_objects();
        for i in 0..self.pictures.len() {
            objects.pair(Name(picture_name(i).as_bytes()), picture(i));
        }
        objects.finish();
        resources.finish();
        page.finish();
        pdf.stream(CONTENT, &packed(&self.content.finish())?).filter(Filter::FlateDecode);
        for (i, Picture { width, height, rgb, alpha }) in self.pictures.iter().enumerate() {
            let mask = Ref::new(picture(i).get() + 1);
            for (reference, bytes) in [(picture(i), rgb), (mask, alpha)] {
                let bytes = packed(bytes)?;
                let mut object = pdf.image_xobject(reference, &bytes);
                object.filter(Filter::FlateDecode);
                object.width(*width as i32).height(*height as i32).bits_per_component(8);
                if reference == mask {
                    object.color_space().device_gray();
                } else {
                    object.color_space().device_rgb();
                    object.s_mask(mask);
                }
            }
        }
        Ok(pdf.finish())
    }
}

fn picture_name(number: usize) -> String {
    format!("P{number}")
}

fn unit(colour: usvg::Color) -> [f32; 3] {
    [colour.red, colour.green, colour.blue].map(|part| f32::from(part) / 255.0)
}

/// One row of pixels along a gradient.
fn of_gradient(gradient: &LinearGradient) -> Picture {
    let stops: Vec<(f32, [f32; 3])> =
        gradient.stops().iter().map(|stop| (stop.offset().get(), unit(stop.color()))).collect();
    let at = |t: f32| -> [f32; 3] {
        let after = stops.partition_point(|(offset, _)| *offset <= t);
        let pick = |i: usize| stops.get(i).or(stops.last()).copied().unwrap_or_default();
        let ((from, low), (to, high)) = (pick(after.saturating_sub(1)), pick(after));
        let share = if to > from { (t - from) / (to - from) } else { 0.0 };
        std::array::from_fn(|i| low[i] + share * (high[i] - low[i]))
    };
    let place = |pixel: usize| (pixel as f32 + 0.5) / GRADIENT_PIXELS as f32;
    let rgb = (0..GRADIENT_PIXELS).flat_map(|pixel| at(place(pixel)));
    let rgb = rgb.map(|part| (255.0 * part).round() as u8).collect();
    Picture { width: GRADIENT_PIXELS, height: 1, rgb, alpha: vec![255; GRADIENT_PIXELS] }
}

fn packed(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"25.4mm\" height=\"12.7mm\" viewBox=\"0 0 72 36\">\
                       <text x=\"4\" y=\"30\" font-size=\"30\" font-family=\"'DejaVu Sans'\">Γ</text>\
                       <path d=\"M0 0L72 36\" stroke=\"#ff0000\" stroke-opacity=\"0.5\"/></svg>";

    #[test]
    fn an_inch_is_72_points_and_letters_are_outlines() {
        let pdf = render(SVG).unwrap();
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-1.7") && text.contains("/MediaBox [0 0 72 36]"), "{text}");
        assert!(text.contains("/G500") && text.contains("/CA 0.5") && !text.contains("/Font"), "{text}");
        assert_eq!(pdf, render(SVG).unwrap());
    }

    #[test]
    fn what_is_not_svg_is_refused() {
        assert!(render("<svg").is_err());
    }
}
