//! What a tidal and a flexion model leave of a traced cone, in β and in the image.

use super::grid::{GridData, einstein_circle};
use crate::plot::{
    Axis, Colour, ColourMap, ColourScale, Corner, Figure, Line, Mark, Norm, Panel, Scatter, Side, Stroke,
};

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct TidalResidualsData<'a> {
    /// |β_traced − β_model| of the tidal model for one cone, arcsec.
    pub tidal: GridData<'a>,
    /// The same of the flexion model.
    pub flexion: GridData<'a>,
    /// (image through the cone − image through the tidal model)/σ of that cone.
    pub tidal_image: GridData<'a>,
    /// The same of the flexion model.
    pub flexion_image: GridData<'a>,
    /// Image χ² of the tidal model for every cone.
    pub tidal_chi_squared: &'a [f64],
    /// Image χ² of the flexion model for every cone.
    pub flexion_chi_squared: &'a [f64],
    /// Rms residual of the tidal model for every cone, arcsec.
    pub tidal_rms_arcsec: &'a [f64],
    /// Rms residual of the flexion model for every cone, arcsec.
    pub flexion_rms_arcsec: &'a [f64],
    /// Radius of the dashed circle.
    pub einstein_radius_arcsec: f64,
}

/// Fraction of the pixels whose values lie within the colour bar.
const COVERAGE: f64 = 0.99;

/// Above both residuals in β of one cone in one stretch and the rms of all cones against each other, below the same of
/// the image.
pub fn tidal_residuals(data: &TidalResidualsData) -> Figure {
    let both: Vec<f64> = data.tidal.values.iter().chain(data.flexion.values).copied().collect();
    let colours = ColourScale { map: ColourMap::Magma, norm: Norm::log_of(&both, COVERAGE) };
    let map = |column: usize, grid: GridData, name: &str| {
        let label = format!("|β − β_{{{name}}}| [arcsec]");
        let mut panel = grid.panel_with_bar(colours, column, label, Side::Top);
        panel.marks.extend(einstein_circle(data.einstein_radius_arcsec, ColourMap::Magma));
        panel
    };
    let panels = vec![
        map(0, data.tidal, "tidal"),
        map(1, data.flexion, "flexion"),
        comparison(data.tidal_rms_arcsec, data.flexion_rms_arcsec, "rms of the", "[arcsec]"),
        image_panel(0, data.tidal_image, "tidal"),
        image_panel(1, data.flexion_image, "flexion"),
        comparison(data.tidal_chi_squared, data.flexion_chi_squared, "image χ^{2} of the", ""),
    ];
    Figure {
        columns: 3,
        panel_aspect: data.tidal.aspect(),
        panels,
        ..Figure::full_width("Residuals of the tidal and flexion models")
    }
}

/// One difference image, in a stretch of its own: the two differ by orders of magnitude.
fn image_panel(column: usize, grid: GridData, name: &str) -> Panel {
    let norm = Norm::symmetric_about(0.0, grid.values, 1.0);
    let label = format!("(image − image_{{{name}}})/σ");
    grid.panel_with_bar(ColourScale { map: ColourMap::Diverging, norm }, column, label, Side::Top)
}

/// Tidal against flexion, one point a cone.
fn comparison(tidal: &[f64], flexion: &[f64], what: &str, unit: &str) -> Panel {
    let finite =
        |values: &[f64]| values.iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect::<Vec<_>>();
    let all = [finite(tidal), finite(flexion)].concat();
    let low = all.iter().copied().fold(f64::INFINITY, f64::min);
    let high = all.iter().copied().fold(0.0, f64::max);
    let equal = Line {
        x: vec![low, high],
        y: vec![low, high],
        stroke: Stroke::dashed(Colour::BLACK, 0.8),
        legend: "equal".into(),
    };
    let cones = Scatter {
        x: tidal.to_vec(),
        y: flexion.to_vec(),
        colour: Colour::BLUE,
        radius_pt: 1.2,
        opacity: 0.8,
        legend: "one cone each".into(),
    };
    Panel {
        marks: vec![Mark::Line(equal), Mark::Scatter(cones)],
        legend: Corner::TopLeft,
        ..Panel::new(
            Axis::log(&format!("{what} tidal model {unit}")),
            Axis::log(&format!("{what} flexion model {unit}")),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_rays_and_cones_are_left_out() {
        let grid = GridData::square(&[f64::NAN, 1e-3, 2e-3, 1e-4], 2, 1.0);
        let data = TidalResidualsData {
            tidal: grid,
            flexion: grid,
            tidal_image: grid,
            flexion_image: grid,
            tidal_chi_squared: &[1.0, 2.0],
            flexion_chi_squared: &[0.1, 0.2],
            tidal_rms_arcsec: &[1e-3, f64::NAN],
            flexion_rms_arcsec: &[1e-4, 2e-4],
            einstein_radius_arcsec: 0.5,
        };
        let figure = tidal_residuals(&data);
        assert_eq!(figure.panels.len(), 6);
        assert!(!figure.to_svg().contains("NaN"));
    }
}
