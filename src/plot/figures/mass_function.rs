//! Halo mass function: number per volume and ln M against M200c, relations as curves, drawn haloes as points.

use crate::plot::{Axis, Colour, Corner, Dash, ErrorBars, Figure, Line, Mark, Panel, Stroke};

/// One published relation, tabulated.
#[derive(Debug, Clone, Copy)]
pub struct MassFunctionCurve<'a> {
    /// Text in the legend.
    pub name: &'a str,
    /// Masses M200c.
    pub m200c_msun: &'a [f64],
    /// dn/dlnM at these masses, per comoving volume.
    pub dn_dlnm_per_cmpc3: &'a [f64],
}

/// Haloes of a realisation, counted in mass bins.
#[derive(Debug, Clone, Copy)]
pub struct DrawnHaloes<'a> {
    /// Text in the legend.
    pub name: &'a str,
    /// Edges of the bins, one more than counts.
    pub m200c_edges_msun: &'a [f64],
    /// Number of haloes in each bin.
    pub counts: &'a [f64],
    /// Comoving volume in which haloes of each bin were kept.
    pub volume_cmpc3: &'a [f64],
}

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct MassFunctionData<'a> {
    /// Relations, the main one first.
    pub curves: &'a [MassFunctionCurve<'a>],
    /// Drawn haloes.
    pub drawn: Option<DrawnHaloes<'a>>,
}

/// Draws the mass function, one column wide.
///
/// Points are N/(V Δln M) at the geometric mean of the bin's edges, with Poisson errors √N/(V Δln M).
pub fn mass_function(data: &MassFunctionData) -> Figure {
    let curve = |(n, curve): (usize, &MassFunctionCurve)| {
        let stroke = Stroke { colour: Colour::of_curve(n), width_pt: 1.1, dash: Dash::of_curve(n) };
        let (x, y) = (curve.m200c_msun.to_vec(), curve.dn_dlnm_per_cmpc3.to_vec());
        Mark::Line(Line { x, y, stroke, legend: curve.name.into() })
    };
    let mut panel = Panel {
        marks: data.curves.iter().enumerate().map(curve).collect(),
        legend: Corner::BottomLeft,
        ..Panel::new(Axis::log("M_{200c} [M_{⊙}]"), Axis::log("dn/dlnM [Mpc^{−3}]"))
    };
    panel.marks.extend(data.drawn.as_ref().map(points));
    Figure { panels: vec![panel], panel_aspect: 0.8, ..Figure::one_column("Halo mass function") }
}

fn points(drawn: &DrawnHaloes) -> Mark {
    let (mut x, mut y, mut low, mut high) = (vec![], vec![], vec![], vec![]);
    let bins = drawn.m200c_edges_msun.windows(2).zip(drawn.counts).zip(drawn.volume_cmpc3);
    for ((edges, &count), &volume_cmpc3) in bins.filter(|((_, count), _)| **count > 0.0) {
        let per_count = 1.0 / (volume_cmpc3 * (edges[1] / edges[0]).ln());
        x.push((edges[0] * edges[1]).sqrt());
        y.push(count * per_count);
        low.push((count - count.sqrt()) * per_count);
        high.push((count + count.sqrt()) * per_count);
    }
    Mark::ErrorBars(ErrorBars { x, y, low, high, colour: Colour::BLACK, legend: drawn.name.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_carry_the_density_and_its_poisson_error() {
        let drawn = DrawnHaloes {
            name: "drawn",
            m200c_edges_msun: &[1e10, 1e12, 1e14],
            counts: &[100.0, 0.0],
            volume_cmpc3: &[50.0, 50.0],
        };
        let Mark::ErrorBars(bars) = points(&drawn) else { panic!() };
        let density = 100.0 / (50.0 * 100f64.ln());
        assert_eq!(bars.x, [1e11]);
        assert!((bars.y[0] / density - 1.0).abs() < 1e-12);
        assert!((bars.high[0] / density - 1.1).abs() < 1e-12 && (bars.low[0] / density - 0.9).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_show_gives_an_empty_panel() {
        let figure = mass_function(&MassFunctionData { curves: &[], drawn: None });
        assert!(figure.to_svg().contains("no data"));
    }
}
