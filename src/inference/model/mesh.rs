//! Where the surface brightness is sampled to integrate it over pixels: fixed while a fit samples.

use crate::imaging::SkyGrid;
use crate::numerics::real::LANES;

/// Samples of every pixel and their weights; the flux of a pixel is Σ weight·brightness.
///
/// A fit keeps its mesh, so that its likelihood is a smooth function of the parameters; an adaptive mesh is fine
/// enough for every parameter set it was built with.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Samples, pixel by pixel, filled up to whole lanes with repetitions of weight 0.
    pub(crate) x_arcsec: Vec<f64>,
    pub(crate) y_arcsec: Vec<f64>,
    /// arcsec² per sample.
    weight: Vec<f64>,
    /// Index of the first sample of each pixel, and the number of samples.
    first: Vec<usize>,
}

impl Mesh {
    /// One sample at the centre of every pixel.
    pub fn of_centres(grid: &SkyGrid) -> Self {
        Self::new(grid, grid.theta_arcsec().into_iter().map(|theta| vec![(theta, 1.0)]))
    }

    /// Samples (θ, fraction of the pixel) of every pixel in turn.
    pub(super) fn new(grid: &SkyGrid, pixels: impl Iterator<Item = Vec<([f64; 2], f64)>>) -> Self {
        let area = grid.pixel_scale_arcsec().powi(2);
        let mut mesh = Self { x_arcsec: vec![], y_arcsec: vec![], weight: vec![], first: vec![0] };
        for samples in pixels {
            for ([x, y], fraction) in samples {
                mesh.x_arcsec.push(x);
                mesh.y_arcsec.push(y);
                mesh.weight.push(fraction * area);
            }
            mesh.first.push(mesh.weight.len());
        }
        let padded = mesh.weight.len().next_multiple_of(LANES);
        for column in [&mut mesh.x_arcsec, &mut mesh.y_arcsec] {
            let last = column.last().copied().unwrap_or(0.0);
            column.resize(padded, last);
        }
        mesh
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.weight.len()
    }

    /// Flux of every pixel from the brightness of the samples.
    pub(crate) fn integrate(&self, brightness: &[f64]) -> Vec<f64> {
        let flux = |ends: &[usize]| {
            let samples = ends[0]..ends[1];
            self.weight[samples.clone()].iter().zip(&brightness[samples]).map(|(w, b)| w * b).sum()
        };
        self.first.windows(2).map(flux).collect()
    }

    /// The transpose of [`Self::integrate`], filled up to whole lanes.
    pub(crate) fn distribute(&self, by_pixel: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.x_arcsec.len());
        for (ends, value) in self.first.windows(2).zip(by_pixel) {
            out.extend(self.weight[ends[0]..ends[1]].iter().map(|w| w * value));
        }
        out.resize(self.x_arcsec.len(), 0.0);
        out
    }
}
