//! Precision, accuracy and outliers of a model over a catalogue, as section 3.1.3 of Hogg et al. 2023 defines them.

use serde::Serialize;

use super::recovery::{ProfiledShear, ShearRecovery};

/// σᵢ: geometric mean over the components of the mean of σ⁺ and σ⁻ (equation 25).
pub fn uncertainty(fit: &ShearRecovery) -> f64 {
    let [one, two] = fit.shear.map(|shear| 0.5 * (shear.high - shear.low));
    (one * two).sqrt()
}

/// σ_a of equation 28: σ⁺ if the output lies below the input or on it, else σ⁻.
fn sigma_towards(fit: &ShearRecovery, truth: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|a| {
        let shear = &fit.shear[a];
        let [minus, plus] = shear.sigmas();
        if shear.median <= truth[a] { plus } else { minus }
    })
}

/// |γ_out − γ_in|/√(σ₁² + σ₂²), the quantity that equation 29 compares with n.
pub fn residual_in_sigma(fit: &ShearRecovery, truth: [f64; 2]) -> f64 {
    let sigma = sigma_towards(fit, truth);
    let distance = (fit.shear[0].median - truth[0]).hypot(fit.shear[1].median - truth[1]);
    distance / sigma[0].hypot(sigma[1])
}

/// What Table 2 of Hogg et al. 2023 has for a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperScore {
    /// haloray's name of the model.
    pub model: &'static str,
    /// N_productive of 64.
    pub productive: usize,
    /// σ̄.
    pub mean_uncertainty: f64,
    /// χ².
    pub chi2: f64,
    /// N_{>2σ}.
    pub outliers: usize,
}

/// Table 2 of Hogg et al. 2023.
pub const PAPER_TABLE_2: [PaperScore; 4] = [
    PaperScore { model: "comprehensive", productive: 63, mean_uncertainty: 0.011, chi2: 1.0, outliers: 0 },
    PaperScore {
        model: "no-foreground-shear",
        productive: 62,
        mean_uncertainty: 0.011,
        chi2: 3.4,
        outliers: 2,
    },
    PaperScore { model: "aligned", productive: 56, mean_uncertainty: 0.010, chi2: 62.9, outliers: 36 },
    PaperScore { model: "power-law", productive: 28, mean_uncertainty: 0.010, chi2: 92.2, outliers: 20 },
];

/// log₁₀ σ = −0.76 log₁₀ Q + 1.01, the paper's line for `comprehensive`.
pub const PAPER_QUALITY_FIT: QualityFit = QualityFit { slope: -0.76, intercept: 1.01 };

/// One column of the paper's Table 2, and what it leaves out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelScore {
    /// Name of the model.
    pub model: String,
    /// Fits.
    pub images: usize,
    /// Fits with R-hat and effective sizes in order.
    pub converged: usize,
    /// N_productive: fits with two-sided bounds on both components.
    pub productive: usize,
    /// σ̄, the mean of σᵢ over the productive images.
    pub mean_uncertainty: f64,
    /// Median of σᵢ over the productive images.
    pub median_uncertainty: f64,
    /// Median over the productive images of the same from the Fisher matrix at the maximum.
    pub median_fisher: f64,
    /// χ², mean over both components.
    pub chi2: f64,
    /// N_{>2σ}.
    pub outliers: usize,
    /// Fraction of the 68% intervals of both components that hold the truth.
    pub coverage: f64,
    /// The same of the profile likelihoods, where there are any.
    pub profile_coverage: Option<f64>,
    /// Mean squared residual of their best fits in σ, of both components.
    pub profile_chi2: Option<f64>,
    /// Largest |γ_out − γ_in| in σ.
    pub largest_residual: f64,
    /// log₁₀ σ against log₁₀ Q.
    pub quality_fit: Option<QualityFit>,
}

/// log₁₀ σ = slope·log₁₀ Q + intercept by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct QualityFit {
    /// Slope.
    pub slope: f64,
    /// Intercept.
    pub intercept: f64,
}

impl ModelScore {
    /// Scores the fits of one model; with each goes the true γ_LOS and, where known, the quality of its image.
    pub fn of(model: &str, fits: &[(&ShearRecovery, [f64; 2], Option<f64>)]) -> Self {
        let productive: Vec<_> = fits.iter().filter(|(fit, ..)| fit.is_productive()).collect();
        let n = productive.len() as f64;
        let mean = |value: &dyn Fn(&ShearRecovery, [f64; 2]) -> f64| {
            productive.iter().map(|(fit, truth, _)| value(fit, *truth)).sum::<f64>() / n
        };
        let chi2 = mean(&|fit, truth| {
            let sigma = sigma_towards(fit, truth);
            (0..2).map(|a| 0.5 * ((fit.shear[a].median - truth[a]) / sigma[a]).powi(2)).sum()
        });
        let residuals = productive.iter().map(|(fit, truth, _)| residual_in_sigma(fit, *truth));
        let points: Vec<[f64; 2]> = productive
            .iter()
            .filter_map(|(fit, _, quality)| {
                Some([quality.filter(|q| *q > 0.0)?.log10(), uncertainty(fit).log10()])
            })
            .collect();
        let held = |fit: &ShearRecovery, truth: [f64; 2]| {
            (0..2).filter(|a| (fit.shear[*a].low..=fit.shear[*a].high).contains(&truth[*a])).count() as f64
                / 2.0
        };
        let profiled: Vec<_> = productive
            .iter()
            .flat_map(|(fit, truth, _)| (0..2).map(|a| (fit.shear[a].profile, truth[a])))
            .filter_map(|(profile, truth)| Some((profile?, truth)))
            .collect();
        let of_profiles = |value: &dyn Fn(ProfiledShear, f64) -> f64| {
            let sum: f64 = profiled.iter().map(|(profile, truth)| value(*profile, *truth)).sum();
            (!profiled.is_empty()).then(|| sum / profiled.len() as f64)
        };
        let of_fisher = |fit: &ShearRecovery| (fit.shear[0].fisher * fit.shear[1].fisher).sqrt();
        Self {
            model: model.into(),
            images: fits.len(),
            converged: fits.iter().filter(|(fit, ..)| fit.converged).count(),
            productive: productive.len(),
            mean_uncertainty: mean(&|fit, _| uncertainty(fit)),
            median_uncertainty: median(productive.iter().map(|(fit, ..)| uncertainty(fit)).collect()),
            median_fisher: median(productive.iter().map(|(fit, ..)| of_fisher(fit)).collect()),
            chi2,
            outliers: residuals.clone().filter(|r| *r > 2.0).count(),
            coverage: mean(&held),
            profile_coverage: of_profiles(&|profile, truth| f64::from(u8::from(profile.holds(truth)))),
            profile_chi2: of_profiles(&|profile, truth| profile.residual_in_sigma(truth).powi(2)),
            largest_residual: residuals.fold(0.0, f64::max),
            quality_fit: straight_line(&points),
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// Least squares through (x, y); `None` for fewer than two abscissae.
fn straight_line(points: &[[f64; 2]]) -> Option<QualityFit> {
    let n = points.len() as f64;
    let [mx, my] = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let xx: f64 = points.iter().map(|p| (p[0] - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p[0] - mx) * (p[1] - my)).sum();
    (xx > 0.0).then(|| QualityFit { slope: xy / xx, intercept: my - xy / xx * mx })
}
