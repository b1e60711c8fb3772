//! What the rows of the study amount to.

use serde::Serialize;

use super::fit_groups::{FitGroup, FitPair};
use super::plan::{SeenHaloes, ValidityPlan};
use super::rows::{Mock, ValiditySightline, VaryingHalo};
use super::statistics::{Biases, Deviation, Share, rank_correlation};
use crate::inference::diagnose::P_VALUE_LIMIT;
use crate::pipeline::DEFINITIONS;

/// χ² above that of the tidal twin, whose noise is the same, that is told of: five deviations of one parameter.
pub const NOTICED_EXCESS: f64 = 25.0;
/// ln of the ratio of evidences above which a model is preferred, 150 to 1.
pub const PREFERRED_LOG_ODDS: f64 = 5.0;
/// Gain in ln p by which a start from the truth ends higher than a blind one for more reasons than rounding.
const HIGHER: f64 = 0.5;
/// The parts of all values below the ends and the middle of an interval of 68%.
pub const MIDDLE: [f64; 3] = [0.16, 0.5, 0.84];

/// Fitted γ_LOS against one definition.
#[derive(Debug, Clone, Serialize)]
pub struct DefinitionSummary {
    /// One of [`DEFINITIONS`].
    pub definition: &'static str,
    /// Whether fits whose χ² speaks against the model are left out.
    pub is_of_good_fits: bool,
    /// Biases, scatter and coverage.
    #[serde(flatten)]
    pub biases: Biases,
}

/// One group of fits summed up.
#[derive(Debug, Clone, Serialize)]
pub struct GroupSummary {
    /// Name of the case.
    pub case: String,
    /// Which haloes were traced: `all`, or below which Δ_h.
    pub haloes: String,
    /// `haloes`, or `tidal` of the twins.
    pub mock: &'static str,
    /// Model.
    pub model: String,
    /// Start.
    pub start: String,
    /// Fits.
    pub fits: usize,
    /// Of these, the ones that failed.
    pub failed: usize,
    /// Of these, the ones that did not converge.
    pub unconverged: usize,
    /// Part whose χ² has a probability below 0.001.
    pub misfits: Share,
    /// Part whose χ² exceeds that of the tidal twin by more than [`NOTICED_EXCESS`].
    pub noticed: Share,
    /// χ² above that of the twin: 16, 50 and 84%.
    pub chi2_excess: [f64; 3],
    /// Part in which the evidence prefers this model to the first one by more than [`PREFERRED_LOG_ODDS`].
    pub preferred: Share,
    /// Part of blind starts that ended below the start from the truth.
    pub missed: Share,
    /// H0 over the true one with lens and tensors of the axis known: 16, 50 and 84%.
    pub h0_axis: [f64; 3],
    /// The same with the tensors of the ring.
    pub h0_ring: [f64; 3],
    /// The same of the best fit.
    pub h0_fit: [f64; 3],
    /// Part whose point images could be followed from the tensors of the axis to the haloes.
    pub followed: Share,
    /// Rank correlation of the excess of χ² with Δ_tot of the axis, Δ_tot of the ring, and what the nearest tidal model leaves of β.
    pub excess_correlations: [f64; 3],
    /// Against each definition, of all fits and of the good ones.
    pub definitions: Vec<DefinitionSummary>,
}

impl GroupSummary {
    fn of(plan: &ValidityPlan, group: &FitGroup) -> Self {
        let done: Vec<&FitPair> = group.done().collect();
        let middle = |of: &dyn Fn(&FitPair) -> f64| middle(done.iter().map(|pair| of(pair)).collect());
        let share = |of: &dyn Fn(&FitPair) -> bool| Share::of(done.iter().map(|pair| of(pair)));
        let missed = done.iter().filter_map(|pair| {
            let truth = pair.from_truth.filter(|truth| truth.failure.is_empty())?;
            Some(truth.log_posterior - pair.fit.log_posterior > HIGHER)
        });
        let correlation = |of: &dyn Fn(&FitPair) -> f64| {
            rank_correlation(&done.iter().map(|pair| [of(pair), pair.chi2_excess()]).collect::<Vec<_>>())
        };
        let definitions = (0..DEFINITIONS.len()).flat_map(|i| [(i, false), (i, true)]);
        let definition = |(i, is_of_good_fits): (usize, bool)| {
            let fits = done.iter().filter(|pair| pair.is_good() || !is_of_good_fits);
            let fits: Vec<Deviation> = fits.map(|pair| pair.deviation(i)).collect();
            DefinitionSummary { definition: DEFINITIONS[i], is_of_good_fits, biases: Biases::of(&fits) }
        };
        Self {
            case: plan.cases[group.case].name.clone(),
            haloes: plan.views[group.view].to_string(),
            mock: group.mock.name(),
            model: plan.models[group.model].clone(),
            start: group.start.to_string(),
            fits: group.fits.len(),
            failed: group.fits.len() - done.len(),
            unconverged: done.iter().filter(|pair| !pair.fit.is_converged).count(),
            misfits: share(&|pair| !pair.is_good()),
            noticed: share(&|pair| pair.chi2_excess() > NOTICED_EXCESS),
            chi2_excess: middle(&|pair| pair.chi2_excess()),
            preferred: share(&|pair| pair.log_odds() > PREFERRED_LOG_ODDS),
            missed: Share::of(missed),
            h0_axis: middle(&|pair| pair.image.h0_ratio[0]),
            h0_ring: middle(&|pair| pair.image.h0_ratio[1]),
            h0_fit: middle(&|pair| pair.fit.h0_ratio),
            followed: share(&|pair| pair.image.h0_ratio[0].is_finite()),
            excess_correlations: [
                correlation(&|pair| pair.view.delta_tot[0]),
                correlation(&|pair| pair.view.delta_tot[1]),
                correlation(&|pair| pair.image.residual_arcsec[0]),
            ],
            definitions: definitions.map(definition).collect(),
        }
    }

    /// Against a definition, of all fits or of the good ones.
    pub fn against(&self, definition: &str, is_of_good_fits: bool) -> Option<&Biases> {
        let of =
            |own: &&DefinitionSummary| own.definition == definition && own.is_of_good_fits == is_of_good_fits;
        self.definitions.iter().find(of).map(|own| &own.biases)
    }
}

/// Sightlines of which a single halo is seen: the first model fails through all haloes and not through those in the tidal regime.
#[derive(Debug, Clone, Serialize)]
pub struct SingleHaloSummary {
    /// Name of the case.
    pub case: String,
    /// What is called failing: `p < 0.001`, or an excess of χ² over the tidal twin.
    pub criterion: String,
    /// Part of the sightlines.
    pub sightlines: Share,
    /// log₁₀ of M200c in solar masses of the halo whose shear changes most: 16, 50 and 84%.
    pub log10_m200c_msun: [f64; 3],
    /// Its redshift.
    pub z: [f64; 3],
    /// Its distance from the axis.
    pub distance_arcsec: [f64; 3],
    /// Its Δ_h.
    pub delta: [f64; 3],
}

/// Everything.
#[derive(Debug, Clone, Serialize)]
pub struct ValiditySummary {
    /// Sightlines of each case.
    pub number_of_sightlines: usize,
    /// Of all cases, those that failed.
    pub number_failed: usize,
    /// Reasons of the first few sightlines and fits that failed.
    pub failures: Vec<String>,
    /// How γ_LOS and its errors are taken from a posterior.
    pub estimate: String,
    /// Where single haloes are seen.
    pub single_haloes: Vec<SingleHaloSummary>,
    /// Every group of fits.
    pub groups: Vec<GroupSummary>,
}

impl ValiditySummary {
    /// Sums up.
    pub fn of(plan: &ValidityPlan, rows: &[ValiditySightline]) -> Self {
        /// Reasons told; all are in the table.
        const TOLD: usize = 20;
        let groups = FitGroup::all(plan, rows);
        let of_sightlines = rows.iter().filter(|row| !row.failure.is_empty());
        let of_sightlines = of_sightlines.map(|row| format!("sightline {}: {}", row.sightline, row.failure));
        let of_fits = groups.iter().flat_map(|group| {
            let failed = group.fits.iter().filter(|pair| !pair.fit.failure.is_empty());
            failed.map(|pair| {
                format!(
                    "sightline {}, {}, {} from {}: {}",
                    pair.row.sightline,
                    plan.views[group.view].words(),
                    plan.models[group.model],
                    group.start,
                    pair.fit.failure
                )
            })
        });
        Self {
            number_of_sightlines: rows.len() / plan.cases.len().max(1),
            number_failed: rows.iter().filter(|row| !row.failure.is_empty()).count(),
            failures: of_sightlines.chain(of_fits).take(TOLD).collect(),
            estimate: plan.estimate.to_string(),
            single_haloes: single_haloes(plan, &groups),
            groups: groups.iter().map(|group| GroupSummary::of(plan, group)).collect(),
        }
    }

    /// The group of a case by place, a view by place, images through haloes or their twins, a model by place, from the first start.
    pub fn group(
        &self,
        plan: &ValidityPlan,
        (case, view, model): (usize, usize, usize),
        mock: Mock,
    ) -> Option<&GroupSummary> {
        let mocks = [Mock::Haloes, Mock::Tidal];
        let mock = mocks.iter().position(|own| *own == mock)?;
        let place = ((case * plan.views.len() + view) * mocks.len() + mock) * plan.models.len() + model;
        self.groups.get(place * plan.starts.len())
    }
}

/// Whether a fit fails, by two criteria.
type Fails = fn(&FitPair) -> bool;

/// Of every case, by two criteria.
fn single_haloes(plan: &ValidityPlan, groups: &[FitGroup]) -> Vec<SingleHaloSummary> {
    let Some(all) = plan.views.iter().position(|view| *view == SeenHaloes::ALL) else { return Vec::new() };
    let Some(&start) = plan.starts.first() else { return Vec::new() };
    let criteria: [(String, Fails); 2] = [
        (format!("p < {P_VALUE_LIMIT}"), |pair| !pair.is_good()),
        (format!("χ² above the twin's by {NOTICED_EXCESS}"), |pair| pair.chi2_excess() > NOTICED_EXCESS),
    ];
    let mut found = Vec::new();
    for (number, case) in plan.cases.iter().enumerate() {
        let limit = case.config.diagnostics.delta_threshold;
        let Some(tidal) = plan.views.iter().position(|view| view.below == Some(limit)) else { continue };
        let of = |view: usize| {
            groups.iter().find(|group| {
                let key = (group.case, group.view, group.mock, group.model, group.start);
                key == (number, view, Mock::Haloes, 0, start)
            })
        };
        let (Some(all), Some(tidal)) = (of(all), of(tidal)) else { continue };
        for (criterion, fails) in &criteria {
            let is_seen = |(all, tidal): &(&FitPair, &FitPair)| fails(all) && !fails(tidal);
            let pairs = || {
                let both = all.fits.iter().zip(&tidal.fits);
                both.filter(|(all, tidal)| all.fit.failure.is_empty() && tidal.fit.failure.is_empty())
            };
            let haloes: Vec<VaryingHalo> =
                pairs().filter(is_seen).filter_map(|(all, _)| all.row.halo).collect();
            let of = |value: fn(&VaryingHalo) -> f64| middle(haloes.iter().map(value).collect());
            found.push(SingleHaloSummary {
                case: case.name.clone(),
                criterion: criterion.clone(),
                sightlines: Share::of(pairs().map(|pair| is_seen(&pair))),
                log10_m200c_msun: of(|halo| halo.m200c_msun.log10()),
                z: of(|halo| halo.z),
                distance_arcsec: of(|halo| halo.distance_arcsec),
                delta: of(|halo| halo.delta),
            });
        }
    }
    found
}

/// The values below which [`MIDDLE`] of the finite ones lie, between two by interpolation; not a number of none.
fn middle(mut values: Vec<f64>) -> [f64; 3] {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return [f64::NAN; 3] };
    MIDDLE.map(|part| {
        let place = part * last as f64;
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        values[low] + (place - place.floor()) * (values[high] - values[low])
    })
}

#[cfg(test)]
mod tests {
    use super::super::plan::{Estimate, FitStart, ValidityCase};
    use super::super::rows::{ValidityFit, ValidityImage, ValidityView};
    use super::*;
    use crate::config::Preset;
    use crate::imaging::Psf;

    fn fit(model: usize, start: FitStart, chi2: f64, log_evidence: f64) -> ValidityFit {
        ValidityFit {
            shear: [0.01, 0.02],
            covariance: [1e-6, 0.0, 1e-6],
            chi2,
            p_value: if chi2 > 150.0 { 1e-6 } else { 0.5 },
            log_evidence,
            log_posterior: -0.5 * chi2,
            is_converged: true,
            ..ValidityFit::failed(model, start, String::new())
        }
    }

    fn image(chi2: [f64; 2], log_evidence: [f64; 2]) -> ValidityImage {
        let of_start =
            |start: FitStart, more: f64| [0, 1].map(|i| fit(i, start, chi2[i] + more, log_evidence[i]));
        let (blind, truth) = (of_start(FitStart::Blind, 2.0), of_start(FitStart::Truth, 0.0));
        ValidityImage {
            by_definition: [[0.01, 0.02]; 5],
            residual_arcsec: [0.001; 2],
            h0_ratio: [1.01, 1.0],
            fits: [&blind[0], &truth[0], &blind[1], &truth[1]].map(Clone::clone).into(),
        }
    }

    fn plan() -> ValidityPlan {
        let psf = Psf::gaussian(0.1, 3.0, 0.1).unwrap();
        let config = Preset::Consistent.config().unwrap();
        ValidityPlan {
            cases: vec![ValidityCase { name: "base".into(), config, psf }],
            views: vec![SeenHaloes::ALL, SeenHaloes { below: Some(0.1) }],
            models: vec!["tidal-minimal".into(), "tidal-flexion".into()],
            starts: vec![FitStart::Blind, FitStart::Truth],
            estimate: Estimate::Laplace,
            has_delays: true,
        }
    }

    #[test]
    fn fits_are_compared_with_their_twins_first_models_and_starts_from_the_truth() {
        let view = |haloes: ValidityImage| ValidityView {
            number_of_haloes: 10,
            delta_tot: [0.5, 0.4],
            haloes,
            tidal: image([100.0, 98.0], [-50.0, -55.0]),
        };
        let halo = VaryingHalo {
            m200c_msun: 1e9,
            z: 0.4,
            distance_arcsec: 1.2,
            delta: 2.0,
            kappa: 0.01,
            shear_change: 0.02,
        };
        let row = |sightline: u64, all: ValidityImage| ValiditySightline {
            sightline,
            case: 0,
            halo: Some(halo),
            views: vec![view(all), view(image([110.0, 108.0], [-52.0, -57.0]))],
            failure: String::new(),
        };
        let failed =
            ValiditySightline { views: vec![], failure: "why".into(), ..row(2, image([0.0; 2], [0.0; 2])) };
        let seen = row(0, image([200.0, 120.0], [-100.0, -60.0]));
        let rows = [seen, row(1, image([110.0, 109.0], [-50.0, -55.0])), failed];
        let summary = ValiditySummary::of(&plan(), &rows);
        assert_eq!((summary.number_of_sightlines, summary.number_failed, summary.groups.len()), (3, 1, 16));
        assert_eq!(summary.failures, ["sightline 2: why"]);
        let group = |view, mock, model| summary.group(&plan(), (0, view, model), mock).unwrap();
        let tidal = group(0, Mock::Haloes, 0);
        assert_eq!(
            (tidal.haloes.as_str(), tidal.model.as_str(), tidal.start.as_str()),
            ("all", "tidal-minimal", "blind")
        );
        assert_eq!((tidal.misfits.part, tidal.noticed.part, tidal.missed.part), (0.5, 0.5, 1.0));
        assert_eq!((tidal.chi2_excess[1], tidal.fits, tidal.failed), (55.0, 2, 0));
        let flexion = group(0, Mock::Haloes, 1);
        assert_eq!(
            (flexion.model.as_str(), flexion.preferred.part, tidal.preferred.part),
            ("tidal-flexion", 0.5, 0.0)
        );
        let twin = group(1, Mock::Tidal, 0);
        assert_eq!((twin.mock, twin.haloes.as_str(), twin.chi2_excess), ("tidal", "0.1", [0.0; 3]));
        let of_good = tidal.against("best_tidal", true).unwrap();
        assert_eq!((of_good.number, tidal.against("axis", false).unwrap().number), (1, 2));
        assert_eq!(of_good.coverage.part, 1.0);
        assert_eq!(summary.single_haloes.len(), 2);
        for single in &summary.single_haloes {
            assert_eq!((single.sightlines.part, single.log10_m200c_msun), (0.5, [9.0; 3]), "{single:?}");
        }
    }
}
