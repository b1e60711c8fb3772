//! Maps over the field of the image: convergence and shear; flexion and Δ.

use super::grid::{GridData, einstein_circle};
use crate::plot::{ColourMap, ColourScale, Figure};

/// Draws κ, γ1 and γ2 side by side over the full page, about the values that take the middle colour (0, or the values on
/// the axis to show the change over the field).
pub fn tidal_maps(grids: [GridData; 3], centres: [f64; 3], einstein_radius_arcsec: f64) -> Figure {
    const COVERAGE: f64 = 0.98;
    let colours = |i: usize| ColourScale::symmetric_about(centres[i], grids[i].values, COVERAGE);
    let told = |i: usize| -> String {
        let name = ["κ", "γ_{1}", "γ_{2}"][i];
        // A scale about zero explains itself; another says what its white is.
        if centres[i] == 0.0 || !centres[i].is_finite() {
            name.into()
        } else {
            format!("{name}  (white: axis, {})", format!("{:.4}", centres[i]).replace('-', "−"))
        }
    };
    let labels = [told(0), told(1), told(2)];
    let labels = labels.each_ref().map(String::as_str);
    map_row("Convergence and shear of the line of sight", grids, colours, labels, einstein_radius_arcsec)
}

/// Draws |F| = |∂γ|, |G| = |∂*γ| and Δ, the change of the shear over the image, side by side over the full page.
pub fn flexion_maps(grids: [GridData; 3], einstein_radius_arcsec: f64) -> Figure {
    const COVERAGE: f64 = 0.99;
    const MAPS: [ColourMap; 3] = [ColourMap::Viridis, ColourMap::Viridis, ColourMap::Magma];
    let colours = |i: usize| ColourScale::log_of(MAPS[i], grids[i].values, COVERAGE);
    let labels = ["|F| [arcsec^{−1}]", "|G| [arcsec^{−1}]", "Δ"];
    map_row("Flexion of the line of sight", grids, colours, labels, einstein_radius_arcsec)
}

/// Three maps of one field in a row, each with its colour bar above and the Einstein circle.
fn map_row(
    title: &str,
    grids: [GridData; 3],
    colours: impl Fn(usize) -> ColourScale,
    labels: [&str; 3],
    einstein_radius_arcsec: f64,
) -> Figure {
    let panels = (0..3).map(|i| {
        let colours = colours(i);
        let mut panel = grids[i].panel_with_bar(colours, i, labels[i], 1);
        panel.marks.extend(einstein_circle(einstein_radius_arcsec, colours.map));
        panel
    });
    Figure::full_width(title, grids[0].aspect(), 3, panels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_zero_or_said_to_be_the_value_on_the_axis() {
        let grid = GridData::square(&[-0.02, 0.01, 0.0, 0.02], 2, 1.0);
        let svg = tidal_maps([grid; 3], [0.0, -0.0123, f64::NAN], 1.0).to_svg();
        assert!(svg.matches("white: axis").count() == 1 && svg.contains("(white: axis, −0.0123)"), "{svg}");
    }

    #[test]
    fn the_colour_bars_carry_units() {
        let grid = GridData::square(&[1e-4, 1e-2, 0.0, -1.0], 2, 1.0);
        let svg = flexion_maps([grid; 3], 1.0).to_svg();
        assert_eq!(svg.matches(">−1<").count(), 2);
        assert_eq!(svg.matches("<ellipse").count(), 3);
    }
}
