//! What every number of the line of sight and every parameter of the lenses does to β, in SIMD lanes.
//!
//! The minimal models are the full ones with numbers that stand for several (os := los, ds := odᵀ; flexion: see
//! [`LineOfSightKind`]), so there are two equations to differentiate: full and flexion. Rays that haloes carry bring
//! their own way to the lens and on to the source; the full equation then adds a tidal field to that of the haloes:
//! t + (A_od − 1)θ is where a ray meets the lens, and β = B(α) + (A_os − 1)θ − (A_ds − 1)α.

use super::equation::{Equation, act};
use super::flexion::FlexionModel;
use super::kind::LineOfSightKind;
use super::tensor::Tidal;
use crate::mapping::{HaloBlock, Rays};
use crate::numerics::complex::Cx;
use crate::numerics::dispatch::fit_kernel;
use crate::numerics::real::{LANES, Lanes};
use crate::profile::mass::{MOST_PARAMETERS, MassModel, Response};

type C = Cx<Lanes>;

/// Lenses behind a model of the line of sight, ready to be differentiated by all parameters.
pub(crate) struct LensResponse<'a> {
    kind: LineOfSightKind,
    equation: Equation,
    lenses: &'a [MassModel],
}

/// Numbers of the flexion model, the most of all.
pub(crate) const MOST_NUMBERS: usize = 26;

impl<'a> LensResponse<'a> {
    /// The model `kind` with its `numbers`, and the lenses.
    pub fn new(kind: LineOfSightKind, numbers: &[f64], lenses: &'a [MassModel]) -> Self {
        let equation = Equation::of(&kind.build(numbers));
        Self { kind, equation, lenses }
    }

    #[inline(always)]
    fn deflection(&self, at: C) -> C {
        let mut alpha = C::zero();
        for lens in self.lenses {
            alpha += lens.deflection_lanes(at.re, at.im);
        }
        alpha
    }

    /// β of the block of rays that starts there.
    pub fn beta(&self, rays: &Rays, start: usize) -> C {
        beta(self, rays, start)
    }

    #[inline(always)]
    fn beta_here(&self, rays: &Rays, start: usize) -> C {
        let (theta, haloes) = (rays.block(start), rays.haloes.as_ref().map(|haloes| haloes.block(start)));
        let alpha_d = self.deflection(self.at_lens(theta, haloes.as_ref()));
        let alpha = match self.equation {
            Equation::Full { .. } => alpha_d,
            Equation::Flexion(_) => self.deflection(theta),
        };
        let beta = self.equation.beta(theta, alpha_d, alpha);
        match haloes {
            Some(haloes) => beta + (haloes.beta(alpha_d) - theta + alpha_d),
            None => beta,
        }
    }

    /// Where rays meet the lens.
    #[inline(always)]
    fn at_lens(&self, theta: C, haloes: Option<&HaloBlock>) -> C {
        let at = self.equation.at_lens(theta);
        match haloes {
            Some(haloes) => at + (haloes.at_lens - theta),
            None => at,
        }
    }

    /// Deflections at the lens of all rays.
    pub fn deflections(&self, rays: &Rays) -> Vec<[f64; 2]> {
        let block = |start| {
            let haloes = rays.haloes.as_ref().map(|haloes| haloes.block(start));
            let alpha = self.deflection(self.at_lens(rays.block(start), haloes.as_ref()));
            (0..LANES).map(move |i| [alpha.re.0[i], alpha.im.0[i]])
        };
        rays.blocks().flat_map(block).take(rays.count()).collect()
    }

    /// As [`Self::beta`], with the derivatives of β by the numbers of the line of sight followed by the parameters of each
    /// lens.
    pub fn respond(&self, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        respond(self, rays, start, by_parameter)
    }

    #[inline(always)]
    fn respond_here(&self, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        let (theta, haloes) = (rays.block(start), rays.haloes.as_ref().map(|haloes| haloes.block(start)));
        let numbers = self.kind.parameters().len();
        let (by_number, by_lens) = by_parameter.split_at_mut(numbers);
        let mut own = [C::zero(); MOST_NUMBERS];
        let beta = match &self.equation {
            Equation::Full { ds, .. } => {
                let lens = self.lens_response(self.at_lens(theta, haloes.as_ref()), by_lens);
                let alpha = lens.deflection;
                // Plain loops: closures would not be compiled for the instruction set of their caller.
                let (by_theta, by_alpha) = (by_tensor(theta), by_tensor(alpha));
                for i in 0..4 {
                    own[i] = behind_lens(ds, haloes.as_ref(), alpha, lens.along(by_theta[i]));
                    own[4 + i] = by_theta[i];
                    own[8 + i] = -by_alpha[i];
                }
                for d in by_lens.iter_mut() {
                    *d = behind_lens(ds, haloes.as_ref(), alpha, *d);
                }
                let beta = self.equation.beta(theta, alpha, alpha);
                match haloes {
                    Some(haloes) => beta + (haloes.beta(alpha) - theta + alpha),
                    None => beta,
                }
            }
            Equation::Flexion(model) => self.respond_flexion(model, theta, &mut own, by_lens),
        };
        by_number.fill(C::zero());
        for (i, &number) in self.kind.roles().iter().enumerate() {
            by_number[number] += own[i] * if self.kind.turns(i) { -1.0 } else { 1.0 };
        }
        beta
    }

    #[inline(always)]
    fn respond_flexion(
        &self,
        model: &FlexionModel,
        theta: C,
        own: &mut [C; MOST_NUMBERS],
        by_lens: &mut [C],
    ) -> C {
        let mut at_theta = [C::zero(); MANY_LENSES];
        let at_theta = &mut at_theta[..by_lens.len()];
        let lens = self.lens_response(theta, at_theta);
        let lens_d = self.lens_response(model.at_lens(theta), by_lens);
        let (alpha, bar) = (lens.deflection, theta.conj());
        let (tidal_theta, tidal_alpha) = (by_tensor(theta), by_tensor(alpha));
        let (flexed_theta, flexed_alpha) = (by_flexion(theta), by_flexion(alpha));
        for i in 0..3 {
            own[i] = -lens_d.along(tidal_theta[i]);
            own[7 + i] = -tidal_alpha[i];
        }
        for i in 0..4 {
            own[3 + i] = tidal_theta[i];
            own[10 + i] = lens_d.along(flexed_theta[i]);
            own[14 + i] = -flexed_theta[i];
            own[18 + i] = -flexed_alpha[i];
        }
        let i = C::splat(0.0, 1.0);
        let alpha_bar = alpha.conj();
        own[22] = (theta + bar) * alpha + theta * alpha_bar;
        own[23] = i * ((bar - theta) * alpha + theta * alpha_bar);
        own[24] = bar * alpha_bar;
        own[25] = i * own[24];
        let (direct, crossed) = model.behind_lens(theta);
        for (d, at_theta) in by_lens.iter_mut().zip(at_theta.iter()) {
            let a = *at_theta;
            *d = direct * a + crossed * a.conj() - model.flexion_1ds.bend_along(alpha, a) - *d;
        }
        theta - model.displacement(theta, alpha, lens_d.deflection)
    }

    /// The lenses' response, with each lens's parameters one after the other in `by_parameter`.
    #[inline(always)]
    fn lens_response(&self, at: C, by_parameter: &mut [C]) -> Response<Lanes> {
        let mut sum = Response { deflection: C::zero(), convergence: Lanes::ZERO, shear: C::zero() };
        let mut rest = by_parameter;
        for lens in self.lenses {
            let (own, after) = rest.split_at_mut(lens.parameters().len());
            let response = lens.response_lanes(at.re, at.im, own);
            sum.deflection += response.deflection;
            sum.convergence += response.convergence;
            sum.shear += response.shear;
            rest = after;
        }
        sum
    }
}

// Compiled once for each instruction set and called once for all lanes.
fit_kernel! {
    fn beta(lens: &LensResponse, rays: &Rays, start: usize) -> C {
        lens.beta_here(rays, start)
    }
}

fit_kernel! {
    fn respond(lens: &LensResponse, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        lens.respond_here(rays, start, by_parameter)
    }
}

/// What a change of the deflection does to β.
#[inline(always)]
fn behind_lens(ds: &Tidal, haloes: Option<&HaloBlock>, alpha: C, d_alpha: C) -> C {
    match haloes {
        Some(haloes) => haloes.along(alpha, d_alpha) + (d_alpha - act(ds, d_alpha)),
        None => -act(ds, d_alpha),
    }
}

/// Room for the parameters of eight lenses.
pub(crate) const MANY_LENSES: usize = 8 * MOST_PARAMETERS;

/// Derivatives of A·z by κ, γ1, γ2, ω.
#[inline(always)]
fn by_tensor(z: C) -> [C; 4] {
    let i = C::splat(0.0, 1.0);
    [-z, -z.conj(), -(i * z.conj()), -(i * z)]
}

/// Derivatives of q(z; F, G) by F1, F2, G1, G2.
#[inline(always)]
fn by_flexion(z: C) -> [C; 4] {
    let (half_i, bar) = (C::splat(0.0, 0.5), z.conj());
    let (square, modulus, bar_square) = (z * z, z * bar, bar * bar);
    [(square + modulus * 2.0) * 0.5, half_i * (modulus * 2.0 - square), bar_square * 0.5, half_i * bar_square]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mapping::tidal::TidalLens;
    use crate::mapping::{Mapping, Order};
    use crate::numerics::differences::derivative;
    use crate::profile::mass::{Epl, Nfw};

    /// Richardson differences with a step of 1e-3.
    const DIFFERENCES: f64 = 1e-9;

    fn lenses(p: &[f64]) -> Vec<MassModel> {
        let epl = Epl::new(p[0], p[1], [p[2], p[3]], [p[4], p[5]]).unwrap();
        let nfw = Nfw::new(p[6], p[7], [p[10], p[11]]).unwrap();
        let nfw = nfw.with_elliptical_potential([p[8], p[9]]).unwrap();
        vec![MassModel::Epl(epl), MassModel::Nfw(nfw)]
    }

    const LENSES: [f64; 12] = [1.2, 2.2, 0.1, -0.05, 0.02, 0.03, 3.0, 0.3, 0.05, 0.02, -0.1, 0.04];

    proptest! {
        #[test]
        fn responses_are_those_of_the_mapping(
            numbers in prop::collection::vec(-0.05..0.05_f64, 26), x in -2.0..2.0_f64, y in 0.3..2.0_f64,
        ) {
            use LineOfSightKind::{Flexion, FlexionMinimal, Full, Minimal, None};
            for kind in [None, Full, Minimal, Flexion, FlexionMinimal] {
                let n = kind.parameters().len();
                let parameters = [&numbers[..n], &LENSES].concat();
                let beta = |p: &[f64], component: usize| {
                    let mapping = TidalLens::new(kind.build(&p[..n]), lenses(&p[n..]));
                    mapping.map(&[[x, y]], Order::Position).beta_arcsec[0][component]
                };
                let lenses = lenses(&LENSES);
                let family = LensResponse::new(kind, &parameters[..n], &lenses);
                let rays = Rays::new(&[[x, y]; 8]);
                let mut by = vec![C::zero(); parameters.len()];
                let got = family.respond(&rays, 0, &mut by);
                prop_assert_eq!(got, family.beta(&rays, 0));
                prop_assert!((got.re.0[3] - beta(&parameters, 0)).abs() < 1e-14);
                prop_assert!((got.im.0[5] - beta(&parameters, 1)).abs() < 1e-14);
                for (i, by) in by.iter().enumerate() {
                    let moved = |v: f64, component| {
                        let mut p = parameters.clone();
                        p[i] = v;
                        beta(&p, component)
                    };
                    let wanted = [0, 1].map(|c| derivative(|v| moved(v, c), parameters[i], 1e-3));
                    for (got, want) in [(by.re.0[0], wanted[0]), (by.im.0[7], wanted[1])] {
                        prop_assert!((got - want).abs() < DIFFERENCES * (1.0 + want.abs()),
                            "{kind:?} parameter {i}: {got:e}, differences {want:e}");
                    }
                }
            }
        }
    }
}
