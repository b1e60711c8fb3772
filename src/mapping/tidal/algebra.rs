//! What the equations of the tidal models ask of a number: single values, SIMD lanes and Taylor expansions all have it.

use std::ops::{Add, Mul, Sub};

use nalgebra::Complex;

use crate::numerics::complex::Cx;
use crate::numerics::real::Real;

/// Complex numbers, or functions with complex values, of which the models of the line of sight are polynomials.
pub(super) trait Algebra:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    /// Complex conjugate.
    fn conj(self) -> Self;
    /// Times a constant.
    fn times(self, factor: Complex<f64>) -> Self;
    /// Plus a constant.
    fn plus(self, term: Complex<f64>) -> Self;
}

impl<R: Real> Algebra for Cx<R> {
    #[inline(always)]
    fn conj(self) -> Self {
        Cx::conj(self)
    }

    #[inline(always)]
    fn times(self, factor: Complex<f64>) -> Self {
        Self::splat(factor.re, factor.im) * self
    }

    #[inline(always)]
    fn plus(self, term: Complex<f64>) -> Self {
        Self::splat(term.re, term.im) + self
    }
}

impl Algebra for Complex<f64> {
    fn conj(self) -> Self {
        Complex::conj(&self)
    }

    fn times(self, factor: Complex<f64>) -> Self {
        factor * self
    }

    fn plus(self, term: Complex<f64>) -> Self {
        term + self
    }
}
