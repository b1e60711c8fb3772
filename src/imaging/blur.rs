//! A PSF made ready for the many images of one size that a fit convolves, and the transpose of that convolution.

use std::sync::Arc;

use haloray_fourier::KernelTransform;

use super::gaussian_blur;
use super::psf::Psf;

/// Convolution with a PSF for models of images of one size; a user's kernel goes through Fourier transforms.
///
/// Equal to [`Psf::convolve`] to rounding, which differs by processor for a user's kernel.
#[derive(Debug, Clone)]
pub struct Blur {
    /// Pixels along a side of the image.
    n: usize,
    way: Way,
}

#[derive(Debug, Clone)]
enum Way {
    None,
    Gaussian(Vec<f64>),
    Kernel { transform: Arc<KernelTransform>, oversampling: usize },
}

impl Blur {
    /// For images of `n`² pixels.
    pub fn new(psf: &Psf, n: usize) -> Self {
        let way = match psf {
            Psf::None => Way::None,
            Psf::Gaussian(weights) => Way::Gaussian(weights.clone()),
            Psf::Kernel { width, weights, oversampling } => Way::Kernel {
                transform: Arc::new(KernelTransform::new(*width, weights, n * oversampling)),
                oversampling: *oversampling,
            },
        };
        Self { n, way }
    }

    /// Convolves a square model, on [`Psf::model_grid`], into an image.
    pub fn convolve(&self, model: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.n * self.n];
        self.convolve_into(model, &mut out);
        out
    }

    /// [`Self::convolve`], written over `out`.
    pub(crate) fn convolve_into(&self, model: &[f64], out: &mut [f64]) {
        match &self.way {
            Way::None => out.copy_from_slice(model),
            Way::Gaussian(weights) => gaussian_blur::convolve_into(model, self.n, weights, out),
            Way::Kernel { transform, oversampling: 1 } => {
                transform.convolved(model, |y, row| out[y * self.n..][..self.n].copy_from_slice(row));
            }
            Way::Kernel { transform, oversampling: k } => {
                out.fill(0.0);
                transform.convolved(model, |y, row| {
                    let out = &mut out[y / k * self.n..][..self.n];
                    out.iter_mut()
                        .zip(row.chunks_exact(*k))
                        .for_each(|(sum, parts)| *sum += parts.iter().sum::<f64>());
                });
            }
        }
    }

    /// The transpose of [`Self::convolve`]: Σ a·convolve(b) = Σ transposed(a)·b.
    pub fn transposed(&self, image: &[f64]) -> Vec<f64> {
        match &self.way {
            Way::None => image.to_vec(),
            Way::Gaussian(weights) => gaussian_blur::transposed(image, self.n, weights),
            Way::Kernel { transform, oversampling: k } => {
                let fine = self.n * k;
                let parts: Vec<f64> =
                    (0..fine * fine).map(|i| image[i / fine / k * self.n + i % fine / k]).collect();
                let mut out = vec![0.0; fine * fine];
                transform.correlated(&parts, |y, row| out[y * fine..][..fine].copy_from_slice(row));
                out
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(n: usize, seed: usize) -> Vec<f64> {
        (0..n * n).map(|i| ((i * 37 + seed * 11) % 17) as f64 - 8.0).collect()
    }

    fn kernel(width: usize, oversampling: usize) -> Psf {
        let weights = (0..width * width).map(|i| ((i * 7) % 5) as f64 + 0.1).collect();
        Psf::kernel(width, width, weights, oversampling).unwrap()
    }

    fn psfs() -> Vec<Psf> {
        let gaussian = Psf::gaussian(0.3, 5.0, 0.08).unwrap();
        vec![
            Psf::None,
            gaussian,
            kernel(3, 1),
            kernel(5, 2),
            kernel(5, 3),
            kernel(1, 1),
            kernel(31, 1),
            kernel(31, 4),
        ]
    }

    #[test]
    fn it_is_the_convolution_of_the_psf() {
        for n in [1, 7, 12] {
            for psf in psfs() {
                let model = image(n * psf.oversampling(), 2);
                let (got, want) = (Blur::new(&psf, n).convolve(&model), psf.convolve(&model, n));
                let largest = model.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
                assert!(got.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-12 * largest), "{n} {psf:?}");
            }
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let n = 7;
        for psf in psfs() {
            let (blur, model) = (Blur::new(&psf, n), image(n * psf.oversampling(), 2));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let forwards = dot(&image(n, 1), &blur.convolve(&model));
            let backwards = dot(&blur.transposed(&image(n, 1)), &model);
            assert!((forwards - backwards).abs() < 1e-11 * forwards.abs().max(1.0), "{psf:?}");
        }
    }
}
