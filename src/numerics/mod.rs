//! Quadrature, splines, roots, SIMD lanes and elementary functions, random streams.

pub mod complex;
pub mod elementary;
pub mod quadrature;
pub mod random;
pub mod real;
pub mod roots;
pub mod spline;
