//! Deflections of many points at once, and their response to the parameters of a lens.

use multiversion::multiversion;

use super::{Epl, MassModel, MassProfile, Nfw, SersicMass};
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};

/// Deflection, convergence and shear of a lens at one point or in the lanes of [`Lanes`].
#[derive(Debug, Clone, Copy)]
pub struct Response<R> {
    /// α_x + iα_y in arcsec.
    pub deflection: Cx<R>,
    /// Convergence κ.
    pub convergence: R,
    /// Shear γ1 + iγ2.
    pub shear: Cx<R>,
}

impl<R: crate::numerics::real::Real> Response<R> {
    /// Hessian of the potential (κ+γ1, γ2, κ−γ1).
    #[inline(always)]
    pub fn hessian(&self) -> [R; 3] {
        [self.convergence + self.shear.re, self.shear.im, self.convergence - self.shear.re]
    }

    /// Change of the deflection when the point moves by `dz`: κ·dz + γ·conj(dz).
    #[inline(always)]
    pub fn along(&self, dz: Cx<R>) -> Cx<R> {
        dz.scale(self.convergence) + self.shear * dz.conj()
    }
}

impl MassModel {
    /// Deflection in every lane.
    pub(crate) fn deflection_lanes(&self, x: Lanes, y: Lanes) -> Cx<Lanes> {
        match self {
            Self::Epl(lens) => epl_deflection(lens, &x, &y),
            Self::Nfw(lens) => nfw_deflection(lens, &x, &y),
            Self::Sersic(lens) => sersic_deflection(lens, &x, &y),
            other => {
                let mut alpha = Cx::<Lanes>::zero();
                for i in 0..LANES {
                    [alpha.re.0[i], alpha.im.0[i]] = other.deflection(x.0[i], y.0[i]);
                }
                alpha
            }
        }
    }

    /// Deflection, convergence, shear and parameter derivatives in every lane.
    pub(crate) fn response_lanes(
        &self,
        x: Lanes,
        y: Lanes,
        by_parameter: &mut [Cx<Lanes>],
    ) -> Response<Lanes> {
        match self {
            Self::Epl(lens) => epl_response(lens, &x, &y, by_parameter),
            Self::Nfw(lens) => nfw_response(lens, &x, &y, by_parameter),
            Self::Sersic(lens) => sersic_response(lens, &x, &y, by_parameter),
            other => other.response_lane_by_lane(x, y, by_parameter),
        }
    }

    fn response_lane_by_lane(&self, x: Lanes, y: Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
        let mut response = Response { deflection: Cx::zero(), convergence: Lanes::ZERO, shear: Cx::zero() };
        let mut own = [Cx::new(0.0, 0.0); MOST_PARAMETERS];
        let own = &mut own[..by_parameter.len()];
        for i in 0..LANES {
            let (x, y) = (x.0[i], y.0[i]);
            [response.deflection.re.0[i], response.deflection.im.0[i]] = self.deflection(x, y);
            let [xx, xy, yy] = self.hessian(x, y);
            response.convergence.0[i] = 0.5 * (xx + yy);
            response.shear.re.0[i] = 0.5 * (xx - yy);
            response.shear.im.0[i] = xy;
            self.parameter_derivatives(x, y, own);
            for (all, own) in by_parameter.iter_mut().zip(own.iter()) {
                (all.re.0[i], all.im.0[i]) = (own.re, own.im);
            }
        }
        response
    }
}

// Compiled once for each instruction set and called once for all lanes.
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn epl_deflection(lens: &Epl, x: &Lanes, y: &Lanes) -> Cx<Lanes> {
    lens.complex_deflection(*x, *y)
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn epl_response(lens: &Epl, x: &Lanes, y: &Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
    lens.response(*x, *y, by_parameter)
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn nfw_deflection(lens: &Nfw, x: &Lanes, y: &Lanes) -> Cx<Lanes> {
    lens.deflection_lanes(*x, *y)
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn nfw_response(lens: &Nfw, x: &Lanes, y: &Lanes, by_parameter: &mut [Cx<Lanes>]) -> Response<Lanes> {
    lens.response_lanes(*x, *y, by_parameter)
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn sersic_deflection(lens: &SersicMass, x: &Lanes, y: &Lanes) -> Cx<Lanes> {
    lens.deflection_lanes(*x, *y)
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn sersic_response(
    lens: &SersicMass,
    x: &Lanes,
    y: &Lanes,
    by_parameter: &mut [Cx<Lanes>],
) -> Response<Lanes> {
    lens.response_lanes(*x, *y, by_parameter)
}

/// The most parameters a profile has.
pub(crate) const MOST_PARAMETERS: usize = 9;

/// Responses of a lens at many points, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Responses {
    /// (α_x, α_y) in arcsec.
    pub deflection_arcsec: [Vec<f64>; 2],
    /// (ψ_xx, ψ_xy, ψ_yy).
    pub hessian: [Vec<f64>; 3],
    /// ∂(α_x, α_y)/∂p for each of the parameters of the lens.
    pub by_parameter: Vec<[Vec<f64>; 2]>,
}

impl Responses {
    /// Columns of `n` points for a lens of `parameters` parameters, from what is allocated already.
    fn resize(&mut self, n: usize, parameters: usize) {
        self.by_parameter.resize_with(parameters, Default::default);
        let columns = self.deflection_arcsec.iter_mut().chain(&mut self.hessian);
        columns.chain(self.by_parameter.iter_mut().flatten()).for_each(|column| column.resize(n, 0.0));
    }
}

/// Deflections (α_x, α_y) of `lens` at the points (x, y), lanes at a time, written over `out`.
pub fn deflections(lens: &MassModel, x_arcsec: &[f64], y_arcsec: &[f64], out: &mut [Vec<f64>; 2]) {
    out.iter_mut().for_each(|column| column.resize(x_arcsec.len(), 0.0));
    deflect_all(lens, x_arcsec, y_arcsec, out);
}

fn deflect_all(lens: &MassModel, x: &[f64], y: &[f64], out: &mut [Vec<f64>; 2]) {
    for start in (0..x.len()).step_by(LANES) {
        let alpha = lens.deflection_lanes(Lanes::load(x, start), Lanes::load(y, start));
        alpha.re.store(&mut out[0], start);
        alpha.im.store(&mut out[1], start);
    }
}

/// Deflection, Hessian and parameter derivatives of `lens` at the points (x, y), lanes at a time, written over `out`.
pub fn responses(lens: &MassModel, x_arcsec: &[f64], y_arcsec: &[f64], out: &mut Responses) {
    out.resize(x_arcsec.len(), lens.parameters().len());
    respond_all(lens, x_arcsec, y_arcsec, out);
}

fn respond_all(lens: &MassModel, x: &[f64], y: &[f64], out: &mut Responses) {
    let mut by_parameter = [Cx::<Lanes>::zero(); MOST_PARAMETERS];
    let by_parameter = &mut by_parameter[..out.by_parameter.len()];
    for start in (0..x.len()).step_by(LANES) {
        let response = lens.response_lanes(Lanes::load(x, start), Lanes::load(y, start), by_parameter);
        response.deflection.re.store(&mut out.deflection_arcsec[0], start);
        response.deflection.im.store(&mut out.deflection_arcsec[1], start);
        for (column, h) in out.hessian.iter_mut().zip(response.hessian()) {
            h.store(column, start);
        }
        for (column, own) in out.by_parameter.iter_mut().zip(by_parameter.iter()) {
            own.re.store(&mut column[0], start);
            own.im.store(&mut column[1], start);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::{Epl, Nfw};

    #[test]
    fn many_points_at_once_have_the_bits_of_one_by_one() {
        let lenses = [
            MassModel::Epl(Epl::new(1.3, 2.3, [0.1, -0.2], [0.05, 0.0]).unwrap()),
            MassModel::Nfw(Nfw::new(2.0, 0.4, [0.1, 0.2]).unwrap()),
            MassModel::Nfw(
                Nfw::new(0.9, 0.4, [0.1, 0.2]).unwrap().with_elliptical_potential([0.1, -0.2]).unwrap(),
            ),
            MassModel::Sersic(
                SersicMass::new(0.7, 0.2, 3.7, [0.1, 0.0])
                    .unwrap()
                    .with_elliptical_potential([0.1, -0.2])
                    .unwrap(),
            ),
            MassModel::Sersic(SersicMass::new(0.7, 0.01, 1.0, [0.0, 0.0]).unwrap()),
        ];
        let x: Vec<f64> = (0..21).map(|i| -1.0 + 0.1 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|x| 0.3 - 0.7 * x * x).collect();
        for lens in lenses {
            let (mut alpha, mut all) = ([vec![], vec![]], Responses::default());
            deflections(&lens, &x, &y, &mut alpha);
            responses(&lens, &x, &y, &mut all);
            assert_eq!(alpha, all.deflection_arcsec);
            for i in 0..x.len() {
                assert_eq!([alpha[0][i], alpha[1][i]], lens.deflection(x[i], y[i]));
                let mut own = vec![Cx::new(0.0, 0.0); lens.parameters().len()];
                lens.parameter_derivatives(x[i], y[i], &mut own);
                for (column, own) in all.by_parameter.iter().zip(own) {
                    assert_eq!([column[0][i], column[1][i]], [own.re, own.im]);
                }
            }
        }
    }
}
