//! An image, a compiled model and a mesh as a likelihood over latent coordinates, with gradient and Fisher matrix.

use nalgebra::{DMatrix, DVector};

use super::latent::LatentLikelihood;
use super::likelihood::{ImageFit, LikelihoodKind, combine, pixel_information};
use super::model::{CompiledModel, Evaluation, Mesh};
use super::observation::Observation;

/// The likelihood of an observation under a model.
#[derive(Debug, Clone)]
pub struct ImageLikelihood {
    /// The image.
    pub observation: Observation,
    /// The model.
    pub model: CompiledModel,
    /// Which likelihood.
    pub kind: LikelihoodKind,
    /// Where the pixels are sampled.
    pub mesh: Mesh,
}

/// The posterior expanded about a point: ln L, gradient of ln L − ½|z|², and its Fisher matrix plus one.
#[derive(Debug, Clone)]
pub struct Curvature {
    /// ln L − ½|z|².
    pub log_posterior: f64,
    /// Its gradient.
    pub gradient: DVector<f64>,
    /// Fisher matrix of the latent coordinates, amplitudes marginalised, plus the unit matrix of the prior.
    pub metric: DMatrix<f64>,
}

/// What a model predicts for the image.
#[derive(Debug, Clone)]
pub struct ModelImage {
    /// Amplitudes of the lights, sources first.
    pub amplitudes: Vec<f64>,
    /// Model flux, e⁻/s per pixel.
    pub model_e_s: Vec<f64>,
    /// Each light alone.
    pub lights_e_s: Vec<Vec<f64>>,
    /// ln L.
    pub log_likelihood: f64,
}

impl ImageLikelihood {
    /// Unit-amplitude images of the lights.
    fn lights(&self, at: &Evaluation) -> Vec<Vec<f64>> {
        let n = self.observation.grid.pixels();
        let samples = at.brightness(&self.mesh);
        samples.iter().map(|b| self.observation.psf.convolve(&self.mesh.integrate(b), n)).collect()
    }

    fn fit(&self, free: &[f64], with_adjoint: bool) -> Option<(Evaluation<'_>, Vec<Vec<f64>>, ImageFit)> {
        let at = self.model.evaluate(free).ok()?;
        let lights = self.lights(&at);
        let priors = &self.model.amplitude_priors;
        let fit = self.kind.fit(&self.observation, &lights, priors, with_adjoint)?;
        fit.log_likelihood.is_finite().then_some((at, lights, fit))
    }

    /// The model image at values of the free parameters; `None` outside the domain of a profile.
    pub fn image(&self, free: &[f64]) -> Option<ModelImage> {
        let (_, lights, fit) = self.fit(free, false)?;
        let scaled = lights.iter().zip(&fit.amplitudes);
        Some(ModelImage {
            model_e_s: combine(&lights, &fit.amplitudes),
            lights_e_s: scaled.map(|(light, a)| light.iter().map(|b| a * b).collect()).collect(),
            log_likelihood: fit.log_likelihood,
            amplitudes: fit.amplitudes,
        })
    }

    /// Expands the log-posterior at latent coordinates; `None` where it is −∞.
    pub fn curvature(&self, latent: &[f64]) -> Option<Curvature> {
        let (free, slopes) = self.model.at_latent(latent);
        let (at, lights, fit) = self.fit(&free, true)?;
        let mut gradient = DVector::from_vec(self.gradient(&at, &fit, &slopes));
        let n = self.observation.grid.pixels();
        let weight = pixel_information(&self.observation, &combine(&lights, &fit.amplitudes));
        let scaled = |image: Vec<f64>| image.iter().zip(&weight).map(|(v, w)| v * w.sqrt()).collect::<Vec<_>>();
        let columns = at.columns(&self.mesh, &fit.amplitudes);
        let mut matrix: Vec<Vec<f64>> = columns
            .iter()
            .map(|c| scaled(self.observation.psf.convolve(&self.mesh.integrate(c), n)))
            .collect();
        matrix.extend(lights.into_iter().map(scaled));
        let all = DMatrix::from_fn(weight.len(), matrix.len(), |i, j| matrix[j][i]);
        let mut fisher = all.tr_mul(&all);
        let (p, k) = (slopes.len(), fit.amplitudes.len());
        for (j, [_, sd]) in self.model.amplitude_priors.iter().enumerate() {
            fisher[(p + j, p + j)] += 1.0 / (sd * sd);
        }
        let amplitudes = fisher.view((p, p), (k, k)).into_owned().cholesky()?;
        let mixed = fisher.view((0, p), (p, k)).into_owned();
        let mut metric = fisher.view((0, 0), (p, p)).into_owned() - &mixed * amplitudes.solve(&mixed.transpose());
        for i in 0..p {
            for j in 0..p {
                metric[(i, j)] *= slopes[i] * slopes[j];
            }
            metric[(i, i)] += 1.0;
        }
        let z = DVector::from_column_slice(latent);
        gradient -= &z;
        let log_posterior = fit.log_likelihood - 0.5 * z.norm_squared();
        Some(Curvature { log_posterior, gradient, metric: (&metric + metric.transpose()) * 0.5 })
    }

    /// ∂lnL/∂z from the adjoint images.
    fn gradient(&self, at: &Evaluation, fit: &ImageFit, slopes: &[f64]) -> Vec<f64> {
        let n = self.observation.grid.pixels();
        let adjoint: Vec<Vec<f64>> = fit
            .adjoint
            .iter()
            .map(|image| self.mesh.distribute(&self.observation.psf.convolve_transposed(image, n)))
            .collect();
        let by_free = at.pull_back(&self.mesh, &adjoint);
        by_free.iter().zip(slopes).map(|(d, slope)| d * slope).collect()
    }

    /// β of every sample of the mesh at values of the free parameters.
    pub fn source_positions(&self, free: &[f64]) -> Option<Vec<[f64; 2]>> {
        Some(self.model.evaluate(free).ok()?.source_positions(&self.mesh))
    }
}

impl LatentLikelihood for ImageLikelihood {
    fn dimension(&self) -> usize {
        self.model.free.len()
    }

    fn log_likelihood(&self, latent: &[f64]) -> f64 {
        let (free, _) = self.model.at_latent(latent);
        self.fit(&free, false).map_or(f64::NEG_INFINITY, |(_, _, fit)| fit.log_likelihood)
    }

    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64 {
        let (free, slopes) = self.model.at_latent(latent);
        let Some((at, _, fit)) = self.fit(&free, true) else { return f64::NEG_INFINITY };
        gradient.copy_from_slice(&self.gradient(&at, &fit, &slopes));
        fit.log_likelihood
    }
}
