//! The folder of a fit: `summary.json`, `posterior.nc`, `model.toml` and figures.

use std::path::Path;

use serde::Serialize;

use super::fit_warnings::{at_edge, warnings};
use super::number_text::probability_text;
use super::page::{RunRecord, stage_page};
use super::staged::{Drawing, stage_figures, stage_json, stage_text};
use crate::error::Result;
use crate::inference::{Fit, ParameterSummary, Profile};
use crate::io::{PosteriorVariable, Provenance, RunFile, Staging, TIMINGS, write_posterior};
use crate::plot::figures::{
    CornerParameter, CornerPosterior, GridData, ProfileCurve, TraceParameter, corner, profiles,
    reconstruction, source_plane, trace_plot,
};
use crate::plot::{Anchor, Caption, Colour, Extent, Figure};
use crate::profile::light::{LightProfile, Sersic};

/// What [`TIMINGS`] holds.
#[derive(Serialize)]
struct Timings {
    seconds: f64,
}

/// What `summary.json` holds.
#[derive(Debug, Clone, Serialize)]
pub struct FitSummary {
    /// Name of the model.
    pub model: String,
    /// Name of the sampler.
    pub sampler: String,
    /// Seed.
    pub seed: u64,
    /// True if the model describes the image: neither χ², too large or too small, nor the largest smoothed residual is improbable.
    pub good_fit: bool,
    /// True if R-hat < 1.01 and ESS > 400 for every quantity.
    pub converged: bool,
    /// Probability of a χ² at least as large as that of the best fit, were the model true.
    pub p_value: f64,
    /// What speaks against image, model or intervals, in words.
    pub warnings: Vec<String>,
    /// Parameters whose 68% interval reaches an edge of their prior.
    pub at_edge: Vec<String>,
    /// Largest |residual| after smoothing by a Gaussian of 1.5 pixels, in its own standard deviations.
    pub largest_residual_sigma: f64,
    /// Where, arcsec.
    pub largest_residual_at_arcsec: [f64; 2],
    /// Largest R-hat of all quantities.
    pub worst_r_hat: f64,
    /// Smallest effective number of draws of all quantities.
    pub worst_ess: f64,
    /// Divergent trajectories among the draws.
    pub divergences: usize,
    /// First draws of each chain that were left out, drawn before the sampler knew the posterior.
    pub early_draws: usize,
    /// χ² per degree of freedom of the best fit.
    pub chi2_reduced: f64,
    /// ln L of the best fit.
    pub log_likelihood: f64,
    /// ln Z and its standard deviation, of nested sampling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_evidence: Option<f64>,
    /// Standard deviation of ln Z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_evidence_error: Option<f64>,
    /// Where the line of sight is made of haloes: largest difference of β from that of rays traced through them, arcsec.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expansion_error_arcsec: Option<f64>,
    /// Evaluations of the likelihood or its gradient, start included.
    pub evaluations: u64,
    /// Seconds the fit took; in `timings.json`, as they differ from run to run.
    #[serde(skip)]
    pub seconds: f64,
    /// Samples of the surface brightness that stand for the pixels.
    pub samples_of_brightness: usize,
    /// Name and value of every light's amplitude at the best fit, e⁻/s per arcsec² at R_sersic.
    pub amplitudes: std::collections::BTreeMap<String, f64>,
    /// One entry a fitted or derived quantity.
    pub parameters: Vec<ParameterSummary>,
    /// Profile likelihoods that were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<Profile>,
}

impl FitSummary {
    /// Reads the numbers off a fit.
    pub fn of(fit: &Fit, model: &str, seconds: f64) -> Self {
        let worst = fit.status.worst;
        let names = fit.likelihood.model().amplitude_names();
        Self {
            model: model.into(),
            sampler: fit.settings.sampler.name().into(),
            seed: fit.settings.seed,
            good_fit: fit.goodness.good_fit,
            converged: fit.status.is_converged,
            p_value: fit.goodness.p_value,
            warnings: warnings(fit),
            at_edge: at_edge(fit).map(String::from).collect(),
            largest_residual_sigma: fit.goodness.largest_residual_sigma,
            largest_residual_at_arcsec: fit.goodness.largest_residual_at_arcsec,
            worst_r_hat: worst.r_hat,
            worst_ess: worst.ess_bulk.min(worst.ess_tail),
            divergences: fit.status.divergences,
            early_draws: fit.status.early_draws,
            chi2_reduced: fit.chi2_reduced(),
            log_likelihood: fit.image.log_likelihood,
            log_evidence: fit.evidence.as_ref().map(|e| e.log_evidence),
            log_evidence_error: fit.evidence.as_ref().map(|e| e.log_evidence_error),
            expansion_error_arcsec: fit.expansion_error_arcsec,
            evaluations: fit.evaluations,
            seconds,
            samples_of_brightness: fit.likelihood.mesh().samples(),
            amplitudes: names.into_iter().zip(fit.image.amplitudes.iter().copied()).collect(),
            parameters: fit.parameters.clone(),
            profiles: Vec::new(),
        }
    }
}

/// The figure, with a line over its first panel that says so where the model does not describe the image.
fn with_verdict(mut figure: Figure, summary: &FitSummary) -> Figure {
    if let Some(panel) = figure.panels.first_mut().filter(|_| !summary.good_fit) {
        let text = format!("Not a good fit: p {}", probability_text(summary.p_value, 1));
        panel.captions.insert(0, Caption { text, colour: Colour::RED, anchor: Anchor::Start });
    }
    figure
}

/// Values by parameter name, and what they are called in figures; of several sets the first is the truth.
pub type NamedTruths<'a> = (&'a str, Vec<(String, f64)>);

/// Stages every file of a fit under `prefix` (empty, or a folder ending in `/`).
///
/// # Errors
/// [`crate::Error::Write`] when the disk is full.
pub fn write_fit(
    fit: &Fit,
    summary: &FitSummary,
    truths: &[NamedTruths],
    staging: &Staging,
    prefix: &str,
    provenance: &Provenance,
    record: &RunRecord,
) -> Result<()> {
    stage_json(staging, &format!("{prefix}summary.json"), summary)?;
    stage_text(staging, &format!("{prefix}model.toml"), &provenance.config_toml)?;
    stage_json(staging, &format!("{prefix}{TIMINGS}"), &Timings { seconds: summary.seconds })?;
    let variables: Vec<PosteriorVariable> = fit
        .parameters
        .iter()
        .filter_map(|p| {
            let draws = fit.draws_of(&p.name)?.to_vec();
            Some(PosteriorVariable {
                name: p.name.clone(),
                unit: p.unit.into(),
                label: p.label.clone(),
                draws,
            })
        })
        .collect();
    let attributes = [("converged", i64::from(summary.converged).into())];
    staging.write(format!("{prefix}posterior.nc"), |path| {
        write_posterior(path, provenance, &variables, &fit.chains, &attributes)
    })?;
    staging
        .write(format!("{prefix}reconstruction.h5"), |path| write_reconstruction(fit, path, provenance))?;
    let names: Vec<&str> = fit.parameters.iter().map(|p| p.name.as_str()).collect();
    let physical = most_physical(&names);
    let shears: Vec<&str> = names.iter().copied().filter(|name| name.starts_with("gamma")).collect();
    let corner = |names: &[&str]| corner_figure(&[("", fit)], names, truths);
    let first_truths: &[(String, f64)] = truths.first().map_or(&[], |set| &set.1);
    type Draw<'a> = &'a (dyn Fn() -> Option<Figure> + Send + Sync);
    let has_profiles = !summary.profiles.is_empty();
    let figures: [(&str, Draw); 7] = [
        ("reconstruction", &|| Some(reconstruction_figure(fit))),
        ("source", &|| source_figure(fit)),
        ("corner", &|| Some(corner(&physical))),
        ("corner_all", &|| (physical.len() < names.len()).then(|| corner(&names))),
        ("corner_shear", &|| (shears.len() > 1).then(|| corner(&shears))),
        ("profiles", &|| has_profiles.then(|| profile_figure(fit, &summary.profiles, first_truths))),
        ("trace", &|| Some(trace_figure(fit, first_truths))),
    ];
    let figures = figures.map(|(name, figure)| {
        let draw: Drawing = Box::new(move || Ok(figure().map(|figure| with_verdict(figure, summary))));
        (format!("{prefix}{name}"), draw)
    });
    stage_figures(staging, figures.into())?;
    stage_page(staging, prefix, record)
}

/// Of many parameters those that fit on a page: shears first, then the lens, then its source.
fn most_physical<'a>(names: &[&'a str]) -> Vec<&'a str> {
    const MOST: usize = 8;
    const FIRST: [&str; 8] = ["_los", "gamma", "theta_E", ".gamma", "lens", ".e", "R_sersic", "source"];
    let rank = |name: &str| FIRST.iter().position(|word| name.contains(word)).unwrap_or(FIRST.len());
    let mut kept: Vec<usize> = (0..names.len()).collect();
    kept.sort_by_key(|&i| (rank(names[i]), i));
    kept.truncate(MOST);
    kept.sort_unstable();
    kept.into_iter().map(|i| names[i]).collect()
}

/// Data, best fit and residual as they are drawn; NaN where the mask leaves a pixel out.
fn write_reconstruction(fit: &Fit, path: &Path, provenance: &Provenance) -> Result<()> {
    let observation = fit.likelihood.observation();
    let n = observation.grid.pixels();
    let file = RunFile::create(path, provenance)?;
    for (name, values, unit, about) in [
        ("residual", fit.normalised_residuals(), "", "(data - model)/noise"),
        ("data", used_data(fit), "electron/s", "the image, where it is used"),
        ("model", fit.image.model_e_s.clone(), "electron/s", "the best fit"),
    ] {
        file.write_with_gaps("image", name, &values, &[n, n], unit, about)?;
    }
    file.attribute("image", "pixel_scale_arcsec", observation.grid.pixel_scale_arcsec())?;
    file.close()
}

fn used_data(fit: &Fit) -> Vec<f64> {
    let observation = fit.likelihood.observation();
    let masked = observation.data_e_s.iter().zip(&observation.used);
    masked.map(|(d, used)| if *used { *d } else { f64::NAN }).collect()
}

/// Corner plot of the named quantities of one or more fits, each with its name in the legend.
pub fn corner_figure(fits: &[(&str, &Fit)], names: &[&str], truths: &[NamedTruths]) -> Figure {
    let told = |name: &str| fits.iter().flat_map(|(_, fit)| &fit.parameters).find(|p| p.name == name);
    let parameters: Vec<CornerParameter> = names
        .iter()
        .map(|name| {
            let (label, unit) = told(name).map_or((*name, ""), |p| (&p.label, p.unit));
            let values = truths.iter().map(|(_, set)| truth_of(set, name)).collect();
            CornerParameter { label, unit, values }
        })
        .collect();
    let draws: Vec<Vec<Vec<f64>>> = fits
        .iter()
        .map(|(_, fit)| names.iter().map(|n| fit.draws_of(n).unwrap_or_default().concat()).collect())
        .collect();
    let posteriors: Vec<CornerPosterior> = fits
        .iter()
        .zip(&draws)
        .map(|((legend, _), draws)| CornerPosterior {
            legend,
            draws: draws.iter().map(Vec::as_slice).collect(),
        })
        .collect();
    let value_names: Vec<&str> = truths.iter().map(|(name, _)| *name).collect();
    corner(&parameters, &posteriors, &value_names)
}

/// Draws of every chain, parameter by parameter.
fn trace_figure(fit: &Fit, truths: &[(String, f64)]) -> Figure {
    let draws: Vec<&[Vec<f64>]> =
        fit.parameters.iter().map(|p| fit.draws_of(&p.name).unwrap_or_default()).collect();
    let parameters: Vec<TraceParameter> = fit
        .parameters
        .iter()
        .zip(&draws)
        .map(|(p, draws)| TraceParameter {
            label: &p.label,
            chains: draws.iter().map(Vec::as_slice).collect(),
            truth: truth_of(truths, &p.name),
        })
        .collect();
    trace_plot(&parameters)
}

/// Profile likelihoods beside the posterior densities of the same parameters.
fn profile_figure(fit: &Fit, found: &[Profile], truths: &[(String, f64)]) -> Figure {
    let draws: Vec<Vec<f64>> =
        found.iter().map(|profile| fit.draws_of(&profile.name).unwrap_or_default().concat()).collect();
    let curves: Vec<ProfileCurve> = found
        .iter()
        .zip(&draws)
        .map(|(profile, draws)| ProfileCurve {
            label: &profile.label,
            unit: profile.unit,
            ratio: profile.likelihood_ratio(),
            draws,
            truth: truth_of(truths, &profile.name),
        })
        .collect();
    profiles(&curves)
}

fn truth_of(truths: &[(String, f64)], name: &str) -> Option<f64> {
    truths.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
}

/// Data, model and residual of a fit.
pub fn reconstruction_figure(fit: &Fit) -> Figure {
    let observation = fit.likelihood.observation();
    let sky = observation.grid;
    let grid = |values| GridData::square(values, sky.pixels(), sky.half_width_arcsec());
    let data = used_data(fit);
    let residuals = fit.normalised_residuals();
    let grids = [grid(&data), grid(&fit.image.model_e_s), grid(&residuals)];
    reconstruction(grids, observation.background_rms_e_s, fit.chi2_reduced())
}

/// The first source of the best fit in its plane, out to four of its radii.
fn source_figure(fit: &Fit) -> Option<Figure> {
    const PIXELS: usize = 201;
    const RADII: f64 = 4.0;
    let model = fit.likelihood.model();
    let value = |name: &str| model.value_of(&format!("source.{name}"), &fit.best_fit);
    let parameters = Sersic::PARAMETERS.map(|parameter| value(parameter.name));
    let [Some(radius), Some(n), Some(e1), Some(e2), Some(x), Some(y)] = parameters else { return None };
    let source = Sersic::of_unit_amplitude([radius, n, e1, e2, x, y]).ok()?;
    let (amplitude, half) = (fit.image.amplitudes.first()?, RADII * radius);
    let at = |i: usize| half * (2.0 * i as f64 / (PIXELS - 1) as f64 - 1.0);
    let values: Vec<f64> = (0..PIXELS * PIXELS)
        .map(|k| amplitude * source.surface_brightness(x + at(k % PIXELS), y + at(k / PIXELS)))
        .collect();
    let observation = fit.likelihood.observation();
    let faintest = observation.background_rms_e_s / observation.grid.pixel_scale_arcsec().powi(2);
    let extent_arcsec = Extent::square([x, y], half);
    Some(source_plane(GridData { values: &values, nx: PIXELS, ny: PIXELS, extent_arcsec }, faintest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_many_keeps_the_shears_and_the_lens() {
        let names = [
            "lens.theta_E",
            "lens.e1",
            "source.x",
            "lens.center_x",
            "light.n",
            "light.R",
            "light.e1",
            "light.e2",
            "gamma1_od",
            "gamma2_od",
            "gamma1_los",
            "gamma2_los",
        ];
        let kept = most_physical(&names);
        let wanted = ["lens.theta_E", "lens.e1", "lens.center_x", "light.e1", "gamma1_od", "gamma2_od"];
        assert_eq!(kept, [&wanted[..], &names[10..]].concat());
        assert_eq!(most_physical(&names[..3]), names[..3]);
    }
}
