//! Lens planes of any mass profiles, traced exactly: multi-plane lensing without the haloes' fast path.

use rayon::prelude::*;

use super::delay::Ray;
use super::plane::LensPlane;
use super::recursion::{BLOCK, RayBlock};
use crate::cosmology::Background;
use crate::error::{Domain, Result};
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::profile::mass::MassModel;

/// Mass profiles at redshifts of their own, deflections reduced to the source; for a few planes, not for thousands.
///
/// The recursion is that of [`super::LineOfSight`] (x comoving, s slope): x ← x + Δχ·s, s ← s − f·α(x/χ),
/// f = χ_s/(χ_s − χ), with first and second derivatives. Profiles at one redshift share a plane.
///
/// ```
/// use haloray::cosmology::Background;
/// use haloray::mapping::{Mapping, Order, multiplane::GeneralMultiPlane};
/// use haloray::profile::mass::{External, MassModel};
/// let sheet = MassModel::External(External::new(0.1, [0.0; 2], [0.0; 4], [0.0; 2]).unwrap());
/// let lens = GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.5, sheet)]).unwrap();
/// assert!((lens.map(&[[1.0, 0.0]], Order::Position).beta_arcsec[0][0] - 0.9).abs() < 1e-15);
/// ```
#[derive(Debug, Clone)]
pub struct GeneralMultiPlane {
    pub(super) chi_source_cmpc: f64,
    /// In order of distance, equal distances in the order given.
    pub(super) planes: Vec<LensPlane>,
}

impl GeneralMultiPlane {
    /// Sorts profiles, each with its redshift, into planes; those at or behind the source do nothing and are left out.
    ///
    /// # Errors
    /// Unless 0 < z for every profile.
    pub fn new(background: &Background, z_source: f64, lenses: &[(f64, MassModel)]) -> Result<Self> {
        let chi_source_cmpc = background.comoving_distance_mpc(Domain::POSITIVE.check("z_source", z_source)?);
        let mut planes = Vec::with_capacity(lenses.len());
        for (z, profile) in lenses {
            if Domain::POSITIVE.check("redshift of a lens", *z)? < z_source {
                let chi = background.comoving_distance_mpc(*z);
                planes.push(LensPlane::new(chi, chi_source_cmpc, profile.clone()));
            }
        }
        planes.sort_by(|a, b| a.chi_cmpc.total_cmp(&b.chi_cmpc));
        Ok(Self { chi_source_cmpc, planes })
    }

    fn trace_order<const ORDER: usize>(
        &self,
        theta: &[[f64; 2]],
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        RayBundle::in_blocks(theta, BLOCK, monitor, |theta| {
            let mut rays = RayBlock::start(0.0, [0.0; 2], [0.0; 2], theta);
            for plane in &self.planes {
                rays.through_lens::<ORDER>(plane, theta.len());
            }
            rays.advance::<ORDER>(self.chi_source_cmpc);
            rays.bundle::<ORDER>(theta.len(), [0.0; 2], self.chi_source_cmpc)
        })
    }
}

impl Mapping for GeneralMultiPlane {
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle> {
        match order {
            Order::Position => self.trace_order::<0>(theta_arcsec, monitor),
            Order::Jacobian => self.trace_order::<1>(theta_arcsec, monitor),
            Order::SecondDerivatives => self.trace_order::<2>(theta_arcsec, monitor),
        }
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let delay = |&theta: &[f64; 2]| {
            let mut ray = Ray::start(0.0, [0.0; 2], theta);
            for plane in &self.planes {
                ray.through_lens(plane);
            }
            ray.delay_days_at(self.chi_source_cmpc)
        };
        theta_arcsec.par_iter().map(delay).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::differences::derivative;
    use crate::profile::mass::{Epl, External, Nfw};

    fn lenses() -> Vec<(f64, MassModel)> {
        vec![
            (0.5, MassModel::Epl(Epl::new(1.4, 2.2, [0.1, -0.05], [0.02, 0.03]).unwrap())),
            (0.9, MassModel::Nfw(Nfw::new(3.0, 0.2, [0.5, -0.4]).unwrap())),
            (0.2, MassModel::External(External::new(0.02, [0.03, -0.01], [0.0; 4], [0.0; 2]).unwrap())),
            (0.5, MassModel::External(External::new(0.0, [-0.02, 0.05], [0.0; 4], [0.0; 2]).unwrap())),
        ]
    }

    fn through(lenses: &[(f64, MassModel)]) -> GeneralMultiPlane {
        GeneralMultiPlane::new(&Background::paper(), 1.5, lenses).unwrap()
    }

    #[test]
    fn derivatives_are_those_of_beta() {
        let mapping = through(&lenses());
        let at = |x: f64, y: f64| mapping.map(&[[x, y]], Order::SecondDerivatives);
        let (x, y, h) = (1.1, -0.6, 1e-3);
        let rays = at(x, y);
        for i in 0..2 {
            let dx = derivative(|x| at(x, y).beta_arcsec[0][i], x, h);
            let dy = derivative(|y| at(x, y).beta_arcsec[0][i], y, h);
            let dxy = derivative(|y| at(x, y).jacobian[0][2 * i], y, h);
            assert!((rays.jacobian[0][2 * i] - dx).abs() < 1e-10);
            assert!((rays.jacobian[0][2 * i + 1] - dy).abs() < 1e-10);
            assert!((rays.second_per_arcsec[0][3 * i + 1] - dxy).abs() < 1e-9);
        }
    }

    #[test]
    fn the_order_of_the_list_does_not_matter() {
        let (one, mut list) = (through(&lenses()), lenses());
        list.reverse();
        let other = through(&list);
        let theta = [[1.1, -0.6], [-0.3, 0.9]];
        for (a, b) in one
            .map(&theta, Order::Position)
            .beta_arcsec
            .iter()
            .zip(other.map(&theta, Order::Position).beta_arcsec)
        {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-14);
        }
        for (a, b) in one.delay_days(&theta).iter().zip(other.delay_days(&theta)) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
    }

    #[test]
    fn planes_at_and_behind_the_source_do_nothing() {
        let mut more = lenses();
        more.extend([(1.5, lenses()[0].1.clone()), (2.5, lenses()[1].1.clone())]);
        let theta = [[1.1, -0.6], [-0.3, 0.9]];
        let (with, without) = (through(&more), through(&lenses()));
        assert_eq!(with.map(&theta, Order::Jacobian), without.map(&theta, Order::Jacobian));
        assert_eq!(with.lens_centres_arcsec(), without.lens_centres_arcsec());
        let error =
            GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.0, lenses()[0].1.clone())]).unwrap_err();
        assert!(error.to_string().starts_with("redshift of a lens is 0, but must be"), "{error}");
    }
}
