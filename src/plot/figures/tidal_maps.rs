//! Maps of convergence and shear over the field of the image.

use super::grid::{GridData, map_row};
use crate::plot::{ColourMap, Figure, Norm};

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct TidalMapsData<'a> {
    /// Convergence κ.
    pub convergence: GridData<'a>,
    /// Shear γ1.
    pub gamma1: GridData<'a>,
    /// Shear γ2.
    pub gamma2: GridData<'a>,
    /// Values that take the middle colour: 0, or the values on the axis to show the change over the field.
    pub centre: [f64; 3],
    /// Radius of the dashed circle.
    pub einstein_radius_arcsec: f64,
}

/// Fraction of the pixels whose values lie within the colour bar.
const COVERAGE: f64 = 0.98;

/// Draws κ, γ1 and γ2 side by side over the full page.
pub fn tidal_maps(data: &TidalMapsData) -> Figure {
    let [kappa, gamma1, gamma2] = data.centre;
    let maps =
        [(data.convergence, kappa, "κ"), (data.gamma1, gamma1, "γ_{1}"), (data.gamma2, gamma2, "γ_{2}")];
    let maps = maps.map(|(grid, centre, label)| {
        (grid, ColourMap::Diverging, Norm::symmetric_about(centre, grid.values, COVERAGE), label)
    });
    map_row("Convergence and shear of the line of sight", maps, data.einstein_radius_arcsec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_and_missing_pixels_stay_blank() {
        let grid = GridData::square(&[f64::NAN, 1.0], 2, 1.0);
        let empty = GridData::square(&[], 0, 0.0);
        let data = TidalMapsData {
            convergence: grid,
            gamma1: empty,
            gamma2: grid,
            centre: [0.0, f64::NAN, 1.0],
            einstein_radius_arcsec: 0.0,
        };
        let svg = tidal_maps(&data).to_svg();
        assert!(svg.contains("no data") && !svg.contains("<ellipse"));
    }
}
