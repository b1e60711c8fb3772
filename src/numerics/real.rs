//! Numbers that the model kernels are written for: one `f64`, or several side by side in SIMD registers.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Arithmetic of one number or of [`Lanes`]; the bits of a lane are those of the number.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Mul<f64, Output = Self>
    + Add<f64, Output = Self>
{
    /// The same number everywhere.
    fn splat(value: f64) -> Self;
    /// A function of each number.
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
    /// A function of each pair of numbers.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;
    /// x = 2^e·m with m in [√½, √2), for positive normal x.
    fn mantissa_and_exponent(self) -> (Self, Self);
    /// `other` where `test` is below `limit`, elsewhere this number.
    fn or_below(self, test: Self, limit: f64, other: Self) -> Self;
    /// Functions of the numbers that stand at the same place of each column.
    fn each<const M: usize, const N: usize>(columns: [Self; M], f: &impl Each<M, N>) -> [Self; N];
    /// The least and the largest of the numbers.
    fn extent(self) -> [f64; 2];

    /// Square root.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    /// 2ᵏ from k + 1.5·2⁵².
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.map(|shifted| f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52))
    }

    /// The nearest number from `low` to `high`.
    #[inline(always)]
    fn clamp(self, low: f64, high: f64) -> Self {
        self.map(|v| v.clamp(low, high))
    }

    /// The larger of the two.
    #[inline(always)]
    fn max(self, least: f64) -> Self {
        self.map(|v| if v > least { v } else { least })
    }

    /// `value` where `test` is below `limit`, elsewhere this number.
    #[inline(always)]
    fn unless_below(self, test: Self, limit: f64, value: f64) -> Self {
        self.zip(test, |v, test| if test < limit { value } else { v })
    }
}

/// `N` numbers of `M` numbers, for [`Real::each`]. A trait, since closures and functions that are handed over are not always
/// compiled into their caller and for its instruction set.
pub trait Each<const M: usize, const N: usize> {
    /// The numbers of these.
    fn of(&self, numbers: [f64; M]) -> [f64; N];
}

/// x = 2^e·m with m in [√½, √2), for positive normal x.
#[inline(always)]
fn mantissa_and_exponent(x: f64) -> (f64, f64) {
    // e is carried biased by 1023 so that all shifts are logical.
    const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;
    const TWO_POW_52_BITS: u64 = 0x4330_0000_0000_0000;
    let bits = x.to_bits();
    let biased = bits.wrapping_sub(SQRT_HALF_BITS).wrapping_add(ONE_BITS) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(biased << 52).wrapping_add(ONE_BITS));
    (m, f64::from_bits(biased | TWO_POW_52_BITS) - (4_503_599_627_370_496.0 + 1023.0))
}

impl Real for f64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(self)
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        f(self, other)
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        mantissa_and_exponent(self)
    }

    #[inline(always)]
    fn or_below(self, test: Self, limit: f64, other: Self) -> Self {
        if test < limit { other } else { self }
    }

    #[inline(always)]
    fn each<const M: usize, const N: usize>(columns: [Self; M], f: &impl Each<M, N>) -> [Self; N] {
        f.of(columns)
    }

    #[inline(always)]
    fn extent(self) -> [f64; 2] {
        [self; 2]
    }
}

/// Numbers in [`Lanes`]: four AVX-512 registers, so that some work while others wait for a result.
pub const LANES: usize = 32;

/// [`LANES`] numbers, one per ray or pixel sample.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    /// Zero in every lane.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// [`LANES`] numbers from `values[start..]`; beyond the end the last one again.
    #[inline(always)]
    pub fn load(values: &[f64], start: usize) -> Self {
        values[start..].first_chunk().map_or_else(|| Self::load_end(values, start), |run| Self(*run))
    }

    /// [`LANES`] numbers from `values[start..]`; beyond the end zero.
    #[inline(always)]
    pub fn load_or_zero(values: &[f64], start: usize) -> Self {
        values[start..].first_chunk().map_or_else(|| Self::load_end_or_zero(values, start), |run| Self(*run))
    }

    /// One for each `true` of `flags[start..]`, zero elsewhere and beyond the end.
    #[inline(always)]
    pub fn load_flags(flags: &[bool], start: usize) -> Self {
        match flags[start..].first_chunk::<LANES>() {
            Some(run) => {
                let mut lanes = Self::ZERO;
                for (lane, flag) in lanes.0.iter_mut().zip(run) {
                    *lane = f64::from(u8::from(*flag));
                }
                lanes
            }
            None => Self::load_end_of_flags(flags, start),
        }
    }

    // The ends are functions of their own, lest whole runs be read number by number as well.

    #[cold]
    #[inline(never)]
    fn load_end(values: &[f64], start: usize) -> Self {
        Self(std::array::from_fn(|i| values[(start + i).min(values.len() - 1)]))
    }

    #[cold]
    #[inline(never)]
    fn load_end_or_zero(values: &[f64], start: usize) -> Self {
        Self(std::array::from_fn(|i| values.get(start + i).copied().unwrap_or(0.0)))
    }

    #[cold]
    #[inline(never)]
    fn load_end_of_flags(flags: &[bool], start: usize) -> Self {
        Self(std::array::from_fn(|i| flags.get(start + i).map_or(0.0, |flag| f64::from(u8::from(*flag)))))
    }

    /// Writes the lanes to `values[start..]`, as many as there is room for.
    #[inline(always)]
    pub fn store(self, values: &mut [f64], start: usize) {
        match values.get_mut(start..start + LANES) {
            Some(run) => run.copy_from_slice(&self.0),
            None => values[start..].iter_mut().zip(self.0).for_each(|(out, lane)| *out = lane),
        }
    }

    /// Sum over the lanes, in a fixed order.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        sum_of_halves(self.0)
    }
}

/// The sum of a power of two of numbers: halves upon halves, sums side by side, each of few roundings.
#[inline(always)]
pub fn sum_of_halves<const N: usize>(mut parts: [f64; N]) -> f64 {
    let mut n = N;
    while n > 1 {
        n /= 2;
        for i in 0..n {
            parts[i] += parts[i + n];
        }
    }
    parts[0]
}

impl Real for Lanes {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for v in &mut out.0 {
            *v = f(*v);
        }
        out
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for (a, b) in out.0.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        out
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        let (mut m, mut e) = (self, self);
        for (m, e) in m.0.iter_mut().zip(&mut e.0) {
            (*m, *e) = mantissa_and_exponent(*m);
        }
        (m, e)
    }

    #[inline(always)]
    fn or_below(self, test: Self, limit: f64, other: Self) -> Self {
        let mut out = self;
        for ((v, test), other) in out.0.iter_mut().zip(test.0).zip(other.0) {
            *v = if test < limit { other } else { *v };
        }
        out
    }

    #[inline(always)]
    fn each<const M: usize, const N: usize>(columns: [Self; M], f: &impl Each<M, N>) -> [Self; N] {
        let mut out = [Self::ZERO; N];
        for i in 0..LANES {
            let mut numbers = [0.0; M];
            for c in 0..M {
                numbers[c] = columns[c].0[i];
            }
            let values = f.of(numbers);
            for n in 0..N {
                out[n].0[i] = values[n];
            }
        }
        out
    }

    #[inline(always)]
    fn extent(self) -> [f64; 2] {
        let (mut least, mut largest) = (self.0, self.0);
        let mut n = LANES;
        while n > 1 {
            n /= 2;
            for i in 0..n {
                least[i] = if least[i + n] < least[i] { least[i + n] } else { least[i] };
                largest[i] = if largest[i + n] > largest[i] { largest[i + n] } else { largest[i] };
            }
        }
        [least[0], largest[0]]
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

/// Each lane with the same number.
macro_rules! with_number {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait<f64> for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, number: f64) -> Self {
                self.map(|v| v $op number)
            }
        }
    };
}

with_number!(Mul, mul, *);
with_number!(Add, add, +);

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|v| -v)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::elementary::Elementary;

    #[test]
    fn lanes_have_the_bits_of_single_numbers() {
        let values: [f64; LANES] = std::array::from_fn(|i| 0.37 + 1.3 * i as f64);
        let lanes = Lanes(values);
        let got = ((lanes * lanes + 1.0).ln() - lanes.sqrt()).exp() / lanes;
        for (v, got) in values.into_iter().zip(got.0) {
            let want = Elementary::exp(Elementary::ln(v * v + 1.0) - v.sqrt()) / v;
            assert_eq!(got.to_bits(), want.to_bits());
        }
    }

    #[test]
    fn a_short_run_repeats_its_last_number() {
        assert_eq!(Lanes::load(&[1.0, 2.0], 1).0, [2.0; LANES]);
        assert_eq!(Lanes::splat(0.5).sum(), 0.5 * LANES as f64);
        assert_eq!(Lanes(std::array::from_fn(|i| 3.0 - i as f64)).extent(), [4.0 - LANES as f64, 3.0]);
        assert_eq!(Lanes::load_flags(&[false, true], 1).sum(), 1.0);
    }
}
