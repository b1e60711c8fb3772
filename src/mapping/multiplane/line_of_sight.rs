//! The line of sight: haloes as sorted planes, ready to be traced between any two redshifts.

use std::sync::Arc;

use rayon::prelude::*;

use super::axis::{Axis, Reference, State};
use super::plane::{LensPlane, Plane, Sheets, sorted_planes};
use super::recursion::{BLOCK, RayBlock};
use super::segment::Segment;
use crate::cosmology::Background;
use crate::error::{Domain, Error, Result};
use crate::halo::HaloCatalogue;
use crate::mapping::{Order, RayBundle};
use crate::monitor::Monitor;
use crate::profile::mass::MassModel;

/// All haloes between observer and source as lens planes, sorted once, each with its sheet.
#[derive(Debug, Clone)]
pub struct LineOfSight {
    background: Background,
    z_source: f64,
    pub(super) chi_source_cmpc: f64,
    pub(super) planes: Arc<Vec<Plane>>,
    reference: Reference,
    /// The axis ray through these planes; for a straight reference the path by which haloes were moved.
    pub(super) axis: Arc<Axis>,
}

/// Where rays meet a plane, and with which slopes they come, before anything in it deflects them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RaysAtPlane {
    /// Comoving position x over arcsec, Mpc; the ray meets the plane in the direction x/χ.
    pub x_cmpc_arcsec: Vec<[f64; 2]>,
    /// Slope s = dx/dχ, arcsec.
    pub slope_arcsec: Vec<[f64; 2]>,
}

/// The main lens, a plane of its own; its deflection is reduced to the source.
#[derive(Debug, Clone)]
pub struct MainLens {
    /// Redshift.
    pub z: f64,
    /// Mass profile.
    pub profile: MassModel,
}

impl LineOfSight {
    /// Sorts the haloes into planes and gives each its sheet; positions are measured from a line that is not bent.
    ///
    /// # Errors
    /// When an expected sheet is missing; haloes were checked by the catalogue.
    pub fn new(haloes: &HaloCatalogue, sheets: &Sheets) -> Result<Self> {
        Self::along(Reference::Bent, haloes, sheets)
    }

    /// As [`Self::new`], with positions measured from `reference`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn along(reference: Reference, haloes: &HaloCatalogue, sheets: &Sheets) -> Result<Self> {
        if let Sheets::Expected(kappa) = sheets
            && kappa.len() != haloes.len()
        {
            return Err(Error::out_of_range(
                "number of expected sheets",
                kappa.len(),
                &format!("one a halo ({})", haloes.len()),
            ));
        }
        let (background, z_source) = (*haloes.background(), haloes.z_source());
        let chi_source_cmpc = background.comoving_distance_mpc(z_source);
        let mut planes = sorted_planes(haloes, chi_source_cmpc, sheets);
        let axis = Axis::through(&mut planes, |plane, ray| {
            if reference == Reference::Straight {
                plane.centre_arcsec = [0, 1].map(|c| plane.centre_arcsec[c] + ray[c]);
            }
            if *sheets == Sheets::OnRay {
                plane.f_sheet = plane.convergence_at(ray);
            }
        });
        let (planes, axis) = (Arc::new(planes), Arc::new(axis));
        Ok(Self { background, z_source, chi_source_cmpc, planes, reference, axis })
    }

    /// Number of haloes in the very plane of redshift `z`.
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn number_at(&self, z: f64) -> Result<usize> {
        let chi = self.distance(z)?;
        Ok(self.planes.iter().filter(|plane| plane.chi_cmpc == chi).count())
    }

    /// The line of sight without the haloes in the very plane of redshift `z`: those at a lens's redshift are part of the lens.
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn without_plane_at(&self, z: f64) -> Result<Self> {
        if self.number_at(z)? == 0 {
            return Ok(self.clone());
        }
        let chi = self.distance(z)?;
        let mut planes: Vec<Plane> = self.planes.iter().filter(|p| p.chi_cmpc != chi).cloned().collect();
        let axis = Axis::through(&mut planes, |plane, ray| {
            if self.reference == Reference::Straight {
                let before = self.axis.at(plane.chi_cmpc).direction_arcsec();
                plane.centre_arcsec = [0, 1].map(|c| plane.centre_arcsec[c] + ray[c] - before[c]);
            }
        });
        Ok(Self { planes: Arc::new(planes), axis: Arc::new(axis), ..self.clone() })
    }

    /// The directions x/χ in which the axis ray, bent by the haloes, meets comoving distances; arcsec.
    ///
    /// For a straight reference these are the directions by which planes at those distances are moved to keep it straight.
    pub fn axis_ray_arcsec(&self, chi_cmpc: &[f64]) -> Vec<[f64; 2]> {
        chi_cmpc.par_iter().map(|&chi| self.axis.at(chi).direction_arcsec()).collect()
    }

    /// The state of a ray that counts as position and slope 0 at comoving distance `chi_cmpc`.
    pub(super) fn origin(&self, chi_cmpc: f64) -> State {
        match self.reference {
            Reference::Bent => State { chi_cmpc, ..State::default() },
            Reference::Straight => self.axis.at(chi_cmpc),
        }
    }

    fn observer_to_chi(&self, chi_end_cmpc: f64) -> Segment {
        let x_end = self.origin(chi_end_cmpc).x;
        Segment::from_observer(&self.planes, self.reference, chi_end_cmpc, x_end)
    }

    /// Number of halo planes.
    pub fn len(&self) -> usize {
        self.planes.len()
    }

    /// True when no halo lies on the line of sight.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty()
    }

    /// Convergence of all sheets, reduced to the source; each takes away so much.
    pub fn sheet_convergence(&self) -> f64 {
        let own = |p: &Plane| p.f_sheet * (self.chi_source_cmpc - p.chi_cmpc) / self.chi_source_cmpc;
        self.planes.iter().map(own).sum()
    }

    /// Observer to source through the haloes alone (os).
    pub fn observer_to_source(&self) -> Segment {
        self.observer_to_chi(self.chi_source_cmpc)
    }

    /// Observer to redshift `z` through the haloes alone (od for z = z_d).
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn observer_to(&self, z: f64) -> Result<Segment> {
        Ok(self.observer_to_chi(self.distance(z)?))
    }

    /// Redshift `z` to source, about the ray that the observer sees on the axis (ds for z = z_d).
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn to_source_from(&self, z: f64) -> Result<Segment> {
        self.between(z, self.z_source)
    }

    /// From redshift `z_near` to `z_far`, about the ray that the observer sees on the axis.
    ///
    /// # Errors
    /// Unless 0 < z_near < z_far ≤ z_source.
    pub fn between(&self, z_near: f64, z_far: f64) -> Result<Segment> {
        Domain::above(z_near).check("the far redshift", z_far)?;
        Ok(self.observer_to_chi(self.distance(z_far)?).behind(&self.axis, self.distance(z_near)?))
    }

    /// f = χ_s/(χ_s − χ(z)): by how much a reduced deflection at redshift `z` changes the slope.
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn slope_per_reduced_deflection(&self, z: f64) -> Result<f64> {
        Ok(self.chi_source_cmpc / (self.chi_source_cmpc - self.distance(z)?))
    }

    /// Observer to source through haloes and main lens: the whole lens mapping.
    ///
    /// # Errors
    /// When the lens does not lie between observer and source.
    pub fn through_lens(&self, lens: &MainLens) -> Result<Segment> {
        Domain::below(self.z_source).check("z_lens", lens.z)?;
        let chi = self.distance(lens.z)?;
        let mut plane = LensPlane::new(chi, self.chi_source_cmpc, lens.profile.clone());
        plane.origin_arcsec = self.origin(chi).direction_arcsec();
        Ok(self.observer_to_source().with_lens(plane))
    }

    /// Where rays of directions θ (arcsec) meet redshift `z`; `monitor` is told of every ray.
    ///
    /// # Errors
    /// When z is not between 0 and the source; when cancelled.
    pub fn rays_at(&self, z: f64, theta_arcsec: &[[f64; 2]], monitor: &dyn Monitor) -> Result<RaysAtPlane> {
        let segment = self.observer_to(z)?;
        let origin = self.origin(self.distance(z)?);
        let block = |theta: &[[f64; 2]]| {
            monitor.check()?;
            let rays = segment.to_end::<0>(theta);
            monitor.advance(theta.len() as u64);
            let each = 0..theta.len();
            let x = each.clone().map(|i| minus(rays.position(i), origin.x)).collect();
            Ok((x, each.map(|i| minus(rays.slope(i), origin.s)).collect()))
        };
        let blocks: Result<(Vec<Vec<_>>, Vec<Vec<_>>)> = theta_arcsec.par_chunks(BLOCK).map(block).collect();
        let (x, slope) = blocks?;
        Ok(RaysAtPlane { x_cmpc_arcsec: x.concat(), slope_arcsec: slope.concat() })
    }

    /// On from redshift `z`, where a lens has changed the slopes, to β at the source through the haloes alone.
    ///
    /// Derivatives are with respect to the slope at `z`: ∂β_i/∂s_j and ∂²β_i/∂s_j∂s_k per arcsec, X = 0 and S = 1 there.
    /// With rays of [`Self::rays_at`] whose slopes are lowered by f·α(x/χ) this is the mapping of
    /// [`Self::through_lens`]. `monitor` is told of every ray.
    ///
    /// # Errors
    /// When z is not between 0 and the source; when there are not as many slopes as positions; when cancelled.
    pub fn onwards(
        &self,
        z: f64,
        rays: &RaysAtPlane,
        order: Order,
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let (x, slope) = (&rays.x_cmpc_arcsec, &rays.slope_arcsec);
        if x.len() != slope.len() {
            let allowed = format!("one a position ({})", x.len());
            return Err(Error::out_of_range("number of slopes", slope.len(), &allowed));
        }
        let chi = self.distance(z)?;
        match order {
            Order::Position => self.onwards_from::<0>(chi, x, slope, monitor),
            Order::Jacobian => self.onwards_from::<1>(chi, x, slope, monitor),
            Order::SecondDerivatives => self.onwards_from::<2>(chi, x, slope, monitor),
        }
    }

    fn onwards_from<const ORDER: usize>(
        &self,
        chi_cmpc: f64,
        x: &[[f64; 2]],
        slope: &[[f64; 2]],
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let (origin, end) = (self.origin(chi_cmpc), self.origin(self.chi_source_cmpc).x);
        let plus = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        let farther = &self.planes[self.planes.partition_point(|p| p.chi_cmpc < chi_cmpc)..];
        let block = |(x, slope): (&[[f64; 2]], &[[f64; 2]])| {
            monitor.check()?;
            let mut rays = RayBlock::from_points(
                chi_cmpc,
                x.len(),
                |i| plus(x[i], origin.x),
                |i| plus(slope[i], origin.s),
            );
            rays.through::<ORDER>(farther);
            rays.advance::<ORDER>(self.chi_source_cmpc);
            monitor.advance(x.len() as u64);
            Ok(rays.bundle::<ORDER>(x.len(), end, self.chi_source_cmpc))
        };
        RayBundle::joined(x.par_chunks(BLOCK).zip(slope.par_chunks(BLOCK)).map(block).collect())
    }

    /// Comoving distance of a redshift on the line of sight, Mpc.
    pub(in crate::mapping) fn distance(&self, z: f64) -> Result<f64> {
        Domain::above_to(0.0, self.z_source).check("redshift on the line of sight", z)?;
        if z == self.z_source {
            return Ok(self.chi_source_cmpc);
        }
        Ok(self.background.comoving_distance_mpc(z))
    }
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::halo::HaloMasses;
    use crate::mapping::Mapping;
    use crate::monitor::Silent;
    use crate::profile::mass::{Epl, MassProfile};

    const Z_LENS: f64 = 0.5;

    fn sight() -> LineOfSight {
        let masses = HaloMasses::Angles {
            r_s_arcsec: vec![3.0, 0.4, 8.0, 1.0, 2.0],
            alpha_rs_arcsec: vec![0.02, 0.03, 0.05, 0.01, 0.04],
        };
        let z = vec![0.9, 0.2, 0.5, 1.2, 0.4];
        let theta = [vec![1.0, -2.0, 0.3, 5.0, -0.7], vec![0.5, 0.1, -3.0, 2.0, 0.9]];
        let haloes = HaloCatalogue::new(1.5, &Background::paper(), z, theta, masses).unwrap();
        LineOfSight::new(&haloes, &Sheets::OnAxis).unwrap()
    }

    #[test]
    fn both_parts_with_a_kick_between_them_are_the_whole_mapping() {
        let sight = sight();
        let epl = Epl::new(1.3, 2.1, [0.1, -0.2], [0.05, 0.02]).unwrap();
        let lens = MainLens { z: Z_LENS, profile: MassModel::Epl(epl) };
        let theta: Vec<[f64; 2]> = (0..100)
            .map(|i| [(f64::from(i) * 0.61).sin() * 2.0, (f64::from(i) * 0.37).cos() * 1.7])
            .collect();
        let mut rays = sight.rays_at(Z_LENS, &theta, &Silent).unwrap();
        let f = sight.slope_per_reduced_deflection(Z_LENS).unwrap();
        let chi = Background::paper().comoving_distance_mpc(Z_LENS);
        for (x, slope) in rays.x_cmpc_arcsec.iter().zip(&mut rays.slope_arcsec) {
            let alpha = lens.profile.deflection(x[0] / chi, x[1] / chi);
            *slope = [slope[0] - f * alpha[0], slope[1] - f * alpha[1]];
        }
        let composed = sight.onwards(Z_LENS, &rays, Order::SecondDerivatives, &Silent).unwrap();
        let whole = sight.through_lens(&lens).unwrap().map(&theta, Order::Position);
        for (ours, whole) in composed.beta_arcsec.iter().zip(&whole.beta_arcsec) {
            assert!((ours[0] - whole[0]).hypot(ours[1] - whole[1]) < 1e-13, "{ours:?} {whole:?}");
        }
        // Derivatives are those by the slope.
        let step = 1e-4;
        for c in 0..2 {
            let moved = |by: f64| {
                let mut moved = rays.clone();
                moved.slope_arcsec.iter_mut().for_each(|slope| slope[c] += by);
                sight.onwards(Z_LENS, &moved, Order::Jacobian, &Silent).unwrap()
            };
            let (up, down) = (moved(step), moved(-step));
            for i in 0..theta.len() {
                for k in 0..2 {
                    let first = (up.beta_arcsec[i][k] - down.beta_arcsec[i][k]) / (2.0 * step);
                    assert!((composed.jacobian[i][2 * k + c] - first).abs() < 1e-7);
                    let second = (up.jacobian[i][2 * k + c] - down.jacobian[i][2 * k + c]) / (2.0 * step);
                    assert!((composed.second_per_arcsec[i][3 * k + 2 * c] - second).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn without_a_plane_it_is_as_if_its_haloes_had_never_been() {
        let all = [(0.9, 1.0, 0.5), (0.2, -2.0, 0.1), (0.5, 0.3, -3.0), (1.2, 5.0, 2.0), (0.5, 0.2, 0.4)];
        for reference in [Reference::Bent, Reference::Straight] {
            let of = |haloes: &[(f64, f64, f64)]| {
                let column = |of: fn(&(f64, f64, f64)) -> f64| haloes.iter().map(of).collect::<Vec<f64>>();
                let masses = HaloMasses::Angles {
                    r_s_arcsec: vec![2.0; haloes.len()],
                    alpha_rs_arcsec: vec![0.05; haloes.len()],
                };
                let theta = [column(|h| h.1), column(|h| h.2)];
                let haloes =
                    HaloCatalogue::new(1.5, &Background::paper(), column(|h| h.0), theta, masses).unwrap();
                LineOfSight::along(reference, &haloes, &Sheets::OnAxis).unwrap()
            };
            let (whole, wanted) = (of(&all), of(&[all[0], all[1], all[3]]));
            assert_eq!(whole.number_at(0.5).unwrap(), 2);
            let (got, theta) = (whole.without_plane_at(0.5).unwrap(), [[0.0, 0.0], [0.7, -0.3]]);
            let [got, wanted] =
                [got, wanted].map(|sight| sight.observer_to_source().map(&theta, Order::Jacobian));
            for (a, b) in got.jacobian.iter().flatten().zip(wanted.jacobian.iter().flatten()) {
                assert!((a - b).abs() < 1e-13, "{a} {b}");
            }
        }
    }

    #[test]
    fn no_rays_are_traced_to_nothing() {
        let rays = sight().observer_to_source().map(&[], Order::SecondDerivatives);
        assert_eq!(rays, RayBundle::default());
    }

    #[test]
    fn a_segment_outlives_its_line_of_sight_and_can_be_sent_away() {
        let theta = [[0.4, -0.3]];
        let (segment, here) = {
            let sight = sight();
            let segment = sight.to_source_from(Z_LENS).unwrap();
            let here = segment.map(&theta, Order::Jacobian);
            (segment, here)
        };
        let there = std::thread::spawn(move || segment.map(&theta, Order::Jacobian));
        assert_eq!(there.join().unwrap(), here);
    }
}
