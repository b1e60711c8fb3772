//! The elementary functions in use are those of the crate `libm`, not the C library's, in haloray and in what it calls.

use std::hint::black_box;

fn same(name: &str, in_use: impl Fn(f64) -> f64, portable: impl Fn(f64) -> f64) {
    for i in 1..20_000 {
        let x = black_box(f64::from(i) * 4.9e-5);
        assert_eq!(in_use(x).to_bits(), portable(x).to_bits(), "{name}({x})");
    }
}

#[test]
fn elementary_functions_are_those_of_libm() {
    same("exp", |x| (40.0 * x).exp(), |x| libm::exp(40.0 * x));
    same("exp2", f64::exp2, libm::exp2);
    same("exp_m1", f64::exp_m1, libm::expm1);
    same("ln", f64::ln, libm::log);
    same("log2", f64::log2, libm::log2);
    same("log10", f64::log10, libm::log10);
    same("ln_1p", f64::ln_1p, libm::log1p);
    same("powf", |x| x.powf(black_box(3.7)), |x| libm::pow(x, 3.7));
    same("cbrt", f64::cbrt, libm::cbrt);
    same("hypot", |x| x.hypot(black_box(0.4)), |x| libm::hypot(x, 0.4));
    same("sin", |x| (9.0 * x).sin(), |x| libm::sin(9.0 * x));
    same("cos", |x| (9.0 * x).cos(), |x| libm::cos(9.0 * x));
    same("sin_cos", |x| (9.0 * x).sin_cos().0, |x| libm::sin(9.0 * x));
    same("cos of sin_cos", |x| (9.0 * x).sin_cos().1, |x| libm::cos(9.0 * x));
    same("tan", f64::tan, libm::tan);
    same("asin", f64::asin, libm::asin);
    same("acos", f64::acos, libm::acos);
    same("atan", f64::atan, libm::atan);
    same("atan2", |y| y.atan2(black_box(0.3)), |y| libm::atan2(y, 0.3));
    same("sinh", f64::sinh, libm::sinh);
    same("cosh", f64::cosh, libm::cosh);
    same("tanh", f64::tanh, libm::tanh);
}
