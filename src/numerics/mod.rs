//! Quadrature, splines, roots, SIMD elementary functions, random streams.

pub mod quadrature;
pub mod roots;
pub mod spline;
