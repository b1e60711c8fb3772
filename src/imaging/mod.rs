//! From a mapping to an exposure: grid, source light, PSF, noise.
