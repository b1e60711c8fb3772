//! κ_h, γ_h, F_h, G_h and Δ_h of every halo on its own.

use nalgebra::Complex;
use rayon::prelude::*;

use super::ring_and_disc::{OnRing, RingAndDisc, evenly, flexion};
use super::variation::ShearVariation;
use crate::error::Domain;
use crate::halo::HaloCatalogue;
use crate::numerics::circle_rule;
use crate::profile::mass::{MassModel, MassProfile};

/// Distortions that each halo alone causes on a ray (os), column by column, in catalogue order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HaloTidal {
    /// Convergence κ_h.
    pub kappa: Vec<f64>,
    /// Shear γ_h.
    pub gamma: Vec<Complex<f64>>,
    /// F-type flexion per arcsec.
    pub f_per_arcsec: Vec<Complex<f64>>,
    /// G-type flexion per arcsec.
    pub g_per_arcsec: Vec<Complex<f64>>,
    /// Relative variation Δ_h of the shear across the scale asked for.
    pub delta: Vec<f64>,
    /// Averages over the ring of that scale about the axis, and over the disc inside it; none along another ray.
    pub averages: Vec<RingAndDisc>,
}

/// κ_h of every halo and whether it is in the tidal regime, and nothing else: what sightlines by the thousand need.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JudgedHaloes {
    /// Convergence κ_h.
    pub kappa: Vec<f64>,
    /// Whether Δ_h lies below the threshold.
    pub is_tidal: Vec<bool>,
}

impl JudgedHaloes {
    /// Judges every halo where a ray meets its plane in the direction `ray(i)`, as [`HaloTidal::along`] would.
    ///
    /// The shear of a round lens whose density falls outwards falls no faster than r⁻², and that of these haloes rises no
    /// faster than r² (a test looks), so that it changes by 2|γ|/r at most in any direction; a step of θ_E = x r then changes
    /// it by |γ|[(1 − x)⁻² − 1] at most, and Δ_h ≤ √2[(1 − x)⁻² − 1]. A halo of which that is below the threshold is not
    /// evaluated for it.
    ///
    /// # Errors
    /// As [`HaloTidal::of`].
    pub fn along(
        haloes: &HaloCatalogue,
        theta_e_arcsec: f64,
        threshold: f64,
        ray: impl Fn(usize) -> [f64; 2] + Sync,
    ) -> crate::Result<Self> {
        /// Roundings of Δ_h.
        const MARGIN: f64 = 1.0 - 1e-6;
        // Where the bound is the threshold: 1 − x = (1 + Δ/√2)^(−1/2).
        let part = 1.0 - (1.0 + threshold / std::f64::consts::SQRT_2).sqrt().recip();
        let beyond = (theta_e_arcsec / (part * MARGIN)).powi(2);
        let is_tidal = |i: usize| {
            let [x, y] = ray(i);
            let [dx, dy] = [haloes.theta_x_arcsec[i] - x, haloes.theta_y_arcsec[i] - y];
            if dx * dx + dy * dy > beyond {
                return Ok(true);
            }
            let variation = shear_variation(&haloes.profile(i)?, [x, y], theta_e_arcsec);
            Ok(variation.delta < threshold)
        };
        let is_tidal = (0..haloes.len()).into_par_iter().map(is_tidal).collect::<crate::Result<_>>()?;
        Ok(Self { kappa: haloes.convergences(ray)?, is_tidal })
    }
}

impl HaloTidal {
    /// Evaluates every halo at 0, θ_E x̂ and θ_E ŷ and on the ring of θ_E; all derivatives are analytic.
    ///
    /// # Errors
    /// When a halo of the catalogue has parameters that no profile allows.
    pub fn of(haloes: &HaloCatalogue, theta_e_arcsec: f64) -> crate::Result<Self> {
        let averages = |i: usize| {
            let halo = [haloes.theta_x_arcsec[i], haloes.theta_y_arcsec[i]];
            Ok(averages(&haloes.profile(i)?, halo, theta_e_arcsec))
        };
        let averages = (0..haloes.len()).into_par_iter().map(averages).collect::<crate::Result<_>>()?;
        Ok(Self { averages, ..Self::along(haloes, theta_e_arcsec, |_| [0.0; 2])? })
    }

    /// As [`Self::of`] without averages, where a ray meets the plane of halo `i` in the direction `ray(i)` instead of 0.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn along(
        haloes: &HaloCatalogue,
        theta_e_arcsec: f64,
        ray: impl Fn(usize) -> [f64; 2] + Sync,
    ) -> crate::Result<Self> {
        let row = |i: usize| {
            let (profile, ray) = (haloes.profile(i)?, ray(i));
            Ok((shear_variation(&profile, ray, theta_e_arcsec), flexion_at(&profile, ray)))
        };
        let rows: Vec<_> = (0..haloes.len()).into_par_iter().map(row).collect::<crate::Result<_>>()?;
        let mut columns = Self { kappa: haloes.convergences(ray)?, ..Self::default() };
        for (variation, [f, g]) in rows {
            columns.gamma.push(variation.gamma);
            columns.f_per_arcsec.push(f);
            columns.g_per_arcsec.push(g);
            columns.delta.push(variation.delta);
        }
        Ok(columns)
    }

    /// True for haloes with Δ_h below `threshold`: those in the tidal regime.
    pub fn within(&self, threshold: f64) -> Vec<bool> {
        self.delta.iter().map(|delta| *delta < threshold).collect()
    }
}

/// The variation of a halo's shear over θ_E where a ray meets its plane.
pub fn shear_variation(profile: &MassModel, [x, y]: [f64; 2], theta_e: f64) -> ShearVariation {
    let shears = [(x, y), (x + theta_e, y), (x, y + theta_e)].map(|(x, y)| shear(profile, x, y));
    ShearVariation::of_shears(shears[0], shears[1], shears[2])
}

fn flexion_at(profile: &MassModel, [x, y]: [f64; 2]) -> [Complex<f64>; 2] {
    flexion(profile.third_derivatives(x, y))
}

/// Averages about the axis, which passes a halo at the offset `halo` seen from it.
///
/// With N places the error is about (R/d)^(N−2) of a halo at distance d, or the inverse inside the ring: 1e-6 and less. Nearer
/// to the ring than half its radius a rule is taken whose places crowd at the halo.
fn averages(profile: &MassModel, halo: [f64; 2], radius: f64) -> RingAndDisc {
    RingAndDisc::of(radius, places(halo, radius).into_iter(), |[cos, sin]| {
        let [x, y] = [radius * cos, radius * sin];
        let [f_per_arcsec, g_per_arcsec] = flexion_at(profile, [x, y]);
        let [alpha_x, alpha_y] = profile.deflection(x, y);
        let (deflection, gamma) = (Complex::new(alpha_x, alpha_y), shear(profile, x, y));
        OnRing { deflection, gamma, f_per_arcsec, g_per_arcsec }
    })
}

/// Places on a ring as (cos φ, sin φ), with weights, that average what a halo at the offset `halo` from its middle does.
fn places(halo: [f64; 2], radius: f64) -> Vec<([f64; 2], f64)> {
    match halo[0].hypot(halo[1]) / radius {
        far if far > 10.0 => evenly(8).collect(),
        far if far > 4.0 => evenly(12).collect(),
        distance @ 0.5..2.0 => {
            let rule = circle_rule::around(halo[1].atan2(halo[0]), (distance - 1.0).abs());
            let place = |(angle, weight): (f64, f64)| {
                let (sin, cos) = angle.sin_cos();
                ([cos, sin], weight)
            };
            rule.map(place).collect()
        }
        _ => evenly(32).collect(),
    }
}

/// Shear γ_LOS = γ_od + γ_os − γ_ds to first order, averaged over the disc of a radius about a ray.
///
/// ⟨γ_LOS⟩ = Σ_h (w_od + 1 − w_ds) ⟨γ_h⟩ with the share of a halo's shear (reduced to the source) that works before the lens,
/// w_od = χ_s(χ_d − χ)/(χ_d(χ_s − χ)), and behind it, w_ds = χ_s(χ − χ_d)/(χ(χ_s − χ_d)); haloes in the plane of the lens
/// are part of it. ⟨γ_h⟩ = ⟨α_h e^{iφ}⟩/R over the edge of the disc (Green's theorem). `ray(i)` is where the ray meets the plane
/// of halo `i`, arcsec.
///
/// # Errors
/// As [`HaloTidal::of`]; when the lens is not in front of the source.
pub fn los_shear_in_disc(
    haloes: &HaloCatalogue,
    z_lens: f64,
    radius_arcsec: f64,
    ray: impl Fn(usize) -> [f64; 2] + Sync,
) -> crate::Result<Complex<f64>> {
    Domain::POSITIVE.check("radius of the disc", radius_arcsec)?;
    Domain::inside(0.0, haloes.z_source()).check("z_lens", z_lens)?;
    let [lens, source] = [z_lens, haloes.z_source()].map(|z| haloes.background().comoving_distance_mpc(z));
    let row = |i: usize| {
        let chi = haloes.chi_cmpc[i];
        let part = if chi == lens {
            return Ok(Complex::new(0.0, 0.0));
        } else if chi < lens {
            1.0 + source * (lens - chi) / (lens * (source - chi))
        } else {
            1.0 - source * (chi - lens) / (chi * (source - lens))
        };
        let (profile, [x, y]) = (haloes.profile(i)?, ray(i));
        let halo = [haloes.theta_x_arcsec[i] - x, haloes.theta_y_arcsec[i] - y];
        let mut sum = Complex::new(0.0, 0.0);
        for ([cos, sin], weight) in places(halo, radius_arcsec) {
            let [alpha_x, alpha_y] = profile.deflection(x + radius_arcsec * cos, y + radius_arcsec * sin);
            sum += Complex::new(alpha_x, alpha_y) * Complex::new(cos, sin) * weight;
        }
        Ok(sum * (part / radius_arcsec))
    };
    let rows: Vec<Complex<f64>> = (0..haloes.len()).into_par_iter().map(row).collect::<crate::Result<_>>()?;
    Ok(rows.into_iter().sum())
}

fn shear(profile: &MassModel, x: f64, y: f64) -> Complex<f64> {
    let [xx, xy, yy] = profile.hessian(x, y);
    Complex::new(0.5 * (xx - yy), xy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::Nfw;

    fn halo() -> MassModel {
        MassModel::Nfw(Nfw::new(0.7, 0.02, [3.0, -1.0]).unwrap())
    }

    #[test]
    fn flexion_regime_needs_two_not_one_half() {
        // Δ²/(θ_E²(|F|²+|G|²)/|γ|²) → 2 as θ_E → 0, to 1e-6; the printed ½ is off by a factor 4.
        let theta_e = 1e-7;
        let ([f, g], variation) =
            (flexion_at(&halo(), [0.0; 2]), shear_variation(&halo(), [0.0; 2], theta_e));
        let flexion = (f.norm_sqr() + g.norm_sqr()) / variation.gamma.norm_sqr();
        let factor = (variation.delta / theta_e).powi(2) / flexion;
        assert!((factor - 2.0).abs() < 2e-6, "{factor}");
        assert!((factor / 0.5 - 4.0).abs() < 1e-5);
    }

    #[test]
    fn flexion_equals_differences_of_shear_and_convergence() {
        let [f, g] = flexion_at(&halo(), [0.0; 2]);
        let h = 1e-4;
        let d = |x: f64, y: f64| (shear(&halo(), x, y) - shear(&halo(), -x, -y)) / (2.0 * h);
        let (dx, dy) = (d(h, 0.0), d(0.0, h));
        let i = Complex::<f64>::i();
        assert!(((dx - i * dy) * 0.5 - f).norm() < 1e-8 * f.norm());
        assert!(((dx + i * dy) * 0.5 - g).norm() < 1e-8 * g.norm());
    }

    #[test]
    fn haloes_that_are_not_evaluated_are_judged_as_if_they_were() {
        use crate::cosmology::Background;
        use crate::halo::HaloMasses;
        // Rings of haloes from next to the axis to far off, plain and truncated at every multiple of their scale radius.
        let number = 4000;
        let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..number).map(|i| f(f64::from(i))).collect() };
        let distance = |i: f64| 0.05 * 1.0025_f64.powf(i);
        let theta = [of(&|i| distance(i) * (1.7 * i).cos()), of(&|i| distance(i) * (1.7 * i).sin())];
        let masses = HaloMasses::Angles {
            r_s_arcsec: of(&|i| 0.02 * 4000_f64.powf((0.618 * i).fract())),
            alpha_rs_arcsec: of(&|_| 0.01),
        };
        let z = of(&|i| 0.1 + 1.3 * (0.271 * i).fract());
        let mut haloes = HaloCatalogue::new(1.5, &Background::paper(), z, theta, masses).unwrap();
        for truncated in [false, true] {
            if truncated {
                let radii =
                    |i: usize| haloes.r_s_arcsec[i] * 10f64.powf(3.0 * (0.39 * i as f64).fract() - 1.0);
                haloes.r_trunc_arcsec = Some((0..haloes.len()).map(radii).collect());
            }
            for (theta_e, threshold) in [(1.0, 0.1), (0.5, 0.03), (1.5, 0.3), (1.0, 0.8)] {
                let ray = |_| [0.3, -0.2];
                let judged = JudgedHaloes::along(&haloes, theta_e, threshold, ray).unwrap();
                let all = HaloTidal::along(&haloes, theta_e, ray).unwrap();
                assert_eq!(judged.kappa, all.kappa);
                assert_eq!(judged.is_tidal, all.within(threshold));
                for i in 0..haloes.len() {
                    let [x, y] = [haloes.theta_x_arcsec[i] - 0.3, haloes.theta_y_arcsec[i] + 0.2];
                    let part = (theta_e / x.hypot(y)).min(1.0);
                    let bound = std::f64::consts::SQRT_2 * ((1.0 - part).powi(-2) - 1.0);
                    assert!(all.delta[i] <= bound * (1.0 + 1e-6), "{i}: {} {bound}", all.delta[i]);
                }
                let tidal = judged.is_tidal.iter().filter(|is| **is).count();
                assert!(tidal > 300 && tidal < haloes.len() - 300, "{tidal}");
            }
        }
    }

    #[test]
    fn averages_are_those_of_many_places_in_the_disc_and_on_the_ring() {
        let radius = 1.2;
        for centre in [[3.0, -1.0], [0.3, 0.2], [0.9, 0.4], [14.0, 2.0]] {
            let halo = MassModel::Nfw(Nfw::new(0.7, 0.02, centre).unwrap());
            let got = averages(&halo, centre, radius);
            let zero = Complex::new(0.0, 0.0);
            let mean = |places: &[[f64; 2]], of: &dyn Fn([f64; 2]) -> Complex<f64>| {
                places.iter().fold(zero, |sum, at| sum + of(*at)) / places.len() as f64
            };
            let turned = |r: f64, k: usize, n: usize| {
                let (sin, cos) = (std::f64::consts::TAU * (k as f64 + 0.3) / n as f64).sin_cos();
                [r * cos, r * sin]
            };
            // Rings of equal area; next to a cusp they are good to half a per cent.
            let disc: Vec<[f64; 2]> = (0..400 * 400)
                .map(|k| turned(radius * (((k / 400) as f64 + 0.5) / 400.0).sqrt(), k % 400, 400))
                .collect();
            let ring: Vec<[f64; 2]> = (0..4000).map(|k| turned(radius, k, 4000)).collect();
            let gamma = |at: [f64; 2]| shear(&halo, at[0], at[1]);
            for (places, got, tolerance) in [(&ring, got.ring, 2e-6), (&disc, got.disc, 1e-2)] {
                let size = mean(places, &|at| Complex::from(flexion_at(&halo, at)[0].norm())).norm();
                let gaps = [
                    (mean(places, &gamma) - got.gamma).norm() / got.gamma.norm().max(size),
                    (mean(places, &|at| flexion_at(&halo, at)[0]) - got.f_per_arcsec).norm() / size,
                    (mean(places, &|at| flexion_at(&halo, at)[1]) - got.g_per_arcsec).norm() / size,
                ];
                assert!(gaps.iter().all(|gap| *gap < tolerance), "{centre:?} {gaps:?}");
            }
        }
    }

    #[test]
    fn smoothed_shear_is_that_of_the_lines_of_sight_in_the_disc() {
        use crate::cosmology::Background;
        use crate::halo::HaloMasses;
        use crate::mapping::multiplane::{LineOfSight, Sheets};
        use crate::mapping::{Mapping, Order};
        let (z_lens, radius) = (0.5, 6.0);
        // So weak that γ_LOS is linear to 1e-4 of itself; before, in and behind the plane of the lens, in and beside the disc.
        let angles = HaloMasses::Angles {
            r_s_arcsec: vec![2.0, 1.0, 3.0, 2.0, 1.5],
            alpha_rs_arcsec: vec![2e-4, 1e-4, 3e-4, 2e-4, 4e-4],
        };
        let at = [vec![3.0, 9.0, -4.0, 1.0, 0.5], vec![1.0, -7.0, 5.5, 2.0, -3.0]];
        let z = vec![0.2, 0.35, 0.8, 0.5, 1.2];
        let haloes = HaloCatalogue::new(1.5, &Background::paper(), z, at, angles).unwrap();
        let got = los_shear_in_disc(&haloes, z_lens, radius, |_| [0.0; 2]).unwrap();
        let sight = LineOfSight::new(&haloes, &Sheets::None).unwrap().without_plane_at(z_lens).unwrap();
        // Rings of equal area; a ray to each place, on to the source, and a straight one on from the lens.
        let n = 200;
        let place = |k: usize| {
            let r = radius * (((k / n) as f64 + 0.5) / n as f64).sqrt();
            let (sin, cos) = (std::f64::consts::TAU * (k % n) as f64 / n as f64).sin_cos();
            [r * cos, r * sin]
        };
        let theta: Vec<[f64; 2]> = (0..n * n).map(place).collect();
        let mean = |jacobians: Vec<[f64; 4]>| {
            let shear = |a: &[f64; 4]| Complex::new(0.5 * (a[3] - a[0]), -0.5 * (a[1] + a[2]));
            jacobians.iter().map(shear).sum::<Complex<f64>>() / jacobians.len() as f64
        };
        let to_lens = mean(sight.observer_to(z_lens).unwrap().map(&theta, Order::Jacobian).jacobian);
        let to_source = mean(sight.observer_to_source().map(&theta, Order::Jacobian).jacobian);
        let chi = |z: f64| Background::paper().comoving_distance_mpc(z);
        let (lens, source) = (chi(z_lens), chi(1.5));
        let mut behind = Complex::new(0.0, 0.0);
        for i in [2, 4] {
            let (profile, chi) = (haloes.profile(i).unwrap(), haloes.chi_cmpc[i]);
            let own = theta.iter().map(|[x, y]| shear(&profile, *x, *y)).sum::<Complex<f64>>();
            behind += own / (n * n) as f64 * (source * (chi - lens) / (chi * (source - lens)));
        }
        let want = to_lens + to_source - behind;
        assert!((got - want).norm() < 5e-3 * want.norm(), "{got} {want}");
        assert!(los_shear_in_disc(&haloes, 1.6, radius, |_| [0.0; 2]).is_err());
    }

    #[test]
    fn far_from_a_halo_all_three_variations_are_one() {
        let halo = MassModel::Nfw(Nfw::new(0.7, 0.02, [200.0, 90.0]).unwrap());
        let averages = averages(&halo, [200.0, 90.0], 1.0);
        let point = shear_variation(&halo, [0.0; 2], 1.0);
        for delta in [averages.ring.delta, averages.disc.delta] {
            assert!((delta / point.delta - 1.0).abs() < 0.01, "{delta} {}", point.delta);
        }
    }
}
