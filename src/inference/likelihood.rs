//! The likelihood of an image given unit-amplitude images of its lights: amplitudes marginalised, or as lenstronomy.
//!
//! Noise: variance v(m) = max(m, 0)/t + σ² of the *model* m = Σ aⱼBⱼ. With B the images of the lights at amplitude 1,
//! ℓ(m) = −½[(d−m)²/v + ln 2πv] per pixel. The right likelihood integrates exp Σℓ over the amplitudes with their normal
//! prior by Laplace's method about the maximum â, with the Fisher matrix F = Σ f·BBᵀ + P, f = 1/v + ½(v′/v)²:
//!
//! ln L = Σℓ(m̂) − ½ Σ Pⱼ(âⱼ−a₀ⱼ)² − ½ ln(det F/Π Pⱼ).
//!
//! lenstronomy's: amplitudes from least squares weighted by the variance of the *data*, ln L = −½Σ(d−m)²/v(m).
//! Both come with ∂lnL/∂B, the only thing that gradients need.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::observation::Observation;

/// Which likelihood.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LikelihoodKind {
    /// One variance, that of the model, with its determinant; amplitudes marginalised.
    #[default]
    Gaussian,
    /// lenstronomy's: no determinant, amplitudes solved with the variance of the data.
    Lenstronomy,
}

/// The likelihood of one model image and what it takes to differentiate it.
pub(crate) struct ImageFit {
    /// Amplitudes of the lights.
    pub amplitudes: Vec<f64>,
    /// ln L.
    pub log_likelihood: f64,
    /// ∂lnL/∂Bⱼ per pixel and light, if asked for.
    pub adjoint: Vec<Vec<f64>>,
}

impl LikelihoodKind {
    /// ln L of the images `lights` (amplitude 1, PSF applied); `None` where amplitudes cannot be solved for.
    pub(crate) fn fit(
        self,
        observation: &Observation,
        lights: &[Vec<f64>],
        priors: &[[f64; 2]],
        with_adjoint: bool,
    ) -> Option<ImageFit> {
        match self {
            Self::Gaussian => marginalised(observation, lights, priors, with_adjoint),
            Self::Lenstronomy => solved(observation, lights, with_adjoint),
        }
    }
}

/// Variance of a pixel and its derivative by the model.
#[inline(always)]
fn variance(model: f64, background: f64, per_exposure: f64) -> [f64; 2] {
    if model > 0.0 { [model * per_exposure + background, per_exposure] } else { [background, 0.0] }
}

/// ℓ and its first two derivatives by m, without the constant −½ ln 2π.
#[inline(always)]
fn pixel(data: f64, model: f64, background: f64, per_exposure: f64) -> [f64; 3] {
    let [v, dv] = variance(model, background, per_exposure);
    let (inverse, r) = (1.0 / v, data - model);
    let w = dv * inverse;
    let pull = r * inverse;
    let first = pull + 0.5 * dv * pull * pull - 0.5 * w;
    let second = -inverse - 2.0 * pull * w - pull * pull * dv * w + 0.5 * w * w;
    [-0.5 * (r * pull + crate::numerics::elementary::ln(v)), first, second]
}

/// f = 1/v + ½(v′/v)², the Fisher information of m, and f′.
#[inline(always)]
fn information(model: f64, background: f64, per_exposure: f64) -> [f64; 2] {
    let [v, dv] = variance(model, background, per_exposure);
    let (inverse, w) = (1.0 / v, dv / v);
    [inverse + 0.5 * w * w, -inverse * w - w * w * w]
}

/// Fisher information of the model flux in every pixel, 0 where it is not used.
pub(crate) fn pixel_information(observation: &Observation, model: &[f64]) -> Vec<f64> {
    let (background, per_exposure) = noise(observation);
    let pixels = model.iter().zip(&observation.used);
    pixels.map(|(m, used)| if *used { information(*m, background, per_exposure)[0] } else { 0.0 }).collect()
}

fn noise(observation: &Observation) -> (f64, f64) {
    (observation.background_rms_e_s.powi(2), 1.0 / observation.exposure_s)
}

/// Σ aⱼBⱼ.
pub(crate) fn combine(lights: &[Vec<f64>], amplitudes: &[f64]) -> Vec<f64> {
    let mut model = vec![0.0; lights[0].len()];
    for (light, a) in lights.iter().zip(amplitudes) {
        model.iter_mut().zip(light).for_each(|(m, b)| *m += a * b);
    }
    model
}

/// Σ wᵢ BᵢBᵢᵀ.
fn products(lights: &[Vec<f64>], weight: &[f64]) -> DMatrix<f64> {
    let k = lights.len();
    let mut matrix = DMatrix::zeros(k, k);
    for i in 0..k {
        for j in 0..=i {
            let pixels = lights[i].iter().zip(&lights[j]).zip(weight);
            matrix[(i, j)] = sum(pixels.map(|((a, b), w)| a * b * w));
            matrix[(j, i)] = matrix[(i, j)];
        }
    }
    matrix
}

fn project(lights: &[Vec<f64>], weight: &[f64]) -> DVector<f64> {
    DVector::from_iterator(lights.len(), lights.iter().map(|b| sum(b.iter().zip(weight).map(|(b, w)| b * w))))
}

/// A sum in eight interleaved parts, which the compiler keeps in SIMD registers.
fn sum(terms: impl ExactSizeIterator<Item = f64>) -> f64 {
    let mut parts = [0.0; 8];
    for (i, term) in terms.enumerate() {
        parts[i % 8] += term;
    }
    parts.iter().sum()
}

/// ℓ, ℓ′, −ℓ″ of every pixel, 0 where it is not used, and the whole objective with the prior of the amplitudes.
struct Expansion {
    value: f64,
    first: Vec<f64>,
    curvature: Vec<f64>,
}

fn expand(
    observation: &Observation,
    lights: &[Vec<f64>],
    amplitudes: &DVector<f64>,
    priors: &[[f64; 2]],
) -> Expansion {
    let (background, per_exposure) = noise(observation);
    let model = combine(lights, amplitudes.as_slice());
    let n = model.len();
    let mut out = Expansion { value: 0.0, first: vec![0.0; n], curvature: vec![0.0; n] };
    let mut parts = [0.0; 8];
    for i in 0..n {
        let [value, first, second] = pixel(observation.data_e_s[i], model[i], background, per_exposure);
        let on = f64::from(u8::from(observation.used[i]));
        parts[i % 8] += on * value;
        out.first[i] = on * first;
        out.curvature[i] = -on * second;
    }
    out.value = parts.iter().sum();
    for (a, [mean, sd]) in amplitudes.iter().zip(priors) {
        out.value -= 0.5 * ((a - mean) / sd).powi(2);
    }
    out
}

fn marginalised(
    observation: &Observation,
    lights: &[Vec<f64>],
    priors: &[[f64; 2]],
    with_adjoint: bool,
) -> Option<ImageFit> {
    let precision = DVector::from_iterator(priors.len(), priors.iter().map(|[_, sd]| 1.0 / (sd * sd)));
    let mean = DVector::from_iterator(priors.len(), priors.iter().map(|[mean, _]| *mean));
    let diagonal = DMatrix::from_diagonal(&precision);
    let mut a = least_squares(observation, lights, &precision, &mean)?;
    let (expansion, curvature) = maximise(observation, lights, priors, (&precision, &mean), &mut a)?;

    let (background, per_exposure) = noise(observation);
    let model = combine(lights, a.as_slice());
    let informations: Vec<[f64; 2]> = (0..model.len())
        .map(|i| if observation.used[i] { information(model[i], background, per_exposure) } else { [0.0; 2] })
        .collect();
    let weights: Vec<f64> = informations.iter().map(|f| f[0]).collect();
    let fisher = (products(lights, &weights) + &diagonal).cholesky()?;
    let ln_det: f64 = 2.0 * fisher.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let constant = -0.5 * std::f64::consts::TAU.ln() * observation.pixels_in_use() as f64;
    let log_likelihood =
        constant + expansion.value - 0.5 * (ln_det - precision.iter().map(|p| p.ln()).sum::<f64>());
    let mut adjoint = Vec::new();
    if with_adjoint {
        // T = −½ ln det F depends on B directly and through â, where −H dâ + d(Bᵀℓ′) = 0.
        let inverse = fisher.inverse();
        let k = lights.len();
        let spread = |i: usize| DVector::from_iterator(k, lights.iter().map(|b| b[i]));
        let mut by_amplitude = DVector::zeros(k);
        let columns: Vec<(DVector<f64>, f64)> = (0..model.len())
            .map(|i| {
                let b = spread(i);
                let solved = &inverse * &b;
                let q = solved.dot(&b);
                by_amplitude.axpy(-0.5 * informations[i][1] * q, &b, 1.0);
                (solved, q)
            })
            .collect();
        let y = curvature.lu().solve(&by_amplitude)?;
        adjoint = vec![vec![0.0; model.len()]; k];
        for (i, (solved, q)) in columns.iter().enumerate() {
            let [f, df] = informations[i];
            let pulled: f64 = (0..k).map(|j| lights[j][i] * y[j]).sum();
            for j in 0..k {
                adjoint[j][i] = expansion.first[i] * (a[j] + y[j])
                    - expansion.curvature[i] * a[j] * pulled
                    - f * solved[j]
                    - 0.5 * df * a[j] * q;
            }
        }
    }
    Some(ImageFit { amplitudes: a.as_slice().to_vec(), log_likelihood, adjoint })
}

/// Newton's method for the amplitudes, halving steps that do not ascend; returns the expansion at the maximum and −H.
fn maximise(
    observation: &Observation,
    lights: &[Vec<f64>],
    priors: &[[f64; 2]],
    (precision, mean): (&DVector<f64>, &DVector<f64>),
    a: &mut DVector<f64>,
) -> Option<(Expansion, DMatrix<f64>)> {
    const MOST_STEPS: usize = 30;
    /// In units of the posterior standard deviations of the amplitudes: leaves 1e-9 of the gradient.
    const CONVERGED: f64 = 1e-9;
    let diagonal = DMatrix::from_diagonal(precision);
    let mut here = expand(observation, lights, a, priors);
    for _ in 0..MOST_STEPS {
        let curvature = products(lights, &here.curvature) + &diagonal;
        let gradient = project(lights, &here.first) - precision.component_mul(&(&*a - mean));
        let Some(factor) = curvature.clone().cholesky() else { return None };
        let step = factor.solve(&gradient);
        if !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        if gradient.dot(&step) <= CONVERGED * CONVERGED {
            return Some((here, curvature));
        }
        let mut length = 1.0;
        loop {
            let moved = &*a + &step * length;
            let there = expand(observation, lights, &moved, priors);
            if there.value >= here.value || length < 1e-3 {
                (*a, here) = (moved, there);
                break;
            }
            length *= 0.5;
        }
    }
    let curvature = products(lights, &here.curvature) + &diagonal;
    Some((here, curvature))
}

/// Amplitudes by least squares with the variance of the data.
fn least_squares(
    observation: &Observation,
    lights: &[Vec<f64>],
    precision: &DVector<f64>,
    mean: &DVector<f64>,
) -> Option<DVector<f64>> {
    let weight = data_weights(observation);
    let weighted: Vec<f64> = weight.iter().zip(&observation.data_e_s).map(|(w, d)| w * d).collect();
    let matrix = products(lights, &weight) + DMatrix::from_diagonal(precision);
    let right = project(lights, &weighted) + precision.component_mul(mean);
    Some(matrix.cholesky()?.solve(&right)).filter(|a| a.iter().all(|a| a.is_finite()))
}

/// 1/(max(d, 0)/t + σ²), 0 where the pixel is not used.
fn data_weights(observation: &Observation) -> Vec<f64> {
    let (background, per_exposure) = noise(observation);
    let pixels = observation.data_e_s.iter().zip(&observation.used);
    pixels
        .map(|(d, used)| if *used { 1.0 / variance(*d, background, per_exposure)[0] } else { 0.0 })
        .collect()
}

fn solved(observation: &Observation, lights: &[Vec<f64>], with_adjoint: bool) -> Option<ImageFit> {
    let k = lights.len();
    let (background, per_exposure) = noise(observation);
    let weight = data_weights(observation);
    let weighted: Vec<f64> = weight.iter().zip(&observation.data_e_s).map(|(w, d)| w * d).collect();
    let factor = products(lights, &weight).cholesky()?;
    let a = factor.solve(&project(lights, &weighted));
    if !a.iter().all(|a| a.is_finite()) {
        return None;
    }
    let model = combine(lights, a.as_slice());
    let n = model.len();
    let mut first = vec![0.0; n];
    let mut parts = [0.0; 8];
    for i in (0..n).filter(|i| observation.used[*i]) {
        let [v, dv] = variance(model[i], background, per_exposure);
        let pull = (observation.data_e_s[i] - model[i]) / v;
        parts[i % 8] -= 0.5 * pull * pull * v;
        first[i] = pull + 0.5 * dv * pull * pull;
    }
    let mut adjoint = Vec::new();
    if with_adjoint {
        let y = factor.solve(&project(lights, &first));
        adjoint = vec![vec![0.0; n]; k];
        for i in 0..n {
            let pulled: f64 = (0..k).map(|j| lights[j][i] * y[j]).sum();
            let residual = weight[i] * (observation.data_e_s[i] - model[i]);
            for j in 0..k {
                adjoint[j][i] = first[i] * a[j] + residual * y[j] - weight[i] * a[j] * pulled;
            }
        }
    }
    Some(ImageFit { amplitudes: a.as_slice().to_vec(), log_likelihood: parts.iter().sum(), adjoint })
}
