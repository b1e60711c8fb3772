//! An image, a compiled model and a mesh as a likelihood over latent coordinates, with gradient and Fisher matrix.

use nalgebra::{DVector, DVectorView};

use super::amplitudes::{By, ImageFit, combine, informations};
use super::latent::{Curvature, LatentLikelihood, NoCurvature};
use super::observation::Observation;
use super::pixel_sums::weighted_gram;
use crate::error::Result;
use crate::imaging::Blur;
use crate::inference::model::{CompiledModel, Evaluation, LikelihoodKind, Mesh};
use crate::monitor::Monitor;

/// The likelihood of an observation under a model; the mesh is always one of the observation's own pixels, or of those of an
/// oversampled PSF.
#[derive(Debug, Clone)]
pub struct ImageLikelihood {
    pub(super) observation: Observation,
    pub(super) model: CompiledModel,
    kind: LikelihoodKind,
    blur: Blur,
    pub(super) mesh: Mesh,
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
    /// Every pixel sampled at its centre, its ray carried through the haloes of the model where it has any.
    ///
    /// # Errors
    /// Those of [`Observation::validate`]; when cancelled.
    pub fn new(
        observation: Observation,
        model: CompiledModel,
        kind: LikelihoodKind,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        observation.validate()?;
        let mut mesh = Mesh::of_centres(&observation.psf.model_grid(&observation.grid));
        model.carry(&mut mesh, monitor)?;
        let blur = Blur::new(&observation.psf, observation.grid.pixels());
        Ok(Self { observation, model, kind, blur, mesh })
    }

    /// The image.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// The model.
    pub fn model(&self) -> &CompiledModel {
        &self.model
    }

    /// Where the pixels are sampled.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The same image under the simpler model that prepares the fit of this one.
    pub(in crate::inference) fn simpler(&self) -> Option<Self> {
        Some(Self { model: self.model.simpler()?.clone(), ..self.clone() })
    }

    /// The same with the background's noise raised to `background_rms_e_s`, if it is lower.
    pub(in crate::inference) fn with_noise_of_at_least(&self, background_rms_e_s: f64) -> Self {
        let mut noisier = self.clone();
        let rms = &mut noisier.observation.background_rms_e_s;
        *rms = rms.max(background_rms_e_s);
        noisier
    }

    /// The same as if it had been exposed for no longer than `exposure_s`.
    pub(in crate::inference) fn with_exposure_of_at_most(&self, exposure_s: f64) -> Self {
        let mut shorter = self.clone();
        let own = &mut shorter.observation.exposure_s;
        *own = own.min(exposure_s);
        shorter
    }

    /// The same without the pixels brighter than `flux_e_s`.
    pub(in crate::inference) fn without_pixels_above(&self, flux_e_s: f64) -> Self {
        let mut fainter = self.clone();
        let observation = &mut fainter.observation;
        for (used, flux) in observation.used.iter_mut().zip(&observation.data_e_s) {
            *used &= *flux <= flux_e_s;
        }
        fainter
    }

    /// Unit-amplitude images of the lights.
    fn lights(&self, at: &Evaluation) -> Vec<Vec<f64>> {
        at.fluxes(&self.mesh).iter().map(|fluxes| self.blur.convolve(fluxes)).collect()
    }

    pub(super) fn fit(&self, free: &[f64], by: By) -> Option<(Evaluation<'_>, Vec<Vec<f64>>, ImageFit)> {
        let at = self.model.evaluate(free).ok()?;
        let lights = self.lights(&at);
        let priors = &self.model.amplitude_priors;
        let fit = self.kind.fit(&self.observation, &lights, priors, by)?;
        fit.log_likelihood.is_finite().then_some((at, lights, fit))
    }

    /// The model image at values of the free parameters; `None` outside the domain of a profile.
    pub fn image(&self, free: &[f64]) -> Option<ModelImage> {
        let (_, lights, fit) = self.fit(free, By::Nothing)?;
        let scaled = lights.iter().zip(&fit.amplitudes);
        Some(ModelImage {
            model_e_s: combine(&lights, &fit.amplitudes),
            lights_e_s: scaled.map(|(light, a)| light.iter().map(|b| a * b).collect()).collect(),
            log_likelihood: fit.log_likelihood,
            amplitudes: fit.amplitudes,
        })
    }

    /// (data − model)/σ of every pixel with σ² = max(model, 0)/t + σ_bg²; not a number where it is not used.
    pub fn normalised_residuals(&self, model_e_s: &[f64]) -> Vec<f64> {
        let observation = &self.observation;
        let pixels = observation.data_e_s.iter().zip(model_e_s).zip(&observation.used);
        let noise = observation.noise();
        let residual = |d: f64, m: f64| (d - m) / noise.variance(m).sqrt();
        pixels.map(|((d, m), used)| if *used { residual(*d, *m) } else { f64::NAN }).collect()
    }

    /// Fitted parameters and amplitudes.
    pub fn fitted_numbers(&self) -> usize {
        self.model.free.len() + self.model.lights()
    }

    /// Pixels less fitted parameters and amplitudes, at least 1.
    pub fn degrees_of_freedom(&self) -> f64 {
        (self.observation.pixels_in_use() as f64 - self.fitted_numbers() as f64).max(1.0)
    }

    /// Sum of squared normalised residuals per degree of freedom.
    pub fn chi2_reduced(&self, image: &ModelImage) -> f64 {
        let residuals = self.normalised_residuals(&image.model_e_s);
        residuals.iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>() / self.degrees_of_freedom()
    }

    /// ∂lnL/∂z from the adjoint images.
    fn gradient(&self, at: &Evaluation, fit: &ImageFit, slopes: &[f64]) -> Vec<f64> {
        let adjoint: Vec<Vec<f64>> =
            fit.adjoint.iter().map(|image| self.mesh.distribute(&self.blur.transposed(image))).collect();
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
        self.fit(&free, By::Nothing).map_or(f64::NEG_INFINITY, |(_, _, fit)| fit.log_likelihood)
    }

    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64 {
        let (free, slopes) = self.model.at_latent(latent);
        let Some((at, _, fit)) = self.fit(&free, By::Light) else { return f64::NEG_INFINITY };
        gradient.copy_from_slice(&self.gradient(&at, &fit, &slopes));
        fit.log_likelihood
    }

    fn curvature(&self, latent: &[f64]) -> std::result::Result<Curvature, NoCurvature> {
        let (free, slopes) = self.model.at_latent(latent);
        let (at, lights, fit) = self.fit(&free, By::Model).ok_or(NoCurvature::ZeroLikelihood)?;
        let [information, _] = informations(&self.observation, &combine(&lights, &fit.amplitudes));
        let pixels = information.len();
        let mut gradient = -DVector::from_column_slice(latent);
        // ∂m/∂p, then B, as the columns of a matrix A; the Fisher matrix is Aᵀ diag(f) A.
        let by_free = at.columns(&self.mesh, &fit.amplitudes);
        let mut convolved = vec![0.0; pixels * by_free.len()];
        for (i, (fluxes, column)) in by_free.iter().zip(convolved.chunks_exact_mut(pixels)).enumerate() {
            self.blur.convolve_into(fluxes, column);
            gradient[i] += slopes[i] * dot(&fit.adjoint[0], column);
        }
        let columns: Vec<&[f64]> =
            convolved.chunks_exact(pixels).chain(lights.iter().map(Vec::as_slice)).collect();
        let mut fisher = weighted_gram(&information, &columns);
        let (p, k) = (slopes.len(), fit.amplitudes.len());
        for (j, [_, sd]) in self.model.amplitude_priors.iter().enumerate() {
            fisher[(p + j, p + j)] += 1.0 / (sd * sd);
        }
        let amplitudes = fisher.view((p, p), (k, k)).into_owned().cholesky();
        let amplitudes = amplitudes.ok_or(NoCurvature::ZeroLikelihood)?;
        let mixed = fisher.view((0, p), (p, k)).into_owned();
        let mut metric =
            fisher.view((0, 0), (p, p)).into_owned() - &mixed * amplitudes.solve(&mixed.transpose());
        for i in 0..p {
            for j in 0..p {
                metric[(i, j)] *= slopes[i] * slopes[j];
            }
            metric[(i, i)] += 1.0;
        }
        let log_posterior = fit.log_likelihood - 0.5 * latent.iter().map(|z| z * z).sum::<f64>();
        Ok(Curvature { log_posterior, gradient, metric: (&metric + metric.transpose()) * 0.5 })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len()))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rayon::prelude::*;

    use super::*;
    use crate::imaging::{Psf, SkyGrid};
    use crate::inference::model::ModelDescription;
    use crate::monitor::Silent;
    use crate::numerics::differences::derivative;
    use crate::numerics::random::{self, stream};

    fn likelihood(name: &str, kind: LikelihoodKind) -> ImageLikelihood {
        let model = CompiledModel::new(&ModelDescription::built_in(name).unwrap()).unwrap();
        let grid = SkyGrid::new(21, 0.16).unwrap();
        let psf = Psf::gaussian(0.2, 3.0, 0.16).unwrap();
        let n = grid.pixels() * grid.pixels();
        let mut used = vec![true; n];
        used[40..60].fill(false);
        let observation = Observation {
            grid,
            data_e_s: vec![0.0; n],
            used,
            background_rms_e_s: 0.006,
            exposure_s: 5400.0,
            psf,
        };
        let mut likelihood = ImageLikelihood::new(observation, model, kind, &Silent).unwrap();
        // The data: the model at one prior draw near the middle with amplitudes of a bright system, plus noise.
        let free = likelihood.model.at_latent(&near_the_middle(&likelihood, 0)).0;
        let at = likelihood.model.evaluate(&free).unwrap();
        let amplitudes: Vec<f64> = (0..likelihood.model.lights()).map(|j| 3.0 + 2.0 * j as f64).collect();
        let image = combine(&likelihood.lights(&at), &amplitudes);
        let mut rng = stream(3, 0, random::Stage::NoiseImage, 0);
        likelihood.observation.data_e_s = image
            .into_iter()
            .map(|m| m + 0.006 * Distribution::<f64>::sample(&StandardNormal, &mut rng))
            .collect();
        likelihood
    }

    /// A draw of the prior, with radii of a lens that fits the image.
    fn near_the_middle(likelihood: &ImageLikelihood, number: u64) -> Vec<f64> {
        let mut rng = stream(5, number, random::Stage::Start, 0);
        let mut random = || -> f64 { StandardNormal.sample(&mut rng) };
        likelihood
            .model
            .free
            .iter()
            .map(|p| match p.name.rsplit('.').next().unwrap() {
                "theta_E" => p.prior.to_latent(1.0 + 0.1 * random()),
                "R_sersic" => p.prior.to_latent(0.4 * (0.2 * random()).exp()),
                _ => random(),
            })
            .collect()
    }

    /// Differences with the step at which they change least.
    fn settled_derivative(f: impl Fn(f64) -> f64, x: f64) -> f64 {
        let by_step = [1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6].map(|step| derivative(&f, x, step));
        let change = |i: &usize| (by_step[*i] - by_step[i - 1]).abs();
        let settled = (1..by_step.len()).min_by(|a, b| change(a).total_cmp(&change(b)));
        by_step[settled.unwrap_or(0)]
    }

    /// The bound on the gradient.
    const GRADIENT: f64 = 1e-7;

    fn check_gradients(points: u64) {
        for name in ["simple-full", "simple-minimal", "tidal-minimal", "tidal-flexion"] {
            for kind in [LikelihoodKind::Gaussian, LikelihoodKind::Lenstronomy] {
                let likelihood = likelihood(name, kind);
                let n = likelihood.dimension();
                (0..points).into_par_iter().for_each(|number| {
                    let z = near_the_middle(&likelihood, number);
                    let mut gradient = vec![0.0; n];
                    let value = likelihood.log_likelihood_gradient(&z, &mut gradient);
                    assert_eq!(value, likelihood.log_likelihood(&z));
                    for i in 0..n {
                        let moved = |v: f64| {
                            let mut z = z.clone();
                            z[i] = v;
                            likelihood.log_likelihood(&z)
                        };
                        let want = settled_derivative(moved, z[i]);
                        assert!(
                            (gradient[i] - want).abs()
                                <= GRADIENT * (want.abs() + 1e-3 * value.abs().max(1.0)),
                            "{name} {kind:?} {}: {:e}, differences {want:e}",
                            likelihood.model.free[i].name,
                            gradient[i]
                        );
                    }
                });
            }
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_log_posterior() {
        check_gradients(12);
    }

    #[test]
    #[ignore = "slow: just nightly"]
    fn the_gradient_is_that_of_the_log_posterior_at_a_hundred_points() {
        check_gradients(100);
    }

    #[test]
    fn the_metric_is_the_curvature_at_a_noise_free_maximum() {
        let mut likelihood = likelihood("tidal-minimal", LikelihoodKind::Gaussian);
        let z = near_the_middle(&likelihood, 0);
        let free = likelihood.model.at_latent(&z).0;
        likelihood.observation.data_e_s = likelihood.image(&free).unwrap().model_e_s;
        let metric = likelihood.curvature(&z).unwrap().metric;
        let n = likelihood.dimension();
        for i in 0..n {
            let by_i = |v: f64, j: usize| {
                let mut z = z.clone();
                z[i] = v;
                let mut gradient = vec![0.0; n];
                likelihood.log_likelihood_gradient(&z, &mut gradient);
                z[j] - gradient[j]
            };
            for j in 0..n {
                let want = derivative(|v| by_i(v, j), z[i], 1e-4);
                let scale = (metric[(i, i)] * metric[(j, j)]).sqrt();
                // The determinant's own curvature is left out of a Fisher matrix: 1e-3 of the whole.
                assert!((metric[(i, j)] - want).abs() < 5e-3 * scale, "{i} {j}: {} {want}", metric[(i, j)]);
            }
        }
    }

    #[test]
    fn the_gradient_that_goes_with_the_metric_is_nearly_exact() {
        for kind in [LikelihoodKind::Gaussian, LikelihoodKind::Lenstronomy] {
            let likelihood = likelihood("tidal-minimal", kind);
            let z = near_the_middle(&likelihood, 0);
            let curvature = likelihood.curvature(&z).unwrap();
            let mut exact = vec![0.0; z.len()];
            let value = likelihood.log_likelihood_gradient(&z, &mut exact);
            let square: f64 = z.iter().map(|z| z * z).sum();
            assert!((curvature.log_posterior - (value - 0.5 * square)).abs() < 1e-9 * value.abs());
            for (i, exact) in exact.iter().enumerate() {
                let off = curvature.gradient[i] - (exact - z[i]);
                let deviation = curvature.metric[(i, i)].sqrt().recip();
                assert!((off * deviation).abs() < 0.1, "{kind:?} {i}: {off:e} of {exact:e}");
            }
        }
    }
}
