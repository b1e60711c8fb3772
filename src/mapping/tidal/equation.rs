//! The two equations behind all tidal models, for single values and Taylor expansions alike.

use nalgebra::Complex;

use super::algebra::Algebra;
use super::flexion::FlexionModel;
use super::model::LineOfSightModel;
use super::tensor::Tidal;
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};
use crate::profile::mass::MassModel;

/// A model of the line of sight with the numbers that stand for others put in: os := los and ds := odᵀ in the minimal one.
#[derive(Debug, Clone, Copy)]
pub(super) enum Equation {
    /// β = A_os θ − A_ds α(A_od θ).
    Full { od: Tidal, os: Tidal, ds: Tidal },
    /// See [`FlexionModel`].
    Flexion(FlexionModel),
}

impl Equation {
    pub fn of(model: &LineOfSightModel) -> Self {
        match *model {
            LineOfSightModel::Full { od, os, ds } => Self::Full { od, os, ds },
            LineOfSightModel::Minimal { od, los } => Self::Full { od, os: los, ds: od.transposed() },
            LineOfSightModel::Flexion(model) => Self::Flexion(model),
        }
    }

    /// θ_d: where a ray seen at θ meets the lens.
    #[inline(always)]
    pub fn at_lens<C: Algebra>(&self, theta: C) -> C {
        match self {
            Self::Full { od, .. } => act(od, theta),
            Self::Flexion(model) => model.at_lens(theta),
        }
    }

    /// β of the rays θ whose deflections at θ_d are `alpha_d`; `alpha`, those at θ, enter flexion models alone.
    #[inline(always)]
    pub fn beta<C: Algebra>(&self, theta: C, alpha_d: C, alpha: C) -> C {
        match self {
            Self::Full { os, ds, .. } => act(os, theta) - act(ds, alpha_d),
            Self::Flexion(model) => theta - model.displacement(theta, alpha, alpha_d),
        }
    }

    // Ray by ray, in loops that the compiler makes lanes of: written in lanes they take it minutes to unroll.

    /// [`Self::at_lens`] of each ray.
    #[inline(always)]
    pub fn at_lens_lanes(&self, theta: &Cx<Lanes>) -> Cx<Lanes> {
        let mut at = Cx::<Lanes>::zero();
        for i in 0..LANES {
            at.set_lane(i, self.at_lens(theta.lane(i)));
        }
        at
    }

    /// [`Self::beta`] of each ray.
    #[inline(always)]
    pub fn beta_lanes(&self, theta: &Cx<Lanes>, alpha_d: &Cx<Lanes>, alpha: &Cx<Lanes>) -> Cx<Lanes> {
        let mut beta = Cx::<Lanes>::zero();
        for i in 0..LANES {
            beta.set_lane(i, self.beta(theta.lane(i), alpha_d.lane(i), alpha.lane(i)));
        }
        beta
    }
}

/// Deflection by all lenses in every lane.
#[inline(always)]
pub(super) fn deflection(lenses: &[MassModel], at: &Cx<Lanes>) -> Cx<Lanes> {
    let mut alpha = Cx::zero();
    for lens in lenses {
        alpha += lens.deflection_lanes(at.re, at.im);
    }
    alpha
}

/// A·z = (1 − κ − iω)z − γz̄.
#[inline(always)]
fn act<C: Algebra>(tidal: &Tidal, z: C) -> C {
    z.times(Complex::new(1.0 - tidal.kappa, -tidal.omega)) - z.conj().times(tidal.gamma)
}
