//! Mass and light profiles: angles in, angles out; no cosmology.
