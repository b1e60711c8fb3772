//! Figures from saved results: one SVG description, rendered to SVG and PNG.
