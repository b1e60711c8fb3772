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

use super::observation::Observation;
use super::pixel_sums::{PixelDensity, Sums, Weights};
use crate::inference::model::LikelihoodKind;
use crate::numerics::dispatch::kernel;
use crate::numerics::real::{LANES, Lanes, Real};

/// What to differentiate a likelihood by.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum By {
    /// Nothing.
    Nothing,
    /// The model image m, amplitudes following: all but the change of ½ ln det F and of the residual's share in â,
    /// which hardly depend on the parameters.
    Model,
    /// The image B of every light, exactly.
    Light,
}

/// The likelihood of one model image and what it takes to differentiate it.
pub(crate) struct ImageFit {
    /// Amplitudes of the lights.
    pub amplitudes: Vec<f64>,
    /// ln L.
    pub log_likelihood: f64,
    /// ∂lnL/∂m of every pixel, or ∂lnL/∂Bⱼ of every pixel and light.
    pub adjoint: Vec<Vec<f64>>,
}

impl LikelihoodKind {
    /// ln L of the images `lights` (amplitude 1, PSF applied); `None` where amplitudes cannot be solved for.
    pub(crate) fn fit(
        self,
        observation: &Observation,
        lights: &[Vec<f64>],
        priors: &[[f64; 2]],
        by: By,
    ) -> Option<ImageFit> {
        match self {
            Self::Gaussian => marginalised(observation, lights, priors, by),
            Self::Lenstronomy => solved(observation, lights, by),
        }
    }
}

/// Fisher information f = 1/v + ½(v′/v)² of the model flux in every pixel and f′, 0 where it is not used.
pub(crate) fn informations(observation: &Observation, model: &[f64]) -> [Vec<f64>; 2] {
    let mut out = [vec![0.0; model.len()], vec![0.0; model.len()]];
    inform_pixels(PixelDensity(observation.noise()), &observation.used, model, &mut out);
    out
}

kernel! {
    fn inform_pixels(noise: PixelDensity, used: &[bool], model: &[f64], [f, df]: &mut [Vec<f64>; 2]) {
        for start in (0..model.len()).step_by(LANES) {
            let used = Lanes::load_flags(used, start);
            let of_pixels = noise.information(Lanes::load(model, start));
            let [of_f, of_df] = of_pixels.map(|v| v.unless_below(used, 1.0, 0.0));
            of_f.store(f, start);
            of_df.store(df, start);
        }
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

kernel! {
    /// Σ a·b·w in eight interleaved parts, which stay in SIMD registers.
    fn weighted_sum(a: &[f64], b: &[f64], w: &[f64]) -> f64 {
        let mut parts = Lanes::ZERO;
        for start in (0..a.len()).step_by(LANES) {
            parts +=
                Lanes::load_or_zero(a, start) * Lanes::load_or_zero(b, start) * Lanes::load_or_zero(w, start);
        }
        parts.sum()
    }
}

/// ℓ′ and −ℓ″ of every pixel, 0 where it is not used.
fn expansions(observation: &Observation, model: &[f64]) -> [Vec<f64>; 2] {
    let mut out = [vec![0.0; model.len()], vec![0.0; model.len()]];
    expand_pixels(observation, model, &mut out);
    out
}

kernel! {
    fn expand_pixels(observation: &Observation, model: &[f64], [first, curvature]: &mut [Vec<f64>; 2]) {
        let noise = PixelDensity(observation.noise());
        for start in (0..model.len()).step_by(LANES) {
            let used = Lanes::load_flags(&observation.used, start);
            let (data, model) = (Lanes::load(&observation.data_e_s, start), Lanes::load(model, start));
            let [of_first, of_curvature] = noise.expand(data, model).map(|v| v.unless_below(used, 1.0, 0.0));
            of_first.store(first, start);
            of_curvature.store(curvature, start);
        }
    }
}

fn marginalised(
    observation: &Observation,
    lights: &[Vec<f64>],
    priors: &[[f64; 2]],
    by: By,
) -> Option<ImageFit> {
    let precision = DVector::from_iterator(priors.len(), priors.iter().map(|[_, sd]| 1.0 / (sd * sd)));
    let mean = DVector::from_iterator(priors.len(), priors.iter().map(|[mean, _]| *mean));
    let diagonal = DMatrix::from_diagonal(&precision);
    let mut a = least_squares(observation, lights, &precision, &mean)?;
    maximise(observation, lights, (&precision, &mean), &mut a)?;

    let information = Sums::of(observation, lights, a.as_slice(), Weights::Information);
    let off = &a - &mean;
    let maximum = information.value - 0.5 * off.dot(&precision.component_mul(&off));
    let fisher = (information.quadratic + &diagonal).cholesky()?;
    let ln_det: f64 = 2.0 * fisher.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let constant = -0.5 * std::f64::consts::TAU.ln() * observation.pixels_in_use() as f64;
    let log_likelihood = constant + maximum - 0.5 * (ln_det - precision.iter().map(|p| p.ln()).sum::<f64>());
    let mut adjoint = Vec::new();
    if by == By::Model {
        let [first, _] = expansions(observation, &combine(lights, a.as_slice()));
        adjoint.push(first);
    }
    if by == By::Light {
        // T = −½ ln det F depends on B directly and through â, where −H dâ + d(Bᵀℓ′) = 0.
        let model = combine(lights, a.as_slice());
        let [f, df] = informations(observation, &model);
        let [first, second] = expansions(observation, &model);
        let expansion = Weights::Expansion { with_value: false };
        let curvature = Sums::of(observation, lights, a.as_slice(), expansion).quadratic + &diagonal;
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
                (0..model.len())
                    .map(|i| {
                        first[i] * (a[j] + y[j])
                            - f[i] * solved[j][i]
                            - a[j] * (second[i] * pulled[i] + 0.5 * df[i] * q[i])
                    })
                    .collect()
            })
            .collect();
    }
    Some(ImageFit { amplitudes: a.as_slice().to_vec(), log_likelihood, adjoint })
}

/// Newton's method for the amplitudes, halving steps that do not ascend; `None` where ln p is not concave.
fn maximise(
    observation: &Observation,
    lights: &[Vec<f64>],
    (precision, mean): (&DVector<f64>, &DVector<f64>),
    a: &mut DVector<f64>,
) -> Option<()> {
    const MOST_STEPS: usize = 30;
    /// A full step this long, in posterior standard deviations of the amplitudes, leaves its square: 1e-8.
    const CONVERGED: f64 = 1e-4;
    /// Steps shorter than this ascend, there is no need to look.
    const SAFE: f64 = 0.1;
    let diagonal = DMatrix::from_diagonal(precision);
    let expand = |a: &DVector<f64>, with_value: bool| {
        let mut sums = Sums::of(observation, lights, a.as_slice(), Weights::Expansion { with_value });
        let off = a - mean;
        // An unknown value is below any other.
        let value = sums.value - 0.5 * off.dot(&precision.component_mul(&off));
        sums.value = if with_value { value } else { f64::NEG_INFINITY };
        sums.linear -= precision.component_mul(&off);
        sums.quadratic += &diagonal;
        sums
    };
    let mut here = expand(a, true);
    for _ in 0..MOST_STEPS {
        let step = here.quadratic.clone().cholesky()?.solve(&here.linear);
        let length = here.linear.dot(&step).sqrt();
        if !length.is_finite() {
            return None;
        }
        if length <= SAFE {
            *a += step;
            if length <= CONVERGED {
                break;
            }
            here = expand(a, false);
            continue;
        }
        let mut part = 1.0;
        loop {
            let moved = &*a + &step * part;
            let there = expand(&moved, true);
            if there.value >= here.value || part < 1e-3 {
                (*a, here) = (moved, there);
                break;
            }
            part *= 0.5;
        }
    }
    Some(())
}

/// Amplitudes by least squares with the variance of the data.
fn least_squares(
    observation: &Observation,
    lights: &[Vec<f64>],
    precision: &DVector<f64>,
    mean: &DVector<f64>,
) -> Option<DVector<f64>> {
    let sums = Sums::of(observation, lights, &[], Weights::Data);
    let matrix = sums.quadratic + DMatrix::from_diagonal(precision);
    let right = sums.linear + precision.component_mul(mean);
    Some(matrix.cholesky()?.solve(&right)).filter(|a| a.iter().all(|a| a.is_finite()))
}

fn solved(observation: &Observation, lights: &[Vec<f64>], by: By) -> Option<ImageFit> {
    let normal = Sums::of(observation, lights, &[], Weights::Data);
    let factor = normal.quadratic.cholesky()?;
    let a = factor.solve(&normal.linear);
    if !a.iter().all(|a| a.is_finite()) {
        return None;
    }
    let chi2 = Sums::of(observation, lights, a.as_slice(), Weights::ChiSquared);
    let y = factor.solve(&chi2.linear);
    let shares: Vec<[f64; 2]> = match by {
        By::Nothing => vec![],
        By::Model => vec![[1.0, 0.0]],
        By::Light => a.iter().zip(&y).map(|(a, y)| [*a, *y]).collect(),
    };
    let mut adjoint = vec![vec![0.0; observation.data_e_s.len()]; shares.len()];
    if by != By::Nothing {
        adjoin_pixels(observation, lights, (a.as_slice(), y.as_slice()), &shares, &mut adjoint);
    }
    Some(ImageFit { amplitudes: a.as_slice().to_vec(), log_likelihood: chi2.value, adjoint })
}

kernel! {
    /// ∂lnL/∂B of [`solved`], from the amplitudes and y = (Σ BBᵀ/v)⁻¹ ∂lnL/∂a: for every one of the `shares` [a, y] that the
    /// model and the residual have in an image.
    fn adjoin_pixels(
        observation: &Observation,
        lights: &[Vec<f64>],
        (a, y): (&[f64], &[f64]),
        shares: &[[f64; 2]],
        adjoint: &mut [Vec<f64>],
    ) {
        let noise = PixelDensity(observation.noise());
        for start in (0..observation.data_e_s.len()).step_by(LANES) {
            let data = Lanes::load(&observation.data_e_s, start);
            let used = Lanes::load_flags(&observation.used, start);
            let (mut model, mut pulled) = (Lanes::ZERO, Lanes::ZERO);
            for (light, (a, y)) in lights.iter().zip(a.iter().zip(y)) {
                let light = Lanes::load(light, start);
                model += light * *a;
                pulled += light * *y;
            }
            let [_, first, weight] = noise.chi_squared(data, model).map(|v| v.unless_below(used, 1.0, 0.0));
            let residual = weight * (data - model);
            for (out, [a, y]) in adjoint.iter_mut().zip(shares) {
                (first * *a + residual * *y - weight * pulled * *a).store(out, start);
            }
        }
    }
}
