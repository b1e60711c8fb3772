//! Maps of convergence and shear over the field of the image.

use super::{GridData, map_row};
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
    let grids = [data.convergence, data.gamma1, data.gamma2];
    let maps =
        grids.into_iter().zip(data.centre).zip(["κ", "γ_{1}", "γ_{2}"]).map(|((grid, centre), label)| {
            (grid, ColourMap::Diverging, Norm::symmetric_about(centre, grid.values, COVERAGE), label)
        });
    map_row("Convergence and shear of the line of sight", maps.collect(), data.einstein_radius_arcsec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_and_missing_pixels_stay_blank() {
        let grid = GridData { values: &[f64::NAN, 1.0], nx: 2, ny: 2, extent_arcsec: [-1.0, 1.0, -1.0, 1.0] };
        let empty = GridData { values: &[], nx: 0, ny: 0, extent_arcsec: [0.0; 4] };
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
