//! exp, ln, pow, sin … of the whole program with the same bits on every processor.
//!
//! `f64::exp` and its kin call the C library, and glibc chooses an implementation with or without fused multiply-add
//! when the program starts: results differ in the last bit from machine to machine, also inside the crates we use.
//! The symbols defined here take the place of the C library's when a program is linked; what they call (the crate
//! `libm`) is plain IEEE 754 arithmetic. `tests/reference/portable.rs` proves that they are the ones in use.

macro_rules! instead_of_the_c_library {
    ($($name:ident($($x:ident),+) = $function:path;)+) => {$(
        #[allow(unsafe_code, reason = "a C symbol, which the linker finds before the C library's")]
        #[unsafe(no_mangle)]
        extern "C" fn $name($($x: f64),+) -> f64 {
            $function($($x),+)
        }
    )+};
}

instead_of_the_c_library! {
    exp(x) = libm::exp;
    exp2(x) = libm::exp2;
    exp10(x) = libm::exp10;
    expm1(x) = libm::expm1;
    log(x) = libm::log;
    log2(x) = libm::log2;
    log10(x) = libm::log10;
    log1p(x) = libm::log1p;
    pow(x, y) = libm::pow;
    cbrt(x) = libm::cbrt;
    hypot(x, y) = libm::hypot;
    sin(x) = libm::sin;
    cos(x) = libm::cos;
    tan(x) = libm::tan;
    asin(x) = libm::asin;
    acos(x) = libm::acos;
    atan(x) = libm::atan;
    atan2(y, x) = libm::atan2;
    sinh(x) = libm::sinh;
    cosh(x) = libm::cosh;
    tanh(x) = libm::tanh;
}

/// sin and cos of one argument, as compilers join them: both through pointers that the caller owns.
#[allow(unsafe_code, reason = "a C symbol, which the linker finds before the C library's")]
#[unsafe(no_mangle)]
unsafe extern "C" fn sincos(x: f64, sin: *mut f64, cos: *mut f64) {
    let (s, c) = libm::sincos(x);
    // SAFETY: C's contract of `sincos`: both point to a number that may be written.
    unsafe {
        sin.write(s);
        cos.write(c);
    }
}
