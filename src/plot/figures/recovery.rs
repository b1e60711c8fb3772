//! What fits of a catalogue recover: input against output shear, uncertainties, residuals, and their dependence on quality.

use super::grid::caption;
use crate::plot::{
    Axis, Colour, ColourBar, ColourMap, ColourScale, Corner, ErrorBars, Figure, Histogram, Line, Mark, Norm,
    Panel, Scatter, Side, Stroke,
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
    /// Its fits.
    pub points: Vec<RecoveredPoint>,
}

/// Input against output, a row a model, coloured by log Q.
pub fn recovery(models: &[RecoveryData]) -> Figure {
    let qualities: Vec<f64> = models.iter().flat_map(|m| m.points.iter().map(|p| p.log_quality)).collect();
    let finite = || qualities.iter().copied().filter(|q| q.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let norm = if low < high { Norm::Linear { low, high } } else { Norm::Linear { low: 0.0, high: 1.0 } };
    let mut panels = Vec::new();
    for (row, model) in models.iter().enumerate() {
        for component in 0..2 {
            panels.push(recovery_panel(model, component, norm, row == 0 && component == 0));
        }
    }
    Figure { columns: 2, panel_aspect: 0.75, panels, ..Figure::full_width("Input and recovered shear") }
}

fn recovery_panel(model: &RecoveryData, component: usize, norm: Norm, with_bar: bool) -> Panel {
    let map = ColourMap::Viridis;
    let inputs = || model.points.iter().map(|p| p.input[component]);
    let reach = 1.15 * inputs().map(f64::abs).fold(0.01, f64::max);
    let (ends, stroke) = (vec![-reach, reach], Stroke::dashed(Colour::GREY, 0.8));
    let mut marks = vec![Mark::Line(Line::new(ends.clone(), ends, stroke))];
    for p in &model.points {
        let colour = norm.position(p.log_quality).map_or(Colour::GREY, |t| map.at(t));
        marks.push(Mark::ErrorBars(ErrorBars {
            x: vec![p.input[component]],
            y: vec![p.output[component]],
            low: vec![p.low[component]],
            high: vec![p.high[component]],
            colour,
            legend: String::new(),
        }));
    }
    let label = |side: &str| format!("γ_{{{}}}^{{LOS, {side}}}", component + 1);
    let x = Axis { limits: Some((-reach, reach)), ..Axis::linear(&label("in")) };
    let y = Axis { limits: Some((-1.6 * reach, 1.6 * reach)), ..Axis::linear(&label("out")) };
    let colours = ColourScale { map, norm };
    let bar = ColourBar { colours, label: "log_{10} Q".into(), side: Side::TopOver(2) };
    // On the white of the page, as on a light map.
    marks.push(caption(&model.model, (0.05, 0.92), ColourMap::Diverging));
    Panel { marks, colour_bar: with_bar.then_some(bar), ..Panel::new(x, y) }
}

/// Histograms of σ and of the residuals in σ, one outline a model.
pub fn recovery_histograms(models: &[RecoveryData]) -> Figure {
    let panel = |label: &str, largest: f64, value: fn(&RecoveredPoint) -> f64| {
        const BINS: usize = 20;
        let edges: Vec<f64> = (0..=BINS).map(|i| largest * i as f64 / BINS as f64).collect();
        let outline = |(i, model): (usize, &RecoveryData)| {
            let mut counts = vec![0.0; BINS];
            for point in &model.points {
                let bin = (value(point) / largest * BINS as f64) as usize;
                counts[bin.min(BINS - 1)] += 1.0;
            }
            let stroke = Stroke::solid(Colour::of_curve(i), 1.0);
            Mark::Histogram(Histogram { edges: edges.clone(), counts, stroke, legend: model.model.clone() })
        };
        let marks = models.iter().enumerate().map(outline).collect();
        Panel { marks, ..Panel::new(Axis::linear(label), Axis::linear("images")) }
    };
    let largest = |value: fn(&RecoveredPoint) -> f64| {
        let all = models.iter().flat_map(|m| &m.points).map(value).filter(|v| v.is_finite());
        all.fold(0.0, f64::max)
    };
    let sigma = largest(|p| p.uncertainty).max(1e-3);
    const MOST: f64 = 20.0;
    let most = largest(|p| p.residual);
    let residual = most.clamp(2.0, MOST);
    let label = "|γ_{LOS}^{out} − γ_{LOS}^{in}| / σ";
    let label = if most > MOST { format!("{label} (last bin: all beyond)") } else { label.into() };
    let panels = vec![panel("σ(γ_{LOS})", sigma, |p| p.uncertainty), panel(&label, residual, |p| p.residual)];
    Figure { columns: 2, panels, ..Figure::full_width("Uncertainties and residuals") }
}

/// σ against Q with straight lines (slope, intercept, legend) in the logarithms, and residuals against Q.
pub fn recovery_quality(model: &RecoveryData, lines: &[([f64; 2], &str)]) -> Figure {
    let points = || model.points.iter().filter(|p| p.log_quality.is_finite());
    let dots = |value: fn(&RecoveredPoint) -> f64| {
        Mark::Scatter(Scatter {
            x: points().map(|p| p.log_quality).collect(),
            y: points().map(value).collect(),
            colour: Colour::BLUE,
            radius_pt: 1.6,
            opacity: 0.8,
            legend: String::new(),
        })
    };
    let ends = [f64::min, f64::max].map(|pick| points().map(|p| p.log_quality).reduce(pick).unwrap_or(0.0));
    let mut left = vec![dots(|p| p.uncertainty.log10())];
    for (i, ([slope, intercept], legend)) in lines.iter().enumerate() {
        left.push(Mark::Line(Line {
            x: ends.to_vec(),
            y: ends.iter().map(|q| slope * q + intercept).collect(),
            stroke: Stroke::dashed([Colour::BLACK, Colour::ORANGE][i % 2], 0.9),
            legend: (*legend).into(),
        }));
    }
    let quality = || Axis::linear("log_{10} Q");
    let panels = vec![
        Panel {
            marks: left,
            legend: Corner::TopRight,
            ..Panel::new(quality(), Axis::linear("log_{10} σ(γ_{LOS})"))
        },
        Panel {
            marks: vec![dots(|p| p.residual)],
            ..Panel::new(quality(), Axis::linear("|γ_{LOS}^{out} − γ_{LOS}^{in}| / σ"))
        },
    ];
    Figure { columns: 2, panels, ..Figure::full_width("Uncertainty and residual against image quality") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> Vec<RecoveryData> {
        let point = RecoveredPoint {
            input: [0.01, -0.02],
            output: [0.012, -0.03],
            low: [0.0, -0.04],
            high: [0.02, -0.02],
            uncertainty: 0.01,
            residual: 0.7,
            log_quality: 3.5,
        };
        let other = RecoveredPoint { log_quality: f64::NAN, residual: 90.0, ..point };
        vec![
            RecoveryData { model: "a".into(), points: vec![point, other] },
            RecoveryData { model: "b".into(), points: vec![] },
        ]
    }

    #[test]
    fn points_have_the_colours_of_the_bar() {
        let mut models = data();
        let best = RecoveredPoint { log_quality: 4.5, ..models[0].points[0] };
        models[0].points.push(best);
        let panel = &recovery(&models).panels[0];
        let bar = panel.colour_bar.as_ref().unwrap();
        assert_eq!(bar.colours.norm.limits(), (3.5, 4.5));
        let colours: Vec<Colour> = panel
            .marks
            .iter()
            .filter_map(|mark| if let Mark::ErrorBars(bars) = mark { Some(bars.colour) } else { None })
            .collect();
        assert_eq!(colours, [bar.colours.map.at(0.0), Colour::GREY, bar.colours.map.at(1.0)]);
    }

    #[test]
    fn every_model_has_two_panels_and_nothing_is_lost_from_the_histograms() {
        assert_eq!(recovery(&data()).panels.len(), 4);
        let figure = recovery_histograms(&data());
        let Mark::Histogram(steps) = &figure.panels[1].marks[0] else { panic!() };
        assert_eq!(steps.counts.iter().sum::<f64>(), 2.0);
        for figure in [recovery(&data()), figure, recovery_quality(&data()[0], &[([-0.76, 1.01], "paper")])] {
            let svg = figure.to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }
}
