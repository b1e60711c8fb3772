//! Where the surface brightness is sampled to integrate it over pixels: fixed while a fit samples.

use crate::error::{Error, Result};
use crate::imaging::SkyGrid;
use crate::mapping::Rays;
use crate::numerics::real::{LANES, Lanes};

/// Samples of every pixel and their weights; the flux of a pixel is Σ weight·brightness.
///
/// A fit keeps its mesh, so that its likelihood is a smooth function of the parameters; an adaptive mesh is fine
/// enough for every parameter set it was built with.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Samples, pixel by pixel; what fills up the last lanes has weight 0.
    pub(crate) rays: Rays,
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
        let (mut theta, mut weight, mut first) = (vec![], vec![], vec![0]);
        for samples in pixels {
            for (sample, fraction) in samples {
                theta.push(sample);
                weight.push(fraction * area);
            }
            first.push(weight.len());
        }
        Self { rays: Rays::new(&theta), weight, first }
    }

    /// A mesh on which each of several models is integrated to `tolerance` (flux units, for each pixel).
    ///
    /// `brightness` gives, for each model, the total surface brightness at points. A cell is represented by its centre
    /// where the 2×2 Gauss–Legendre rule agrees with that, by the rule where the rules of its quarters agree with it,
    /// and quartered otherwise, down to 1/1024 of a pixel.
    pub(crate) fn adaptive(
        grid: &SkyGrid,
        tolerance: &[f64],
        brightness: impl Fn(&[[f64; 2]]) -> Result<Vec<Vec<f64>>>,
    ) -> Result<Self> {
        const DEEPEST: i32 = 10;
        /// Cells of one depth whose samples fit into a gigabyte.
        const MOST_CELLS: usize = 500_000;
        /// Half the distance of the two Gauss–Legendre nodes in units of the cell.
        const NODE: f64 = 0.288_675_134_594_812_9;
        let around =
            |[x, y]: [f64; 2], d: f64| [[x - d, y - d], [x + d, y - d], [x - d, y + d], [x + d, y + d]];
        let mut width = grid.pixel_scale_arcsec();
        let mut cells: Vec<(usize, [f64; 2])> = grid.theta_arcsec().into_iter().enumerate().collect();
        let mut samples: Vec<Vec<([f64; 2], f64)>> = vec![Vec::new(); cells.len()];
        for depth in 0..=DEEPEST {
            // Errors of the cells of a pixel add up like random numbers: a quarter may have half the error.
            let share = 0.5_f64.powi(depth) / (width * width);
            let fraction = 0.25_f64.powi(depth);
            let points: Vec<[f64; 2]> = cells
                .iter()
                .flat_map(|(_, c)| {
                    let quarters = around(*c, 0.25 * width).map(|q| around(q, 0.5 * NODE * width));
                    std::iter::once(*c).chain(around(*c, NODE * width)).chain(quarters.into_iter().flatten())
                })
                .collect();
            let values = brightness(&points)?;
            let mut next = Vec::new();
            for (i, (pixel, centre)) in cells.iter().enumerate() {
                let allowed = tolerance[*pixel] * share;
                let mut errors = [0.0_f64; 2];
                for model in &values {
                    let own = &model[21 * i..21 * (i + 1)];
                    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
                    let (coarse, fine) = (mean(&own[1..5]), mean(&own[5..]));
                    errors[0] = errors[0].max((fine - own[0]).abs());
                    errors[1] = errors[1].max((fine - coarse).abs());
                }
                if errors[0] <= allowed {
                    samples[*pixel].push((*centre, fraction));
                } else if errors[1] <= allowed || depth == DEEPEST {
                    samples[*pixel].extend(around(*centre, NODE * width).map(|p| (p, 0.25 * fraction)));
                } else {
                    next.extend(around(*centre, 0.25 * width).map(|quarter| (*pixel, quarter)));
                }
            }
            (cells, width) = (next, 0.5 * width);
            if cells.len() > MOST_CELLS.max(8 * samples.len()) {
                let allowed = "one that fewer rays integrate to 1% of the noise; is the noise right? pixel_sampling = \"point\" integrates nothing";
                return Err(Error::out_of_range("brightness over noise", "too large", allowed));
            }
        }
        Ok(Self::new(grid, samples.into_iter()))
    }

    /// Samples at any points, for evaluation alone.
    pub(crate) fn at_points(points: &[[f64; 2]]) -> Self {
        Self { rays: Rays::new(points), weight: vec![1.0; points.len()], first: vec![0] }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.weight.len()
    }

    /// The transpose of [`PixelSums`]: weight·value of its pixel for every sample, filled up to whole lanes.
    pub(crate) fn distribute(&self, by_pixel: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.rays.padded());
        for (ends, value) in self.first.windows(2).zip(by_pixel) {
            out.extend(self.weight[ends[0]..ends[1]].iter().map(|w| w * value));
        }
        out.resize(self.rays.padded(), 0.0);
        out
    }
}

/// Fluxes of pixels, or derivatives of them, in columns to which blocks of samples are added in turn.
///
/// The brightness of all samples would fill many times the processor's second-level cache.
pub(super) struct PixelSums<'a> {
    mesh: &'a Mesh,
    /// The pixel of the last sample added.
    pixel: usize,
    columns: Vec<Vec<f64>>,
}

impl<'a> PixelSums<'a> {
    /// `count` columns of zeros.
    pub fn new(mesh: &'a Mesh, count: usize) -> Self {
        Self { mesh, pixel: 0, columns: vec![vec![0.0; mesh.first.len() - 1]; count] }
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.columns.len()
    }

    /// Adds the samples of the block that begins at `start`: a brightness of each for every column.
    pub fn add(&mut self, start: usize, brightness: &[Lanes]) {
        let first = &self.mesh.first;
        let weight = Lanes::load_or_zero(&self.mesh.weight, start);
        if self.mesh.samples() == first.len() - 1 {
            let columns = self.columns.iter_mut().zip(brightness);
            columns.for_each(|(column, own)| (*own * weight).store(column, start));
            return;
        }
        let end = self.mesh.samples().min(start + LANES);
        let mut sample = start;
        while sample < end {
            while first[self.pixel + 1] <= sample {
                self.pixel += 1;
            }
            let next = first[self.pixel + 1].min(end);
            let run = sample - start..next - start;
            for (column, own) in self.columns.iter_mut().zip(brightness) {
                let flux = &mut column[self.pixel];
                *flux =
                    weight.0[run.clone()].iter().zip(&own.0[run.clone()]).fold(*flux, |f, (w, b)| f + w * b);
            }
            sample = next;
        }
    }

    /// The columns, when all samples were added.
    pub fn into_columns(self) -> Vec<Vec<f64>> {
        self.columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::real::Real;

    #[test]
    fn samples_are_added_to_their_own_pixels() {
        let grid = SkyGrid::new(7, 0.1).unwrap();
        let spike = |[x, y]: &[f64; 2]| 1.0 / (1e-3 + x * x + y * y);
        let fine = Mesh::adaptive(&grid, &[1e-4; 49], |points| Ok(vec![points.iter().map(spike).collect()]))
            .unwrap();
        assert!(fine.samples() > 10 * LANES, "{}", fine.samples());
        for mesh in [Mesh::of_centres(&grid), fine] {
            let theta = mesh.rays.theta_arcsec();
            let mut sums = PixelSums::new(&mesh, 2);
            for start in mesh.rays.blocks() {
                let lanes = mesh.rays.block(start);
                sums.add(start, &[Lanes::splat(1.0), lanes.re]);
            }
            let columns = sums.into_columns();
            for (pixel, ends) in mesh.first.windows(2).enumerate() {
                let of_pixel = |value: fn([f64; 2]) -> f64| -> f64 {
                    (ends[0]..ends[1]).map(|i| mesh.weight[i] * value(theta[i])).sum()
                };
                assert_eq!([columns[0][pixel], columns[1][pixel]], [of_pixel(|_| 1.0), of_pixel(|[x, _]| x)]);
            }
        }
    }

    #[test]
    fn brightness_that_no_mesh_resolves_is_refused_before_it_fills_the_memory() {
        let grid = SkyGrid::new(8, 0.1).unwrap();
        let adaptive = |amplitude: f64| {
            let noise = |[x, y]: &[f64; 2]| amplitude * (1e9 * x + 3e9 * y).sin();
            Mesh::adaptive(&grid, &[1e-9; 64], |points| Ok(vec![points.iter().map(noise).collect()]))
        };
        assert_eq!(adaptive(0.0).unwrap().samples(), 64);
        let error = adaptive(1.0).unwrap_err().to_string();
        assert!(error.contains("brightness over noise"), "{error}");
    }
}
