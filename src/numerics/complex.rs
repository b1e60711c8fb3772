//! Complex numbers over one `f64` or over [`Lanes`].

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use super::real::{Lanes, Real};

/// re + i·im.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cx<R> {
    /// Real part.
    pub re: R,
    /// Imaginary part.
    pub im: R,
}

impl<R: Real> Cx<R> {
    /// re + i·im.
    #[inline(always)]
    pub fn new(re: R, im: R) -> Self {
        Self { re, im }
    }

    /// The same number everywhere.
    #[inline(always)]
    pub fn splat(re: f64, im: f64) -> Self {
        Self::new(R::splat(re), R::splat(im))
    }

    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(0.0, 0.0)
    }

    /// Complex conjugate.
    #[inline(always)]
    pub fn conj(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// |z|².
    #[inline(always)]
    pub fn norm_sqr(self) -> R {
        self.re * self.re + self.im * self.im
    }

    /// Times a real number.
    #[inline(always)]
    pub fn scale(self, factor: R) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }

    /// Re(z̄·other), the scalar product of the two vectors.
    #[inline(always)]
    pub fn dot(self, other: Self) -> R {
        self.re * other.re + self.im * other.im
    }
}

impl Cx<Lanes> {
    /// The number of lane `i`.
    #[inline(always)]
    pub fn lane(&self, i: usize) -> Cx<f64> {
        Cx::new(self.re.0[i], self.im.0[i])
    }

    /// Puts a number in lane `i`.
    #[inline(always)]
    pub fn set_lane(&mut self, i: usize, number: Cx<f64>) {
        (self.re.0[i], self.im.0[i]) = (number.re, number.im);
    }
}

impl<R: Real> Add for Cx<R> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl<R: Real> Sub for Cx<R> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl<R: Real> Mul for Cx<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }
}

impl<R: Real> Mul<f64> for Cx<R> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }
}

impl<R: Real> Neg for Cx<R> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.re, -self.im)
    }
}

impl<R: Real> AddAssign for Cx<R> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<R: Real> SubAssign for Cx<R> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
