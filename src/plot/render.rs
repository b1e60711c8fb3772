//! A figure written as SVG and PNG.

use std::path::{Path, PathBuf};

use super::figure::Figure;
use super::layout::lay_out;
use super::svg::Svg;
use super::{axes, colour_bar, draw_marks, legend, png};
use crate::{Error, Result};

impl Figure {
    /// The figure as SVG, with text as text; the same figure gives the same bytes.
    pub fn to_svg(&self) -> String {
        let layout = lay_out(self);
        let mut svg = Svg::new(layout.width_pt, layout.height_pt, &self.title);
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
        self.save_as(stem, [true, true])
    }

    /// The same of `STEM.svg` and `STEM.png` those that are wanted.
    ///
    /// # Errors
    /// As [`save`](Self::save).
    pub fn save_as(&self, stem: &Path, [svg_wanted, png_wanted]: [bool; 2]) -> Result<Vec<PathBuf>> {
        let svg = self.to_svg();
        let with_suffix = |suffix: &str| {
            let mut name = stem.as_os_str().to_owned();
            name.push(suffix);
            PathBuf::from(name)
        };
        let (svg_path, png_path) = (with_suffix(".svg"), with_suffix(".png"));
        let mut written = Vec::new();
        let mut write = |path: PathBuf, bytes: &[u8]| -> Result<()> {
            std::fs::write(&path, bytes).map_err(|error| Error::write(&path, error))?;
            written.push(path);
            Ok(())
        };
        if png_wanted {
            let png = png::render(&svg).map_err(|problem| Error::write(&png_path, problem))?;
            write(png_path, &png)?;
        }
        if svg_wanted {
            write(svg_path, svg.as_bytes())?;
        }
        written.reverse();
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
