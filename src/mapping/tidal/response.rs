//! What every number of the line of sight and every parameter of the lenses does to β, in SIMD lanes.
//!
//! The minimal models are the full ones with numbers that stand for several (os := los, ds := odᵀ; flexion: see
//! [`LineOfSightKind`]), so there are two equations to differentiate: full and flexion. Rays that haloes carry bring
//! their own way to the lens and on to the source; the full equation then adds a tidal field to that of the haloes:
//! t + (A_od − 1)θ is where a ray meets the lens, and β = B(α) + (A_os − 1)θ − (A_ds − 1)α.

use super::equation::{Equation, deflection};
use super::flexion::FlexionModel;
use super::kind::LineOfSightKind;
use super::tensor::Tidal;
use crate::mapping::{HaloBlock, Rays};
use crate::numerics::complex::Cx;
use crate::numerics::dispatch::kernel;
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

    /// β of the block of rays that starts there.
    pub fn beta(&self, rays: &Rays, start: usize) -> C {
        beta(self, rays, start)
    }

    #[inline(always)]
    fn beta_here(&self, rays: &Rays, start: usize) -> C {
        let (theta, haloes) = (rays.block(start), rays.haloes.as_ref().map(|haloes| haloes.block(start)));
        let alpha_d = deflection(self.lenses, &self.at_lens(&theta, haloes.as_ref()));
        let mut beta = match self.equation {
            Equation::Full { .. } => self.equation.beta_lanes(&theta, &alpha_d, &alpha_d),
            Equation::Flexion(_) => {
                self.equation.beta_lanes(&theta, &alpha_d, &deflection(self.lenses, &theta))
            }
        };
        if let Some(haloes) = &haloes {
            for i in 0..LANES {
                let alpha = alpha_d.lane(i);
                beta.set_lane(i, beta.lane(i) + (haloes.beta(i, alpha) - theta.lane(i) + alpha));
            }
        }
        beta
    }

    /// Where rays meet the lens.
    #[inline(always)]
    fn at_lens(&self, theta: &C, haloes: Option<&HaloBlock>) -> C {
        let at = self.equation.at_lens_lanes(theta);
        match haloes {
            Some(haloes) => at + (haloes.at_lens - *theta),
            None => at,
        }
    }

    /// Deflections at the lens of all rays.
    pub fn deflections(&self, rays: &Rays) -> Vec<[f64; 2]> {
        let block = |start| {
            let haloes = rays.haloes.as_ref().map(|haloes| haloes.block(start));
            let alpha = deflection(self.lenses, &self.at_lens(&rays.block(start), haloes.as_ref()));
            (0..LANES).map(move |i| [alpha.re.0[i], alpha.im.0[i]])
        };
        rays.blocks().flat_map(block).take(rays.count()).collect()
    }

    /// As [`Self::beta`], with the derivatives of β by the numbers of the line of sight followed by the parameters of each
    /// lens.
    pub fn respond(&self, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        respond(self, rays, start, by_parameter)
    }

    /// The lenses in lanes, the equation ray by ray, in loops that the compiler makes lanes of.
    #[inline(always)]
    fn respond_here(&self, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        let (theta, haloes) = (rays.block(start), rays.haloes.as_ref().map(|haloes| haloes.block(start)));
        let (by_number, by_lens) = by_parameter.split_at_mut(self.kind.parameters().len());
        let at_lens = self.lens_response(&self.at_lens(&theta, haloes.as_ref()), by_lens);
        let mut block = Block { beta: C::zero(), behind: [C::zero(); 2], own: [C::zero(); MOST_NUMBERS] };
        match &self.equation {
            Equation::Full { ds, .. } => {
                for i in 0..LANES {
                    self.respond_full(ds, i, theta.lane(i), &at_lens, haloes.as_ref(), &mut block);
                }
                for d in by_lens.iter_mut() {
                    for i in 0..LANES {
                        d.set_lane(i, block.behind(i, d.lane(i)));
                    }
                }
            }
            Equation::Flexion(model) => {
                let mut by_lens_at_theta = [C::zero(); MANY_LENSES];
                let by_lens_at_theta = &mut by_lens_at_theta[..by_lens.len()];
                let at_theta = self.lens_response(&theta, by_lens_at_theta);
                for i in 0..LANES {
                    respond_flexion(model, i, theta.lane(i), &at_theta, &at_lens, &mut block);
                }
                for (d, at_theta) in by_lens.iter_mut().zip(by_lens_at_theta) {
                    for i in 0..LANES {
                        d.set_lane(i, block.behind(i, at_theta.lane(i)) - d.lane(i));
                    }
                }
            }
        }
        by_number.fill(C::zero());
        for (own, (i, &number)) in block.own.iter().zip(self.kind.roles().iter().enumerate()) {
            by_number[number] += *own * if self.kind.turns(i) { -1.0 } else { 1.0 };
        }
        block.beta
    }

    #[inline(always)]
    fn respond_full(
        &self,
        ds: &Tidal,
        i: usize,
        theta: Cx<f64>,
        lens: &Response<Lanes>,
        haloes: Option<&HaloBlock>,
        out: &mut Block,
    ) {
        let alpha = lens.deflection.lane(i);
        let mut beta = self.equation.beta(theta, alpha, alpha);
        let mut behind = [Cx::new(ds.kappa - 1.0, ds.omega), Cx::new(ds.gamma.re, ds.gamma.im)];
        if let Some(haloes) = haloes {
            beta += haloes.beta(i, alpha) - theta + alpha;
            let [direct, crossed] = haloes.along(i, alpha);
            behind[0] += direct + Cx::new(1.0, 0.0);
            behind[1] += crossed;
        }
        out.beta.set_lane(i, beta);
        out.set_behind(i, behind);
        let (by_theta, by_alpha) = (by_tensor(theta), by_tensor(alpha));
        // Plain loops: closures would not be compiled for the instruction set of their caller.
        for k in 0..4 {
            out.own[k].set_lane(i, out.behind(i, lens.lane(i).along(by_theta[k])));
            out.own[4 + k].set_lane(i, by_theta[k]);
            out.own[8 + k].set_lane(i, -by_alpha[k]);
        }
    }

    /// The lenses' response, with each lens's parameters one after the other in `by_parameter`.
    #[inline(always)]
    fn lens_response(&self, at: &C, by_parameter: &mut [C]) -> Response<Lanes> {
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

/// What the equation makes of a block of rays.
struct Block {
    beta: C,
    /// What the deflection (in flexion models, that at θ) does to β: dβ = behind[0] dα + behind[1] dᾱ.
    behind: [C; 2],
    /// Derivatives of β by the numbers of the full or the flexion model.
    own: [C; MOST_NUMBERS],
}

impl Block {
    #[inline(always)]
    fn set_behind(&mut self, i: usize, [direct, crossed]: [Cx<f64>; 2]) {
        self.behind[0].set_lane(i, direct);
        self.behind[1].set_lane(i, crossed);
    }

    /// Change of β when the deflection of ray `i` changes by `d_alpha`.
    #[inline(always)]
    fn behind(&self, i: usize, d_alpha: Cx<f64>) -> Cx<f64> {
        self.behind[0].lane(i) * d_alpha + self.behind[1].lane(i) * d_alpha.conj()
    }
}

#[inline(always)]
fn respond_flexion(
    model: &FlexionModel,
    i: usize,
    theta: Cx<f64>,
    at_theta: &Response<Lanes>,
    at_lens: &Response<Lanes>,
    out: &mut Block,
) {
    let (alpha, lens_d) = (at_theta.deflection.lane(i), at_lens.lane(i));
    out.beta.set_lane(i, theta - model.displacement(theta, alpha, lens_d.deflection));
    let [direct, crossed] = model.behind_lens(theta);
    let [bent, bent_crossed] = model.flexion_1ds.along(alpha);
    out.set_behind(i, [direct - bent, crossed - bent_crossed]);
    let (tidal_theta, tidal_alpha) = (by_tensor(theta), by_tensor(alpha));
    let (flexed_theta, flexed_alpha) = (by_flexion(theta), by_flexion(alpha));
    for k in 0..3 {
        out.own[k].set_lane(i, -lens_d.along(tidal_theta[k]));
        out.own[7 + k].set_lane(i, -tidal_alpha[k]);
    }
    for k in 0..4 {
        out.own[3 + k].set_lane(i, tidal_theta[k]);
        out.own[10 + k].set_lane(i, lens_d.along(flexed_theta[k]));
        out.own[14 + k].set_lane(i, -flexed_theta[k]);
        out.own[18 + k].set_lane(i, -flexed_alpha[k]);
    }
    let (unit, bar, alpha_bar) = (Cx::new(0.0, 1.0), theta.conj(), alpha.conj());
    let twice = bar * alpha_bar;
    out.own[22].set_lane(i, (theta + bar) * alpha + theta * alpha_bar);
    out.own[23].set_lane(i, unit * ((bar - theta) * alpha + theta * alpha_bar));
    out.own[24].set_lane(i, twice);
    out.own[25].set_lane(i, unit * twice);
}

// Compiled once for each instruction set and called once for all lanes.
kernel! {
    fn beta(lens: &LensResponse, rays: &Rays, start: usize) -> C {
        lens.beta_here(rays, start)
    }
}

kernel! {
    fn respond(lens: &LensResponse, rays: &Rays, start: usize, by_parameter: &mut [C]) -> C {
        lens.respond_here(rays, start, by_parameter)
    }
}

/// Room for the parameters of eight lenses.
pub(crate) const MANY_LENSES: usize = 8 * MOST_PARAMETERS;

/// Derivatives of A·z by κ, γ1, γ2, ω.
#[inline(always)]
fn by_tensor(z: Cx<f64>) -> [Cx<f64>; 4] {
    let i = Cx::new(0.0, 1.0);
    [-z, -z.conj(), -(i * z.conj()), -(i * z)]
}

/// Derivatives of q(z; F, G) by F1, F2, G1, G2.
#[inline(always)]
fn by_flexion(z: Cx<f64>) -> [Cx<f64>; 4] {
    let (half_i, bar) = (Cx::new(0.0, 0.5), z.conj());
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
