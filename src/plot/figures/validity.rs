//! What fits of tidal models say of sightlines, and where they fail.

use super::which_shear::steps;
use crate::plot::{Anchor, Axis, Caption, Colour, Corner, Figure, Mark, Panel, Rule, Shape, Stroke};

/// Fitted against defined shears of one view and definition: (x, y, low, high).
#[derive(Debug, Clone, PartialEq)]
pub struct FittedPoints {
    pub definition: String,
    pub view: String,
    /// Of fits that describe their images.
    pub good: Vec<[f64; 4]>,
    /// Of fits that do not.
    pub misfits: Vec<[f64; 4]>,
}

/// Deviations of the fits of one view, σ, by definition.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverageView {
    pub view: String,
    pub sets: Vec<(String, Vec<f64>)>,
}

/// (Δ_tot of the axis, of the ring, residual of the nearest tidal model) each with the excess of χ².
#[derive(Debug, Clone, PartialEq)]
pub struct ExcessView {
    pub view: String,
    pub by: [Vec<[f64; 2]>; 3],
}

/// Shares with their errors by limit of Δ_h; none is all haloes.
#[derive(Debug, Clone, PartialEq)]
pub struct FailingCurve {
    pub name: String,
    pub points: Vec<(Option<f64>, [f64; 2])>,
}

fn captioned(panel: Panel, text: String) -> Panel {
    Panel { captions: vec![Caption { text, colour: Colour::BLACK, anchor: Anchor::Start }], ..panel }
}

/// A panel a view and definition, three in a row.
pub fn fitted_shears(sets: &[FittedPoints]) -> Figure {
    let panel = |set: &FittedPoints| {
        let all = || set.good.iter().chain(&set.misfits).flat_map(|point| [point[0], point[1]]);
        let mut sizes: Vec<f64> = all().map(f64::abs).filter(|v| v.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        // A few fits far out must not hide all others.
        let reach = 1.3 * sizes.get(sizes.len() * 49 / 50).copied().unwrap_or(0.05).max(0.01);
        let bars =
            |points: &[[f64; 4]], colour| Mark::from(Shape::ErrorBars { points: points.into(), colour });
        let equal = Mark::line([[-reach; 2], [reach; 2]], Stroke::dashed(Colour::GREY, 0.8));
        let marks = [
            equal,
            bars(&set.misfits, Colour::ORANGE).named("p < 0.001"),
            bars(&set.good, Colour::BLUE).named("p ≥ 0.001"),
        ];
        let x = Axis::linear(&format!("γ_{{1,2}} of {}", set.definition)).between(-reach, reach);
        let y = Axis::linear("fitted γ_{1,2}^{LOS}").between(-reach, reach);
        captioned(Panel { legend: Corner::TopLeft, ..Panel::new(x, y, marks) }, format!("seen: {}", set.view))
    };
    Figure::full_width("Fitted and defined shear", 1.0, 3, sets.iter().map(panel))
}

/// The part of the fits within so many σ of each definition, a panel a view, beside what right errors give, 1 − exp(−σ²).
pub fn coverage(views: &[CoverageView]) -> Figure {
    let panel = |view: &CoverageView| {
        let curve = |(number, (name, sigma)): (usize, &(String, Vec<f64>))| {
            let stroke = match number < 5 {
                true => Stroke::solid(Colour::of_curve(number), 1.0),
                false => Stroke::solid(Colour::GREY, 1.0),
            };
            Mark::line(steps(sigma), stroke).named(name.as_str())
        };
        let right: Vec<[f64; 2]> = (0..=120)
            .map(|i| 10f64.powf(-1.0 + 3.0 * f64::from(i) / 120.0))
            .map(|sigma| [sigma, 1.0 - (-sigma * sigma).exp()])
            .collect();
        let right = Mark::line(right, Stroke::dashed(Colour::BLACK, 0.8)).named("right errors");
        let marks: Vec<Mark> = view.sets.iter().enumerate().map(curve).chain([right]).collect();
        let x = Axis::log("deviation from the definition [σ]").between(0.1, 100.0);
        let y = Axis::linear("fraction of fits").between(0.0, 1.0);
        // Large deviations are of few fits: the curves leave that corner free.
        captioned(
            Panel { legend: Corner::BottomRight, ..Panel::new(x, y, marks) },
            format!("seen: {}", view.view),
        )
    };
    Figure::full_width("Fits within their errors of each definition", 0.75, 2, views.iter().map(panel))
}

/// χ² above that of the twins against three measures of what is not tidal.
pub fn excess(views: &[ExcessView]) -> Figure {
    /// What is below is drawn there.
    const LEAST: f64 = 0.1;
    let labels = ["Δ_{tot}", "Δ_{tot}, ring", "residual of best tidal [arcsec]"];
    let panel = |i: usize| {
        let dots = |(number, view): (usize, &ExcessView)| {
            let points = view.by[i].iter().map(|[x, y]| [*x, y.max(LEAST)]).collect();
            let colour = Colour::of_curve(number);
            Mark::from(Shape::Dots { points, colour, radius_pt: 1.1, opacity: 0.6 }).named(view.view.as_str())
        };
        let limit = Mark::rule(Rule::Y(25.0), Stroke::dashed(Colour::GREY, 0.8));
        let marks: Vec<Mark> = views.iter().enumerate().map(dots).chain([limit]).collect();
        let y = Axis::log("χ² − χ² of the tidal twin").outer(i == 0);
        Panel { legend: Corner::TopLeft, ..Panel::new(Axis::log(labels[i]), y, marks) }
    };
    Figure::full_width("Misfit and variation of the shear", 1.0, 3, (0..3).map(panel))
}

/// Shares against the limit of Δ_h; those of all haloes stand at the right.
pub fn failing(curves: &[FailingCurve]) -> Figure {
    let limits = || curves.iter().flat_map(|curve| &curve.points).filter_map(|(limit, _)| *limit);
    let largest = limits().fold(0.0, f64::max);
    let all = if largest > 0.0 { 4.0 * largest } else { 1.0 };
    let marks = curves.iter().enumerate().flat_map(|(number, curve)| {
        // Beside each other, so that errors can be told apart.
        let shift = 1.0 + 0.02 * number as f64;
        let mut points: Vec<[f64; 3]> = curve
            .points
            .iter()
            .map(|(limit, [part, error])| [limit.unwrap_or(all) * shift, 100.0 * part, 100.0 * error])
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let colour = Colour::of_curve(number);
        let line: Vec<[f64; 2]> = points.iter().map(|[x, y, _]| [*x, *y]).collect();
        let bars = points.iter().map(|[x, y, e]| [*x, *y, y - e, y + e]).collect();
        [
            Mark::line(line, Stroke::solid(colour, 0.9)).named(curve.name.as_str()),
            Shape::ErrorBars { points: bars, colour }.into(),
        ]
    });
    let x = Axis::log(&format!("haloes seen: Δ_{{h}} below (all at {all})"));
    let y = Axis::linear("sightlines [%]").between(0.0, 130.0);
    let panel = Panel { legend: Corner::TopLeft, ..Panel::new(x, y, marks) };
    Figure::one_column("Sightlines whose images are not tidal", 0.9, panel)
}

/// H0 over the true one, (view, [tensors of the axis, of the ring, best fit]).
pub fn delay_ratios(views: &[(String, [Vec<f64>; 3])]) -> Figure {
    const BINS: usize = 40;
    let panel = |(view, sets): &(String, [Vec<f64>; 3])| {
        let mut sizes: Vec<f64> =
            sets.iter().flatten().map(|v| (v - 1.0).abs()).filter(|v| v.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        let reach = sizes.get(sizes.len() * 9 / 10).copied().unwrap_or(0.1).max(1e-3);
        let edges: Vec<f64> =
            (0..=BINS).map(|i| 1.0 + reach * (2.0 * i as f64 / BINS as f64 - 1.0)).collect();
        let outline = |(number, (name, values)): (usize, (&str, &Vec<f64>))| {
            let mut counts = vec![0.0; BINS];
            for value in values.iter().filter(|v| v.is_finite()) {
                let place = (value - 1.0 + reach) / (2.0 * reach) * BINS as f64;
                if (0.0..BINS as f64).contains(&place) {
                    counts[place as usize] += 1.0;
                }
            }
            let stroke = Stroke::solid(Colour::of_curve(number), 1.0);
            Mark::from(Shape::Histogram { edges: edges.clone(), counts, stroke }).named(name)
        };
        let names = ["tensors of the axis", "tensors of the ring", "best fit"];
        let marks: Vec<Mark> = names.into_iter().zip(sets).enumerate().map(outline).collect();
        let tallest = marks.iter().flat_map(Mark::points).map(|[_, y]| y).fold(1.0, f64::max);
        let y = Axis::linear("sightlines").between(0.0, 1.5 * tallest);
        let panel =
            Panel { legend: Corner::TopLeft, ..Panel::new(Axis::linear("H_{0} / true H_{0}"), y, marks) };
        captioned(panel, format!("seen: {view}"))
    };
    Figure::full_width("H0 from delays", 0.7, 2, views.iter().map(panel))
}

/// (z, M200c) of sightlines that look tidal and of those that do not.
pub fn varying_haloes([tidal, others]: [Vec<[f64; 2]>; 2]) -> Figure {
    let dots = |points: Vec<[f64; 2]>, colour, name: &str| {
        Mark::from(Shape::Dots { points, colour, radius_pt: 1.4, opacity: 0.7 }).named(name)
    };
    let marks = [
        dots(tidal, Colour::BLUE, "χ² as of the tidal twin"),
        dots(others, Colour::ORANGE, "χ² above it by 25"),
    ];
    let mut panel = Panel::new(Axis::linear("z"), Axis::log("M_{200c} [M_{⊙}]"), marks);
    let masses = panel.marks.iter().flat_map(Mark::points).map(|[_, mass]| mass);
    let (low, high) = masses.fold((f64::INFINITY, 0.0), |(low, high), m| (m.min(low), m.max(high)));
    if low > 0.0 && high.is_finite() && low <= high {
        // Room for the legend.
        panel.y = panel.y.between(0.7 * low, 8.0 * high);
    }
    Figure::one_column("The halo whose shear changes most", 0.8, panel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_have_panels_and_all_haloes_stand_right_of_the_limits() {
        let view = CoverageView { view: "all".into(), sets: vec![("axis".into(), vec![0.5, f64::NAN])] };
        assert_eq!(coverage(&[view.clone(), view]).panels.len(), 2);
        let points = vec![(None, [0.9, 0.1]), (Some(0.1), [0.2, 0.1])];
        let figure = failing(&[FailingCurve { name: "p".into(), points }]);
        let Shape::Line { points, .. } = &figure.panels[0].marks[0].shape else { panic!() };
        assert_eq!(points.as_slice(), [[0.1, 20.0], [0.4, 90.0]]);
        let figure = delay_ratios(&[("all".into(), [vec![1.01, 0.99, f64::NAN, 7.0], vec![], vec![]])]);
        let Shape::Histogram { counts, .. } = &figure.panels[0].marks[0].shape else { panic!() };
        assert_eq!(counts.iter().sum::<f64>(), 2.0);
    }
}
