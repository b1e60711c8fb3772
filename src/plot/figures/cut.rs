//! What the shear cut does: changes of κ, γ, F, Δ and of the image against the cut.

use crate::plot::{Axis, Colour, Corner, Figure, Mark, Panel, Stroke, points};

/// Changes of |κ|, |γ|, |F| per arcsec and Δ on the axis on the left; those of the image (largest pixel over its noise, χ²)
/// on the right. One value a cut, differences from the loosest cut, which is left out.
pub fn cut(min_point_shear: &[f64], tensors: [&[f64]; 4], image: [&[f64]; 2]) -> Figure {
    let solid = |colour| Stroke::solid(colour, 1.0);
    let tensor_styles = [
        (solid(Colour::BLACK), "κ"),
        (solid(Colour::BLUE), "γ"),
        (solid(Colour::ORANGE), "F [arcsec^{−1}]"),
        (Stroke::dashed(Colour::BLACK, 1.0), "Δ"),
    ];
    let image_styles = [(solid(Colour::BLUE), "largest pixel"), (solid(Colour::ORANGE), "χ^{2}")];
    // Room for the legend above the curves.
    let panel = |label: &str, room: f64, curves: &[&[f64]], styles: &[(Stroke, &str)]| {
        let positive = curves.iter().flat_map(|values| values.iter().copied()).filter(|v| *v > 0.0);
        let (low, high) = positive.fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        let lines = curves.iter().zip(styles).map(|(values, (stroke, legend))| {
            let all = points(min_point_shear, values).into_iter();
            Mark::line(all.filter(|[x, y]| *x > 0.0 && *y > 0.0).collect::<Vec<_>>(), *stroke).named(*legend)
        });
        let y = Axis { limits: (high > 0.0).then_some((low / 2.0, high * room)), ..Axis::log(label) };
        let x = Axis::log("smallest point-lens shear kept");
        Panel { legend: Corner::TopLeft, ..Panel::new(x, y, lines) }
    };
    let panels = [
        panel("change from the loosest cut", 100.0, &tensors, &tensor_styles),
        panel("change of the image over its noise", 20.0, &image, &image_styles),
    ];
    Figure::full_width("What the shear cut does", 0.75, 2, panels)
}
