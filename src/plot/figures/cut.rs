//! What the shear cut does: changes of κ, γ, F, Δ and of the image against the cut.

use crate::plot::{Axis, Colour, Corner, Figure, Line, Mark, Panel, Stroke};

/// What the figure shows: one value a cut, differences from the loosest cut, which is left out.
#[derive(Debug, Clone, Copy)]
pub struct CutData<'a> {
    /// The cuts.
    pub min_point_shear: &'a [f64],
    /// |Δκ| on the axis.
    pub kappa: &'a [f64],
    /// |Δγ| on the axis.
    pub gamma: &'a [f64],
    /// |ΔF| on the axis, per arcsec.
    pub f_per_arcsec: &'a [f64],
    /// |ΔΔ|.
    pub delta: &'a [f64],
    /// Largest difference of a pixel over its noise.
    pub image_largest: &'a [f64],
    /// χ² of the image.
    pub image_chi_squared: &'a [f64],
}

/// Tensors on the left, the image on the right.
pub fn cut(data: &CutData) -> Figure {
    let line = |values: &[f64], stroke: Stroke, legend: &str| {
        let points = || data.min_point_shear.iter().zip(values).filter(|(x, y)| **x > 0.0 && **y > 0.0);
        Mark::Line(Line {
            x: points().map(|(x, _)| *x).collect(),
            y: points().map(|(_, y)| *y).collect(),
            stroke,
            legend: legend.into(),
        })
    };
    // Room for the legend above the curves.
    let limits = |curves: &[&[f64]], room: f64| {
        let positive = curves.iter().flat_map(|values| values.iter().copied()).filter(|v| *v > 0.0);
        let (low, high) = positive.fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        (high > 0.0).then_some((low / 2.0, high * room))
    };
    let panel = |label: &str, limits: Option<(f64, f64)>, marks: Vec<Mark>| Panel {
        marks,
        legend: Corner::TopLeft,
        ..Panel::new(Axis::log("smallest point-lens shear kept"), Axis { limits, ..Axis::log(label) })
    };
    let panels = vec![
        panel(
            "change from the loosest cut",
            limits(&[data.kappa, data.gamma, data.f_per_arcsec, data.delta], 100.0),
            vec![
                line(data.kappa, Stroke::solid(Colour::BLACK, 1.0), "κ"),
                line(data.gamma, Stroke::solid(Colour::BLUE, 1.0), "γ"),
                line(data.f_per_arcsec, Stroke::solid(Colour::ORANGE, 1.0), "F [arcsec^{−1}]"),
                line(data.delta, Stroke::dashed(Colour::BLACK, 1.0), "Δ"),
            ],
        ),
        panel(
            "change of the image over its noise",
            limits(&[data.image_largest, data.image_chi_squared], 20.0),
            vec![
                line(data.image_largest, Stroke::solid(Colour::BLUE, 1.0), "largest pixel"),
                line(data.image_chi_squared, Stroke::solid(Colour::ORANGE, 1.0), "χ^{2}"),
            ],
        ),
    ];
    Figure { columns: 2, panels, ..Figure::full_width("What the shear cut does") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_without_change_are_left_out() {
        let values: &[f64] = &[1e-3, 0.0];
        let data = CutData {
            min_point_shear: &[1e-5, 1e-6],
            kappa: values,
            gamma: values,
            f_per_arcsec: values,
            delta: values,
            image_largest: values,
            image_chi_squared: values,
        };
        let figure = cut(&data);
        assert_eq!(figure.panels.len(), 2);
        assert!(!figure.to_svg().contains("NaN"));
    }
}
