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

use multiversion::multiversion;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::observation::Observation;
use crate::numerics::real::{LANES, Lanes, Real};

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

/// Variance of the background and that of one e⁻/s of signal, 1/exposure.
#[derive(Clone, Copy)]
struct Noise {
    background: f64,
    per_exposure: f64,
}

impl Noise {
    fn of(observation: &Observation) -> Self {
        Self {
            background: observation.background_rms_e_s.powi(2),
            per_exposure: 1.0 / observation.exposure_s,
        }
    }

    /// Variance at a model and its derivative by the model.
    #[inline(always)]
    fn variance(self, model: Lanes) -> [Lanes; 2] {
        let slope = Lanes::splat(self.per_exposure).unless_below(model, f64::MIN_POSITIVE, 0.0);
        [model.max(0.0) * self.per_exposure + self.background, slope]
    }
}

/// ℓ, ℓ′ and −ℓ″ of some pixels, without the constant −½ ln 2π.
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn expand_lanes(noise: Noise, data: &Lanes, model: &Lanes) -> [Lanes; 3] {
    let [v, dv] = noise.variance(*model);
    let (inverse, r) = (Lanes::splat(1.0) / v, *data - *model);
    let w = dv * inverse;
    let pull = r * inverse;
    let first = pull + (dv * pull * pull - w) * 0.5;
    let curvature = inverse + pull * w * 2.0 + pull * pull * dv * w - w * w * 0.5;
    [(r * pull + v.ln()) * -0.5, first, curvature]
}

/// Fisher information f = 1/v + ½(v′/v)² of the model flux in every pixel and f′, 0 where it is not used.
pub(crate) fn informations(observation: &Observation, model: &[f64]) -> [Vec<f64>; 2] {
    let mut out = [vec![0.0; model.len()], vec![0.0; model.len()]];
    inform_pixels(Noise::of(observation), &observation.used, model, &mut out);
    out
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn inform_pixels(noise: Noise, used: &[bool], model: &[f64], [f, df]: &mut [Vec<f64>; 2]) {
    for start in (0..model.len()).step_by(LANES) {
        let [v, dv] = noise.variance(Lanes::load(model, start));
        let inverse = Lanes::splat(1.0) / v;
        let w = dv * inverse;
        let used = Lanes::load_flags(used, start);
        (inverse + w * w * 0.5).unless_below(used, 1.0, 0.0).store(f, start);
        (-(inverse * w) - w * w * w).unless_below(used, 1.0, 0.0).store(df, start);
    }
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
            matrix[(i, j)] = weighted_sum(&lights[i], &lights[j], weight);
            matrix[(j, i)] = matrix[(i, j)];
        }
    }
    matrix
}

fn project(lights: &[Vec<f64>], weight: &[f64]) -> DVector<f64> {
    let ones = vec![1.0; weight.len()];
    DVector::from_iterator(lights.len(), lights.iter().map(|light| weighted_sum(light, weight, &ones)))
}

/// Σ a·b·w in eight interleaved parts, which stay in SIMD registers.
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn weighted_sum(a: &[f64], b: &[f64], w: &[f64]) -> f64 {
    let mut parts = Lanes::ZERO;
    for start in (0..a.len()).step_by(LANES) {
        parts +=
            Lanes::load_or_zero(a, start) * Lanes::load_or_zero(b, start) * Lanes::load_or_zero(w, start);
    }
    parts.sum()
}

/// ℓ′ and −ℓ″ of every pixel, 0 where it is not used, and Σℓ with the prior of the amplitudes.
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
    let model = combine(lights, amplitudes.as_slice());
    let n = model.len();
    let mut out = Expansion { value: 0.0, first: vec![0.0; n], curvature: vec![0.0; n] };
    let (noise, mut sum) = (Noise::of(observation), Lanes::ZERO);
    for start in (0..n).step_by(LANES) {
        let used = Lanes::load_flags(&observation.used, start);
        let (data, model) = (Lanes::load(&observation.data_e_s, start), Lanes::load(&model, start));
        let [value, first, curvature] =
            expand_lanes(noise, &data, &model).map(|v| v.unless_below(used, 1.0, 0.0));
        sum += value;
        first.store(&mut out.first, start);
        curvature.store(&mut out.curvature, start);
    }
    out.value = sum.sum();
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

    let model = combine(lights, a.as_slice());
    let [f, df] = informations(observation, &model);
    let fisher = (products(lights, &f) + &diagonal).cholesky()?;
    let ln_det: f64 = 2.0 * fisher.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let constant = -0.5 * std::f64::consts::TAU.ln() * observation.pixels_in_use() as f64;
    let log_likelihood =
        constant + expansion.value - 0.5 * (ln_det - precision.iter().map(|p| p.ln()).sum::<f64>());
    let mut adjoint = Vec::new();
    if with_adjoint {
        // T = −½ ln det F depends on B directly and through â, where −H dâ + d(Bᵀℓ′) = 0.
        let inverse = fisher.inverse();
        // F⁻¹B and q = BᵀF⁻¹B of every pixel.
        let solved: Vec<Vec<f64>> = inverse.column_iter().map(|c| combine(lights, c.as_slice())).collect();
        let mut q = vec![0.0; model.len()];
        for (light, solved) in lights.iter().zip(&solved) {
            q.iter_mut().zip(light.iter().zip(solved)).for_each(|(q, (b, s))| *q += b * s);
        }
        let by_amplitude = lights.iter().map(|light| -0.5 * weighted_sum(light, &df, &q));
        let y = curvature.lu().solve(&DVector::from_iterator(lights.len(), by_amplitude))?;
        let pulled = combine(lights, y.as_slice());
        adjoint = (0..lights.len())
            .map(|j| {
                let (first, curvature) = (&expansion.first, &expansion.curvature);
                (0..model.len())
                    .map(|i| {
                        first[i] * (a[j] + y[j])
                            - f[i] * solved[j][i]
                            - a[j] * (curvature[i] * pulled[i] + 0.5 * df[i] * q[i])
                    })
                    .collect()
            })
            .collect();
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
    /// A full step this long, in posterior standard deviations of the amplitudes, leaves its square: 1e-10.
    const CONVERGED: f64 = 1e-5;
    let diagonal = DMatrix::from_diagonal(precision);
    let mut here = expand(observation, lights, a, priors);
    for _ in 0..MOST_STEPS {
        let curvature = products(lights, &here.curvature) + &diagonal;
        let gradient = project(lights, &here.first) - precision.component_mul(&(&*a - mean));
        let factor = curvature.clone().cholesky()?;
        let step = factor.solve(&gradient);
        if !step.iter().all(|s| s.is_finite()) {
            return None;
        }
        if gradient.dot(&step) <= CONVERGED * CONVERGED {
            *a += step;
            return Some((expand(observation, lights, a, priors), curvature));
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
    let mut weight = vec![0.0; observation.data_e_s.len()];
    weigh_pixels(Noise::of(observation), observation, &mut weight);
    weight
}

#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn weigh_pixels(noise: Noise, observation: &Observation, weight: &mut [f64]) {
    for start in (0..weight.len()).step_by(LANES) {
        let [v, _] = noise.variance(Lanes::load(&observation.data_e_s, start));
        let used = Lanes::load_flags(&observation.used, start);
        (Lanes::splat(1.0) / v).unless_below(used, 1.0, 0.0).store(weight, start);
    }
}

/// −½(d−m)²/v(m) over all pixels, and its derivative by m in each.
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2+fma", "aarch64+neon"))]
fn pull_pixels(noise: Noise, observation: &Observation, model: &[f64], first: &mut [f64]) -> f64 {
    let mut sum = Lanes::ZERO;
    for start in (0..model.len()).step_by(LANES) {
        let [v, dv] = noise.variance(Lanes::load(model, start));
        let r = Lanes::load(&observation.data_e_s, start) - Lanes::load(model, start);
        let pull = r / v;
        let used = Lanes::load_flags(&observation.used, start);
        sum += (r * pull * -0.5).unless_below(used, 1.0, 0.0);
        (pull + dv * pull * pull * 0.5).unless_below(used, 1.0, 0.0).store(first, start);
    }
    sum.sum()
}

fn solved(observation: &Observation, lights: &[Vec<f64>], with_adjoint: bool) -> Option<ImageFit> {
    let k = lights.len();
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
    let log_likelihood = pull_pixels(Noise::of(observation), observation, &model, &mut first);
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
    Some(ImageFit { amplitudes: a.as_slice().to_vec(), log_likelihood, adjoint })
}
