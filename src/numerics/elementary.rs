//! Branch-free ln, exp and arctan that the compiler turns into SIMD: 2 ulp, the same bits on every CPU.
//!
//! Only +, −, ×, ÷ and bit operations, never a fused multiply-add: IEEE 754 fixes every bit of the
//! result, so AVX-512, AVX2 and plain code agree exactly. The polynomials are printed by
//! `data/reference/make_polynomials.py`.

use super::real::Real;

const ARTANH: [f64; 7] = [
    0.333_333_333_333_333_5,
    0.199_999_999_999_488_26,
    0.142_857_143_134_069_9,
    0.111_111_054_990_618_73,
    0.090_914_495_340_317_76,
    0.076_656_957_989_932_56,
    0.073_102_612_781_862_25,
];

const ARCTAN: [f64; 11] = [
    -0.333_333_333_333_333_3,
    0.199_999_999_999_954_93,
    -0.142_857_142_846_604_95,
    0.111_111_110_147_700_66,
    -0.090_909_045_583_716_15,
    0.076_921_827_321_137_3,
    -0.066_645_049_882_144_91,
    0.058_580_928_215_155_27,
    -0.050_851_563_157_224_11,
    0.039_223_184_414_091_21,
    -0.019_166_513_005_958_467,
];

/// Σ cₙzⁿ of at least four terms as four sums in z⁴, which the processor adds side by side.
#[inline(always)]
pub fn polynomial<R: Real, const N: usize>(coefficients: &[f64; N], z: R) -> R {
    let square = z * z;
    let fourth = square * square;
    let (lower, highest) = coefficients.split_at(N - 4);
    let mut sums = [R::splat(0.0); 4];
    for k in 0..4 {
        sums[k] = R::splat(highest[k]);
    }
    for lower in lower.rchunks(4) {
        let [a, b, c, d] = sums;
        sums = match lower {
            [p, q, r, s] => [a * fourth + *p, b * fourth + *q, c * fourth + *r, d * fourth + *s],
            [p, q, r] => [b * fourth + *p, c * fourth + *q, d * fourth + *r, a],
            [p, q] => [c * fourth + *p, d * fourth + *q, a, b],
            [p] => [d * fourth + *p, a, b, c],
            _ => sums,
        };
    }
    (sums[0] + z * sums[1]) + square * (sums[2] + z * sums[3])
}

/// (artanh(s)/s − 1)/s² for |s| ≤ (√2−1)/(√2+1) = 0.1716, from z = s².
#[inline(always)]
pub fn artanh_series<R: Real>(z: R) -> R {
    polynomial(&ARTANH, z)
}

const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// ln x for positive normal x (2.3e-308 < x < ∞); other arguments give an unspecified number.
#[inline(always)]
pub fn ln<R: Real>(x: R) -> R {
    let ([numerator, denominator], e) = reduced_for_ln(x);
    half_ln_of_reduced(numerator / denominator, e) * 2.0
}

/// Numerator and denominator of s and a whole number e of which ln x is made, for whom a division is dear.
#[inline(always)]
pub fn reduced_for_ln<R: Real>(x: R) -> ([R; 2], R) {
    let (m, e) = x.mantissa_and_exponent();
    ([m + -1.0, m + 1.0], e)
}

/// ½ ln x = ½e·ln 2 + artanh s.
#[inline(always)]
pub fn half_ln_of_reduced<R: Real>(s: R, e: R) -> R {
    let z = s * s;
    e * (0.5 * LN2_HIGH) + ((s + e * (0.5 * LN2_LOW)) + s * z * artanh_series(z))
}

/// The least argument of [`ln_1p`], √½ − 1.
pub const LEAST_OF_LN_1P: f64 = std::f64::consts::FRAC_1_SQRT_2 - 1.0;

/// ln(1 + x) for x > √½ − 1, without loss where x is small.
#[inline(always)]
pub fn ln_1p<R: Real>(x: R) -> R {
    let sum = x + 1.0;
    let (m, e) = sum.mantissa_and_exponent();
    let s = (m + -1.0).or_below(sum, std::f64::consts::SQRT_2, x) / (m + 1.0);
    half_ln_of_reduced(s, e) * 2.0
}

/// (arctan(t)/t − 1)/t² for |t| ≤ tan(π/8) = √2 − 1, from z = t².
#[inline(always)]
pub fn arctan_series<R: Real>(z: R) -> R {
    polynomial(&ARCTAN, z)
}

/// eˣ; 0 below −708, and arguments above 708 are taken as 708.
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    // x = k·ln 2 + r with |r| ≤ ½ ln 2, then the Taylor series: its first term left out is 4e-18.
    const INVERSE_FACTORIALS: [f64; 12] = [
        1.0 / 2.0,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ];
    let clamped = x.clamp(-708.0, 708.0);
    let shifted = clamped * std::f64::consts::LOG2_E + ROUNDER;
    let k = shifted + -ROUNDER;
    let r = (clamped - k * LN2_HIGH) - k * LN2_LOW;
    let fraction = (r + r * r * polynomial(&INVERSE_FACTORIALS, r)) + 1.0;
    (fraction * shifted.power_of_two()).unless_below(x, -708.0, 0.0)
}

/// Adding 1.5·2⁵² rounds to an integer and leaves it in the low bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// ln and exp of [`Real`] numbers as methods.
pub trait Elementary: Real {
    /// Natural logarithm of positive normal numbers.
    #[inline(always)]
    fn ln(self) -> Self {
        ln(self)
    }

    /// Exponential function, 0 below −708 and of 708 above.
    #[inline(always)]
    fn exp(self) -> Self {
        exp(self)
    }
}

impl<R: Real> Elementary for R {}
