//! Convolution with a separable Gaussian, pixels beyond an edge taken as that of the edge, and its transpose.

use crate::numerics::dispatch::kernel;

/// An image of `n`² pixels convolved with the one-dimensional `weights` along x and y.
pub(super) fn convolve(image: &[f64], n: usize, weights: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    convolve_into(image, n, weights, &mut out);
    out
}

/// [`convolve`], written over `out`.
pub(super) fn convolve_into(image: &[f64], n: usize, weights: &[f64], out: &mut [f64]) {
    convolve_columns(&convolve_rows(image, n, weights), n, weights, out);
}

/// The transpose of [`convolve`].
pub(super) fn transposed(image: &[f64], n: usize, weights: &[f64]) -> Vec<f64> {
    gather_rows(&gather_columns(image, n, weights), n, weights)
}

kernel! {
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

kernel! {
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

kernel! {
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

kernel! {
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
