//! Quadrature, splines, roots, SIMD elementary functions, random streams.
