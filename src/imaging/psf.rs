//! Point-spread functions and convolution.

use rayon::prelude::*;

use crate::error::{Domain, Error, Result};
use crate::numerics::dispatch::fit_kernel;

/// A point-spread function on the pixel grid.
#[derive(Debug, Clone, PartialEq)]
pub enum Psf {
    /// No blurring.
    None,
    /// Separable Gaussian: the 1-D weights, point-sampled, out to int(Tσ+½) pixels, summing to one; edges clamped.
    Gaussian(Vec<f64>),
    /// A user's kernel, row-major (y, x), `width`² weights summing to one; nothing beyond the edges.
    Kernel {
        /// Pixels a side, odd.
        width: usize,
        /// Weights.
        weights: Vec<f64>,
    },
}

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
        let radius = (truncation_sigma * sigma + 0.5) as i64;
        let weights: Vec<f64> =
            (-radius..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let total: f64 = weights.iter().sum();
        Ok(Self::Gaussian(weights.into_iter().map(|w| w / total).collect()))
    }

    /// A user's kernel, normalised here.
    ///
    /// # Errors
    /// When it is not square with an odd number of pixels, not finite, or does not have a positive sum.
    pub fn kernel(width: usize, height: usize, weights: Vec<f64>) -> Result<Self> {
        if width != height || width.is_multiple_of(2) {
            return Err(Error::out_of_range(
                "size of the PSF kernel",
                format!("{width}×{height}"),
                "square with an odd number of pixels a side",
            ));
        }
        let total = Domain::POSITIVE.check("sum of the PSF kernel", weights.iter().sum())?;
        Ok(Self::Kernel { width, weights: weights.into_iter().map(|w| w / total).collect() })
    }

    /// Convolves a square image of `n`² pixels.
    pub fn convolve(&self, image: &[f64], n: usize) -> Vec<f64> {
        let mut out = vec![0.0; image.len()];
        self.convolve_into(image, n, &mut out);
        out
    }

    /// [`Self::convolve`], written over `out`.
    pub(crate) fn convolve_into(&self, image: &[f64], n: usize, out: &mut [f64]) {
        match self {
            Self::None => out.copy_from_slice(image),
            Self::Gaussian(weights) => convolve_columns(&convolve_rows(image, n, weights), n, weights, out),
            Self::Kernel { width, weights } => {
                out.copy_from_slice(&convolve_kernel(image, n, *width, weights));
            }
        }
    }

    /// The transpose of [`Self::convolve`]: Σ a·convolve(b) = Σ convolve_transposed(a)·b.
    pub fn convolve_transposed(&self, image: &[f64], n: usize) -> Vec<f64> {
        match self {
            Self::None => image.to_vec(),
            Self::Gaussian(weights) => gather_rows(&gather_columns(image, n, weights), n, weights),
            Self::Kernel { width, weights } => {
                let turned: Vec<f64> = weights.iter().rev().copied().collect();
                convolve_kernel(image, n, *width, &turned)
            }
        }
    }
}

fit_kernel! {
    /// One-dimensional convolution along x, pixels beyond an edge taken as that of the edge.
    fn convolve_rows(image: &[f64], n: usize, weights: &[f64]) -> Vec<f64> {
        let radius = weights.len() / 2;
        let mut out = vec![0.0; n * n];
        let mut padded = vec![0.0; n + 2 * radius];
        for (row, out) in image.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
            padded[..radius].fill(row[0]);
            padded[radius..radius + n].copy_from_slice(row);
            padded[radius + n..].fill(row[n - 1]);
            for (k, w) in weights.iter().enumerate() {
                add_scaled(out, &padded[k..k + n], *w);
            }
        }
        out
    }
}

fit_kernel! {
    /// The same along y.
    fn convolve_columns(image: &[f64], n: usize, weights: &[f64], out: &mut [f64]) {
        for (y, out) in out.chunks_exact_mut(n).enumerate() {
            out.fill(0.0);
            for (k, w) in weights.iter().enumerate() {
                let from = edge_row(y, k, n, weights);
                add_scaled(out, &image[from * n..(from + 1) * n], *w);
            }
        }
    }
}

fit_kernel! {
    /// The transpose of [`convolve_rows`].
    fn gather_rows(image: &[f64], n: usize, weights: &[f64]) -> Vec<f64> {
        let radius = weights.len() / 2;
        let mut out = vec![0.0; n * n];
        let mut padded = vec![0.0; n + 2 * radius];
        for (row, out) in image.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
            padded.fill(0.0);
            for (k, w) in weights.iter().enumerate() {
                add_scaled(&mut padded[k..k + n], row, *w);
            }
            out.copy_from_slice(&padded[radius..radius + n]);
            out[0] += padded[..radius].iter().sum::<f64>();
            out[n - 1] += padded[radius + n..].iter().sum::<f64>();
        }
        out
    }
}

fit_kernel! {
    /// The transpose of [`convolve_columns`].
    fn gather_columns(image: &[f64], n: usize, weights: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; n * n];
        for (y, row) in image.chunks_exact(n).enumerate() {
            for (k, w) in weights.iter().enumerate() {
                let to = edge_row(y, k, n, weights);
                add_scaled(&mut out[to * n..(to + 1) * n], row, *w);
            }
        }
        out
    }
}

/// Row that weight k of row y reads from.
fn edge_row(y: usize, k: usize, n: usize, weights: &[f64]) -> usize {
    (y + k).saturating_sub(weights.len() / 2).min(n - 1)
}

#[inline(always)]
fn add_scaled(out: &mut [f64], row: &[f64], factor: f64) {
    out.iter_mut().zip(row).for_each(|(out, v)| *out += factor * v);
}

fn convolve_kernel(image: &[f64], n: usize, width: usize, weights: &[f64]) -> Vec<f64> {
    let (size, radius) = (n as i64, (width / 2) as i64);
    (0..n * n)
        .into_par_iter()
        .map(|k| {
            let (x, y) = ((k % n) as i64, (k / n) as i64);
            let mut sum = 0.0;
            for ky in 0..width as i64 {
                let sy = y - (ky - radius);
                if !(0..size).contains(&sy) {
                    continue;
                }
                for kx in 0..width as i64 {
                    let sx = x - (kx - radius);
                    if (0..size).contains(&sx) {
                        sum += weights[(ky * width as i64 + kx) as usize] * image[(sy * size + sx) as usize];
                    }
                }
            }
            sum
        })
        .collect()
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
        let moved = Psf::kernel(3, 3, weights).unwrap().convolve(&point(5, (2, 2)), 5);
        assert_eq!(moved, point(5, (3, 2)));
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let n = 7;
        let image = |seed: usize| -> Vec<f64> {
            (0..n * n).map(|i| ((i * 37 + seed * 11) % 17) as f64 - 8.0).collect()
        };
        let kernel = Psf::kernel(3, 3, vec![0.0, 1.0, 0.5, 2.0, 4.0, 0.1, 0.0, 0.3, 1.0]).unwrap();
        for psf in [Psf::None, Psf::gaussian(0.3, 5.0, 0.08).unwrap(), kernel] {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let forwards = dot(&image(1), &psf.convolve(&image(2), n));
            let backwards = dot(&psf.convolve_transposed(&image(1), n), &image(2));
            assert!((forwards - backwards).abs() < 1e-12 * forwards.abs().max(1.0), "{psf:?}");
        }
    }

    #[test]
    fn kernels_without_a_centre_or_sum_are_refused() {
        assert!(Psf::kernel(4, 4, vec![1.0; 16]).is_err());
        assert!(Psf::kernel(3, 5, vec![1.0; 15]).is_err());
        assert!(Psf::kernel(3, 3, vec![0.0; 9]).is_err());
        assert!(Psf::kernel(3, 3, vec![f64::NAN; 9]).is_err());
    }
}
