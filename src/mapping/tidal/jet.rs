//! Second-order Taylor expansions in θ of complex functions: values with all first and second derivatives.

use std::ops::{Add, Mul, Sub};

use nalgebra::Complex;

use crate::profile::mass::{MassModel, MassProfile};

type C = Complex<f64>;

/// A complex function of θ = (x, y) with its derivatives (x, y, xx, xy, yy) at one point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub value: C,
    /// ∂/∂x, ∂/∂y.
    pub first: [C; 2],
    /// ∂²/∂x², ∂²/∂x∂y, ∂²/∂y².
    pub second: [C; 3],
}

const ZERO: C = Complex::new(0.0, 0.0);

impl Jet {
    /// θ itself as the complex number x + iy.
    pub fn theta(x: f64, y: f64) -> Self {
        let (one, i) = (Complex::new(1.0, 0.0), Complex::new(0.0, 1.0));
        Self { value: Complex::new(x, y), first: [one, i], second: [ZERO; 3] }
    }

    /// Deflection α_x + iα_y of the lenses at this position, by the chain rule; without `SECOND` the second derivatives
    /// lack what the third derivatives of the potential add to them.
    pub fn deflected_by<const SECOND: bool>(self, lenses: &[MassModel]) -> Self {
        let (x, y) = (self.value.re, self.value.im);
        let mut value = ZERO;
        let (mut hessian, mut third) = ([0.0; 3], [0.0; 4]);
        for lens in lenses {
            let [ax, ay] = lens.deflection(x, y);
            value += Complex::new(ax, ay);
            add(&mut hessian, lens.hessian(x, y));
            if SECOND {
                add(&mut third, lens.third_derivatives(x, y));
            }
        }
        let along = [Complex::new(hessian[0], hessian[1]), Complex::new(hessian[1], hessian[2])];
        let bend = [0, 1, 2].map(|i| Complex::new(third[i], third[i + 1]));
        let first = self.first.map(|d| along[0] * d.re + along[1] * d.im);
        let second = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let (a, b, ab) = (self.first[i], self.first[j], self.second[i + j]);
            bend[0] * (a.re * b.re)
                + bend[1] * (a.re * b.im + a.im * b.re)
                + bend[2] * (a.im * b.im)
                + along[0] * ab.re
                + along[1] * ab.im
        });
        Self { value, first, second }
    }
}

fn add<const N: usize>(sum: &mut [f64; N], terms: [f64; N]) {
    sum.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: [0, 1].map(|i| self.first[i] + other.first[i]),
            second: [0, 1, 2].map(|i| self.second[i] + other.second[i]),
        }
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            first: self.first.map(|v| v * factor),
            second: self.second.map(|v| v * factor),
        }
    }
}

impl Mul for Jet {
    type Output = Self;

    #[allow(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self, other);
        Self {
            value: a.value * b.value,
            first: [0, 1].map(|i| a.first[i] * b.value + a.value * b.first[i]),
            second: [(0, 0), (0, 1), (1, 1)].map(|(i, j)| {
                a.second[i + j] * b.value
                    + a.first[i] * b.first[j]
                    + a.first[j] * b.first[i]
                    + a.value * b.second[i + j]
            }),
        }
    }
}
