//! Taylor expansions in θ of complex functions, of first order or of second.

use std::ops::{Add, Mul, Sub};

use nalgebra::Complex;

use super::algebra::Algebra;
use crate::numerics::complex::Cx;

/// A complex function of θ = (x, y) with its derivatives: `S` = 0 second ones or all 3.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet<const S: usize> {
    pub value: Cx<f64>,
    /// ∂/∂x, ∂/∂y.
    pub first: [Cx<f64>; 2],
    /// ∂²/∂x², ∂²/∂x∂y, ∂²/∂y².
    pub second: [Cx<f64>; S],
}

/// Which two first derivatives make each second one.
const PAIRS: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

impl<const S: usize> Jet<S> {
    /// θ itself as the complex number x + iy.
    #[inline(always)]
    pub fn theta(x: f64, y: f64) -> Self {
        let first = [Cx::splat(1.0, 0.0), Cx::splat(0.0, 1.0)];
        Self { value: Cx::new(x, y), first, second: [Cx::zero(); S] }
    }

    /// The deflection `alpha` of lenses at this position, by the chain rule from the Hessian of their potential there and, for
    /// second derivatives, its third derivatives.
    #[inline(always)]
    pub fn deflected(&self, alpha: Cx<f64>, hessian: [f64; 3], third: [f64; 4]) -> Self {
        let along = [Cx::new(hessian[0], hessian[1]), Cx::new(hessian[1], hessian[2])];
        let mut deflected = Self { value: alpha, ..*self };
        for i in 0..2 {
            let d = self.first[i];
            deflected.first[i] = along[0].scale(d.re) + along[1].scale(d.im);
        }
        for (n, &(i, j)) in PAIRS.iter().enumerate().take(S) {
            let (a, b, ab) = (self.first[i], self.first[j], self.second[n]);
            deflected.second[n] = Cx::new(third[0], third[1]).scale(a.re * b.re)
                + Cx::new(third[1], third[2]).scale(a.re * b.im + a.im * b.re)
                + Cx::new(third[2], third[3]).scale(a.im * b.im)
                + along[0].scale(ab.re)
                + along[1].scale(ab.im);
        }
        deflected
    }
}

/// The same linear function of value and derivatives. A macro, since closures are not always compiled into their caller.
macro_rules! linear {
    ($jet:expr, $v:ident => $image:expr) => {{
        let mut jet = $jet;
        let $v = jet.value;
        jet.value = $image;
        for v in &mut jet.first {
            let $v = *v;
            *v = $image;
        }
        for v in &mut jet.second {
            let $v = *v;
            *v = $image;
        }
        jet
    }};
}

impl<const S: usize> Add for Jet<S> {
    type Output = Self;

    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        for i in 0..2 {
            self.first[i] += other.first[i];
        }
        for n in 0..S {
            self.second[n] += other.second[n];
        }
        self
    }
}

impl<const S: usize> Sub for Jet<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.add(linear!(other, v => -v))
    }
}

impl<const S: usize> Mul<f64> for Jet<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        linear!(self, v => v * factor)
    }
}

impl<const S: usize> Mul for Jet<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self, other);
        let mut product = Self { value: a.value * b.value, ..a };
        for i in 0..2 {
            product.first[i] = a.first[i] * b.value + a.value * b.first[i];
        }
        for (n, &(i, j)) in PAIRS.iter().enumerate().take(S) {
            product.second[n] = a.second[n] * b.value
                + a.first[i] * b.first[j]
                + a.first[j] * b.first[i]
                + a.value * b.second[n];
        }
        product
    }
}

impl<const S: usize> Algebra for Jet<S> {
    #[inline(always)]
    fn conj(self) -> Self {
        linear!(self, v => v.conj())
    }

    #[inline(always)]
    fn times(self, factor: Complex<f64>) -> Self {
        linear!(self, v => v.times(factor))
    }

    #[inline(always)]
    fn plus(self, term: Complex<f64>) -> Self {
        Self { value: self.value.plus(term), ..self }
    }
}
