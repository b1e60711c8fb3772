//! Gauss–Legendre quadrature with 32 nodes, computed once for the whole program.

use std::num::NonZeroUsize;
use std::sync::LazyLock;

use gauss_quad::GaussLegendre;

/// Number of nodes of [`UnitRule`].
pub const NODES: usize = 32;

/// The 32-node Gauss–Legendre rule on [0, 1]: ∫₀¹ f(t) dt ≈ Σ wᵢ f(tᵢ).
///
/// Exact for polynomials up to degree 63. For a function analytic inside the Bernstein ellipse of
/// parameter ρ about the interval the error falls as ρ⁻⁶⁴ (Trefethen 2008, SIAM Rev. 50, 67).
#[derive(Debug)]
pub struct UnitRule {
    /// Nodes tᵢ in (0, 1), ascending.
    pub nodes: [f64; NODES],
    /// Weights wᵢ; they add up to 1.
    pub weights: [f64; NODES],
}

static UNIT_RULE: LazyLock<UnitRule> = LazyLock::new(|| {
    let rule = GaussLegendre::new(NonZeroUsize::MIN.saturating_add(NODES - 1));
    let mut unit = UnitRule { nodes: [0.0; NODES], weights: [0.0; NODES] };
    for (i, &(node, weight)) in rule.as_node_weight_pairs().iter().enumerate() {
        unit.nodes[i] = 0.5 * (1.0 + node);
        unit.weights[i] = 0.5 * weight;
    }
    unit
});

/// The shared 32-node rule on [0, 1].
pub fn unit_rule() -> &'static UnitRule {
    &UNIT_RULE
}

impl UnitRule {
    /// ∫₀¹ f(t) dt.
    #[inline]
    pub fn integrate_unit(&self, integrand: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for i in 0..NODES {
            sum += self.weights[i] * integrand(self.nodes[i]);
        }
        sum
    }
}

/// ∫ₐᵇ f(x) dx in `panels` equal panels of 32 Gauss–Legendre nodes each.
///
/// ```
/// let half_sine = haloray::numerics::quadrature::integrate(0.0, std::f64::consts::PI, 1, f64::sin);
/// assert!((half_sine - 2.0).abs() < 1e-14);
/// ```
pub fn integrate(low: f64, high: f64, panels: usize, integrand: impl Fn(f64) -> f64) -> f64 {
    let width = (high - low) / panels as f64;
    let rule = unit_rule();
    (0..panels)
        .map(|panel| {
            let start = low + width * panel as f64;
            width * rule.integrate_unit(|t| integrand(start + width * t))
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_63_is_exact() {
        let value = integrate(0.0, 1.0, 1, |x| 64.0 * x.powi(63));
        assert!((value - 1.0).abs() < 1e-14, "{value}");
    }

    #[test]
    fn a_polynomial_of_high_degree_needs_panels() {
        let exact = 1.0;
        let one = integrate(0.0, 1.0, 1, |x| 2001.0 * x.powi(2000));
        let sixty_four = integrate(0.0, 1.0, 64, |x| 2001.0 * x.powi(2000));
        assert!((one - exact).abs() > 1e-6, "{one}");
        assert!((sixty_four - exact).abs() < 1e-12, "{sixty_four}");
    }

    #[test]
    fn nodes_ascend_inside_the_interval_and_weights_add_up_to_one() {
        let rule = unit_rule();
        assert!(rule.nodes.is_sorted() && rule.nodes[0] > 0.0 && rule.nodes[NODES - 1] < 1.0);
        assert!((rule.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
