//! Halo mass function: number per volume and ln M against M200c, the relation as a curve, drawn haloes as points.

use crate::plot::{Axis, Colour, Corner, Figure, Mark, Panel, Shape, Stroke, points};

/// Haloes of a realisation, counted in bins of M200c.
#[derive(Debug, Clone, Copy)]
pub struct DrawnHaloes<'a> {
    /// Edges of the bins, one more than counts.
    pub edges_msun: &'a [f64],
    pub counts: &'a [f64],
    /// Comoving volume in which haloes of each bin were kept.
    pub volume_cmpc3: &'a [f64],
}

/// Draws a relation, dn/dlnM per comoving volume at masses M200c, and the haloes drawn from it, one column wide.
///
/// Points are N/(V Δln M) at the geometric mean of the bin's edges, with Poisson errors √N/(V Δln M).
pub fn mass_function(
    name: &str,
    m200c_msun: &[f64],
    dn_dlnm_per_cmpc3: &[f64],
    drawn: Option<DrawnHaloes>,
) -> Figure {
    let relation = Mark::line(points(m200c_msun, dn_dlnm_per_cmpc3), Stroke::solid(Colour::BLUE, 1.1));
    let drawn = drawn.map(|drawn| {
        let bars = Shape::ErrorBars { points: densities(&drawn), colour: Colour::BLACK };
        Mark::from(bars).named("haloes of this run")
    });
    let (x, y) = (Axis::log("M_{200c} [M_{⊙}]"), Axis::log("dn/dlnM [Mpc^{−3}]"));
    let panel = Panel::new(x, y, [relation.named(name)].into_iter().chain(drawn));
    Figure::one_column("Halo mass function", 0.8, Panel { legend: Corner::BottomLeft, ..panel })
}

/// Mass, density and the ends of its error bar for every bin that is not empty.
fn densities(drawn: &DrawnHaloes) -> Vec<[f64; 4]> {
    let bins = drawn.edges_msun.windows(2).zip(drawn.counts).zip(drawn.volume_cmpc3);
    let filled = bins.filter(|((_, count), _)| **count > 0.0);
    let point = |((edges, &count), &volume_cmpc3): ((&[f64], &f64), &f64)| {
        let per_count = 1.0 / (volume_cmpc3 * (edges[1] / edges[0]).ln());
        let at = |count: f64| count * per_count;
        [(edges[0] * edges[1]).sqrt(), at(count), at(count - count.sqrt()), at(count + count.sqrt())]
    };
    filled.map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_carry_the_density_and_its_poisson_error() {
        let (edges_msun, counts, volume_cmpc3) = (&[1e10, 1e12, 1e14], &[100.0, 0.0], &[50.0, 50.0]);
        let [[mass, y, low, high]] = densities(&DrawnHaloes { edges_msun, counts, volume_cmpc3 })[..] else {
            panic!()
        };
        let density = 100.0 / (50.0 * 100f64.ln());
        assert_eq!(mass, 1e11);
        for (got, wanted) in [(y, 1.0), (low, 0.9), (high, 1.1)] {
            assert!((got / density - wanted).abs() < 1e-12);
        }
    }
}
