//! The one trait θ ↦ β with first and second derivatives, and its implementations.
