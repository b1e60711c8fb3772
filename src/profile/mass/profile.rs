//! What every mass profile is: equations over one number or SIMD lanes, and a description.

use crate::error::Result;
use crate::numerics::complex::Cx;
use crate::numerics::dispatch::kernel;
use crate::numerics::real::{LANES, Lanes, Real};
use crate::profile::parameter::{Name, Parameter};

/// A thin lens in angular units, its deflection reduced to one source.
///
/// Arguments are angles (arcsec) from the observer's axis; ψ is in arcsec², α in arcsec,
/// its Hessian without unit, third derivatives per arcsec.
pub trait MassProfile: Sync + Sized {
    /// Lensing potential ψ(θ) in arcsec², zero at the centre of the profile.
    fn potential(&self, x_arcsec: f64, y_arcsec: f64) -> f64;
    /// Reduced deflection ∂ψ/∂x + i∂ψ/∂y in arcsec, of one point or of one a lane.
    fn deflect<R: Real>(&self, x_arcsec: R, y_arcsec: R) -> Cx<R>;
    /// Deflection, convergence and shear, with the derivatives of the deflection by each of its parameters
    /// ([`Described::PARAMETERS`]), whose number is the length of `by_parameter`.
    fn respond<R: Real>(&self, x_arcsec: R, y_arcsec: R, by_parameter: &mut [Cx<R>]) -> Response<R>;
    /// Deflection and Hessian (ψ_xx, ψ_xy, ψ_yy), of one point or of one a lane.
    fn expand<R: Real>(&self, x_arcsec: R, y_arcsec: R) -> (Cx<R>, [R; 3]);
    /// Third derivatives (ψ_xxx, ψ_xxy, ψ_xyy, ψ_yyy) per arcsec.
    fn third_derivatives(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 4];

    /// Reduced deflection (∂ψ/∂x, ∂ψ/∂y) in arcsec.
    fn deflection(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 2] {
        let alpha = self.deflect(x_arcsec, y_arcsec);
        [alpha.re, alpha.im]
    }

    /// Hessian (ψ_xx, ψ_xy, ψ_yy).
    fn hessian(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 3] {
        self.expand(x_arcsec, y_arcsec).1
    }
}

/// A mass profile as the registry lists it.
pub trait Described: MassProfile {
    /// lenstronomy's names for it.
    const NAMES: &'static [Name];
    /// Its parameters; the centre comes last.
    const PARAMETERS: &'static [Parameter];

    /// The profile of as many values as it has parameters.
    ///
    /// # Errors
    /// Another number of values, or one outside its domain.
    fn of_parameters(values: &[f64]) -> Result<Self>;

    /// Centre in arcsec, of a profile that has one.
    fn centre_arcsec(&self) -> Option<[f64; 2]> {
        None
    }
}

/// Deflection, convergence and shear of a lens at one point or in SIMD lanes.
#[derive(Debug, Clone, Copy)]
pub struct Response<R> {
    /// α_x + iα_y in arcsec.
    pub deflection: Cx<R>,
    /// Convergence κ.
    pub convergence: R,
    /// Shear γ1 + iγ2.
    pub shear: Cx<R>,
}

impl<R: Real> Response<R> {
    /// That of a deflection and the Hessian of its potential.
    #[inline(always)]
    pub(super) fn new(deflection: Cx<R>, [xx, xy, yy]: [R; 3]) -> Self {
        Self { deflection, convergence: (xx + yy) * 0.5, shear: Cx::new((xx - yy) * 0.5, xy) }
    }

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

impl Response<Lanes> {
    /// That of lane `i`.
    #[inline(always)]
    pub(crate) fn lane(&self, i: usize) -> Response<f64> {
        Response {
            deflection: self.deflection.lane(i),
            convergence: self.convergence.0[i],
            shear: self.shear.lane(i),
        }
    }
}

/// Compiled once for each instruction set and profile that fits are fast for, and called once for all lanes.
pub(super) mod kernels {
    use super::*;

    kernel! {
        pub fn deflect<P: MassProfile>(lens: &P, x: &Lanes, y: &Lanes) -> Cx<Lanes> {
            lens.deflect(*x, *y)
        }
    }

    kernel! {
        pub fn expand<P: MassProfile>(lens: &P, x: &Lanes, y: &Lanes) -> (Cx<Lanes>, [Lanes; 3]) {
            lens.expand(*x, *y)
        }
    }

    kernel! {
        pub fn respond<P: MassProfile>(
            lens: &P,
            x: &Lanes,
            y: &Lanes,
            by_parameter: &mut [Cx<Lanes>],
        ) -> Response<Lanes> {
            lens.respond(*x, *y, by_parameter)
        }
    }
}

/// Lane by lane, with the same bits: for profiles that are not worth the time of compiling them for every instruction set.
pub(super) mod each_lane {
    use super::*;

    pub fn deflect<P: MassProfile>(lens: &P, x: &Lanes, y: &Lanes) -> Cx<Lanes> {
        let mut alpha = Cx::<Lanes>::zero();
        for i in 0..LANES {
            [alpha.re.0[i], alpha.im.0[i]] = lens.deflection(x.0[i], y.0[i]);
        }
        alpha
    }

    pub fn expand<P: MassProfile>(lens: &P, x: &Lanes, y: &Lanes) -> (Cx<Lanes>, [Lanes; 3]) {
        let (mut alpha, mut hessian) = (Cx::<Lanes>::zero(), [Lanes::ZERO; 3]);
        for i in 0..LANES {
            let (own, [xx, xy, yy]) = lens.expand(x.0[i], y.0[i]);
            (alpha.re.0[i], alpha.im.0[i]) = (own.re, own.im);
            [hessian[0].0[i], hessian[1].0[i], hessian[2].0[i]] = [xx, xy, yy];
        }
        (alpha, hessian)
    }

    pub fn respond<P: MassProfile>(
        lens: &P,
        x: &Lanes,
        y: &Lanes,
        by_parameter: &mut [Cx<Lanes>],
    ) -> Response<Lanes> {
        let mut all = Response { deflection: Cx::zero(), convergence: Lanes::ZERO, shear: Cx::zero() };
        let mut own = [Cx::zero(); MOST_PARAMETERS];
        let own = &mut own[..by_parameter.len()];
        for i in 0..LANES {
            let response = lens.respond(x.0[i], y.0[i], own);
            all.convergence.0[i] = response.convergence;
            let columns = [&mut all.deflection, &mut all.shear].into_iter().chain(&mut *by_parameter);
            for (column, own) in columns.zip([response.deflection, response.shear].iter().chain(&*own)) {
                (column.re.0[i], column.im.0[i]) = (own.re, own.im);
            }
        }
        all
    }
}

/// Room for the parameters of any profile.
pub(crate) const MOST_PARAMETERS: usize = 9;
