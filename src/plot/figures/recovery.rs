//! What fits of a catalogue recover: input against output shear, uncertainties, residuals, and their dependence on quality.

use super::grid::caption;
use crate::plot::{
    Anchor, At, Axis, Colour, ColourBar, ColourMap, ColourScale, Corner, Figure, Mark, Panel, Shape, Stretch,
    Stroke,
};

/// One fit as the figures need it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecoveredPoint {
    /// True γ1, γ2.
    pub input: [f64; 2],
    /// Recovered γ1, γ2.
    pub output: [f64; 2],
    /// Lower ends of the 68% intervals.
    pub low: [f64; 2],
    /// Upper ends.
    pub high: [f64; 2],
    /// σ.
    pub uncertainty: f64,
    /// |output − input| in σ.
    pub residual: f64,
    /// log₁₀ Q; not a number where unknown.
    pub log_quality: f64,
}

/// The productive fits of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryData {
    /// Name of the model.
    pub model: String,
    pub points: Vec<RecoveredPoint>,
}

/// Qualities closer together than this, in log₁₀, have a colour bar of at least twice that.
const LEAST_RANGE: f64 = 0.1;
/// Outputs reach so much farther than inputs before they are outside.
const OUTPUT_REACH: f64 = 1.6;

const RESIDUAL: &str = "|γ_{LOS}^{out} − γ_{LOS}^{in}| / σ";

/// Input against output, a row a model that has any, coloured by log Q; arrows at an edge stand for what lies beyond it.
pub fn recovery(models: &[RecoveryData]) -> Figure {
    let qualities = models.iter().flat_map(|m| m.points.iter().map(|p| p.log_quality));
    let finite: Vec<f64> = qualities.filter(|q| q.is_finite()).collect();
    let ends = [(f64::INFINITY, f64::min as fn(f64, f64) -> f64), (f64::NEG_INFINITY, f64::max)]
        .map(|(start, pick)| finite.iter().copied().fold(start, pick));
    // A bar about one quality alone has numbers too.
    let (low, high) = match finite.len() {
        0 => (0.0, 1.0),
        _ if ends[1] - ends[0] < LEAST_RANGE => (ends[0] - LEAST_RANGE, ends[1] + LEAST_RANGE),
        _ => (ends[0], ends[1]),
    };
    let shown: Vec<&RecoveryData> = models.iter().filter(|model| !model.points.is_empty()).collect();
    let colours = ColourScale { map: ColourMap::Viridis, low, high, stretch: Stretch::Linear };
    let pairs = shown.iter().flat_map(|model| [(*model, 0), (*model, 1)]);
    let panels = pairs.enumerate().map(|(i, (model, component))| {
        let bar = ColourBar { colours, label: "log_{10} Q".into(), panels: 2 };
        Panel {
            colour_bar: (i == 0 && !finite.is_empty()).then_some(bar),
            ..recovery_panel(model, component, colours)
        }
    });
    Figure::full_width("Input and recovered shear", 0.75, 2, panels)
}

fn recovery_panel(model: &RecoveryData, i: usize, colours: ColourScale) -> Panel {
    let reach = 1.15 * model.points.iter().map(|p| p.input[i].abs()).fold(0.01, f64::max);
    let equal = Mark::line([[-reach; 2], [reach; 2]], Stroke::dashed(Colour::GREY, 0.8));
    let bars = model.points.iter().map(|p| {
        let colour = colours.colour(p.log_quality).unwrap_or(Colour::GREY);
        Shape::ErrorBars { points: vec![[p.input[i], p.output[i], p.low[i], p.high[i]]], colour }.into()
    });
    let arrows = model.points.iter().filter(|p| p.output[i].abs() > OUTPUT_REACH * reach).map(|p| {
        let colour = colours.colour(p.log_quality).unwrap_or(Colour::GREY);
        let (text, height) = if p.output[i] > 0.0 { ("▲", 0.955) } else { ("▼", 0.005) };
        let at = At::DataFraction(p.input[i], height);
        Shape::Text { at, text: text.into(), anchor: Anchor::Middle, colour, halo: None }.into()
    });
    let axis = |side: &str, reach: f64| {
        Axis::linear(&format!("γ_{{{}}}^{{LOS, {side}}}", i + 1)).between(-reach, reach)
    };
    // On the white of the page, as on a light map.
    let name = caption(&model.model, (0.05, 0.92), ColourMap::Diverging);
    let marks = [equal].into_iter().chain(bars).chain(arrows).chain([name]);
    Panel::new(axis("in", reach), axis("out", OUTPUT_REACH * reach), marks)
}

/// Histograms of σ and of the residuals in σ, one outline a model.
pub fn recovery_histograms(models: &[RecoveryData]) -> Figure {
    const BINS: usize = 20;
    const MOST: f64 = 20.0;
    let panel = |label: &str, largest: f64, value: fn(&RecoveredPoint) -> f64| {
        let outline = |(i, model): (usize, &RecoveryData)| {
            let mut counts = vec![0.0; BINS];
            for point in &model.points {
                let bin = (value(point) / largest * BINS as f64) as usize;
                counts[bin.min(BINS - 1)] += 1.0;
            }
            let edges = (0..=BINS).map(|i| largest * i as f64 / BINS as f64).collect();
            let stroke = Stroke::solid(Colour::of_curve(i), 1.0);
            Mark::from(Shape::Histogram { edges, counts, stroke }).named(&model.model)
        };
        let marks: Vec<Mark> = models.iter().enumerate().map(outline).collect();
        // Room for the legend; counts are whole numbers.
        let top = 1.5 * marks.iter().flat_map(Mark::points).map(|[_, y]| y).fold(1.0, f64::max);
        let y = Axis { most_intervals: (top as usize).min(7), ..Axis::linear("images").between(0.0, top) };
        Panel::new(Axis::linear(label), y, marks)
    };
    let largest = |value: fn(&RecoveredPoint) -> f64| {
        let all = models.iter().flat_map(|m| &m.points).map(value).filter(|v| v.is_finite());
        all.fold(0.0, f64::max)
    };
    let most = largest(|p| p.residual);
    let beyond = if most > MOST { " (last bin: all beyond)" } else { "" };
    let panels = [
        panel("σ(γ_{LOS})", largest(|p| p.uncertainty).max(1e-3), |p| p.uncertainty),
        panel(&format!("{RESIDUAL}{beyond}"), most.clamp(2.0, MOST), |p| p.residual),
    ];
    Figure::full_width("Uncertainties and residuals", 0.75, 2, panels)
}

/// σ against Q with straight lines (slope, intercept, legend) in the logarithms, and residuals against Q.
pub fn recovery_quality(model: &RecoveryData, lines: &[([f64; 2], &str)]) -> Figure {
    let points = || model.points.iter().filter(|p| p.log_quality.is_finite());
    let panel = |label: &str, value: fn(&RecoveredPoint) -> f64| {
        let points = points().map(|p| [p.log_quality, value(p)]).collect();
        let dots = Shape::Dots { points, colour: Colour::BLUE, radius_pt: 1.6, opacity: 0.8 };
        Panel::new(Axis::linear("log_{10} Q"), Axis::linear(label), [dots.into()])
    };
    let mut left = panel("log_{10} σ(γ_{LOS})", |p| p.uncertainty.log10());
    let ends = [f64::min, f64::max].map(|pick| points().map(|p| p.log_quality).reduce(pick).unwrap_or(0.0));
    for (i, ([slope, intercept], legend)) in lines.iter().enumerate() {
        let stroke = Stroke::dashed([Colour::BLACK, Colour::ORANGE][i % 2], 0.9);
        left.marks.push(Mark::line(ends.map(|q| [q, slope * q + intercept]), stroke).named(*legend));
    }
    // Points run from the upper left to the lower right.
    left.legend = Corner::BottomLeft;
    let panels = [left, panel(RESIDUAL, |p| p.residual)];
    Figure::full_width("Uncertainty and residual against image quality", 0.75, 2, panels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_the_colours_of_the_bar_and_nothing_is_lost_from_the_histograms() {
        let point = RecoveredPoint {
            input: [0.01, -0.02],
            output: [0.012, -0.03],
            low: [0.0, -0.04],
            high: [0.02, -0.02],
            uncertainty: 0.01,
            residual: 0.7,
            log_quality: 3.5,
        };
        let unknown = RecoveredPoint { log_quality: f64::NAN, residual: 90.0, ..point };
        let points = vec![point, unknown, RecoveredPoint { log_quality: 4.5, ..point }];
        let models = [RecoveryData { model: "a".into(), points }];
        let far = RecoveredPoint { output: [0.5, -0.02], ..point };
        let none = RecoveryData { model: "none".into(), points: vec![] };
        let beyond = recovery(&[RecoveryData { model: "far".into(), points: vec![far] }, none]);
        assert_eq!(beyond.panels.len(), 2);
        assert!(beyond.to_svg().contains("▲") && !beyond.to_svg().contains("▼"));
        assert_eq!(beyond.panels[0].colour_bar.as_ref().unwrap().colours.limits(), (3.4, 3.6));
        let figure = recovery(&models);
        assert_eq!(figure.panels.len(), 2);
        let bar = figure.panels[0].colour_bar.as_ref().unwrap();
        assert_eq!(bar.colours.limits(), (3.5, 4.5));
        let colour =
            |mark: &Mark| if let Shape::ErrorBars { colour, .. } = mark.shape { Some(colour) } else { None };
        let colours: Vec<Colour> = figure.panels[0].marks.iter().filter_map(colour).collect();
        assert_eq!(colours, [bar.colours.map.at(0.0), Colour::GREY, bar.colours.map.at(1.0)]);
        let Shape::Histogram { counts, .. } = &recovery_histograms(&models).panels[1].marks[0].shape else {
            panic!()
        };
        assert_eq!(counts.iter().sum::<f64>(), 3.0);
    }
}
