//! Where an image is sampled once a start is known: a finer mesh, and rays through haloes expanded about it.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::amplitudes::{By, combine, informations};
use super::image::ImageLikelihood;
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::inference::model::Mesh;
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};

/// A maximum of the posterior: latent coordinates, and the metric there.
pub(in crate::inference) type Mode<'a> = (&'a [f64], &'a DMatrix<f64>);

/// Of the noise of each pixel, its error of integration while draws are taken.
const TOLERANCE_OF_NOISE: f64 = 0.01;

impl ImageLikelihood {
    /// Makes ready to sample around modes: a finer mesh where pixels are integrated, and rays through haloes expanded about the
    /// deflections of the first.
    ///
    /// # Errors
    /// A metric that is not positive definite; when cancelled.
    pub(in crate::inference) fn refine(
        &mut self,
        modes: &[Mode],
        (sampling, seed): (PixelSampling, u64),
        monitor: &dyn Monitor,
    ) -> Result<()> {
        if sampling == PixelSampling::Adaptive {
            self.refine_mesh(modes, TOLERANCE_OF_NOISE, seed, monitor)?;
        }
        let (start, _) = modes[0];
        let expansion = self.model.evaluate(&self.model.at_latent(start).0)?.expand(&self.mesh, monitor)?;
        self.mesh.rays.haloes = expansion;
        Ok(())
    }

    /// How far in arcsec β is from that of rays traced through the haloes of the model, at most; 0 without haloes.
    ///
    /// # Errors
    /// Values outside the domain of a profile; when cancelled.
    pub fn expansion_error_arcsec(&self, free: &[f64], monitor: &dyn Monitor) -> Result<f64> {
        self.model.evaluate(free)?.expansion_error_arcsec(&self.mesh, monitor)
    }

    /// Samples the pixels anew, so that every one is integrated to a part of its noise at the modes, and at models scattered
    /// around them as their metrics say.
    ///
    /// # Errors
    /// A metric that is not positive definite, brightness that no mesh resolves; when cancelled.
    pub(in crate::inference) fn refine_mesh(
        &mut self,
        modes: &[Mode],
        part_of_noise: f64,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<()> {
        const MODELS: usize = 4;
        let indefinite =
            || Error::out_of_range("the Fisher matrix at the start", "indefinite", "positive definite");
        let mut rng = stream(seed, 0, Stage::Mesh, 0);
        let mut models = Vec::new();
        for (latent, metric) in modes {
            let factor = (*metric).clone().cholesky().ok_or_else(indefinite)?;
            for i in 0..MODELS {
                let normal = DVector::from_fn(latent.len(), |_, _| StandardNormal.sample(&mut rng));
                let scatter = factor.l().tr_solve_lower_triangular(&normal).ok_or_else(indefinite)?;
                let spread = if i == 0 { 0.0 } else { 1.5 };
                let scattered: Vec<f64> =
                    latent.iter().zip(scatter.iter()).map(|(z, s)| z + spread * s).collect();
                let free = self.model.at_latent(&scattered).0;
                models.extend(self.fit(&free, By::Nothing).map(|(_, _, fit)| (free, fit.amplitudes)));
            }
        }
        let image = self.image(&self.model.at_latent(modes[0].0).0);
        let image = image.ok_or_else(|| {
            Error::out_of_range("the start", "without an image", "a model that can be evaluated")
        })?;
        let [information, _] = informations(&self.observation, &image.model_e_s);
        let coarsest = self.observation.background_rms_e_s;
        let noise = |f: f64| if f > 0.0 { f.sqrt().recip() } else { coarsest };
        let tolerance: Vec<f64> = information.into_iter().map(|f| part_of_noise * noise(f)).collect();
        let (grid, psf) = (&self.observation.grid, &self.observation.psf);
        let tolerance = psf.tolerance_of_model(tolerance, grid.pixels());
        self.mesh = Mesh::adaptive(&psf.model_grid(grid), &tolerance, |points| {
            let mut points = Mesh::at_points(points);
            self.model.carry(&mut points, monitor)?;
            let of = |(free, amplitudes): &(Vec<f64>, Vec<f64>)| {
                let at = self.model.evaluate(free).ok()?;
                Some(combine(&at.brightness(&points), amplitudes))
            };
            Ok(models.par_iter().filter_map(of).collect())
        })?;
        self.model.carry(&mut self.mesh, monitor)
    }
}
