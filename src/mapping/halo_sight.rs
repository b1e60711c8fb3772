//! The haloes in front of and behind a main lens that is being fitted: rays carried once, and expanded about a deflection.

use super::multiplane::{LineOfSight, RaysAtPlane};
use super::rays::HaloExpansion;
use super::{Mapping, Order, RayBundle};
use crate::error::Result;
use crate::monitor::Monitor;

/// A line of sight through given haloes with a main lens in it whose parameters are free.
///
/// The foreground does not depend on the lens: it carries each ray once to its point x_d of the lens plane. Behind the
/// lens β depends on its deflection alone, s ← s − f·α, so that fits expand it to second order about a reference and
/// refresh that. Positions in the lens plane and at the source are measured from the ray that the observer sees on the
/// axis, where the haloes make centred lenses and sources appear.
#[derive(Debug, Clone)]
pub struct HaloSight {
    sight: LineOfSight,
    z_lens: f64,
    chi_lens_cmpc: f64,
    slope_per_deflection: f64,
    /// Where the axis ray meets lens plane and source, arcsec.
    axis_at_lens: [f64; 2],
    axis_at_source: [f64; 2],
}

impl HaloSight {
    /// The haloes of `sight` around a lens at `z_lens`.
    ///
    /// # Errors
    /// When the lens does not lie between observer and source.
    pub fn new(sight: LineOfSight, z_lens: f64) -> Result<Self> {
        let axis = |mapping: &dyn Mapping| mapping.map(&[[0.0; 2]], Order::Position).beta_arcsec[0];
        let chi_lens_cmpc = sight.distance(z_lens)?;
        Ok(Self {
            axis_at_lens: axis(&sight.observer_to(z_lens)?),
            axis_at_source: axis(&sight.observer_to_source()),
            slope_per_deflection: sight.slope_per_reduced_deflection(z_lens)?,
            chi_lens_cmpc,
            z_lens,
            sight,
        })
    }

    /// Carries rays to the lens, and expands what follows about deflections that lead each to where the observer sees the
    /// axis: those of rays that meet a small source.
    ///
    /// # Errors
    /// When cancelled.
    pub(crate) fn carry(&self, theta: &[[f64; 2]], monitor: &dyn Monitor) -> Result<HaloExpansion> {
        let foreground = self.sight.rays_at(self.z_lens, theta, monitor)?;
        let at_lens: Vec<[f64; 2]> = (foreground.x_cmpc_arcsec.iter())
            .map(|x| [0, 1].map(|c| x[c] / self.chi_lens_cmpc - self.axis_at_lens[c]))
            .collect();
        self.expand(foreground, &at_lens, at_lens.clone(), monitor)
    }

    /// Expands carried rays about other deflections, one a ray.
    ///
    /// # Errors
    /// When cancelled.
    pub(crate) fn expand_about(
        &self,
        rays: &HaloExpansion,
        deflection: Vec<[f64; 2]>,
        monitor: &dyn Monitor,
    ) -> Result<HaloExpansion> {
        self.expand(rays.foreground.clone(), &rays.at_lens_arcsec(), deflection, monitor)
    }

    fn expand(
        &self,
        foreground: RaysAtPlane,
        at_lens: &[[f64; 2]],
        deflection: Vec<[f64; 2]>,
        monitor: &dyn Monitor,
    ) -> Result<HaloExpansion> {
        let behind = self.behind(&foreground, &deflection, Order::SecondDerivatives, monitor)?;
        Ok(HaloExpansion::new(foreground, at_lens, &deflection, &behind))
    }

    /// β of carried rays after deflections at the lens, exactly, with derivatives by these.
    fn behind(
        &self,
        foreground: &RaysAtPlane,
        deflection: &[[f64; 2]],
        order: Order,
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let f = self.slope_per_deflection;
        let slopes = foreground.slope_arcsec.iter().zip(deflection);
        let kicked = RaysAtPlane {
            x_cmpc_arcsec: foreground.x_cmpc_arcsec.clone(),
            slope_arcsec: slopes.map(|(s, alpha)| [0, 1].map(|c| s[c] - f * alpha[c])).collect(),
        };
        let mut rays = self.sight.onwards(self.z_lens, &kicked, order, monitor)?;
        for beta in &mut rays.beta_arcsec {
            *beta = [0, 1].map(|c| beta[c] - self.axis_at_source[c]);
        }
        for first in &mut rays.jacobian {
            *first = first.map(|d| -f * d);
        }
        for second in &mut rays.second_per_arcsec {
            *second = second.map(|d| f * f * d);
        }
        Ok(rays)
    }

    /// The largest distance in arcsec between the expansion of β and β itself, at deflections of one a ray.
    ///
    /// # Errors
    /// When cancelled.
    pub(crate) fn expansion_error_arcsec(
        &self,
        rays: &HaloExpansion,
        deflection: &[[f64; 2]],
        monitor: &dyn Monitor,
    ) -> Result<f64> {
        let exact = self.behind(&rays.foreground, deflection, Order::Position, monitor)?.beta_arcsec;
        let expanded = rays.beta_arcsec(deflection);
        let error = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
        Ok(exact.iter().zip(&expanded).map(error).fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::halo::{HaloCatalogue, HaloMasses};
    use crate::mapping::Rays;
    use crate::mapping::multiplane::{MainLens, Sheets};
    use crate::mapping::tidal::{LensResponse, LineOfSightKind};
    use crate::monitor::Silent;
    use crate::numerics::complex::Cx;
    use crate::numerics::differences::derivative;
    use crate::profile::mass::{Epl, MassModel};

    fn sight() -> LineOfSight {
        let masses = HaloMasses::Angles {
            r_s_arcsec: vec![3.0, 0.4, 8.0, 1.0, 2.0],
            alpha_rs_arcsec: vec![0.02, 0.03, 0.05, 0.01, 0.04],
        };
        let z = vec![0.9, 0.2, 0.5, 1.2, 0.4];
        let theta = [vec![1.0, -2.0, 0.3, 5.0, -0.7], vec![0.5, 0.1, -3.0, 2.0, 0.9]];
        let background = Background::paper();
        let haloes = HaloCatalogue::new(1.5, &background, z, theta, masses).unwrap();
        LineOfSight::new(&haloes, &Sheets::OnAxis).unwrap()
    }

    fn epl(centre: [f64; 2]) -> MassModel {
        MassModel::Epl(Epl::new(1.3, 2.1, [0.1, -0.2], centre).unwrap())
    }

    fn theta() -> Vec<[f64; 2]> {
        (0..40).map(|i| [(f64::from(i) * 0.61).sin() * 1.6, (f64::from(i) * 0.37).cos() * 1.4]).collect()
    }

    fn rays(haloes: &HaloSight, lenses: &[MassModel]) -> Rays {
        let mut rays = Rays::new(&theta());
        let carried = haloes.carry(&theta(), &Silent).unwrap();
        rays.haloes = Some(carried);
        let alpha = LensResponse::new(LineOfSightKind::Haloes, &[0.0; 8], lenses).deflections(&rays);
        rays.haloes = Some(haloes.expand_about(rays.haloes.as_ref().unwrap(), alpha, &Silent).unwrap());
        rays
    }

    #[test]
    fn expanded_about_a_lens_the_rays_are_those_traced_through_it() {
        let haloes = HaloSight::new(sight(), 0.5).unwrap();
        let lenses = [epl([0.0; 2])];
        let rays = rays(&haloes, &lenses);
        let main = MainLens { z: 0.5, profile: epl(haloes.axis_at_lens) };
        let traced = sight().through_lens(&main).unwrap().map(&theta(), Order::Position).beta_arcsec;
        let lens = LensResponse::new(LineOfSightKind::Haloes, &[0.0; 8], &lenses);
        let alpha = lens.deflections(&rays);
        for (i, traced) in traced.iter().enumerate() {
            let beta = lens.beta(&rays, i - i % 32);
            let [x, y] = [0, 1].map(|c| traced[c] - haloes.axis_at_source[c]);
            assert!((beta.re.0[i % 32] - x).hypot(beta.im.0[i % 32] - y) < 1e-13);
        }
        assert!(
            haloes.expansion_error_arcsec(rays.haloes.as_ref().unwrap(), &alpha, &Silent).unwrap() < 1e-13
        );
    }

    #[test]
    fn the_error_of_the_expansion_is_of_third_order() {
        let haloes = HaloSight::new(sight(), 0.5).unwrap();
        let rays = rays(&haloes, &[epl([0.0; 2])]);
        let error = |shift: f64| {
            let moved = [epl([shift, -0.5 * shift])];
            let alpha = LensResponse::new(LineOfSightKind::Haloes, &[0.0; 8], &moved).deflections(&rays);
            haloes.expansion_error_arcsec(rays.haloes.as_ref().unwrap(), &alpha, &Silent).unwrap()
        };
        let (coarse, fine) = (error(0.02), error(0.01));
        assert!(coarse < 1e-4 && fine < coarse / 6.0, "{coarse:e} {fine:e}");
    }

    #[test]
    fn responses_are_those_of_beta() {
        let haloes = HaloSight::new(sight(), 0.5).unwrap();
        let rays = rays(&haloes, &[epl([0.01, 0.0])]);
        let parameters = [0.01, 0.02, -0.01, 0.003, -0.02, 0.03, 0.01, 0.002, 1.3, 2.1, 0.1, -0.2, 0.0, 0.0];
        let build =
            |p: &[f64]| [MassModel::Epl(Epl::new(p[8], p[9], [p[10], p[11]], [p[12], p[13]]).unwrap())];
        let beta = |p: &[f64]| {
            let lenses = build(p);
            LensResponse::new(LineOfSightKind::Haloes, &p[..8], &lenses).beta(&rays, 0)
        };
        let lenses = build(&parameters);
        let mut by = vec![Cx::zero(); parameters.len()];
        let lens = LensResponse::new(LineOfSightKind::Haloes, &parameters[..8], &lenses);
        assert_eq!(lens.respond(&rays, 0, &mut by), beta(&parameters));
        for (i, by) in by.iter().enumerate() {
            let moved = |v: f64| {
                let mut p = parameters;
                p[i] = v;
                beta(&p)
            };
            for ray in [0, 7, 31] {
                let x = derivative(|v| moved(v).re.0[ray], parameters[i], 1e-3);
                let y = derivative(|v| moved(v).im.0[ray], parameters[i], 1e-3);
                assert!((by.re.0[ray] - x).hypot(by.im.0[ray] - y) < 1e-8, "parameter {i}, ray {ray}");
            }
        }
    }
}
