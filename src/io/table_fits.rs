//! Tables as FITS.
