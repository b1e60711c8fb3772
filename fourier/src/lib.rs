//! The Fourier transform of a kernel, and convolution and correlation of square models with it.
//!
//! A crate of its own, because what it takes from rustfft is generic and would else be compiled into each build of haloray's
//! library: that for programs and that for its tests.

use std::fmt;
use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// A kernel made ready for models of `side`² pixels with nothing beyond their edges.
///
/// Models are padded with zeros to `padded`² ≥ (side + radius)²: what wraps around falls outside the model. Spectra are kept
/// column by column: kx from 0 to padded/2, ky along each.
pub struct KernelTransform {
    side: usize,
    padded: usize,
    /// Of the kernel with its centre at the origin, over padded², which the transforms leave out.
    spectrum: Vec<Complex<f64>>,
    row_forwards: Arc<dyn RealToComplex<f64>>,
    row_back: Arc<dyn ComplexToReal<f64>>,
    column_forwards: Arc<dyn Fft<f64>>,
    column_back: Arc<dyn Fft<f64>>,
}

impl fmt::Debug for KernelTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("KernelTransform");
        shown.field("side", &self.side).field("padded", &self.padded).finish_non_exhaustive()
    }
}

impl KernelTransform {
    /// Of `weights`, row-major (y, x), `width`² of them, `width` odd, for models of `side`² pixels, `side` at least one.
    ///
    /// # Panics
    /// When there are fewer weights.
    pub fn new(width: usize, weights: &[f64], side: usize) -> Self {
        // Weights farther from the centre than the model is wide meet none of its pixels.
        let radius = (width / 2).min(side - 1);
        let padded = transformed_quickly(side + radius);
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        let mut kernel = Self {
            side,
            padded,
            spectrum: vec![],
            row_forwards: real.plan_fft_forward(padded),
            row_back: real.plan_fft_inverse(padded),
            column_forwards: complex.plan_fft_forward(padded),
            column_back: complex.plan_fft_inverse(padded),
        };
        let mut at_origin = vec![0.0; padded * padded];
        let near = width / 2 - radius..=width / 2 + radius;
        for (y, x) in near.clone().flat_map(|y| near.clone().map(move |x| (y, x))) {
            let [to_y, to_x] = [y, x].map(|i| (i + padded - width / 2) % padded);
            at_origin[to_y * padded + to_x] = weights[y * width + x];
        }
        let mut spectrum = kernel.spectrum_of(&at_origin, padded);
        spectrum.iter_mut().for_each(|v| *v /= (padded * padded) as f64);
        kernel.spectrum = spectrum;
        kernel
    }

    /// Hands each row y of the model (row-major, `side`² pixels) convolved with the kernel to `take`.
    pub fn convolved(&self, model: &[f64], take: impl FnMut(usize, &[f64])) {
        let mut spectrum = self.spectrum_of(model, self.side);
        spectrum.iter_mut().zip(&self.spectrum).for_each(|(v, k)| *v *= k);
        self.rows_of(spectrum, take);
    }

    /// The same with the kernel turned by 180°: the transpose.
    pub fn correlated(&self, model: &[f64], take: impl FnMut(usize, &[f64])) {
        let mut spectrum = self.spectrum_of(model, self.side);
        spectrum.iter_mut().zip(&self.spectrum).for_each(|(v, k)| *v *= k.conj());
        self.rows_of(spectrum, take);
    }

    /// Of a square image of `side` ≤ padded pixels.
    fn spectrum_of(&self, image: &[f64], side: usize) -> Vec<Complex<f64>> {
        let mut spectrum = vec![Complex::default(); self.row_forwards.complex_len() * self.padded];
        let mut row = vec![0.0; self.padded];
        let mut transformed = self.row_forwards.make_output_vec();
        let mut scratch = self.row_forwards.make_scratch_vec();
        for (y, pixels) in image.chunks_exact(side).enumerate() {
            row[..side].copy_from_slice(pixels);
            row[side..].fill(0.0);
            // Only wrong lengths are errors.
            let _ = self.row_forwards.process_with_scratch(&mut row, &mut transformed, &mut scratch);
            let column = spectrum.iter_mut().skip(y).step_by(self.padded);
            column.zip(&transformed).for_each(|(to, from)| *to = *from);
        }
        self.column_forwards.process(&mut spectrum);
        spectrum
    }

    /// The first `side` pixels of the first `side` rows of the image that has this spectrum.
    fn rows_of(&self, mut spectrum: Vec<Complex<f64>>, mut take: impl FnMut(usize, &[f64])) {
        self.column_back.process(&mut spectrum);
        let mut row = self.row_back.make_output_vec();
        let mut transformed = self.row_back.make_input_vec();
        let mut scratch = self.row_back.make_scratch_vec();
        for y in 0..self.side {
            let column = spectrum.iter().skip(y).step_by(self.padded);
            transformed.iter_mut().zip(column).for_each(|(to, from)| *to = *from);
            // Lengths are right, and imaginary parts of rounding in what must be real are passed over.
            let _ = self.row_back.process_with_scratch(&mut transformed, &mut row, &mut scratch);
            take(y, &row[..self.side]);
        }
    }
}

/// The least number from `n` on without other prime factors than 2 and 3.
fn transformed_quickly(n: usize) -> usize {
    let is_quick = |n: &usize| {
        let odd = n >> n.trailing_zeros();
        odd == 3_usize.pow(odd.ilog(3))
    };
    (n.max(1)..).find(is_quick).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padded_sizes_are_products_of_twos_and_threes() {
        let sizes = [1, 5, 7, 31, 140, 145, 513].map(transformed_quickly);
        assert_eq!(sizes, [1, 6, 8, 32, 144, 162, 576]);
    }
}
