//! Point-spread functions, and the convolution of one image.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::gaussian_blur;
use super::grid::SkyGrid;
use crate::error::{Domain, Error, Result};

/// A point-spread function on the pixel grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Psf {
    /// No blurring.
    None,
    /// Separable Gaussian: the 1-D weights, point-sampled, out to int(Tσ+½) pixels, summing to one; edges clamped.
    Gaussian(Vec<f64>),
    /// A user's kernel, row-major (y, x), `width`² weights summing to one; nothing beyond the edges.
    Kernel {
        /// Its own pixels a side, odd.
        width: usize,
        /// Weights.
        weights: Vec<f64>,
        /// Its own pixels along the side of an image's pixel; light is convolved on them, then summed over each pixel.
        oversampling: usize,
    },
}

/// Pixels that a kernel may reach: as many as an image may have.
const LARGEST_RADIUS: f64 = 4096.0;

impl Psf {
    /// Gaussian of the given width, as lenstronomy's `GAUSSIAN` with `truncation`.
    ///
    /// # Errors
    /// When the width is negative or the truncation is not positive.
    pub fn gaussian(fwhm_arcsec: f64, truncation_sigma: f64, pixel_scale_arcsec: f64) -> Result<Self> {
        Domain::NON_NEGATIVE.check("psf_fwhm_arcsec", fwhm_arcsec)?;
        Domain::POSITIVE.check("psf_truncation_sigma", truncation_sigma)?;
        if fwhm_arcsec == 0.0 {
            return Ok(Self::None);
        }
        let sigma = fwhm_arcsec / (8.0 * std::f64::consts::LN_2).sqrt() / pixel_scale_arcsec;
        let radius = truncation_sigma * sigma + 0.5;
        if radius.is_nan() || radius > LARGEST_RADIUS {
            let allowed =
                format!("so small that psf_truncation_sigma = {truncation_sigma} of it are 4096 pixels");
            return Err(Error::out_of_range("psf_fwhm_arcsec", fwhm_arcsec, &allowed));
        }
        let radius = radius as i64;
        let weights: Vec<f64> =
            (-radius..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let total: f64 = weights.iter().sum();
        Ok(Self::Gaussian(weights.into_iter().map(|w| w / total).collect()))
    }

    /// A user's kernel with `oversampling` pixels along the side of an image's pixel, normalised here.
    ///
    /// # Errors
    /// When it is not square with an odd number of pixels, not finite, or does not have a positive sum.
    pub fn kernel(width: usize, height: usize, weights: Vec<f64>, oversampling: usize) -> Result<Self> {
        if width != height || width.is_multiple_of(2) {
            return Err(Error::out_of_range(
                "size of the PSF kernel",
                format!("{width}×{height}"),
                "square with an odd number of pixels a side, the PSF's centre on the middle one",
            ));
        }
        let total = Domain::POSITIVE.check("sum of the PSF kernel", weights.iter().sum())?;
        let weights = weights.into_iter().map(|w| w / total).collect();
        Ok(Self::Kernel { width, weights, oversampling: oversampling.max(1) })
    }

    /// Parts into which the side of a pixel is divided for a model that is to be convolved.
    pub fn oversampling(&self) -> usize {
        match self {
            Self::Kernel { oversampling, .. } => *oversampling,
            _ => 1,
        }
    }

    /// The grid on which a model of an image on `grid` is made before it is convolved.
    pub fn model_grid(&self, grid: &SkyGrid) -> SkyGrid {
        grid.divided(self.oversampling())
    }

    /// Errors allowed in the pixels of a model so that those of the image's `n`² pixels keep to theirs, adding up at random.
    pub(crate) fn tolerance_of_model(&self, by_pixel: Vec<f64>, n: usize) -> Vec<f64> {
        let k = self.oversampling();
        match k {
            1 => by_pixel,
            _ => (0..n * n * k * k)
                .map(|i| by_pixel[i / (n * k) / k * n + i % (n * k) / k] / k as f64)
                .collect(),
        }
    }

    /// Convolves a square model, on [`Self::model_grid`], into an image of `n`² pixels, in the same bits on every processor.
    pub fn convolve(&self, model: &[f64], n: usize) -> Vec<f64> {
        match self {
            Self::None => model.to_vec(),
            Self::Gaussian(weights) => gaussian_blur::convolve(model, n, weights),
            Self::Kernel { width, weights, oversampling } => {
                PixelKernel::new(*width, weights, *oversampling).convolve(model, n)
            }
        }
    }
}

/// What the pixels of an image gather from the finer pixels of a model: a kernel summed over the parts of a pixel.
struct PixelKernel {
    width: usize,
    weights: Vec<f64>,
    oversampling: usize,
    /// Distance of the model's pixel that the first weight reads from the first one of its image pixel.
    reach: i64,
}

impl PixelKernel {
    fn new(width: usize, kernel: &[f64], oversampling: usize) -> Self {
        let wide = width + oversampling - 1;
        let mut weights = vec![0.0; wide * wide];
        for (part_y, part_x) in (0..oversampling).flat_map(|y| (0..oversampling).map(move |x| (y, x))) {
            for (y, row) in kernel.chunks_exact(width).enumerate() {
                let at = (y + part_y) * wide + part_x;
                weights[at..at + width].iter_mut().zip(row).for_each(|(sum, w)| *sum += w);
            }
        }
        let reach = (width / 2 + oversampling - 1) as i64;
        Self { width: wide, weights, oversampling, reach }
    }

    /// First model pixel that image pixel `i` reads along an axis, by the last weight, and the weights inside the model.
    fn span(&self, i: usize, fine: usize) -> (usize, std::ops::Range<usize>) {
        let last = (i * self.oversampling) as i64 + self.reach;
        let from = (last - fine as i64 + 1).max(0);
        let to = (last + 1).clamp(from, self.width as i64);
        (last as usize, from as usize..to as usize)
    }

    fn convolve(&self, model: &[f64], n: usize) -> Vec<f64> {
        let fine = n * self.oversampling;
        let pixel = |k: usize| {
            let ((last_x, xs), (last_y, ys)) = (self.span(k % n, fine), self.span(k / n, fine));
            let row = |y: usize| {
                let (row, at) = (&model[(last_y - y) * fine..][..fine], y * self.width);
                xs.clone().map(|x| self.weights[at + x] * row[last_x - x]).sum::<f64>()
            };
            ys.map(row).sum()
        };
        (0..n * n).into_par_iter().map(pixel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(n: usize, at: (usize, usize)) -> Vec<f64> {
        let mut image = vec![0.0; n * n];
        image[at.1 * n + at.0] = 1.0;
        image
    }

    #[test]
    fn flux_is_kept_away_from_edges() {
        let psf = Psf::gaussian(0.2, 5.0, 0.08).unwrap();
        let total: f64 = psf.convolve(&point(41, (20, 20)), 41).iter().sum();
        assert!((total - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_constant_image_stays_constant_under_the_gaussian() {
        let psf = Psf::gaussian(0.3, 5.0, 0.08).unwrap();
        assert!(psf.convolve(&vec![2.0; 400], 20).iter().all(|v| (v - 2.0).abs() < 1e-14));
    }

    #[test]
    fn a_kernel_is_laid_down_as_it_is_not_mirrored() {
        let mut weights = vec![0.0; 9];
        weights[5] = 1.0; // right of the centre
        let moved = Psf::kernel(3, 3, weights, 1).unwrap().convolve(&point(5, (2, 2)), 5);
        assert_eq!(moved, point(5, (3, 2)));
    }

    #[test]
    fn kernels_without_a_centre_or_sum_are_refused() {
        assert!(Psf::kernel(4, 4, vec![1.0; 16], 1).is_err());
        assert!(Psf::kernel(3, 5, vec![1.0; 15], 1).is_err());
        assert!(Psf::kernel(3, 3, vec![0.0; 9], 1).is_err());
        assert!(Psf::kernel(3, 3, vec![f64::NAN; 9], 1).is_err());
    }

    #[test]
    fn an_oversampled_kernel_is_a_convolution_on_its_own_pixels_summed_over_those_of_the_image() {
        let weights: Vec<f64> = (0..25).map(|i| ((i * 7) % 5) as f64 + 0.1).collect();
        for k in [2, 3, 4] {
            let (n, fine) = (4, 4 * k);
            let model: Vec<f64> = (0..fine * fine).map(|i| ((i * 37) % 17) as f64).collect();
            let psf = Psf::kernel(5, 5, weights.clone(), k).unwrap();
            let on_its_own = Psf::kernel(5, 5, weights.clone(), 1).unwrap().convolve(&model, fine);
            let mut summed = vec![0.0; n * n];
            (0..fine * fine).for_each(|i| summed[i / fine / k * n + i % fine / k] += on_its_own[i]);
            let image = psf.convolve(&model, n);
            assert!(image.iter().zip(&summed).all(|(a, b)| (a - b).abs() < 1e-12 * b.abs()), "{k}");
            let tolerance = psf.tolerance_of_model((0..n * n).map(|i| i as f64).collect(), n);
            assert_eq!((tolerance.len(), tolerance[fine * fine - 1]), (fine * fine, 15.0 / k as f64));
        }
    }

    #[test]
    fn a_gaussian_wider_than_any_image_is_refused() {
        for (fwhm, truncation) in [(9.2e18, 5.0), (0.2, 1e300), (f64::MAX, f64::MAX)] {
            let error = Psf::gaussian(fwhm, truncation, 0.25).unwrap_err().to_string();
            assert!(error.starts_with("psf_fwhm_arcsec is ") && error.contains("4096 pixels"), "{error}");
        }
    }
}
