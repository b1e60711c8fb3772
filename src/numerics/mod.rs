//! Quadrature, splines, roots, contours, SIMD lanes and elementary functions, random streams.

mod c_math;
pub(crate) mod circle_rule;
pub mod complex;
pub(crate) mod contour;
#[cfg(test)]
pub(crate) mod differences;
pub(crate) mod dispatch;
pub mod elementary;
pub mod quadrature;
pub mod random;
pub mod real;
pub mod roots;
pub mod spline;
pub(crate) mod triangle_mesh;
