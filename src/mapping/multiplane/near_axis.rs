//! The axis ray and two beside it, with all derivatives that tensors and flexions need, in one pass through the planes.

use super::line_of_sight::LineOfSight;
use super::recursion::{FEW, FewRays, RaysTogether};
use crate::error::{Error, Result};

/// Jacobian (a_xx, a_xy, a_yx, a_yy) and b_ijk = ∂²β_i/∂θ_j∂θ_k per arcsec of one ray, and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayDerivatives {
    /// β, arcsec.
    pub beta_arcsec: [f64; 2],
    /// A.
    pub jacobian: [f64; 4],
    /// (b_xxx, b_xxy, b_xyy, b_yxx, b_yxy, b_yyy).
    pub second_per_arcsec: [f64; 6],
}

/// What is known of a line of sight on its axis and beside it, bit by bit what its segments say of these rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearAxis {
    /// The axis ray from observer to lens.
    pub od: RayDerivatives,
    /// From observer to source.
    pub os: RayDerivatives,
    /// From lens to source, about the ray that the observer sees on the axis.
    pub ds: RayDerivatives,
    /// ∂²β/∂θ_j∂σ_k of the axis ray, symmetrised, for a change σ of its slope at the lens: per arcsec, as b_ijk.
    pub mixed_per_arcsec: [f64; 6],
    /// Two more rays from observer to source.
    pub beside: [RayDerivatives; 2],
}

/// Rays of the block: three that meet no lens, and the axis ray stopped at it: as it is, with another slope from there on,
/// and with derivatives by that slope alone. The lanes left over repeat the last.
const AXIS: usize = 0;
const BESIDE: [usize; 2] = [1, 2];
const STOPPED: usize = 3;
const KICKED: usize = 4;
const FROM_LENS: usize = 5;

impl LineOfSight {
    /// Traces the axis ray and two of directions `beside`, with a lens plane at `z_lens`.
    ///
    /// A change of the slope that goes with the direction has the second derivatives b_θθ + 2b_θσ + b_σσ, of which the first
    /// and the last are known.
    ///
    /// # Errors
    /// When the lens is not between observer and source.
    pub fn near_axis(&self, z_lens: f64, beside: [[f64; 2]; 2]) -> Result<NearAxis> {
        let (chi_lens, chi_source) = (self.distance(z_lens)?, self.chi_source_cmpc);
        if chi_lens >= chi_source {
            return Err(Error::out_of_range("z_lens", z_lens, "below z_source"));
        }
        let (nearer, farther) =
            self.planes.split_at(self.planes.partition_point(|plane| plane.chi_cmpc < chi_lens));
        let mut rays = FewRays::start(0.0, [0.0; 2], [0.0; 2], &[[0.0; 2], beside[0], beside[1], [0.0; 2]]);
        rays.through::<2>(nearer);
        let mut stopped = rays.clone();
        stopped.advance::<2>(chi_lens);
        let at_lens = self.origin(chi_lens);
        let od = of(&stopped, STOPPED, at_lens.x, chi_lens);
        (FROM_LENS..FEW).for_each(|i| stopped.forget_derivatives(i));
        for i in KICKED..FEW {
            stopped.by_theta.ds[0][i] += 1.0;
            stopped.by_theta.ds[3][i] += 1.0;
        }
        // A stop divides a step in two, which rounds otherwise: the first three rays make it in one.
        let next = farther.first().map_or(chi_source, |plane| plane.chi_cmpc);
        rays.advance::<2>(next);
        stopped.advance::<2>(next);
        (STOPPED..FEW).for_each(|i| rays.take(i, &stopped));
        rays.through::<2>(farther);
        rays.advance::<2>(chi_source);
        let origin = self.origin(chi_source).x;
        let length = chi_source - chi_lens;
        let second = |i: usize, c: usize| rays.by_theta.d2x[c][i] / chi_source;
        let mixed = |c| 0.5 * (second(KICKED, c) - second(STOPPED, c) - second(FROM_LENS, c));
        Ok(NearAxis {
            od,
            os: of(&rays, AXIS, origin, chi_source),
            ds: of(&rays, FROM_LENS, rays.position(FROM_LENS), length),
            mixed_per_arcsec: std::array::from_fn(mixed),
            beside: BESIDE.map(|i| of(&rays, i, origin, chi_source)),
        })
    }
}

/// Ray `i` as seen from a start so far away.
fn of<const N: usize>(
    rays: &RaysTogether<N>,
    i: usize,
    origin: [f64; 2],
    length_cmpc: f64,
) -> RayDerivatives {
    RayDerivatives {
        beta_arcsec: [0, 1].map(|c| (rays.x[c][i] - origin[c]) / length_cmpc),
        jacobian: std::array::from_fn(|c| rays.by_theta.dx[c][i] / length_cmpc),
        second_per_arcsec: std::array::from_fn(|c| rays.by_theta.d2x[c][i] / length_cmpc),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::halo::{HaloCatalogue, HaloMasses};
    use crate::mapping::multiplane::{Reference, Segment, Sheets};
    use crate::mapping::{Mapping, Order};

    /// Haloes about the axis, some of them truncated.
    fn haloes(number: usize) -> HaloCatalogue {
        let column = |low: f64, high: f64, stride: f64| -> Vec<f64> {
            (0..number).map(|i| low + (high - low) * (i as f64 * stride).fract()).collect()
        };
        let masses = HaloMasses::Angles {
            r_s_arcsec: column(0.2, 9.0, 0.391),
            alpha_rs_arcsec: column(0.001, 0.03, 0.737),
        };
        let theta = [column(-20.0, 20.0, 0.618), column(-15.0, 25.0, 0.271)];
        let z = column(0.05, 1.45, 0.529);
        let mut haloes = HaloCatalogue::new(1.5, &Background::paper(), z, theta, masses).unwrap();
        let radii = (0..number).map(|i| if i % 3 == 0 { f64::INFINITY } else { 4.0 + i as f64 });
        haloes.r_trunc_arcsec = Some(radii.collect());
        haloes
    }

    fn assert_is_ray(segment: &Segment, theta: [f64; 2], got: &RayDerivatives, what: &str) {
        let wanted = segment.map(&[theta], Order::SecondDerivatives);
        assert_eq!(got.beta_arcsec, wanted.beta_arcsec[0], "{what}");
        assert_eq!(got.jacobian, wanted.jacobian[0], "{what}");
        assert_eq!(got.second_per_arcsec, wanted.second_per_arcsec[0], "{what}");
    }

    #[test]
    fn rays_are_those_of_the_segments_bit_by_bit() {
        for (number, z_lens) in [(0, 0.5), (1, 0.5), (60, 0.5), (61, 1.4999), (40, 0.01)] {
            for reference in [Reference::Bent, Reference::Straight] {
                for sheets in [Sheets::OnAxis, Sheets::OnRay, Sheets::None] {
                    let sight = LineOfSight::along(reference, &haloes(number), &sheets).unwrap();
                    let beside = [[1.0, 0.0], [0.0, 1.3]];
                    let near = sight.near_axis(z_lens, beside).unwrap();
                    let os = sight.observer_to_source();
                    assert_is_ray(&os, [0.0; 2], &near.os, "os");
                    assert_is_ray(&sight.observer_to(z_lens).unwrap(), [0.0; 2], &near.od, "od");
                    assert_is_ray(&sight.to_source_from(z_lens).unwrap(), [0.0; 2], &near.ds, "ds");
                    for (theta, got) in beside.iter().zip(&near.beside) {
                        assert_is_ray(&os, *theta, got, "beside");
                    }
                }
            }
        }
    }

    #[test]
    fn mixed_derivatives_are_differences_of_jacobians_behind_a_lens() {
        use crate::mapping::multiplane::RaysAtPlane;
        use crate::monitor::Silent;
        let (z_lens, step) = (0.5, 1e-3);
        let sight = LineOfSight::new(&haloes(60), &Sheets::OnAxis).unwrap();
        let mixed = sight.near_axis(z_lens, [[0.0; 2]; 2]).unwrap().mixed_per_arcsec;
        // ∂²β_i/∂θ_j∂σ_k, by θ in steps and by σ exactly.
        let by_slope = |theta: [f64; 2]| {
            let rays: RaysAtPlane = sight.rays_at(z_lens, &[theta], &Silent).unwrap();
            sight.onwards(z_lens, &rays, Order::Jacobian, &Silent).unwrap().jacobian[0]
        };
        let of = |i: usize, j: usize, k: usize| {
            let moved = |by: f64| by_slope([0, 1].map(|c| if c == j { by } else { 0.0 }))[2 * i + k];
            (moved(step) - moved(-step)) / (2.0 * step)
        };
        for (c, (i, j, k)) in
            [(0, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 0), (1, 0, 1), (1, 1, 1)].into_iter().enumerate()
        {
            let wanted = 0.5 * (of(i, j, k) + of(i, k, j));
            assert!(
                (mixed[c] - wanted).abs() < 1e-5 * mixed[c].abs().max(0.01),
                "{c}: {} {wanted}",
                mixed[c]
            );
        }
    }
}
