//! A figure written as SVG, PNG and PDF.

use std::path::{Path, PathBuf};

use super::figure::Figure;
use super::figure_style::Style;
use super::layout::lay_out;
use super::svg::Svg;
use super::{axes, colour_bar, draw_marks, legend, pdf, png};
use crate::{Error, Result};

impl Figure {
    /// The figure as SVG, with text as text; the same figure gives the same bytes.
    pub fn to_svg(&self) -> String {
        self.to_svg_in(Style::SCREEN)
    }

    /// The same in another style.
    pub fn to_svg_in(&self, style: Style) -> String {
        let layout = lay_out(self, style.magnification);
        let mut svg = Svg::new(layout.width_pt, layout.height_pt, &self.title, style);
        for place in &layout.placed {
            if place.panel.is_blank {
                legend::draw(&mut svg, place);
                continue;
            }
            draw_marks::draw(&mut svg, place);
            axes::draw(&mut svg, place);
            legend::draw(&mut svg, place);
            if let Some(bar) = &place.panel.colour_bar {
                colour_bar::draw(&mut svg, place, bar, &self.panels);
            }
        }
        svg.finish()
    }

    /// Writes `STEM.svg` and `STEM.png` (300 dpi) and returns their paths.
    ///
    /// # Errors
    /// [`Error::Write`] if a file cannot be written or the figure is too large to render.
    pub fn save(&self, stem: &Path) -> Result<Vec<PathBuf>> {
        self.save_as(stem, &["svg", "png"], Style::SCREEN)
    }

    /// Writes `STEM.svg`, `STEM.png` and `STEM.pdf`, as far as their extensions are named, and returns their paths.
    ///
    /// # Errors
    /// As [`save`](Self::save); [`Error::OutOfRange`] for another extension.
    pub fn save_as(&self, stem: &Path, extensions: &[&str], style: Style) -> Result<Vec<PathBuf>> {
        let svg = self.to_svg_in(style);
        let mut written = Vec::new();
        for extension in extensions {
            let mut name = stem.as_os_str().to_owned();
            name.push(format!(".{extension}"));
            let path = PathBuf::from(name);
            let bytes = match *extension {
                "svg" => Ok(svg.clone().into_bytes()),
                "png" => png::render(&svg),
                "pdf" => pdf::render(&svg),
                other => return Err(Error::out_of_range("format of a figure", other, "svg, png or pdf")),
            };
            let bytes = bytes.map_err(|problem| Error::write(&path, problem))?;
            std::fs::write(&path, bytes).map_err(|error| Error::write(&path, error))?;
            written.push(path);
        }
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::*;

    /// One panel with every kind of mark, over values of which many cannot be drawn.
    fn everything(values: &[f64], scale: Scale) -> Figure {
        let (colour, stroke, legend) = (Colour::BLUE, Stroke::dashed(Colour::RED, 1.0), "a < b & c");
        let (points, colours) = (points(values, values), ColourScale::symmetric_about(0.0, values, 0.98));
        let (many, edges, bars) = (
            points.repeat(2000),
            points.iter().map(|[x, y]| [*x, *y, *y]).collect(),
            points.iter().map(|[x, y]| [*x, *y, *y, *y]).collect(),
        );
        let v = values.to_vec();
        let (anchor, at) = (Anchor::Start, At::DataFraction(f64::INFINITY, 1.0));
        let mut marks: Vec<Mark> = [
            Shape::Raster { values: v.clone(), nx: 3, ny: 2, extent: Extent::square([0.5; 2], 0.4), colours },
            Shape::Line { points: points.clone(), stroke },
            Shape::Band { edges, colour },
            Shape::Dots { points: many, colour, radius_pt: 1.0, opacity: 0.5 },
            Shape::ErrorBars { points: bars, colour },
            Shape::Histogram { edges: v.clone(), counts: v, stroke },
            Shape::Region { rings: vec![points], stroke, opacity: 0.5 },
        ]
        .map(|shape| Mark::from(shape).named(legend))
        .into();
        marks.extend([
            Shape::Circle { centre: [0.0, f64::NAN], radius: 1.0, stroke }.into(),
            Mark::rule(Rule::X(f64::NAN), stroke),
            Mark::rule(Rule::Y(0.0), stroke),
            Shape::Text { at, text: "never".into(), anchor, colour, halo: None }.into(),
        ]);
        let axis = Axis { scale, ..Axis::linear("θ_{x} <&>") };
        let colour_bar = Some(ColourBar { colours, label: "κ".into(), panels: 9 });
        let panel = Panel { colour_bar, ..Panel::new(axis.clone(), axis, marks) };
        Figure::one_column("all < & marks", 0.75, panel)
    }

    const AWKWARD: [f64; 8] = [f64::NAN, -1.0, 0.0, f64::INFINITY, 1e300, -1e300, 1e-300, f64::NEG_INFINITY];

    #[test]
    fn values_that_are_not_finite_are_skipped_and_never_panic() {
        for scale in [Scale::Linear, Scale::Log] {
            for values in [&AWKWARD[..], &AWKWARD[..1], &[], &[2.0], &[0.2, 0.4, 0.8]] {
                let svg = everything(values, scale).to_svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("never"), "{values:?}");
                png::render(&svg).unwrap();
            }
        }
    }

    #[test]
    fn an_empty_panel_says_so() {
        assert!(everything(&[], Scale::Log).to_svg().contains("no data"));
        assert!(!everything(&[0.2, 0.4], Scale::Log).to_svg().contains("no data"));
    }

    #[test]
    fn the_same_figure_gives_the_same_bytes_and_real_text() {
        let figure = everything(&[0.2, 0.3, 0.5, f64::NAN], Scale::Log);
        let svg = figure.to_svg();
        assert_eq!(svg, figure.to_svg());
        assert!(svg.contains("width=\"84mm\"") && svg.contains("<title>all &lt; &amp; marks</title>"));
        assert!(svg.contains("θ<tspan") && svg.contains("a &lt; b &amp; c") && svg.contains("DejaVu Sans"));
    }

    #[test]
    fn styles_magnify_letters_swap_colours_of_the_page_and_leave_pictures() {
        let figure = everything(&[0.2, 0.4, 0.8], Scale::Linear);
        let [screen, paper, dark] =
            [Style::SCREEN, Style::PAPER, Style::DARK].map(|style| figure.to_svg_in(style));
        assert_eq!(screen, figure.to_svg());
        // As wide, on a page of fewer points, whose letters are larger by as much.
        let view_box =
            |svg: &str| svg.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>();
        let ratio = view_box(&screen).unwrap() / view_box(&paper).unwrap();
        assert!((ratio - Style::PAPER.magnification).abs() < 1e-3 && paper.contains("width=\"84mm\""));
        let sizes =
            paper.split("font-size=\"").skip(1).filter_map(|rest| rest.split('"').next()?.parse().ok());
        let smallest = Style::PAPER.magnification * sizes.fold(f64::INFINITY, f64::min);
        assert!((6.0..10.0).contains(&smallest), "{smallest} pt");
        let picture =
            |svg: &str| svg.split("<image").nth(1).and_then(|rest| rest.split("/>").next()).map(String::from);
        assert_eq!(picture(&screen), picture(&dark));
        // The page and its axes are dark and light; what lies on the picture keeps its colours.
        assert!(dark.contains("fill=\"#14161a\"") && dark.contains("#e6e8ec") && dark.contains("#0072b2"));
        assert_eq!(Style::named("dark"), Style::DARK);
    }

    #[test]
    fn saving_writes_both_files_beside_a_stem_with_dots() {
        let folder = tempfile::tempdir().unwrap();
        let paths = everything(&[0.2, 0.4], Scale::Linear).save(&folder.path().join("cone.0")).unwrap();
        assert_eq!(paths, [folder.path().join("cone.0.svg"), folder.path().join("cone.0.png")]);
        assert!(paths.iter().all(|path| path.metadata().unwrap().len() > 1000));
        let failure =
            everything(&[0.2], Scale::Linear).save(&folder.path().join("missing/cone")).unwrap_err();
        assert!(matches!(failure, Error::Write { .. }));
    }
}
