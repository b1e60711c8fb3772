//! How far fits lie from several definitions of the shear that they measure.

use crate::plot::{Axis, Colour, Corner, Figure, Mark, Panel, Stroke};

/// The fraction of fits within so many σ of each definition, given by its name and the deviations of all fits.
pub fn deviations(definitions: &[(String, Vec<f64>)]) -> Figure {
    let curve = |(number, (name, sigma)): (usize, &(String, Vec<f64>))| {
        Mark::line(steps(sigma), Stroke::solid(Colour::of_curve(number), 1.0)).named(name.as_str())
    };
    let x = Axis::log("deviation from the definition [σ]");
    let y = Axis::linear("fraction of fits").between(0.0, 1.0);
    // Large deviations are of few fits: the curves leave that corner free.
    let panel =
        Panel { legend: Corner::BottomRight, ..Panel::new(x, y, definitions.iter().enumerate().map(curve)) };
    Figure::full_width("Which shear fits measure", 0.6, 1, [panel])
}

/// The fraction of values up to each of them, as the corners of steps; values that no logarithm has are left out.
pub(super) fn steps(values: &[f64]) -> Vec<[f64; 2]> {
    let mut values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite() && *v > 0.0).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let step = |(i, v): (usize, &f64)| [[*v, i as f64 / n], [*v, (i + 1) as f64 / n]];
    values.iter().enumerate().flat_map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_definition_has_a_curve_and_none_is_no_fault() {
        let figure = deviations(&[("axis".into(), vec![3.0, f64::NAN, 1.0]), ("ring".into(), vec![])]);
        assert_eq!(figure.panels[0].marks.len(), 2);
        assert!(figure.to_svg().contains("axis"));
    }
}
