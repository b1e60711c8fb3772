//! Flat ΛCDM: distances, linear growth, the Eisenstein–Hu power spectrum and σ(M).
