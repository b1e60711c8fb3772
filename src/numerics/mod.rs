//! Quadrature, splines, roots, SIMD elementary functions, random streams.

pub mod elementary;
pub mod quadrature;
pub mod random;
pub mod roots;
pub mod spline;
