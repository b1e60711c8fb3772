//! Maps of the flexions |F| and |G| and of Δ over the field of the image.

use super::grid::{GridData, map_row};
use crate::plot::{ColourMap, Figure, Norm};

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct FlexionMapsData<'a> {
    /// Modulus of the first flexion, F = ∂γ.
    pub f_per_arcsec: GridData<'a>,
    /// Modulus of the second flexion, G = ∂*γ.
    pub g_per_arcsec: GridData<'a>,
    /// Δ, the change of the shear over the image.
    pub delta: GridData<'a>,
    /// Radius of the dashed circle.
    pub einstein_radius_arcsec: f64,
}

/// Fraction of the pixels whose values lie within the colour bar.
const COVERAGE: f64 = 0.99;

/// Draws |F|, |G| and Δ side by side over the full page.
pub fn flexion_maps(data: &FlexionMapsData) -> Figure {
    let maps = [
        (data.f_per_arcsec, ColourMap::Viridis, "|F| [arcsec^{−1}]"),
        (data.g_per_arcsec, ColourMap::Viridis, "|G| [arcsec^{−1}]"),
        (data.delta, ColourMap::Magma, "Δ"),
    ];
    let maps = maps.map(|(grid, map, label)| (grid, map, Norm::log_of(grid.values, COVERAGE), label));
    map_row("Flexion of the line of sight", maps, data.einstein_radius_arcsec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_bars_carry_units() {
        let grid = GridData::square(&[1e-4, 1e-2, 0.0, -1.0], 2, 1.0);
        let data = FlexionMapsData {
            f_per_arcsec: grid,
            g_per_arcsec: grid,
            delta: grid,
            einstein_radius_arcsec: 1.0,
        };
        let svg = flexion_maps(&data).to_svg();
        assert_eq!(svg.matches(">−1<").count(), 2);
        assert_eq!(svg.matches("<ellipse").count(), 3);
    }
}
