//! The sky grid of an image.

use serde::{Deserialize, Serialize};

use crate::error::{Domain, Result};

/// A square image of `pixels`² pixels centred on the axis; pixel (0, 0) is bottom left at −(n−1)/2·Δ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkyGrid {
    pixels: usize,
    pixel_scale_arcsec: f64,
}

impl SkyGrid {
    /// Grid of `pixels` a side, each `pixel_scale_arcsec` wide.
    ///
    /// # Errors
    /// When there is no pixel, more than 4096 a side, or the scale is not positive.
    pub fn new(pixels: usize, pixel_scale_arcsec: f64) -> Result<Self> {
        Domain::from_to(1.0, 4096.0).check("image.pixels", pixels as f64)?;
        Domain::POSITIVE.check("instrument.pixel_scale_arcsec", pixel_scale_arcsec)?;
        Ok(Self { pixels, pixel_scale_arcsec })
    }

    /// The same square with pixels divided into `parts` along each side.
    pub(super) fn divided(&self, parts: usize) -> Self {
        let pixel_scale_arcsec = self.pixel_scale_arcsec / parts as f64;
        Self { pixels: self.pixels * parts, pixel_scale_arcsec }
    }

    /// Pixels a side.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Width of a pixel.
    pub fn pixel_scale_arcsec(&self) -> f64 {
        self.pixel_scale_arcsec
    }

    /// Half the width of the image, to the outer edge of its pixels.
    pub fn half_width_arcsec(&self) -> f64 {
        0.5 * self.pixels as f64 * self.pixel_scale_arcsec
    }

    /// Directions of the pixel centres, row by row from the bottom, x fastest.
    pub fn theta_arcsec(&self) -> Vec<[f64; 2]> {
        let n = self.pixels;
        let at = |i: usize| (i as f64 - 0.5 * (n as f64 - 1.0)) * self.pixel_scale_arcsec;
        (0..n * n).map(|k| [at(k % n), at(k / n)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_pixel_is_bottom_left_and_rows_run_along_x() {
        let theta = SkyGrid::new(64, 0.08).unwrap().theta_arcsec();
        assert!((theta[0][0] + 2.52).abs() < 1e-14 && (theta[0][1] + 2.52).abs() < 1e-14);
        assert!((theta[1][0] + 2.44).abs() < 1e-14 && theta[1][1] == theta[0][1]);
        assert!((theta[4095][1] - 2.52).abs() < 1e-14);
    }
}
