//! Averages over a circle of functions that are singular at a point near it.

use super::quadrature::unit_rule;

/// Nodes of [`around`], with weights that add up to 1: a rule for ⟨f⟩ = ∫f dφ/2π whose nodes crowd about `nearest`, the angle at
/// which a singularity lies nearest to the circle, `distance` of the circle's radius away from it.
///
/// φ = nearest + δ sinh t with δ = `distance`: what varies over δ about that angle varies over 1 in t, however small δ is. 64
/// Gauss–Legendre nodes then have an error below 1e-8 of the largest value for δ from 1e-6 to 1, at which δ is limited.
pub fn around(nearest: f64, distance: f64) -> impl Iterator<Item = (f64, f64)> {
    let distance = distance.clamp(1e-6, 1.0);
    let end = (std::f64::consts::PI / distance).asinh();
    let rule = unit_rule();
    let half = rule.nodes.iter().zip(&rule.weights).map(move |(node, weight)| {
        let t = end * node;
        (distance * t.sinh(), weight * end * distance * t.cosh() / std::f64::consts::TAU)
    });
    half.flat_map(move |(angle, weight)| [(nearest - angle, weight), (nearest + angle, weight)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_near_the_circle_are_averaged() {
        // ⟨1/(1 − a e^{−i(φ−φ₀)})⟩ = 1, and ⟨1/|1 − a e^{iφ}|²⟩ = 1/(1 − a²), a pole 1 − a away.
        for a in [0.3, 0.9, 0.99, 0.9999] {
            let (mut weights, mut square) = (0.0, 0.0);
            for (angle, weight) in around(0.7, 1.0 - a) {
                let cos = (angle - 0.7).cos();
                weights += weight;
                square += weight / (1.0 - 2.0 * a * cos + a * a);
            }
            assert!((weights - 1.0).abs() < 1e-8, "{a}: {weights}");
            assert!((square * (1.0 - a * a) - 1.0).abs() < 1e-6, "{a}: {square}");
        }
    }
}
